# Draws power.svg and power.png: run gnuplot power.gp in this folder.
if (!exists("picture")) {
  do for [picture in "svg png"] { load "power.gp" }
  undefine picture
  exit
}
reset
set encoding utf8
if (picture eq "svg") {
  set terminal svg size 800,730 font "sans-serif,14" background "white" name "power"
} else {
  set terminal pngcairo size 1600,1460 font "sans-serif,14" fontscale 1.5 linewidth 2 pointscale 2 background "white"
}
set output "power." . picture
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
set multiplot layout 3,1 margins 0.14 ,0.975,0.0959,0.882 spacing 0.145,0.0466 title "UNSTABLE: Driving torque over a turn, and where its power goes" noenhanced
set xtics 90; set xrange [0:360]
set format x ''; unset xlabel
set key on at graph 1,graph 1.01 bottom right horizontal samplen 2 width 1 font ',12'
low = 1e300; high = -1e300
set table $unused; unset logscale
plot [0:1] [-1:1] 'power.csv' using (0):(v = 1 * column(3), low = v < low && v > -1e300 ? v : low, high = v > high && v < 1e300 ? v : high, 0) smooth unique
plot [0:1] [-1:1] 'power.csv' using (0):(v = 1 * column(4), low = v < low && v > -1e300 ? v : low, high = v > high && v < 1e300 ? v : high, 0) smooth unique
unset table
if (low > high) { low = 0; high = 0 }
if (high - low <= 1e-9 * (abs(low) + abs(high))) { low = low - (low == 0 ? 1 : 0.01 * abs(low)); high = high + (high == 0 ? 1 : 0.01 * abs(high)) }
set yrange [low - 0.07 * (high - low):high + 0.07 * (high - low)]
set ylabel "torque (N m)" noenhanced
plot 'power.csv' using 1:(1 * column(3)) with lines lt 1 title "on the vibrating frame" noenhanced, \
  'power.csv' using 1:(1 * column(4)) with lines lt 2 title "on a frame at rest" noenhanced
low = 1e300; high = -1e300
set table $unused; unset logscale
plot [0:1] [-1:1] 'power.csv' using (0):(v = 1 * column(5), low = v < low && v > -1e300 ? v : low, high = v > high && v < 1e300 ? v : high, 0) smooth unique
plot [0:1] [-1:1] 'power.csv' using (0):(v = 1 * column(6), low = v < low && v > -1e300 ? v : low, high = v > high && v < 1e300 ? v : high, 0) smooth unique
unset table
if (low > high) { low = 0; high = 0 }
if (high - low <= 1e-9 * (abs(low) + abs(high))) { low = low - (low == 0 ? 1 : 0.01 * abs(low)); high = high + (high == 0 ? 1 : 0.01 * abs(high)) }
set yrange [low - 0.07 * (high - low):high + 0.07 * (high - low)]
set ylabel "power (W)" noenhanced
plot 'power.csv' using 1:(1 * column(5)) with lines lt 1 title "of the drive" noenhanced, \
  'power.csv' using 1:(1 * column(6)) with lines lt 2 title "taken by the dampers" noenhanced
set xtics 90; set xrange [0:360]
set format x; set xlabel 'crank angle (deg)'
set key off
low = 1e300; high = -1e300
set table $unused; unset logscale
plot [0:1] [-1:1] 'power.csv' using (0):(v = 1 * column(7), low = v < low && v > -1e300 ? v : low, high = v > high && v < 1e300 ? v : high, 0) smooth unique
unset table
if (low > high) { low = 0; high = 0 }
if (high - low <= 1e-9 * (abs(low) + abs(high))) { low = low - (low == 0 ? 1 : 0.01 * abs(low)); high = high + (high == 0 ? 1 : 0.01 * abs(high)) }
set yrange [low - 0.07 * (high - low):high + 0.07 * (high - low)]
set ylabel "energy (J)" noenhanced
plot 'power.csv' using 1:(1 * column(7)) with lines lt 1 title "energy" noenhanced
unset multiplot
unset output
