# Bilder 3 to 5 of the paper anew. From the checkout, after
#   for n in 240 360; do ./bootstrap fpm run -- -q --set drive.speed_rpm=$n -o turn/$n data/khang_four_bar.nml; done
#   gnuplot doc/pictures/bilder.gp
set encoding utf8
set terminal svg size 760,760 font "sans,14" background "white"
set output "doc/pictures/bilder.svg"
set datafile separator ","
set datafile commentschars "#"
set multiplot layout 3,1 margins 0.12,0.96,0.09,0.94 spacing 0,0.05
set border 3
set xrange [0:360]; set xtics 60 nomirror format ""
set grid lc "#dddddd"
set xzeroaxis lc "#888888"
set ytics nomirror; set offsets 0, 0, graph 0.08, graph 0.08
set key top center horizontal
set ylabel "ξ_F (mm)" offset 0.5
plot "turn/240/response.csv" using 1:($3*1e3) with lines lw 2 lc "#0072b2" title "240 min^{-1}", \
     "turn/360/response.csv" using 1:($3*1e3) with lines lw 2 dt 2 lc "#d55e00" title "360 min^{-1}"
set ylabel "η_F (mm)"
unset key
plot "turn/240/response.csv" using 1:($4*1e3) with lines lw 2 lc "#0072b2", \
     "turn/360/response.csv" using 1:($4*1e3) with lines lw 2 dt 2 lc "#d55e00"
set ylabel "ψ_F (mrad)"
set xtics format "%g"
set xlabel "crank angle (deg)"
plot "turn/240/response.csv" using 1:($5*1e3) with lines lw 2 lc "#0072b2", \
     "turn/360/response.csv" using 1:($5*1e3) with lines lw 2 dt 2 lc "#d55e00"
unset multiplot
