#!/usr/bin/env python3
"""Builds the program with each compiler for each system and compares its results with those of a reference program.

usage: validation/compilers/compilers.py [OPTION ...] REFERENCE BUILDS [TARGET ...]

REFERENCE: program whose tables count as right; it is built by gfortran 12 and passes all tests. BUILDS: folder for the builds,
which later runs continue. A target is a compiler of the list below; without a target, all compilers that are installed are used.

--quick            compile without optimisation and without OpenMP, and compare four inputs instead of all of data/
--tests NAME,...   also run these tests of test/cli (names of files without .py), with the programs for this system
--lapack FOLDER    sources of the reference LAPACK, needed for other systems: apt-get source lapack

Prints a table in Markdown: tables that agree within their error bounds (validation/same_digits.py), and checks of the tests passed.
The exit code is 1 if a build fails, a table differs or a check fails.
"""
import argparse
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

CHECKOUT = Path(__file__).resolve().parent.parent.parent
QUICK = ("khang_four_bar", "compressor", "cam_press", "engine_in_space")


class Target(NamedTuple):
    """A compiler. `cross`: prefix of the tools for another system. `runner`: command that runs a program of the other system."""

    compiler: str
    system: str = "Linux x86-64"
    options: tuple = ()
    cross: str = ""
    runner: str = ""


TARGETS = [
    Target("gfortran-11"), Target("gfortran-12"), Target("gfortran-13"), Target("gfortran-14"), Target("gfortran-15"),
    # flang 19 does not know -fno-openmp, which CMakeLists.txt needs for threads
    Target("flang-new-19", options=("-DGESTELL_OPENMP=OFF",)), Target("flang-20"), Target("flang-21"), Target("flang-22"),
    Target("aarch64-linux-gnu-gfortran", "Linux arm64, in the emulator QEMU", ("-DCMAKE_SYSTEM_NAME=Linux",
           "-DCMAKE_SYSTEM_PROCESSOR=aarch64"), "aarch64-linux-gnu-", "qemu-aarch64"),
    Target("x86_64-w64-mingw32-gfortran", "Windows x86-64, in Wine", ("-DCMAKE_SYSTEM_NAME=Windows",), "x86_64-w64-mingw32-",
           "wine64"),
]


def find(tool):
    """The path of a program; None if it is not installed."""
    return shutil.which(tool, path=os.environ["PATH"] + ":/usr/lib/wine")


def run(log, *command):
    """Runs a command, whose output goes to the file `log`. Raises CalledProcessError if it fails."""
    with open(log, "ab") as file:
        subprocess.run([str(word) for word in command], stdout=file, stderr=subprocess.STDOUT, check=True, cwd=CHECKOUT,
                       stdin=subprocess.DEVNULL)


def compile_with(target, folder, lapack, quick):
    """Builds the program, and LAPACK for other systems. Returns the program, which this system can run."""
    folder.mkdir(parents=True, exist_ok=True)
    log = folder / "log"
    common = ["-G", "Ninja", f"-DCMAKE_Fortran_COMPILER={target.compiler}", "-DCMAKE_BUILD_TYPE=Release", *target.options]
    if quick:
        common += ["-DCMAKE_Fortran_FLAGS_RELEASE=-O0", "-DGESTELL_OPENMP=OFF"]
    ending = ".exe" if "mingw" in target.cross else ""
    if target.cross:
        common.append(f"-DCMAKE_C_COMPILER={target.cross}gcc")
        library = folder / "lapack/lib"
        openmp = subprocess.run([target.compiler, "-print-file-name=libgomp.a"], capture_output=True, text=True, check=True)
        if not (library / "liblapack.a").exists():
            run(log, "cmake", "-S", lapack, "-B", folder / "lapack", *common, "-DBUILD_SINGLE=OFF", "-DBUILD_COMPLEX=OFF",
                "-DBUILD_TESTING=OFF")
            # not its tests, which only the other system could run
            run(log, "cmake", "--build", folder / "lapack", "--parallel", str(os.cpu_count()), "--target", "blas", "lapack")
        common += [f"-DBLAS_LIBRARIES={library}/libblas.a", f"-DLAPACK_LIBRARIES={library}/liblapack.a;{library}/libblas.a",
                   "-DCMAKE_EXE_LINKER_FLAGS=-static", f"-DOpenMP_gomp_LIBRARY={openmp.stdout.strip()}"]
    run(log, "cmake", "-S", CHECKOUT, "-B", folder / "gestell", *common)
    run(log, "cmake", "--build", folder / "gestell", "--parallel", str(os.cpu_count()), "--target", "gestell-program")
    program = folder / f"gestell/bin/gestell{ending}"
    if not target.runner:
        return program
    script = folder / "gestell.sh"
    # Wine says much on standard error about what a machine without a screen lacks.
    script.write_text(f"#!/bin/sh\nWINEDEBUG=-all exec {find(target.runner)} '{program}' \"$@\"\n")
    script.chmod(0o755)
    return script


def compare(reference, program, inputs):
    """Compares the tables of two programs. Returns the result as a cell of the table, and if all tables agree."""
    script = CHECKOUT / "validation/same_digits.py"
    done = subprocess.run([sys.executable, script, "--compiler", reference, program, *inputs], text=True, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT)
    print(done.stdout, file=sys.stderr)
    same, within, different = map(int, re.findall(r"\d+", done.stdout.splitlines()[-1]))
    return f"{same + within} of {same + within + different}", different == 0 and same + within > 0


def check(program, tests):
    """Runs tests of the command line. Returns the result as a cell of the table, and if all checks pass."""
    done = subprocess.run([sys.executable, CHECKOUT / "test/cli/run.py", program, *tests], text=True, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT)
    count = re.search(r"(\d+) passed, (\d+) failed", done.stdout)
    if not count or done.returncode:
        print(done.stdout, file=sys.stderr)
    return (f"{count[1]} of {int(count[1]) + int(count[2])}", count[2] == "0") if count else ("do not run", False)


def version_of(compiler):
    """The compiler's name with its version."""
    line = subprocess.run([compiler, "--version"], capture_output=True, text=True, check=True).stdout.splitlines()[0]
    number = re.findall(r"\d+\.\d+\.\d+", line) or re.findall(r"\d+-\w+", line)
    return f"{'flang' if 'flang' in line else 'gfortran'} {number[-1]}"


def main():
    """Prints the table."""
    parser = argparse.ArgumentParser(usage=__doc__.partition("usage: ")[2].partition("\n")[0])
    for name in ("reference", "builds"):
        parser.add_argument(name, type=lambda word: Path(word).resolve())
    parser.add_argument("targets", nargs="*")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--tests", default="")
    parser.add_argument("--lapack")
    options = parser.parse_args()
    unknown = set(options.targets) - {target.compiler for target in TARGETS}
    if unknown:
        parser.error(f"unknown target {', '.join(unknown)}")
    inputs = [CHECKOUT / f"data/{name}.nml" for name in QUICK] if options.quick else sorted((CHECKOUT / "data").glob("*.nml"))
    good = True
    rows = ["| compiler | system | tables that agree | checks of the command line |", "|---|---|---|---|"]
    for target in TARGETS:
        if options.targets and target.compiler not in options.targets or target.cross and not options.lapack:
            continue
        if not (find(target.compiler) and (not target.runner or find(target.runner))):
            if options.targets:
                rows.append(f"| {target.compiler} | {target.system} | not installed | |")
            continue
        tables, checks, agrees, passes = "does not compile", "", False, True
        try:
            program = compile_with(target, options.builds / target.compiler, options.lapack, options.quick)
            tables, agrees = compare(options.reference, program, inputs)
            if options.tests and not target.runner:
                checks, passes = check(program, options.tests.split(","))
        except subprocess.CalledProcessError as failure:
            print(f"{failure}: see {options.builds / target.compiler / 'log'}", file=sys.stderr)
        good = good and agrees and passes
        rows.append(f"| {version_of(target.compiler)} | {target.system} | {tables} | {checks} |")
    print(*rows, sep="\n")
    return 0 if good and len(rows) > 2 else 1


if __name__ == "__main__":
    sys.exit(main())
