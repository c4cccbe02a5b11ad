#!/usr/bin/env bash
# What compiler flags are worth for the library, as a Markdown table: ./bootstrap bash bench/flags.sh
# The programs run in turn, ROUNDS times (7); the shortest times count. What is built stays in build/bench/flags.

set -eu
cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.."
export LC_ALL=C OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
build=$PWD/build/bench/flags
sets=(
  ""
  "--profile release"
  "--profile release --flag -march=native"
  "--profile release --flag -march=native\ -mprefer-vector-width=512"
)
orders=("khang_four_bar 240 gauss6 64" "khang_four_bar 240 auto 1e-9" "khang_four_bar 1 multipliers 1e-9"
  "watt_six_bar 180 auto 1e-9")
mkdir -p "$build"

for i in "${!sets[@]}"; do
  eval "flags=(${sets[i]})"
  fpm install --directory bench/speed --prefix "$build/$i" ${flags[@]+"${flags[@]}"} >"$build/$i.log" 2>&1 ||
    { tail -n 20 "$build/$i.log" >&2; exit 1; }
done

rm -f "$build"/times-*
for ((round = 0; round < ${ROUNDS:-7}; round++)); do
  for i in "${!sets[@]}"; do
    for k in "${!orders[@]}"; do
      echo "${orders[k]} 0.1" | "$build/$i/bin/speed" data 2>/dev/null | cut -d, -f1 >>"$build/times-$i-$k"
    done
  done
done

printf '| flags to fpm |'; printf ' %s |' "${orders[@]}"
printf '\n|---|'; printf -- '--:|%.0s' "${orders[@]}"; printf '\n'
for i in "${!sets[@]}"; do
  eval "flags=(${sets[i]})"
  printf '| `%s` |' "$(sed 's/^ *$/none: the debug build/' <<<"${flags[*]-}")"
  for k in "${!orders[@]}"; do
    sort -g "$build/times-$i-$k" | awk 'NR == 1 {printf " %.3g us |", $1 * 1e6}'
  done
  printf '\n'
done
