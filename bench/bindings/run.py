"""Measures the cost of the Python package in addition to the library: python3 bench/bindings/run.py PROGRAM LIBRARY

A call for one machine is timed on a library of the same functions that do nothing (nothing.c), so that all of it is the package's
own time; a sweep of 1e5 machines through one call against the program with the same library, in turns. Needs cc and numpy.
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent

CALLS = """
import timeit, gestell
machine = gestell.Machine("machine")
solution = machine.solve("stability")
for name, call in (("set", "machine['drive.speed_rpm'] = 240.0"), ("solve", "machine.solve('stability')"),
                   ("verdict", "solution.verdict"), ("multipliers", "solution.multipliers")):
    print(f"{name:12s} {min(timeit.repeat(call, globals=globals(), number=5000, repeat=20)) / 5000 * 1e6:6.2f} us")
"""

SWEEP = """
import sys, time, gestell
begin = time.perf_counter()
table = gestell.Machine(sys.argv[1]).solve().table("sweep")
print(time.perf_counter() - begin, len(table["rho_max"]))
"""


def nothing(folder):
    """Builds the library of functions that do nothing."""
    names = set(re.findall(r"\b(gestell_\w+)\(", (ROOT / "include/gestell.h").read_text()))
    done = set(re.findall(r"\b(gestell_\w+)\(", (HERE / "nothing.c").read_text()))
    rest = folder / "rest.c"
    rest.write_text("".join(f"int {name}(void) {{ return 0; }}\n" for name in sorted(names - done)))
    library = folder / "libnothing.so"
    subprocess.run(["cc", "-O2", "-shared", "-fPIC", f"-I{ROOT / 'include'}", HERE / "nothing.c", rest, "-o", library], check=True)
    return library


def python(library, words, *arguments):
    environment = dict(os.environ, GESTELL_LIBRARY=str(library), PYTHONPATH=str(ROOT / "python"), OPENBLAS_NUM_THREADS="1")
    return subprocess.run([sys.executable, "-c", words, *map(str, arguments)], check=True, env=environment, capture_output=True,
                          text=True).stdout


def seconds_of(program, file, folder):
    """The program's time from start to exit."""
    before = os.times()
    subprocess.run([program, "-q", "-o", folder / "out", file], check=True)
    return os.times().elapsed - before.elapsed


def main():
    program, library = sys.argv[1:]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        print("the package's own time in a call for one machine:")
        print(python(nothing(folder), CALLS), end="")
        for model in ("rest", "exact"):
            text = (ROOT / "data/khang_chart.nml").read_text()
            text = text.replace("count=1000, columns", "count=400, columns").replace("count=1000", "count=250")
            text = re.sub(r"&model[^/]*/.*\n", "", text) + f"&model frame='{model}' /\n"
            file = folder / f"{model}.nml"
            file.write_text(text)
            ratios = []
            for _ in range(3):
                alone = seconds_of(program, file, folder)
                through, points = python(library, SWEEP, file).split()
                ratios.append(float(through) / alone)
            print(f"sweep of {points} machines, {model}: Python / program, median {sorted(ratios)[len(ratios) // 2]:.3f}, "
                  f"{min(ratios):.3f} to {max(ratios):.3f}; the program {alone:.2f} s")


if __name__ == "__main__":
    main()
