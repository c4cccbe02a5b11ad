#!/usr/bin/env bash
# The picture and the table of doc/validation.md, "Three models": rho_max over the speed by all models of the frame.
#
#   validation/models.sh GESTELL [FOLDER]
#
# GESTELL: the installed program; FOLDER: where models.svg goes, doc/pictures as a rule. Needs gnuplot for the picture.
set -eu
here=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd)
gestell=$(realpath "$1")
target=$(cd -- "${2:-$here/../doc/pictures}" && pwd)
data=$here/../data
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

# machine NAME FROM TO < input
machine() {
  cat - <(printf "&sweep parameter='drive.speed_rpm', from=%s, to=%s, count=241, columns='rho_max','verdict' /\n" "$2" "$3") >"$1.nml"
  local model
  for model in exact first_order rest; do
    "$gestell" -q -s case.tasks=sweep -s "model.frame=$model" -o "$1_$model" "$1.nml"
    printf '%-12s %-12s %4d of 241 speeds unstable, %4d without a vibration, greatest rho_max %s\n' "$1" $model \
      "$(grep -c ',unstable' "$1_$model/sweep.csv" || true)" "$(grep -c ',failed' "$1_$model/sweep.csv" || true)" \
      "$(awk -F, '!/^#/ && $2 + 0 > most { most = $2 } END { printf "%.6f", most }' "$1_$model/sweep.csv")"
  done
}

machine four_bar 2405 2460 <"$data/khang_four_bar.nml"
{ echo "&model frame='exact' /"; cat "$here/sieve_on_springs.nml"; } | machine sieve 540 640
{ echo "&model frame='exact' /"; sed 's/damping=60.0,120.0/damping=1.2,2.4/' "$data/compressor.nml"; } | machine compressor 640 720

command -v gnuplot >/dev/null || { echo 'no gnuplot: no picture'; exit 0; }
gnuplot <<TEXT
set terminal svg size 760,760 font 'sans,13'
set output '$target/models.svg'
set datafile separator ','
set datafile commentschars '#'
set multiplot layout 3,1
set key top right
set ylabel 'greatest |rho|'
set grid
draw(name) = sprintf("plot '%s_rest/sweep.csv' skip 1 using 1:2 with lines lw 2 lc rgb '#999999' title 'rest', " \
  . "'%s_first_order/sweep.csv' skip 1 using 1:2 with lines lw 2 lc rgb '#0072b2' title 'first order', " \
  . "'%s_exact/sweep.csv' skip 1 using 1:2 with lines lw 2 dt '-' lc rgb '#d55e00' title 'exact', " \
  . "1 with lines lc rgb 'black' notitle", name, name, name)
set title 'The four-bar mechanism of the paper'
eval draw('four_bar')
set title 'Sieve on springs'
eval draw('sieve')
set yrange [0.99:1.12]
set title 'Compressor with a fiftieth of its damping'
set xlabel 'crank speed (rpm)'
eval draw('compressor')
unset multiplot
TEXT
