#!/usr/bin/env bash
# The picture of the README, by the program itself: doc/pictures/make.sh [GESTELL [FOLDER]]
# GESTELL: the installed program; FOLDER: where it goes, this folder as a rule. Needs gnuplot.
set -e
here=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd)
gestell=${1:-gestell}
target=$(cd -- "${2:-$here}" && pwd)
data=$here/../../data
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
"$gestell" -q --plot -o four_bar --set "case.tasks='drawing'" "$data/khang_four_bar.nml"
cp four_bar/mechanism_motion.svg "$target/machine.svg"
