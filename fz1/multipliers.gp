# Draws multipliers.svg and multipliers.png: run gnuplot multipliers.gp in this folder.
if (!exists("picture")) {
  do for [picture in "svg png"] { load "multipliers.gp" }
  undefine picture
  exit
}
reset
set encoding utf8
if (picture eq "svg") {
  set terminal svg size 880,460 font "sans-serif,14" background "white" name "multipliers"
} else {
  set terminal pngcairo size 1760,920 font "sans-serif,14" fontscale 1.5 linewidth 2 pointscale 2 background "white"
}
set output "multipliers." . picture
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
heading = "UNDECIDED: Multipliers at 3665.4 rpm: undecided, |ρ|max = 1"
set multiplot title heading noenhanced
set title "in the complex plane; shaded: stable" noenhanced font ",12" offset 0,-0.6
set lmargin screen 0.09; set rmargin screen 0.47; set bmargin screen 0.15; set tmargin screen 0.8
set size ratio -1
set xrange [-1.25:1.25]
set yrange [-1.25:1.25]
set xlabel 'Re ρ'; set ylabel 'Im ρ' offset 1
set object 1 circle at 0,0 size 1 behind fillcolor rgb '#E4EEF5' fillstyle solid 1 border lt -1
set arrow 1 from graph 0,first 0 to graph 1,first 0 nohead lt 8 dt 1 lw 0.6
set arrow 2 from first 0,graph 0 to first 0,graph 1 nohead lt 8 dt 1 lw 0.6
plot NaN notitle, 'multipliers.csv' using (column('abs') < 20 ? column('re') : 1e3):(column('im')):(column('abs') * (column('error') < 1 ? column('error') : 1)) with circles lt 2 dt 1 fs solid 0.3 noborder notitle, 'multipliers.csv' using (column('abs') < 20 ? column('re') : 1e3):'im' with points lt 2 pt 7 ps 1.1 notitle
unset object 1; unset arrow
set lmargin screen 0.6; set rmargin screen 0.975
set size noratio
set title "growth in a turn, with error bounds" noenhanced font ",12" offset 0,-0.6
set xrange [-0.05:1.05]; set xlabel '|arg ρ| / π'; set xtics 0.25
set yrange [-0.00269212408:0.000574303192]; set ylabel 'ln |ρ|'
set object 2 rectangle from graph 0,graph 0 to graph 1,first 0 behind fillcolor rgb '#E4EEF5' fillstyle solid 1 noborder
set arrow 3 from graph 0,first 0 to graph 1,first 0 nohead lt 7 dt 1 lw 1.5
plot NaN notitle, 'multipliers.csv' using (abs(column('arg_rad')) / pi):'log_abs':(0):(-column('log_abs')) with vectors nohead lt 2 dt 1 lw 1 notitle, 'multipliers.csv' using (abs(column('arg_rad')) / pi):'log_abs':(column('error') < 1 ? column('error') : 1) with yerrorbars lt 2 dt 1 lw 1.5 pt 7 ps 1.1 notitle
unset multiplot

unset output
