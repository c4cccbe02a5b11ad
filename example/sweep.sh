#!/usr/bin/env bash
# Many machines from the shell: a loop, GNU parallel, a job array.
#
#   bash example/sweep.sh [FOLDER]      runs the loop and a sweep in parts, here one after the other
#
# GESTELL names the program where it is not installed: GESTELL="fpm run --profile release --" bash example/sweep.sh

set -eu
gestell=${GESTELL:-gestell}
input=$(dirname -- "$0")/../data/khang_four_bar.nml
folder=${1:-sweep_example}
mkdir -p "$folder"

# 1. A loop: one line of CSV for each case, the header once.
header=1
for speed in 240 300 360; do
  # shellcheck disable=SC2086 # the program may be several words
  $gestell --one-line --set drive.speed_rpm=$speed "$input" | tail -n +$header
  header=2
done >"$folder/loop.csv"

# 2. The same with GNU parallel, as many at a time as there are cores:
#
#   parallel -k gestell --one-line --set drive.speed_rpm={} "$input" '|' tail -n 1 ::: 240 300 360 >>"$folder/loop.csv"

# 3. A sweep in parts. Each part is a program of its own, on this machine or another that sees the folder; it may be
#    killed and started again. The table is the same as of one run, to the last byte.
sweep() {
  # shellcheck disable=SC2086
  $gestell --quiet --output "$folder/chart" "$@" "$(dirname -- "$0")/sweep.nml"
}
for part in 1 2 3 4; do
  sweep --part $part/4
done
sweep --merge

#    As a job array of Slurm (sbatch this; then, when all are done, --merge):
#
#   #!/bin/bash
#   #SBATCH --array=1-100
#   #SBATCH --cpus-per-task=4
#   export OMP_NUM_THREADS=$SLURM_CPUS_PER_TASK
#   gestell --quiet --output chart --part $SLURM_ARRAY_TASK_ID/100 sweep.nml
