#!/usr/bin/env bash
# Cost against work: measures, writes bench/cost/cost.csv and draws doc/pictures/cost.svg: ./bootstrap bash bench/cost/run.sh
# FLAGS are those of the library. The picture needs gnuplot.

set -eu
cd -- "$(dirname -- "${BASH_SOURCE[0]}")/../.."
export LC_ALL=C OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
build=$PWD/build/bench/cost
mkdir -p "$build"
fpm install --directory bench/cost --prefix "$build" --profile release \
  --flag "${FLAGS:--O3 -march=native -mprefer-vector-width=512}" >"$build.log" 2>&1 || { tail -n 20 "$build.log" >&2; exit 1; }
"$build/bin/cost" >bench/cost/cost.csv
gnuplot -e "table='bench/cost/cost.csv'; picture='doc/pictures/cost.svg'" bench/cost/cost.gp
