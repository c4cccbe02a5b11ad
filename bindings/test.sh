#!/usr/bin/env bash
# The bindings for C, C++, CMake, pkg-config and Python, from outside: ./bootstrap bash bindings/test.sh
# Needs cmake, pkg-config and Python; what is missing is said, and left out. The last line is "N passed, M failed".
# With --sanitize the library of FetchContent has gfortran's address and undefined-behaviour sanitizers (ten minutes).

set -u
cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." || exit 1
export LC_ALL=C OPENBLAS_NUM_THREADS=1
home=$PWD
temporary=$(mktemp -d) || exit 1
trap 'rm -rf "$temporary"' EXIT
passed=0 failed=0
prefix=$temporary/prefix
build=${GESTELL_BUILD:-$temporary/build}
# What CMake, FetchContent, Meson and Python's builder compile with the same flags is compiled once.
export FC=$home/.ci/gfortran GESTELL_OBJECTS=${GESTELL_OBJECTS:-$temporary/objects}
sanitizers=
[ "${1:-}" != --sanitize ] || sanitizers='-fsanitize=address,undefined -fno-sanitize-recover=all -g1'

# check NAME COMMAND...: runs the command and prints how long it took; where it fails, shows what it said. A last line
# "N passed, M failed" counts.
check() {
  local name=$1 good=1 bad=0 begin=$SECONDS
  shift
  if "$@" >"$temporary/log" 2>&1; then
    printf 'ok    %s, %d s\n' "$name" $((SECONDS - begin))
  else
    printf 'FAIL  %s, %d s\n' "$name" $((SECONDS - begin))
    tail -n 30 "$temporary/log" | sed 's/^/      | /'
    good=0 bad=1
  fi
  if [[ $(tail -n 1 "$temporary/log") =~ ^([0-9]+)\ passed,\ ([0-9]+)\ failed$ ]]; then
    good=$((good + BASH_REMATCH[1])) bad=$((bad + BASH_REMATCH[2]))
  fi
  passed=$((passed + good)) failed=$((failed + bad))
}

# CMake calls make unless the user chooses otherwise. The first build does; Ninja takes half the processor time for the others.
command -v ninja >/dev/null && quick=(-G Ninja) || quick=()

# The flags of `fpm test`, which bootstrap defines
debug_flags=$(sed -n "s/^debug_flags='\(.*\)'$/\1/p" bootstrap)

# install_as KIND: static or shared, of the same objects; debug: the static library alone, of the objects of the unit tests.
install_as() {
  local folder=$build options=(-DBUILD_SHARED_LIBS=OFF)
  case $1 in
    shared) options=(-DBUILD_SHARED_LIBS=ON) ;;
    debug) folder=$build-debug options+=("${quick[@]}" -DCMAKE_BUILD_TYPE=Debug -DGESTELL_PROGRAM=OFF "-DCMAKE_Fortran_FLAGS=$debug_flags") ;;
  esac
  cmake -S "$home" -B "$folder" "${options[@]}" -DCMAKE_INSTALL_PREFIX="$prefix-$1" &&
    cmake --build "$folder" --parallel 2 && cmake --install "$folder"
}

# compile KIND SOURCE PROGRAM: by pkg-config, in C or Fortran.
compile() {
  local flags compiler=(cc -std=c99 -pthread)
  [[ $2 != *.f90 ]] || compiler=("$FC" -std=f2018)
  flags=$(PKG_CONFIG_PATH=$prefix-$1/lib/pkgconfig:$prefix-$1/lib64/pkgconfig:$(echo "$prefix-$1"/lib/*/pkgconfig) \
    pkg-config --cflags --libs $([ "$1" = shared ] || echo --static) gestell) || return
  # shellcheck disable=SC2086 # flags are words
  "${compiler[@]}" -Wall -Wextra -Werror "$home/$2" $flags -lm -ldl -o "$temporary/$3-$1"
}

libraries() { for folder in "$prefix-shared"/lib*/ "$prefix-shared"/lib/*/; do printf '%s:' "$folder"; done; }

# run KIND PROGRAM ARGUMENT...: from an empty folder.
run() {
  local kind=$1 program=$2
  shift 2
  mkdir -p "$temporary/empty"
  (cd "$temporary/empty" && LD_LIBRARY_PATH=$(libraries) "$temporary/$program-$kind" "$@")
}

# The numbers of three files, of the command line and of programs that use the library, to the last digit: same PROGRAM TABLE...,
# commands. The chart has fewer points. What is refused is so by the program's words and code.
same() {
  local program=$1 name table one
  shift
  for name in khang_four_bar:response compressor:multipliers khang_chart:sweep; do
    table=${name#*:} name=${name%:*}
    rm -rf "${temporary:?}/$name"
    sed 's/count=1000/count=12/' "$home/data/$name.nml" >"$temporary/$name.nml"
    "$program" -q -o "$temporary/$name" "$temporary/$name.nml" || return
    for one in "$@"; do
      "$one" "$temporary/$name.nml" "$table" >"$temporary/$name.csv" &&
        equal "$temporary/$name.csv" "$temporary/$name/$table.csv" || return
    done
  done
  for one in "$@"; do
    refused_alike "$program" "$one" || return
  done
}

# Two tables.
equal() {
  python3 - "$@" <<'PYTHON'
import csv, sys
one, two = ([row for row in csv.reader(line for line in open(name) if not line.startswith("#"))] for name in sys.argv[1:])
def equal(a, b):
    try:
        return a == b or float(a or "nan") == float(b or "nan") or {a.lower(), b.lower()} <= {"nan", "", "-nan"}
    except ValueError:
        return False
bad = [(a, b) for r, s in zip(one, two) for a, b in zip(r, s) if not equal(a, b)]
print(sys.argv[2], len(one), len(two), bad[:5])
sys.exit(list(map(len, one)) != list(map(len, two)) or bool(bad))
PYTHON
}

# refused_alike PROGRAM TABLE: what is wrong in a file, and a mechanism that cannot be; a number that is none has words of its own.
refused_alike() {
  local good=$home/data/khang_four_bar.nml bad=$temporary/bad.nml change code told
  for change in s/speed_rpm/speed_rp/ s/lengths=0.37/lengths=0.05/; do
    sed "$change" "$good" >"$bad"
    told=$("$1" -q -o "$temporary/bad" "$bad" 2>&1 >"$temporary/ignored")
    code=$?
    [ $code -gt 1 ] && [ "$("$2" "$bad" response 2>&1 >"$temporary/ignored"; echo "code $?")" = "$told"$'\n'"code $code" ] ||
      { echo "$change: $2 ends otherwise than with $code, $told"; return 1; }
  done
  told=$("$2" "$good" response drive.speed_rpm nan 2>&1)
  [ "$? $told" = '2 at drive.speed_rpm=NaN: must be finite' ] || { echo "NaN: $told"; return 1; }
}

numbers() {
  local programs=("$temporary/table-$1")
  compile "$1" bindings/table.c table || return
  # a shared library shows C's functions only
  [ "$1" = shared ] || { compile "$1" bindings/table.f90 fortran && programs+=("$temporary/fortran-$1"); } || return
  (export LD_LIBRARY_PATH=$(libraries) && same "$prefix-$1/bin/gestell" "${programs[@]}")
}

refusals() { compile "$1" bindings/refusals.c refusals && run "$1" refusals "$home/data/khang_four_bar.nml"; }

# Threads that solve machines side by side, and the same under a tool that finds data races even where they do no harm.
threads() {
  local input=$home/data/khang_four_bar.nml
  compile "$1" bindings/threads.c threads && run "$1" threads 4 "$input" "$home/data/compressor.nml" || return
  # (it does not know how the threads of OpenMP wait for each other)
  ! command -v valgrind >/dev/null ||
    LD_LIBRARY_PATH=$(libraries) valgrind -q --tool=helgrind --history-level=none --error-exitcode=9 "$temporary/threads-$1" 2 "$input"
}

# What is counted in memory asked for, and what a child of fork computes with more than one thread.
adding() { compile "$1" bindings/adding.c adding && run "$1" adding; }
forked() { compile "$1" bindings/fork.c forked && OMP_NUM_THREADS=2 run "$1" forked "$home/data/khang_chart.nml"; }

example() {
  compile "$1" example/c/verdict.c verdict && run "$1" verdict "$home/data/khang_four_bar.nml" | grep -x stable &&
    ! run "$1" verdict && [ "$(run "$1" verdict /no/such/file)" = '/no/such/file: there is no such file' ]
}

# Every option is in the man page, and what completion offers is there.
helped() {
  local program=$prefix-static/bin/gestell option found
  for option in $("$program" --help | grep -o -- '--[a-z-]*' | sort -u); do
    sed 's/\\-/-/g' "$prefix-static/share/man/man1/gestell.1" | grep -q -- "$option" || { echo "not in the man page: $option"; return 1; }
  done
  grep -q "\"gestell $("$program" --version | grep -o '[0-9.]*$')\"" "$prefix-static/share/man/man1/gestell.1" || return
  # shellcheck source=/dev/null
  source "$prefix-static/share/bash-completion/completions/gestell"
  COMP_WORDS=("$program" --one) COMP_CWORD=1 && _gestell && found=${COMPREPLY[*]} && [ "$found" = --one-line ] &&
    COMP_WORDS=("$program" --help supp) COMP_CWORD=2 && _gestell && found=${COMPREPLY[*]} && [ "$found" = support ] &&
    COMP_WORDS=("$program" "$home/data/shap") COMP_CWORD=1 && _gestell && found=${COMPREPLY[*]} && [ "$found" = "$home/data/shaper.nml" ]
}

# The first lines of doc/c.md run as they stand.
page() {
  awk '/^```c$/ { on = 1; next } /^```$/ { if (on) exit } on' "$home/doc/c.md" >"$temporary/page.c"
  (
    home=$temporary
    compile shared page.c page
  ) && [ "$(cd "$home" && LD_LIBRARY_PATH=$(libraries) "$temporary/page-shared")" = stable ]
}

# Nothing of the modules leaves a shared library, and the header compiles as C++.
symbols() {
  local library=$(echo "$prefix-shared"/lib*/libgestell.so "$prefix-shared"/lib/*/libgestell.so | tr ' ' '\n' | grep -v '\*' | head -1)
  ! nm -D --defined-only "$library" | awk '{ print $3 }' | grep -v '^gestell_' &&
    [ "$(nm -D --defined-only "$library" | wc -l)" = "$(grep -c 'gestell_[a-z_]*(' "$home/include/gestell.h")" ] &&
    echo '#include <gestell.h>' | c++ -x c++ -Wall -Wextra -Werror -I"$prefix-shared/include" -fsyntax-only -
}

# A program linked to the shared library asks for it by the major version; the file and pkg-config have the whole version.
release() {
  local library version
  library=$(echo "$prefix-shared"/lib*/libgestell.so "$prefix-shared"/lib/*/libgestell.so | tr ' ' '\n' | grep -v '\*' | head -1)
  version=$("$prefix-shared/bin/gestell" --version | grep -o '[0-9.]*$')
  objdump -p "$library" | grep 'SONAME' | grep -x " *SONAME *libgestell\.so\.${version%%.*}" && [ -f "$library.$version" ] &&
    [ "$(PKG_CONFIG_PATH=${library%/*}/pkgconfig pkg-config --modversion gestell)" = "$version" ]
}

# A user's project, in C and Fortran: its sources.
sources() {
  mkdir -p "$1"
  cp "$home"/bindings/*.c "$home"/bindings/*.f90 "$1"
  sed "s#data/#$home/data/#" "$home/example/verdict.f90" >"$1/verdict.f90"
  # doc/library.md begins with it
  awk '/^```fortran$/ { on = 1; next } /^```$/ { if (on) exit } on' "$home/doc/library.md" | diff - "$home/example/verdict.f90"
}

# project FOLDER LINE...: of CMake, with these lines to find the library.
project() {
  local folder=$1
  shift
  sources "$folder" || return
  printf '%s\n' 'cmake_minimum_required(VERSION 3.20)' 'project(user LANGUAGES C Fortran)' "$@" \
    'add_executable(c table.c)' 'target_link_libraries(c gestell::gestell)' \
    'add_executable(fortran table.f90)' 'target_link_libraries(fortran gestell::gestell)' \
    'add_executable(verdict verdict.f90)' 'target_link_libraries(verdict gestell::gestell)' \
    'add_executable(refusals refusals.c)' 'target_link_libraries(refusals gestell::gestell m)' >"$folder/CMakeLists.txt"
}

verdict() { "$1" | grep '^stable, force on the ground 137.6661 N'; }

packages() {
  local here=$temporary/package
  project "$here" 'find_package(gestell 1.0 REQUIRED)'
  cmake -S "$here" -B "$here/build" -DCMAKE_PREFIX_PATH="$prefix-static" && cmake --build "$here/build" &&
    same "$prefix-static/bin/gestell" "$here/build/c" "$here/build/fortran" && verdict "$here/build/verdict"
}

# The library is built in the user's project; program and library are of the same objects.
fetched() {
  local here=$temporary/fetched origin=$home flags=$sanitizers
  if [ -e "$home/.git" ]; then
    origin=$temporary/clone
    git clone -q "$home" "$origin" || return
  fi
  project "$here" 'include(FetchContent)' "FetchContent_Declare(gestell SOURCE_DIR $origin)" 'FetchContent_MakeAvailable(gestell)'
  cmake -S "$here" -B "$here/build" "${quick[@]}" -DGESTELL_PROGRAM=ON "-DCMAKE_Fortran_FLAGS=$flags" \
    "-DCMAKE_C_FLAGS=$flags" && cmake --build "$here/build" --parallel 2 &&
    same "$(find "$here/build" -name gestell -path '*/bin/*')" "$here/build/c" "$here/build/fortran" &&
    verdict "$here/build/verdict"
}

refused() { "$temporary/fetched/build/refusals" "$home/data/khang_four_bar.nml"; }

# No bytes are lost, and none outside of an array is touched, in 100,000 calls. The library is built like the unit tests: optimised
# loops read, and do not use, more of a vector than was written.
leaks() {
  install_as debug && compile debug bindings/leaks.c leaks &&
    # Without optimisation gfortran compares the bounds of an array that is not yet allocated before it allocates it by an assignment;
    # valgrind would report these comparisons.
    valgrind -q --undef-value-errors=no --leak-check=full --errors-for-leak-kinds=definite,indirect,possible --error-exitcode=9 \
      "$temporary/leaks-debug" "$home/data/compressor.nml"
}

subproject() {
  local here=$temporary/subproject
  sources "$here" || return
  mkdir -p "$here/subprojects" && ln -s "$home" "$here/subprojects/gestell"
  printf '%s\n' "project('user', 'c', 'fortran')" "gestell = dependency('gestell')" \
    "executable('c', 'table.c', dependencies: gestell)" "executable('fortran', 'table.f90', dependencies: gestell)" \
    "executable('verdict', 'verdict.f90', dependencies: gestell)" >"$here/meson.build"
  tool meson setup "$here/build" "$here" --buildtype release -Ddefault_library=static -Dwarning_level=0 \
    -Dfortran_args=-funroll-loops && ninja -C "$here/build" &&
    same "$here/build/subprojects/gestell/gestell" "$here/build/c" "$here/build/fortran" &&
    verdict "$here/build/verdict"
}

# tool NAME ARGUMENT...: a tool of Python's, from a place of its own where the machine has none.
tool() {
  local name=$1
  shift
  if command -v "$name" >/dev/null; then "$name" "$@"; else "$home/.bootstrap/venv/bin/$name" "$@"; fi
}

# In a new environment, without a compiler and with nothing of this machine's on the PATH.
wheel() {
  local environment=$temporary/environment
  CMAKE_BUILD_PARALLEL_LEVEL=2 bash "$home/python/wheel.sh" "$temporary/wheels" && python3 -m venv "$environment" &&
    "$environment/bin/pip" -q install --require-hashes --only-binary :all: -r "$home/.ci/pinned/xarray.txt" -r "$home/.ci/pinned/mypy.txt" &&
    "$environment/bin/pip" -q install --no-index "$temporary"/wheels/gestell-*.whl || return
  # with its command and the files of the live page
  [ -f "$(echo "$environment"/lib/python*/site-packages/gestell/live.js)" ] &&
    env -i PATH="$environment/bin" gestell live none.nml --no-browser 2>&1 | grep -q '^none.nml: cannot be read' || return
  (cd "$temporary" && mkdir -p nothing && cd nothing &&
    # the sessions of doc/python.md have types
    awk '/^```python$/ { on = 1; next } /^```$/ { on = 0 } on' "$home/doc/python.md" >session.py &&
    env -i PATH="$environment/bin" "$environment/bin/mypy" --strict session.py &&
    env -i PATH="$environment/bin" "$environment/bin/python" "$home/bindings/package.py" &&
    env -i PATH="$environment/bin" "$environment/bin/python" "$home/bindings/python.py" "$prefix-static/bin/gestell")
}

# What is installed, and nothing else: no modules of the program.
installed() {
  (cd "$prefix-static" && find . -name '*.mod' | grep -v '/gestell' ; find . -name 'gestell*.mod' | grep -c . ; ls bin include) >"$temporary/files"
  cat "$temporary/files"
  ! grep -q '^\./' "$temporary/files" && [ -x "$prefix-static/bin/gestell" ] && [ -e "$prefix-static/include/gestell.h" ]
}

# by_python SCRIPT ARGUMENT...: with the shared library and a Python that has numpy.
by_python() {
  python3 -c 'import numpy' 2>/dev/null || "$home/bootstrap" --pip numpy || return
  local interpreter=python3
  python3 -c 'import numpy' 2>/dev/null || interpreter=$home/.bootstrap/venv/bin/python3
  GESTELL_LIBRARY=$(echo "$prefix-shared"/lib*/libgestell.so "$prefix-shared"/lib/*/libgestell.so | tr ' ' '\n' | grep -v '\*' | head -1) \
    PYTHONPATH=$home/python "$interpreter" "$@"
}
python() { by_python "$home/bindings/python.py" "$prefix-shared/bin/gestell"; }
package() { by_python "$home/bindings/package.py"; }
live() { by_python "$home/bindings/live.py" "$prefix-shared/bin/gestell"; }
fuzzed() { PROGRAM=$prefix-shared/bin/gestell by_python "$home/bindings/fuzz.py" 300; }

for tool in cmake pkg-config cc; do
  command -v $tool >/dev/null || { echo "skip  there is no $tool"; echo '0 passed, 0 failed'; exit 0; }
done
check 'signatures in C, Fortran and Python' python3 bindings/signatures.py
check 'CMake, static' install_as static
check 'what is installed' installed
check 'man page and completion' helped
check 'pkg-config, static: the numbers of the command line' numbers static
check 'pkg-config, static: what is refused' refusals static
check 'find_package from C and Fortran' packages
check 'CMake, shared' install_as shared
check 'symbols of the shared library, header in C++' symbols
check 'version of the shared library and of pkg-config' release
check 'pkg-config, shared: the numbers of the command line' numbers shared
check 'pkg-config, shared: what is refused' refusals shared
check 'groups added one by one' adding shared
check 'sweeps after fork' forked shared
check 'machines solved by several threads' threads shared
check 'example' example shared
check 'doc/c.md' page
check 'Python' python
check 'Python, as people use it' package
check 'the live page' live
check 'random texts and calls through Python and C' fuzzed
check 'Python, from a wheel' wheel
check 'FetchContent from C and Fortran' fetched
check 'what is refused, in that build' refused
if command -v valgrind >/dev/null; then
  check 'no leak in 100,000 calls' leaks
else
  echo 'skip  there is no valgrind'
fi
command -v meson >/dev/null || "$home/bootstrap" --pip meson >/dev/null 2>&1
if command -v ninja >/dev/null; then
  check 'Meson, a subproject, from C and Fortran' subproject
else
  echo 'skip  there is no ninja for Meson'
fi

printf '%d passed, %d failed\n' $passed $failed
[ $failed = 0 ]
