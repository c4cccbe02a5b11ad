#!/usr/bin/env bash
# What the parts of a sweep cost, and what threads and ranks gain: ./bootstrap bash bench/scaling/measure.sh [ROUNDS]
# Writes bench/scaling/costs-*.csv and bench/scaling/runs.csv, which simulate.py reads. Needs Open MPI.

set -eu
cd -- "$(dirname -- "${BASH_SOURCE[0]}")/../.."
home=$PWD
here=$PWD/bench/scaling
rounds=${1:-10}
export LC_ALL=C OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1
build=$PWD/build/bench/scaling
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$build"
flags=${FLAGS:--O3 -march=native -mprefer-vector-width=512}

install() {
  FPM_FC=$2 fpm install --directory "$1" --prefix "$build" --profile release --flag "$flags" >"$build.log" 2>&1 ||
    { tail -n 20 "$build.log" >&2; exit 1; }
}
install . gfortran
install mpi mpifort
install bench/scaling gfortran
mpifort -O2 -J "$work" -o "$build/bin/roundtrip" src/base/error.f90 mpi/ranks.f90 mpi/queue.f90 bench/scaling/roundtrip.f90

cd "$work"
chart=$home/data/khang_chart.nml
costs() { "$build/bin/costs" -o "$1" "${@:2}" >"$here/costs-$1.csv"; rm -rf "$1"; }
easy=(--set 'sweep(1).from=300' --set 'sweep(2).from=150000' --set 'sweep(2).to=250000')
all="'rho_max','log_rho_max','rho_error','verdict','xi_peak_m','eta_peak_m','psi_peak_rad'"
costs chart "$chart"
costs easy "${easy[@]}" "$chart"
costs columns --set "sweep(1).columns=$all" "$chart"
costs npy --set sweep.format=npy "$chart"
costs huge --set 'sweep(1).count=100000' --set 'sweep(2).count=100000' "$chart"
mpirun -n 2 "$build/bin/roundtrip" >"$here/costs-memory.csv"
mpirun --mca osc pt2pt --mca pml ob1 --mca btl self,tcp -n 2 "$build/bin/roundtrip" >"$here/costs-network.csv"

# Seconds by the clock and of all cores together, interleaved, for the machine may have other work. `pair`: two programs at
# once that do not know of each other, each the whole chart: what the machine can give to two.
measure() {
  local name=$1 count=$2 times
  shift 2
  rm -rf run other
  times=$( { TIMEFORMAT='%R,%U,%S'; time "$@" >/dev/null 2>&1; } 2>&1)
  echo "$name,$count,$times" >>"$here/runs.csv"
}
pair() {
  "$build/bin/gestell" -q -o other "$chart" &
  "$build/bin/gestell" -q -o run "$chart"
  wait
}
echo 'what,number,seconds,user,system' >"$here/runs.csv"
for ((round = 0; round < rounds; round++)); do
  measure pair 2 pair
  for n in 2 1; do
    measure ranks $n mpirun -n $n "$build/bin/gestell_mpi" -q -o run "$chart"
    OMP_NUM_THREADS=$n measure threads $n "$build/bin/gestell" -q -o run "$chart"
    measure start $n mpirun -n $n "$build/bin/gestell_mpi" --version
  done
done
