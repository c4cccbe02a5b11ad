#!/usr/bin/env bash
# Measures the library and what users would take in its place, and writes bench/RESULTS.md:
#
#   ./bootstrap bash bench/run.sh [option of compare.py ...]
#
# What is missing of the peers is skipped with a word on how to install it. PYTHON names the Python with SciPy, numba and
# numbalsoda, CC and CXX the compilers of the peers, FLAGS the flags of the library. A whole run takes an hour or so; with
# --ours-only the library is measured alone, with --cases khang_four_bar:240 one case. --charts-only measures the charts of a
# million machines alone and renews their section of bench/RESULTS.md, --space-only the one in space, --multibody-only the section
# beside Exudyn, which the Python that EXUDYN names has (python3 as a rule); without, that section stays as it is. --brief measures
# the portable build beside GSL and Boost in two cases, for a section of this processor that whole runs leave as it is.

set -eu
cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.."
export LC_ALL=C OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
build=$PWD/build/bench
flags=${FLAGS:--O3 -march=native -mprefer-vector-width=512}
peer_flags="-O3 -march=native"
mkdir -p "$build"
say() { printf 'bench: %s\n' "$*" >&2; }

# With its widest vectors, for processors of one name differ in these.
processor() {
  local widest=
  for vectors in avx2:AVX2 avx512f:AVX-512; do
    if grep -qw "${vectors%:*}" /proc/cpuinfo; then widest=" with ${vectors#*:}"; fi
  done
  sed -n "s/^model name[^:]*: *\\(.*\\)/\\1$widest/p" /proc/cpuinfo | head -n 1
}

# library NAME FOLDER FLAGS
library() {
  fpm install --directory "$2" --prefix "$build/$1" --profile release --flag "$3" >"$build/$1.log" 2>&1 ||
    { tail -n 20 "$build/$1.log" >&2; exit 1; }
}

# peer NAME PACKAGE COMPILER SOURCE LIBRARY...
peer() {
  local name=$1 package=$2 compiler=$3 source=$4
  shift 4
  rm -f "$build/$name"
  # shellcheck disable=SC2086 # flags are words
  "$compiler" $peer_flags "bench/peers/$source" -o "$build/$name" "$@" -lm >"$build/$name.log" 2>&1 ||
    skipped+=("$name is skipped; to have it: apt-get install $package")
}

module() {
  "$python" -c "import $1" 2>/dev/null || skipped+=("$1 is skipped; to have it: pip install $1")
}

# replace HEADING FILE: the section of bench/RESULTS.md with this heading, or one before the section beside Exudyn, becomes the file.
replace() {
  awk -v heading="$1" -v file="$2" -v before="## Beside a general program of multibody dynamics" '
    function put(line) { while ((getline line < file) > 0) print line; print ""; done = 1 }
    /^## / { within = $0 == heading; if (!done && (within || ($0 == before && !known))) put() }
    !within' known="$(grep -cxF "$1" bench/RESULTS.md)" bench/RESULTS.md >"$build/results.md"
  cp "$build/results.md" bench/RESULTS.md
  say "bench/RESULTS.md has its section '${1#\#\# }'"
}

# The section on a frame with six degrees of freedom.
in_space() {
  say "in space"
  cat - >"$build/space.md" <<TEXT
## In space

The same for a frame with six degrees of freedom and a mechanism beside its middle: 156 numbers. Measured on
$(processor), $(date +%Y-%m-%d). The right-hand side of the compiled peers is
\`bench/peers/space.h\`, written by hand for this machine.

TEXT
  python3 bench/compare.py "$build" --python "$python" --states 12 ${options[@]+"${options[@]}"} >>"$build/space.md"
  sed -i '/^| program | peak/,$d' "$build/space.md"
}

# The section of this processor alone, and those of others.
brief() {
  say "in brief"
  {
    printf '## In brief: %s\n\nThe portable build, `--profile release`, %s.\n\n' "$(processor)" "$(date +%Y-%m-%d)"
    python3 bench/compare.py "$build" --python false --cases khang_four_bar:240 --states 6 | sed '/^| program | peak/,$d'
    python3 bench/compare.py "$build" --python false --states 12 | sed 's/ rpm to/ rpm, six degrees of freedom, to/; /^| program | peak/,$d'
  } | cat -s | sed '${/^$/d;}' >"$build/brief.md"
}
briefs() { awk '/^## / { within = /^## In brief: / } within' bench/RESULTS.md; }

# The section on charts.
charts() {
  local alone=()
  if [[ $ours_only ]]; then alone=(--ours-only); fi
  say "charts"
  library chart bench/chart "$flags"
  library gestell . "$flags"
  python3 bench/charts.py "$build" --python "$python" ${alone[@]+"${alone[@]}"} |
    sed "s/^## Charts$/&\n\nMeasured on $(processor), $(date +%Y-%m-%d)./" >"$build/charts.md"
  sed -i '${/^$/d;}' "$build/charts.md"
}

# The section beside Exudyn; as it was where Exudyn is missing.
multibody() {
  if "${EXUDYN:-python3}" -c 'import exudyn, numpy' 2>/dev/null; then
    say "multibody"
    library gestell . "$flags"
    "${EXUDYN:-python3}" bench/multibody.py "$build/gestell/bin/gestell" >"$build/multibody.md"
  else
    say "Exudyn is skipped; to have it: pip install exudyn==1.13.6 numpy"
    sed -n '/^## Beside a general program/,/^## Operations/{/^## Operations/d;p}' bench/RESULTS.md >"$build/multibody.md"
  fi
  sed -i '${/^$/d;}' "$build/multibody.md"
}

ours_only='' charts_only='' space_only='' multibody_only='' brief_only='' options=()
for word; do
  case $word in
    --charts-only) charts_only=yes ;;
    --space-only) space_only=yes ;;
    --multibody-only) multibody_only=yes ;;
    --brief) brief_only=yes flags= ;;
    --ours-only) ours_only=yes options+=("$word") ;;
    *) options+=("$word") ;;
  esac
done
python=${PYTHON:-python3}
cc=${CC:-gcc} cxx=${CXX:-g++}
skipped=()
say "building"
if [[ $multibody_only ]]; then
  multibody
  replace '## Beside a general program of multibody dynamics' "$build/multibody.md"
  exit
fi
[[ $charts_only ]] || library speed bench/speed "$flags"
peer gsl libgsl-dev "$cc" gsl.c -lgsl -lgslcblas
peer boost libboost-dev "$cxx" boost.cpp
peer gsl_space libgsl-dev "$cc" gsl.c -DSPACE -lgsl -lgslcblas
peer boost_space libboost-dev "$cxx" boost.cpp -DSPACE
peer sundials libsundials-dev "$cc" sundials.c -lsundials_arkode -lsundials_cvode -lsundials_nvecserial
for name in scipy numba numbalsoda; do module $name; done
if [[ $ours_only ]]; then skipped=(); fi
for line in ${skipped[@]+"${skipped[@]}"}; do say "$line"; done

versions() {
  "${FPM_FC:-gfortran}" --version | sed -n '1s/^/- Library: /p'
  printf '  `%s`\n' "--profile release --flag '$flags'"
  "$cc" --version | sed -n '1s/^/- Peers: /p'
  printf '  `%s`\n' "$peer_flags"
  for name in gsl boost sundials; do
    case $name in
      gsl) header=gsl/gsl_version.h macro=GSL_VERSION ;;
      boost) header=boost/version.hpp macro=BOOST_LIB_VERSION ;;
      sundials) header=sundials/sundials_config.h macro=SUNDIALS_VERSION ;;
    esac
    if [ -e "$build/$name" ]; then
      printf -- '- %s %s\n' $name "$(printf '#include <%s>\n%s\n' $header $macro | "$cxx" -E -P -x c++ - |
        tail -n 1 | tr -d '"' | tr _ .)"
    fi
  done
  "$python" - <<'PYTHON'
import importlib.metadata, platform
print("- Python", platform.python_version(), end="")
for name in ("numpy", "scipy", "numba", "numbalsoda"):
    try:
        print(f", {name} {importlib.metadata.version(name)}", end="")
    except importlib.metadata.PackageNotFoundError:
        pass
print()
PYTHON
}

"$python" -c 'import sys; sys.exit(sys.version_info < (3, 8))' || { say "$python is too old"; exit 1; }
if [[ $charts_only ]]; then
  charts
  replace '## Charts' "$build/charts.md"
  exit
fi
if [[ $brief_only ]]; then
  brief
  replace "$(head -n 1 "$build/brief.md")" "$build/brief.md"
  exit
fi
if [[ $space_only ]]; then
  in_space
  replace '## In space' "$build/space.md"
  exit
fi

say "comparing"
python3 bench/compare.py "$build" --python "$python" --csv "$build/trials.csv" --states 6 ${options[@]+"${options[@]}"} >"$build/comparison.md"
in_space

say "counting operations"
"$cc" -O3 -march=native bench/peak.c -o "$build/peak"
peak=$("$build/peak")
if command -v valgrind >/dev/null; then
  library counted bench/speed "-O3 -march=x86-64-v3"
  python3 bench/operations.py "$build/counted/bin/speed" "$build/speed/bin/speed" "$peak" data \
    "khang_four_bar 240 gauss8 32" "khang_four_bar 240 gauss10 16" "khang_four_bar 240 auto 1e-9" \
    "khang_four_bar 1 multipliers 1e-9" >"$build/operations.md"
else
  echo "Not counted: valgrind is missing (apt-get install valgrind)." >"$build/operations.md"
fi

library kernel bench/kernel "$flags"
"$build/kernel/bin/kernel" "$peak" >"$build/kernel.md"

say "trying flags"
bash bench/flags.sh >"$build/flags.md"

charts
multibody

briefs >"$build/briefs.md"
cat - "$build/comparison.md" >bench/RESULTS.md <<TEXT
# Results of the benchmarks

Made by \`bench/run.sh\` on $(processor), $(nproc --all) cores, one of them used,
$(uname -sr | sed 's/-.*//'), $(date +%Y-%m-%d).

$(versions)
$([ ${#skipped[@]} = 0 ] || printf -- '- %s\n' "${skipped[@]}")

## Against the peers

All compute Phi(T) and x0 = (E - Phi)^-1 x_p(T) of the same machine, by integration over one period: 42 numbers at once, with one
evaluation of the kinematics for a right-hand side that is written by hand for the machine in question. The states are
balanced for the peers, so that one tolerance, relative and absolute, suits all components. Errors are the true ones, against
\`bench/reference.dat\`, relative and in balanced units; of each program's methods and settings the cheapest counts whose
two errors are both small enough. Times are medians over rounds in which the programs take turns.

- **Gestell** (row 1) does what the peers do: so many steps of a method, no estimate of the error.
- **Gestell, all** (row 2) is told a tolerance and nothing else: the method and the steps are chosen, multipliers, x0 and bounds on
  their errors and the verdict computed; its first error is that of the multipliers.
- **Gestell, multipliers** is the same without x0, **Gestell, with peaks** with all that the task \`response\` says too.
- **Gestell, plain** is row 1 by Gauss' methods as they are, not fitted to the fastest motion.
- **SciPy**: DOP853 with the right-hand side in Python, as one writes it with numpy (plain) and as fast as Python gets
  (scalar), and compiled by numba.

TEXT
{
  printf '\n'
  cat "$build/space.md"
  printf '\n'
  cat "$build/briefs.md" "$build/multibody.md"
  printf '\n## Operations and the peak of the core\n\nMeasured peak of one core: %s 1e9 operations a second (fused' "$peak"
  printf ' multiply-adds in registers, bench/peak.c).\nInstructions and operations of one solution are counted by valgrind'
  printf ' in a build for AVX2; times are those of the build above.\n\n'
  cat "$build/operations.md"
  printf '\nThe elimination alone, for three degrees of freedom:\n\n'
  cat "$build/kernel.md"
  printf '\n## What flags are worth\n\nShortest times, in turn.\n\n'
  cat "$build/flags.md"
  printf '\n'
  cat "$build/charts.md"
} >>bench/RESULTS.md
say "bench/RESULTS.md is written"
