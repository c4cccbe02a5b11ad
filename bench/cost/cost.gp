# Cost against work, from the table of cost.f90: gnuplot -e "table='FILE'; picture='FILE'" bench/cost/cost.gp
set terminal svg size 1000,360 font "sans,12" background "white"
set output picture
set datafile separator ","
set logscale xy
set format x "10^{%T}"
set format y "10^{%T}"
set border 3
set grid lc "#dddddd"
set tics nomirror
set key top left Left reverse samplen 2 font ",10"
set fit quiet logfile "/dev/null"
rows(family, series) = sprintf("< awk -F, '$1 == \"%s\" && $2 == \"%s\" {print $3 \",\" $4 * 1e6 \",\" $6}' %s", family, series, table)
way(family, series, name) = sprintf("< awk -F, -v reduced=%d '$1 == \"%s\" && $2 == \"%s\" && ($6 == \"reduced\") == reduced {print $3 \",\" $4 * 1e6}' %s", name eq "reduced", family, series, table)

# Slopes d ln(time) / d ln(x).
slope(p) = sprintf("%.2f", p)

set multiplot layout 1,3 margins 0.06,0.985,0.15,0.9 spacing 0.06,0
set ylabel "time (us)" offset 1

set title "w_{max} T: the four-bar from fast to slow"
set xlabel "w_{max} T (rad)"
a = 1; p = 1
fit [log(1):log(30)] a + p*x way("turns", "x0", "integrated") using (log($1)):(log($2)) via a, p
p_few = p
fit [log(100):log(1e3)] a + p*x way("turns", "x0", "integrated") using (log($1)):(log($2)) via a, p
p_many = p
fit a + p*x way("turns", "x0", "reduced") using (log($1)):(log($2)) via a, p
p_reduced = p
plot way("turns", "x0", "integrated") using 1:2 with linespoints pt 7 ps 0.5 lc "#0072b2" \
       title "integrated: slope ".slope(p_few)." below 30, ".slope(p_many)." above 100", \
     way("turns", "x0", "reduced") using 1:2 with linespoints pt 7 ps 0.5 lc "#d55e00" title "reduced: slope ".slope(p_reduced), \
     rows("turns", "multipliers") using 1:2 with lines dt 3 lc "#444444" title "without x_0"

set autoscale x
set title "links: a row of rockers"
set xlabel "links"
set xtics (2, 3, 5, 10, 20)
set format x "%g"
unset ylabel
fit [log(2):log(20)] a + p*x rows("links", "x0") using (log($1)):(log($2)) via a, p
p_solve = p
fit [log(2):log(20)] a + p*x rows("links", "frame") using (log($1)):(log($2)) via a, p
set xrange [1.8:22]
plot rows("links", "x0") using 1:2 with linespoints pt 7 ps 0.5 lc "#0072b2" title "solution: slope ".slope(p_solve), \
     rows("links", "frame") using 1:2 with linespoints pt 7 ps 0.5 lc "#009e73" title "proof that it turns: slope ".slope(p)

set title "tolerance"
set xlabel "tolerance"
set xtics ("10^{-3}" 1e-3, "10^{-5}" 1e-5, "10^{-7}" 1e-7, "10^{-9}" 1e-9, "10^{-11}" 1e-11, "10^{-13}" 1e-13)
set autoscale x
array colour[3] = ["#0072b2", "#009e73", "#d55e00"]
array slopes[3]
do for [i=1:3] {
  fit a + p*x rows("tolerance", word("240 20 1", i)." rpm") using (log($1)):(log($2)) via a, p
  slopes[i] = p
}
set xrange [1e-2:1e-14]
plot for [i=1:3] rows("tolerance", word("240 20 1", i)." rpm") using 1:2 with linespoints pt 7 ps 0.5 lc rgb colour[i] \
       title word("240 20 1", i)." rpm: slope ".slope(slopes[i])
unset multiplot
