# Draws response.svg and response.png: run gnuplot response.gp in this folder.
if (!exists("picture")) {
  do for [picture in "svg png"] { load "response.gp" }
  undefine picture
  exit
}
reset
set encoding utf8
if (picture eq "svg") {
  set terminal svg size 880,1320 font "sans-serif,14" background "white" name "response"
} else {
  set terminal pngcairo size 1760,2640 font "sans-serif,14" fontscale 1.5 linewidth 2 pointscale 2 background "white"
}
set output "response." . picture
set datafile separator comma
set datafile columnheaders
set linetype 1 lc rgb "#0072B2" lw 2 dt 1 pt 7
set linetype 2 lc rgb "#D55E00" lw 2 dt (12,5) pt 5
set linetype 3 lc rgb "#009E73" lw 2 dt (3,4) pt 9
set linetype 4 lc rgb "#CC79A7" lw 2 dt (12,4,3,4) pt 13
set linetype 5 lc rgb "#E69F00" lw 2 dt (18,4) pt 11
set linetype 6 lc rgb "#56B4E9" lw 2 dt (6,3) pt 4
set linetype 7 lc rgb "#000000" lw 2 dt (12,4,3,4,3,4) pt 6
set linetype 8 lc rgb "#999999" lw 2 dt (2,3) pt 8
set grid lt 1 dt 1 lw 0.6 lc rgb "#DDDDDD"
set border lw 1
set tics nomirror
set style fill solid 1 noborder
heading = "UNDECIDED: Periodic vibration and forces on the ground at 3665.4 rpm"
set multiplot layout 6,2 margins 0.125,0.975,0.1,0.86 spacing 0.135,0.04 title heading noenhanced
set xtics 90; set format x ''
set xrange [0:360]
set title "peak 0, rms 0 mm" noenhanced font ",12" offset 0,-0.6
set ylabel 'ξ (mm)'
set yrange [-1:1]
plot 'response.csv' using 'crank_deg':(1e3 * column('xi_m')) with lines lt 1 dt 1 notitle
set title "peak 15.65, rms 11.05 kN" noenhanced font ",12" offset 0,-0.6
set ylabel 'force x (kN)'
set yrange [-17.7746884:17.8338754]
plot 'response.csv' using 'crank_deg':(1e-3 * column('fx_N')) with lines lt 2 dt 1 notitle
set title "peak 0, rms 0 mm" noenhanced font ",12" offset 0,-0.6
set ylabel 'η (mm)'
set yrange [-1:1]
plot 'response.csv' using 'crank_deg':(1e3 * column('eta_m')) with lines lt 1 dt 1 notitle
set title "peak 209, rms 147.5 N" noenhanced font ",12" offset 0,-0.6
set ylabel 'force y (N)'
set yrange [-238.155326:237.361756]
plot 'response.csv' using 'crank_deg':(1 * column('fy_N')) with lines lt 2 dt 1 notitle
set title "peak 76.66, rms 54.12 mrad" noenhanced font ",12" offset 0,-0.6
set ylabel 'ψ (mrad)'
set yrange [-87.0834951:87.3734704]
plot 'response.csv' using 'crank_deg':(1e3 * column('psi_rad')) with lines lt 1 dt 1 notitle
set title "peak 2904, rms 2050 N m" noenhanced font ",12" offset 0,-0.6
set ylabel 'moment z (N m)'
set yrange [-3299.10387:3310.08924]
plot 'response.csv' using 'crank_deg':(1 * column('m_Nm')) with lines lt 2 dt 1 notitle
set title "peak 203.5, rms 203.5 m" noenhanced font ",12" offset 0,-0.6
set ylabel 'ζ (m)'
set yrange [-203.526223:-203.477193]
plot 'response.csv' using 'crank_deg':(1 * column('zeta_m')) with lines lt 1 dt 1 notitle
set title "peak 3437, rms 2222 N" noenhanced font ",12" offset 0,-0.6
set ylabel 'force z (N)'
set yrange [-3907.5455:3754.75423]
plot 'response.csv' using 'crank_deg':(1 * column('fz_N')) with lines lt 2 dt 1 notitle
set title "peak 486.8, rms 486.8 rad" noenhanced font ",12" offset 0,-0.6
set ylabel 'rot ξ (rad)'
set yrange [-486.781415:-486.776506]
plot 'response.csv' using 'crank_deg':(1 * column('rot_xi_rad')) with lines lt 1 dt 1 notitle
set title "peak 631.1, rms 408 N m" noenhanced font ",12" offset 0,-0.6
set ylabel 'moment x (N m)'
set yrange [-689.406669:717.460522]
plot 'response.csv' using 'crank_deg':(1 * column('mx_Nm')) with lines lt 2 dt 1 notitle
set format x; set xlabel 'crank angle (deg)'
set title "peak 761.9, rms 761.9 rad" noenhanced font ",12" offset 0,-0.6
set ylabel 'rot η (rad)'
set yrange [761.863937:761.865363]
plot 'response.csv' using 'crank_deg':(1 * column('rot_eta_rad')) with lines lt 1 dt 1 notitle
set title "peak 514.9, rms 332.9 N m" noenhanced font ",12" offset 0,-0.6
set ylabel 'moment y (N m)'
set yrange [-585.334686:562.447164]
plot 'response.csv' using 'crank_deg':(1 * column('my_Nm')) with lines lt 2 dt 1 notitle
unset multiplot

unset output
