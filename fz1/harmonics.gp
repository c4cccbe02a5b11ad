# Draws harmonics.svg and harmonics.png: run gnuplot harmonics.gp in this folder.
if (!exists("picture")) {
  do for [picture in "svg png"] { load "harmonics.gp" }
  undefine picture
  exit
}
reset
set encoding utf8
if (picture eq "svg") {
  set terminal svg size 880,640 font "sans-serif,14" background "white" name "harmonics"
} else {
  set terminal pngcairo size 1760,1280 font "sans-serif,14" fontscale 1.5 linewidth 2 pointscale 2 background "white"
}
set output "harmonics." . picture
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
heading = "UNDECIDED: Harmonics of the vibration and of the forces on the ground at 3665.4 rpm"
set multiplot layout 2,1 margins 0.11,0.98,0.11,0.79 spacing 0,0.08 title heading noenhanced
set xrange [-0.6:20.6]
set key inside top right horizontal samplen 2
set grid noxtics ytics
set link x2 via x * 61.09 inverse x / 61.09
set x2tics; set x2label 'frequency (Hz)'
set xtics nomirror; set format x ''
set boxwidth 0.13
set style fill solid 1 border lt -1
set ylabel 'amplitude'
set logscale y
set format y '10^{%L}'
set yrange [0.000762:22856]
plot 'harmonics.csv' using (column('order') + -0.35):(1e3 * abs(column('xi_m_amplitude'))) with boxes lt 1 dt 1 lw 1 fs solid 1 title 'ξ (mm)', 'harmonics.csv' using (column('order') + -0.21):(1e3 * abs(column('eta_m_amplitude'))) with boxes lt 2 dt 1 lw 1 fs pattern 2 title 'η (mm)', 'harmonics.csv' using (column('order') + -0.07):(1e3 * abs(column('psi_rad_amplitude'))) with boxes lt 3 dt 1 lw 1 fs solid 0.25 title 'ψ (mrad)', 'harmonics.csv' using (column('order') + 0.07):(1 * abs(column('zeta_m_amplitude'))) with boxes lt 4 dt 1 lw 1 fs solid 1 title 'ζ (m)', 'harmonics.csv' using (column('order') + 0.21):(1 * abs(column('rot_xi_rad_amplitude'))) with boxes lt 5 dt 1 lw 1 fs pattern 2 title 'rot ξ (rad)', 'harmonics.csv' using (column('order') + 0.35):(1 * abs(column('rot_eta_rad_amplitude'))) with boxes lt 6 dt 1 lw 1 fs solid 0.25 title 'rot η (rad)'
unset x2label; set format x2 ''; set format x
set xlabel 'order of the crank speed (0: magnitude of the mean)'
set ylabel 'amplitude'
set logscale y
set format y '10^{%L}'
set yrange [0.00312:93633]
plot 'harmonics.csv' using (column('order') + -0.35):(1e-3 * abs(column('fx_N_amplitude'))) with boxes lt 1 dt 1 lw 1 fs solid 1 title 'force x (kN)', 'harmonics.csv' using (column('order') + -0.21):(1 * abs(column('fy_N_amplitude'))) with boxes lt 2 dt 1 lw 1 fs pattern 2 title 'force y (N)', 'harmonics.csv' using (column('order') + -0.07):(1 * abs(column('m_Nm_amplitude'))) with boxes lt 3 dt 1 lw 1 fs solid 0.25 title 'moment z (N m)', 'harmonics.csv' using (column('order') + 0.07):(1 * abs(column('fz_N_amplitude'))) with boxes lt 4 dt 1 lw 1 fs solid 1 title 'force z (N)', 'harmonics.csv' using (column('order') + 0.21):(1 * abs(column('mx_Nm_amplitude'))) with boxes lt 5 dt 1 lw 1 fs pattern 2 title 'moment x (N m)', 'harmonics.csv' using (column('order') + 0.35):(1 * abs(column('my_Nm_amplitude'))) with boxes lt 6 dt 1 lw 1 fs solid 0.25 title 'moment y (N m)'
unset multiplot

unset output
