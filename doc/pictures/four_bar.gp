# The picture of the README. From the checkout, after `./bootstrap fpm run -- data/khang_four_bar.nml`:
#   gnuplot doc/pictures/four_bar.gp
set terminal svg size 900,330 font "sans,13" background "white"
set output "doc/pictures/four_bar.svg"
set datafile separator ","
set datafile commentschars "#"
set multiplot layout 1,2 margins 0.04,0.98,0.2,0.88 spacing 0.09,0

# The machine: frame, supports, four-bar at a crank angle of 60 deg, in the frame's system (m).
set title "Four-bar on an elastic frame"
unset key; unset border; unset tics
set size ratio -1
set xrange [-0.44:0.44]; set yrange [-0.33:0.42]
ox = -0.20; oy = 0.20
ax = ox + 0.07*cos(pi/3); ay = oy + 0.07*sin(pi/3)
bx = ox + 0.40; by = oy
d = sqrt((bx-ax)**2 + (by-ay)**2)
u = (0.37**2 - 0.16**2 + d**2)/(2*d); v = sqrt(0.37**2 - u**2)
px = ax + u*(bx-ax)/d - v*(by-ay)/d; py = ay + u*(by-ay)/d + v*(bx-ax)/d
set object 1 rectangle from -0.36,-0.20 to 0.36,0.23 fillstyle solid 0.25 noborder fillcolor "#8c9bab"
do for [x in "-0.3 -0.1 0.1 0.3"] {
  xs = real(x)
  set arrow from xs,-0.20 to xs,-0.215 nohead lw 1.5
  do for [i=0:5] { set arrow from xs+(i%2==0?0.012:-0.012)*(i>0),-0.215-0.011*i to xs+(i%2==0?-0.012:0.012)*(i<5),-0.226-0.011*i nohead lw 1.5 }
}
set arrow from -0.38,-0.285 to 0.38,-0.285 nohead lw 2
set arrow from ox,oy to ax,ay nohead lw 5 lc "#d55e00"
set arrow from ax,ay to px,py nohead lw 5 lc "#0072b2"
set arrow from bx,by to px,py nohead lw 5 lc "#009e73"
set label 1 "F" at 0.015,0.01
set label 2 "crank" at ox-0.01,oy-0.035 center
set label 3 "coupler" at (ax+px)/2-0.03,(ay+py)/2+0.04 center
set label 4 "rocker" at (bx+px)/2+0.03,(by+py)/2 left
set label 5 "4 x 196 kN/m" at 0,-0.315 center
set label 6 "" at ox,oy point pt 7 ps 0.8
set label 7 "" at bx,by point pt 7 ps 0.8
set label 8 "" at 0,0 point pt 2 ps 1
plot NaN notitle

# The vibration.
unset label; unset arrow; unset object
set title "One turn at 240 rpm: stable,  {/Symbol r}_{max} = 0.996775"
set border 3; set size noratio
set xrange [0:360]; set xtics 90 nomirror; set xlabel "crank angle (deg)"
set yrange [-0.8:1.0]; set ytics 0.4 nomirror; set key top center horizontal
set grid lc "#dddddd"
plot "khang_four_bar/response.csv" using 1:($3*1e3) with lines lw 2 lc "#d55e00" title "{/Symbol x} (mm)", \
     "" using 1:($4*1e3) with lines lw 2 dt 2 lc "#0072b2" title "{/Symbol h} (mm)", \
     "" using 1:($5*1e3) with lines lw 2 dt 4 lc "#009e73" title "{/Symbol y} (mrad)"
unset multiplot
