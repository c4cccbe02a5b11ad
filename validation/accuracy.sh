#!/usr/bin/env bash
# Work-precision tables as Markdown and the picture of doc/accuracy.md, from task `trade`:
#
#   ./bootstrap bash validation/accuracy.sh [PICTURE.svg]
#
# About 10 s for each speed, and a release build before. The picture needs gnuplot.

set -eu
cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.."
export LC_ALL=C OPENBLAS_NUM_THREADS=1
picture=${1:-}
speeds='1 20 240 1300'
input=data/khang_four_bar.nml
temporary=$(mktemp -d)
trap 'rm -rf "$temporary"' EXIT

fpm build --profile release >"$temporary/log" 2>&1 || { cat "$temporary/log" >&2; exit 1; }
measured=
for speed in $speeds; do
  if fpm run --profile release gestell -- "$input" --quiet --set "drive.speed_rpm=$speed" --set "case.tasks='trade'" \
      --output "$temporary/$speed" >"$temporary/log" 2>&1; then
    measured="$measured $speed"
  else
    printf '%s rpm: %s\n\n' "$speed" "$(grep -v '^ \|^Project\|^STOP\|^<ERROR>' "$temporary/log" | tail -n 1)"
  fi
done

# The rows of trade.csv without preamble and header.
rows() { grep -v '^#' "$temporary/$1/trade.csv" | tail -n +2; }

printf '## The cheapest way\n\nErrors of Phi(T) and x0 below the bound; milliseconds are medians on this machine.\n\n'
printf '| rpm | error below | method | steps | evaluations | milliseconds | error of Phi | of rho | of x0 |\n|---|---|---|---|---|---|---|---|---|\n'
for speed in $measured; do
  for bound in 1e-3 1e-6 1e-9 1e-12; do
    rows "$speed" | awk -F, -v speed="$speed" -v bound="$bound" '
      $5 <= bound + 0 && $7 <= bound + 0 && (best == "" || $8 < least) { best = $0; least = $8 }
      END {
        if (best == "") { printf "| %s | %s | not reached in the time allowed ||||||\n", speed, bound; exit }
        split(best, c, ",")
        printf "| %s | %s | %s | %d | %d | %.3g | %.1e | %.1e | %.1e |\n", speed, bound, c[1], c[3], c[4], 1000 * c[8], c[5], c[6], c[7]
      }'
  done
done

# Per method the least time whose errors of Phi and x0 are below each bound.
printf '\n## Milliseconds per method\n'
for speed in $measured; do
  printf '\n%s rpm; the converged solution claims:%s\n\n' "$speed" \
    "$(sed -n 's/^# errors of the converged solution://p' "$temporary/$speed/trade.csv" |
      awk '{ for (i = 1; i < NF; i += 2) printf " %s %.0e", $i, $(i + 1) }')"
  printf '| method | order | 1e-3 | 1e-6 | 1e-9 | 1e-12 |\n|---|---|---|---|---|---|\n'
  rows "$speed" | awk -F, '
    BEGIN { n = split("1e-3 1e-6 1e-9 1e-12", bound, " ") }
    !($1 in order) { name[++methods] = $1; order[$1] = $2 }
    { for (i = 1; i <= n; i++) if ($5 <= bound[i] + 0 && $7 <= bound[i] + 0 && (!(($1, i) in time) || $8 < time[$1, i])) {
        time[$1, i] = $8; steps[$1, i] = $3 } }
    END {
      for (m = 1; m <= methods; m++) {
        line = "| " name[m] " | " order[name[m]]
        for (i = 1; i <= n; i++) line = line " | " (((name[m], i) in time) ? sprintf("%.3g (%d steps)", 1000 * time[name[m], i], steps[name[m], i]) : "")
        print line " |"
      }
    }'
done

[ -n "$picture" ] || exit 0
command -v gnuplot >/dev/null || { echo 'accuracy.sh: no gnuplot, no picture' >&2; exit 0; }
# Colours that colour-blind readers tell apart (M. Okabe, K. Ito), and a sign for each method.
style() {
  case $1 in
    rk4) echo "lc rgb '#000000' pt 2 ps 0.6" ;;
    explicit8) echo "lc rgb '#999999' pt 1 ps 0.6" ;;
    magnus4) echo "lc rgb '#E69F00' pt 4 ps 0.6" ;;
    magnus6) echo "lc rgb '#D55E00' pt 5 ps 0.6" ;;
    gauss2) echo "lc rgb '#56B4E9' pt 6 ps 0.6" ;;
    gauss4) echo "lc rgb '#009E73' pt 8 ps 0.6" ;;
    gauss6) echo "lc rgb '#0072B2' pt 9 ps 0.6" ;;
    gauss8) echo "lc rgb '#CC79A7' pt 7 ps 0.6" ;;
    reduced) echo "lc rgb '#D00000' pt 3 ps 1.2" ;;
  esac
}

{
  echo "set terminal svg size 900,760 font 'sans-serif,12' background rgb 'white'"
  echo "set output '$picture'; set datafile separator ','; set logscale xy; set format '10^{%T}'; set grid lc rgb '#dddddd'"
  echo "set xlabel 'seconds'; set ylabel 'error of Phi(T)'; set yrange [1e-15:1]; set multiplot layout 2,2"
  key='set key bottom right samplen 2'
  for speed in $measured; do
    echo "set title '$speed rpm'; $key"
    key='unset key'
    separator='plot '
    for method in rk4 explicit8 magnus4 magnus6 gauss2 gauss4 gauss6 gauss8 reduced; do
      rows "$speed" | grep "^$method," | awk -F, '$5 > 0' >"$temporary/$speed/$method.csv" || true
      [ -s "$temporary/$speed/$method.csv" ] || echo ',,,,NaN,,,NaN' >"$temporary/$speed/$method.csv"
      printf "%s'%s' using 8:5 with linespoints %s title '%s'" "$separator" "$temporary/$speed/$method.csv" \
        "$(style $method)" "$method"
      separator=', '
    done
    echo
  done
  echo 'unset multiplot'
} >"$temporary/plot"
gnuplot "$temporary/plot"
