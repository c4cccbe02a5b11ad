#!/usr/bin/env bash
# The pictures of the README, by the program itself: doc/pictures/make.sh [GESTELL [FOLDER]]
# GESTELL: the installed program; FOLDER: where they go, this folder as a rule. Needs gnuplot.
set -e
here=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd)
gestell=${1:-gestell}
target=$(cd -- "${2:-$here}" && pwd)
data=$here/../../data
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
"$gestell" -q --plot -o four_bar "$data/khang_four_bar.nml"
"$gestell" -q --plot -o speeds --set "case.tasks='campbell','critical'" "$data/khang_speeds.nml"
"$gestell" -q --plot -o sieve --set "case.tasks='sweep','boundary'" --set sweep.count=120 "$data/sieve_borders.nml"
cp four_bar/mechanism.svg "$target/machine.svg"
cp four_bar/response.svg "$target/response.svg"
cp speeds/critical.svg "$target/critical.svg"
cp sieve/sweep.svg "$target/chart.svg"
