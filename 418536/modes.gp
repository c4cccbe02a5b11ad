# Draws modes.svg and modes.png: run gnuplot modes.gp in this folder.
if (!exists("picture")) {
  do for [picture in "svg png"] { load "modes.gp" }
  undefine picture
  exit
}
reset
set encoding utf8
if (picture eq "svg") {
  set terminal svg size 720,460 font "sans-serif,14" background "white" name "modes"
} else {
  set terminal pngcairo size 1440,920 font "sans-serif,14" fontscale 1.5 linewidth 2 pointscale 2 background "white"
}
set output "modes." . picture
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
set title "UNSTABLE: Shapes of the modes at 23.2503 rpm, at the start of a turn" noenhanced
# a row's place among the bars, -9 for the second of a pair
place(row) = real(word('1 2 -9 3 -9 4', int(row)))
size_of(name) = sqrt(column(name . '_re')**2 + column(name . '_im')**2)
radius = 0.000371464764
greatest(a, b, c) = a > b ? (a > c ? a : c) : (b > c ? b : c)
most(row) = greatest(size_of('xi'), size_of('eta'), radius * size_of('psi'))
part(value) = most(0) > 0 ? value / most(0) : 0
set xrange [0.4:4.6]; set yrange [0:1.05]; set boxwidth 0.24
set xtics ('1' 1, '2, 3' 2, '4, 5' 3, '6' 4); set xlabel 'multipliers (largest first)'
set ylabel 'amplitude relative to the greatest'
set grid noxtics ytics; set key outside bottom center horizontal samplen 2
set style fill solid 1 border lt -1
plot 'modes.csv' using (place(column('index')) - 0.27):(part(size_of('xi'))) with boxes lt 1 dt 1 lw 1 fs solid 1 title '|ξ|', '' using (place(column('index'))):(part(size_of('eta'))) with boxes lt 2 dt 1 lw 1 fs pattern 2 title '|η|', '' using (place(column('index')) + 0.27):(part(radius * size_of('psi'))) with boxes lt 3 dt 1 lw 1 fs solid 0.25 title 'r |ψ|, r = 0.000371 m'
unset output
