#!/usr/bin/env bash
# Uses the library as other projects do: ./bootstrap bash test/use_as_library.sh
# The last line is "N passed, M failed".

set -u
cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." || exit 1
export LC_ALL=C OPENBLAS_NUM_THREADS=1
home=$PWD
# The flags of `fpm test`, so that the checks of all steps compile the library once
FPM_FFLAGS=$(sed -n "s/^debug_flags='\(.*\)'$/\1/p" bootstrap) && export FPM_FFLAGS
compiler=${FPM_FC:-gfortran}
temporary=$(mktemp -d) || exit 1
trap 'rm -rf "$temporary"' EXIT
passed=0 failed=0

# check NAME COMMAND...: runs the command and shows its output if it fails.
check() {
  local name=$1
  shift
  if "$@" >"$temporary/log" 2>&1; then
    printf 'ok    %s\n' "$name"
    passed=$((passed + 1))
  else
    printf 'FAIL  %s\n' "$name"
    tail -n 30 "$temporary/log" | sed 's/^/      | /'
    failed=$((failed + 1))
  fi
}

# Another package that depends on the checkout. It must not fetch what only our tests need. Without -fopenmp fpm would compile the
# library again, without threads; validation/compilers checks such a build. test/documents.py uses the same flags.
dependent_package() {
  mkdir -p "$temporary/beside/user/app"
  ln -s "$home" "$temporary/beside/gestell"
  cp test/use_as_library/vinograd.f90 "$temporary/beside/user/app/main.f90"
  printf '%s\n' 'name = "user"' '[dependencies]' 'gestell = { path = "../gestell" }' >"$temporary/beside/user/fpm.toml"
  (cd "$temporary/beside/user" && FPM_FFLAGS="$FPM_FFLAGS -fopenmp" fpm run) || return
  [ ! -e "$temporary/beside/user/build/dependencies/test-drive" ] || { echo 'test-drive was fetched'; return 1; }
}

install_library() { fpm install --prefix "$temporary/installed"; }

# link SOURCE PROGRAM FLAG...: compiles and links against the installed library, without fpm and outside the checkout.
link() {
  local source=$home/$1 program=$2
  shift 2
  mkdir -p "$temporary/plain"
  # shellcheck disable=SC2086 # flags are words
  (cd "$temporary/plain" &&
    "$compiler" -fopenmp -std=f2018 -Wall -Wextra -Werror "$@" -I"$temporary/installed/include" -o "$program" "$source" \
      -L"$temporary/installed/lib" -lgestell -llapack -lblas ${FPM_LDFLAGS:-})
}

# near NAME VALUE KNOWN ALLOWED
near() {
  awk -v name="$1" -v value="$2" -v known="$3" -v allowed="$4" 'BEGIN {
    d = value - known
    if (d < 0) d = -d
    good = value ~ /^-?[0-9.]+$/ && d <= allowed
    printf "%s: %s, known %s, allowed %s: %s\n", name, value, known, allowed, good ? "equal" : "DIFFERENT"
    exit !good
  }'
}

# The exponent 0.0995364372755138 + i is known to 16 digits; 15 are printed.
plain_mathieu() {
  local out
  link example/mathieu.f90 mathieu || return
  out=$("$temporary/plain/mathieu") || return
  near 'real part' "$(awk '$1 == "exponent" && $2 == 1 { print $3 }' <<<"$out")" 0.0995364372755138 2e-14 &&
    near 'imaginary part' "$(awk '$1 == "exponent" && $2 == 1 { print $4 }' <<<"$out")" 1 2e-14 &&
    [ "$(awk '$1 == "verdict" { print $2 }' <<<"$out")" = unstable ] &&
    [ "$(grep -c '^  a = .* un' <<<"$out")" = 11 ] &&
    [ "$(awk '$1 == "a" && $5 == "unstable" { print $3 }' <<<"$out" | xargs)" = '0.8 0.9 1.0 1.1' ]
}

# Converged values of the paper's example are known: x0(1:3) in m and rad to 9 decimals (printed times 1000), rho to 6.
plain_four_bar() {
  local out
  link example/four_bar.f90 four_bar || return
  out=$("$temporary/plain/four_bar") || return
  [ "$(awk '$1 == "verdict:" { print $2 }' <<<"$out")" = stable ] &&
    near '|rho|' "$(awk 'NR == 3 { print $1 }' <<<"$out")" 0.996775 5e-7 &&
    near xi "$(awk '$1 == "xi" { print $2 }' <<<"$out")" 0.223724 5e-7 &&
    near eta "$(awk '$1 == "eta" { print $2 }' <<<"$out")" -0.001189 5e-7 &&
    near psi "$(awk '$1 == "psi" { print $2 }' <<<"$out")" -0.728151 5e-7
}

threads() {
  link test/use_as_library/parallel.f90 parallel -fopenmp && OMP_NUM_THREADS=4 "$temporary/plain/parallel"
}

# gfortran keeps the length of a text that a function allocates in static memory, which threads share: the library below
# src/input has no such functions.
static_lengths() {
  ! nm -A "$temporary/installed/lib/libgestell.a" | grep -E 'src_(base|math|system|floquet|model|study)_.* b slen'
}

# Every Fortran block of the documentation is part of an example, word for word.
documentation() {
  local block file found count=0
  rm -f "$temporary"/block-*
  awk -v prefix="$temporary/block-" '/^```fortran$/ { n++; inside = 1; next } /^```$/ { inside = 0 }
    inside { print > (prefix n) }' doc/library.md
  for block in "$temporary"/block-*; do
    [ -e "$block" ] || break
    count=$((count + 1)) found=
    for file in example/*.f90; do
      [[ $(<"$file") != *"$(<"$block")"* ]] || found=$file
    done
    if [ -z "$found" ]; then
      echo 'part of no example:'
      cat "$block"
      return 1
    fi
  done
  [ $count -gt 0 ] || { echo 'no Fortran in doc/library.md'; return 1; }
}

check 'a package that depends on the library builds and runs' dependent_package
check 'fpm install installs the library' install_library
check 'the Mathieu example, built without fpm, prints the known exponent' plain_mathieu
check 'the four-bar example, built without fpm, prints the known vibration' plain_four_bar
check 'four threads obtain the same bits as one' threads
check 'no function keeps the length of a text in static memory' static_lengths
check 'all code in doc/library.md is part of an example' documentation

printf '%d passed, %d failed\n' $passed $failed
[ $failed = 0 ]
