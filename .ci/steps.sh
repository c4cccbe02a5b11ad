# The steps of .ci/Makefile: bash .ci/steps.sh NAME runs one, reports how it ended and notes it in build/ci/NAME.result.

set -u
export LC_ALL=C
logs=$PWD/build/ci
installed=$logs/installed
program=$installed/bin/gestell
# The library is built many times, as its users would build it, but a file of it is compiled once for each set of flags.
export FPM_FC=$PWD/.ci/gfortran GESTELL_OBJECTS=$logs/objects
# Waiting threads leave the core to the other step.
export OMP_WAIT_POLICY=passive

# ---- steps that build

bootstrap() {
  # Packages that are optional for users are needed to check everything. Without them the checks of pictures and of the page in a
  # browser print that they are skipped.
  if [ "${CI:-}" = true ] && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    FPM_FC='' ./bootstrap --with gnuplot || echo 'no gnuplot'
    command -v gfortran-11 >/dev/null || { apt-get update && apt-get install -y --no-install-recommends gfortran-11; } || echo 'no gfortran-11'
    command -v chromium >/dev/null || { apt-get update && apt-get install -y --no-install-recommends chromium; } || echo 'no chromium'
  fi
  # .ci/gfortran needs a compiler, which bootstrap installs for users who name none.
  FPM_FC='' ./bootstrap && ./bootstrap
}

install() { ./bootstrap fpm install --profile release --prefix "$installed"; }

# Packages that use the library are linked with the installed, optimised one instead of its sources. The tests are one of their programs.
linked=$logs/linked
packages() {
  local package name modules
  modules=$(cd "$installed/include" && printf '"%s", ' gestell*.mod) || return
  mkdir -p "$linked/build" && ln -s "$PWD/build/dependencies" "$linked/build/" || return
  for name in *; do [[ $name = @(build|validation|mpi) ]] || ln -s "$PWD/$name" "$linked/" || return; done
  for package in validation validation/fuzz mpi; do
    mkdir -p "$linked/$package" || return
    for name in "$PWD/$package"/*; do
      case ${name##*/} in
        build | fpm.toml | fuzz) ;;
        *) ln -s "$name" "$linked/$package/" || return ;;
      esac
    done
    sed "/^gestell = /d; /^external-modules = /d; s/^link = \[/external-modules = [${modules//.mod/}\"mpi_f08\"]\nlink = [\"gestell\", /" \
      "$package/fpm.toml" >"$linked/$package/fpm.toml" || return
  done
  printf '\n[[executable]]\nname = "check"\nsource-dir = "../test"\nmain = "main.f90"\n' >>"$linked/validation/fpm.toml"
  build_linked validation && build_linked validation/fuzz
}
build_linked() {
  # What is measured is in the library; the programs around it compile in half the time without further optimisation. The suites of
  # the tests take little time themselves. (They cannot be linked as `fpm test` has compiled them: gfortran 12 does not read modules of
  # builds with and without run-time checks together.)
  GESTELL_PLAIN_SUITES=yes ./bootstrap fpm install --directory "$linked/$1" --prefix "$linked" \
    --flag "-O1 -fopenmp -I$installed/include" --link-flag "-L$installed/lib -fopenmp"
}
# run_linked FOLDER PROGRAM ARGUMENT...: in a folder of the checkout, where the program finds its files.
run_linked() { OPENBLAS_NUM_THREADS=1 ./bootstrap bash -c 'cd "$0" && exec "$@"' "$1" "$linked/bin/$2" "${@:3}"; }

# ---- tests in Fortran

# A test that stops the program early must not pass: the count at the end is required.
counted() {
  local log code=0
  log=$("$@" 2>&1) || code=$?
  printf '%s\n' "$log"
  [ $code = 0 ] && grep -Eq '^[0-9]+ passed, 0 failed$' <<<"$log"
}

# The second command of a new user: all run-time checks, with warnings as errors
strict-tests() { GESTELL_TRAPS=yes counted ./bootstrap fpm test; }
# With the optimised library, without traps, because its vectors may contain unused numbers
slow-tests() { counted run_linked . check slow; }

# The same tests as strict-tests, which counts them; they are not counted again.
optimised-tests() {
  counted run_linked . check | sed 's/\[PASSED\]/[passed]/; s/ passed, 0 failed$/&, counted once/'
  return "${PIPESTATUS[0]}"
}

mutants() { ./bootstrap python3 validation/mutants/mutants.py --jobs 1 fixed; }

# ---- commands of users

# No warning of the run-time library disturbs the report of a first run, in any task about one machine.
first-command() {
  local tasks=drawing,stability,modes,response,forces,power,trade,balance,sensitivity,separation
  ./bootstrap fpm run -- data/khang_four_bar.nml >"$logs/first" 2>&1 &&
    ./bootstrap fpm run -- -q -o "$logs/tasks" --set case.tasks=$tasks data/khang_four_bar.nml >>"$logs/first" 2>&1 || return
  cat "$logs/first"
  ! grep 'runtime warning' "$logs/first" && only_the_report
}

# Standard output of the first command contains only the report's lines, however much is built; the exit code is the program's.
only_the_report() {
  local code=0
  rm -f build/gfortran_*/app/gestell
  ./bootstrap fpm run -- data/khang_four_bar.nml >"$logs/report" 2>"$logs/building" || return
  diff <(sed 's/[0-9].*//' "$logs/report") <("$program" data/khang_four_bar.nml | sed 's/[0-9].*//') || return
  grep -q '100%' "$logs/building" || { echo 'no progress of the build is shown'; return 1; }
  ./bootstrap fpm run -- no/such/file.nml >"$logs/report" 2>"$logs/building" || code=$?
  [ $code = 2 ] && [ ! -s "$logs/report" ] && grep -q 'there is no such file' "$logs/building"
}

examples() {
  local name
  for name in $(sed -n '/^\[\[example\]\]/,/^$/s/^name *= *"\(.*\)"/\1/p' fpm.toml); do
    ./bootstrap fpm run --example "$name" || return
  done
}

documents() { ./bootstrap python3 test/documents.py; }
use-as-library() { ./bootstrap bash test/use_as_library.sh; }
command-line() { ./bootstrap python3 test/cli/run.py "$program"; }
bindings() { ./bootstrap bash bindings/test.sh; }

# Sweeps by a shell script, with few points
shell-sweeps() {
  local folder=$logs/sweeps
  GESTELL=$program bash example/sweep.sh "$folder" &&
    [ "$(wc -l <"$folder/loop.csv")" = 4 ] && [ "$(grep -vc '^#' "$folder/chart/sweep.csv")" = 1601 ]
}

# The MPI program, built from the objects of gestell; its own manifest is only listed.
ranks() (
  if ! command -v mpifort >/dev/null || ! command -v mpirun >/dev/null; then
    echo 'skipped: mpifort or mpirun is missing (apt-get install libopenmpi-dev openmpi-bin)'
    return
  fi
  export FPM_FC=mpifort
  ./bootstrap fpm build --directory mpi --profile release --list >/dev/null &&
    build_linked mpi && python3 mpi/test.py "$program" "$linked/bin/gestell_mpi"
)

# An fpm of another kind or version is not used; a package with an unexpected hash is refused.
set-up() {
  local other=$logs/other copy=$logs/set-up said
  mkdir -p "$other" "$copy/.ci" && cp bootstrap fpm.toml "$copy" && cp -R .ci/pinned "$copy/.ci" || return
  for said in '1.15.1' 'Version:     0.9.0, alpha' 'Version:     0.120.0'; do
    printf '#!/bin/sh\necho "%s"\n' "$said" >"$other/fpm" && chmod +x "$other/fpm" || return
    PATH=$other:$PATH ./bootstrap bash -c 'fpm --version' | grep -q '^Version: *0\.12\.' || { echo "fpm that says $said"; return 1; }
  done
  sed -i 's/sha256:./sha256:x/; s/:x/:0/' "$copy/.ci/pinned/meson.txt"
  ! "$copy/bootstrap" --pip meson && grep -q 'DO NOT MATCH' "$copy/.bootstrap/log" && ! "$copy/bootstrap" --pip meson==1.0
}

# ---- random inputs and machines

# The fuzzer finds planted faults, and no fault in random inputs. Each input may take a quarter of the usual time: most need a tenth of
# it, and the 6 % that need more than a quarter would take half of this step's time.
fuzzer() { run_linked validation/fuzz fuzz self-test && run_linked validation/fuzz fuzz 10300 1 1 '' 4; }
population() { run_linked validation population 150 5001; }
population-exact() { run_linked validation population 21 306 exact; }
designs() { python3 validation/designs/designs.py "$program" 6 4711; }
borders() { run_linked validation symmetric_borders 4 1 100; }
extremes() { run_linked validation extremes; }

# ---- other compilers and packages

# The library with gfortran 11, the oldest compiler, and without OpenMP: without optimisation, in one and a half minutes of two processors
compilers() {
  if ! command -v gfortran-11 >/dev/null; then
    echo 'skipped: gfortran-11 is missing (apt-get install gfortran-11)'
    return
  fi
  ./bootstrap python3 validation/compilers/compilers.py --quick "$program" "$logs/compilers" gfortran-11
}

# The registry of fpm would accept the package.
fpm-package() { ./bootstrap bash packaging/fpm.sh --dry-run --token none | grep -F 'Dry run successful'; }

# ---- checks of the sources' text

layers() { python3 .ci/layers; }
layers-self-test() { python3 .ci/layers --self-test; }
versions() { bash .ci/versions "$program"; }
reference() { ./bootstrap python3 doc/reference/make.py; }
linter() {
  local fortitude=.bootstrap/venv/bin/fortitude
  [ -x $fortitude ] && [[ $($fortitude --version) == *\ 0.10.0 ]] || ./bootstrap --pip fortitude-lint==0.10.0 || return
  $fortitude check src app mpi test example bench validation
}

# ---- one step

name=$1 log=$logs/$1.log begin=$SECONDS code=0 TIMEFORMAT='%U %S'
mkdir -p "$logs"
{ time "$name" >"$log" 2>&1; } 2>"$log.time" || code=$?
seconds=$((SECONDS - begin))

# The count of a step is its last line "N passed, M failed" or, without it, the lines of test-drive.
good=$(grep -c '^ *\.\.\. .*\[PASSED\]' "$log")
bad=$(grep -c '^ *\.\.\. .*\[FAILED\]' "$log")
if [[ $(tail -n 1 "$log") =~ ^([0-9]+)\ passed,\ ([0-9]+)\ failed$ ]]; then
  good=${BASH_REMATCH[1]} bad=${BASH_REMATCH[2]}
fi
if [ "$code" = 0 ]; then good=$((good + 1)); else bad=$((bad + 1)); fi
echo "$good $bad" >"$logs/$name.result"
how=$([ "$code" = 0 ] && echo ok || echo FAIL)
printf '%-5s %-20s %4d s, of processors %4.0f s, %6d passed\n' "$how" "$name" "$seconds" "$(awk '{ print $1 + $2 }' "$log.time")" "$good"
[ "$code" = 0 ] || { echo "      exit code $code" && grep -v '^\[ *[0-9]*%\]' "$log" | sed 's/^/      | /' | tail -n 60; }
exit 0
