"""Compares the time of Gestell's models of the frame with that of Exudyn, a general program of multibody dynamics, for the
vibration and the multipliers of its map of one turn. Prints a section of bench/RESULTS.md.

    python bench/multibody.py GESTELL [MACHINE:RPM ...]

needs numpy and Exudyn (pip install exudyn==1.13.6 numpy). The machines are built in Exudyn as validation/exudyn/compare.py
does, and solved by its integrator in time, Newton's method for the fixed point of the map, from the vibration about rest, and
central differences. The time is that of the first of the numbers of steps 125, 250, ... for which all multipliers are within
ERROR of those that Gestell computes to 1e-13, to which Exudyn converges. Gestell's tolerance is 1e-9; its error is printed too.
Times are the shortest of several runs, which other work on the computer disturbs least: for Gestell those of task `trade`,
inside the program, and of the whole program with start and files; for Exudyn of the solution alone, without building the model.
"""

import math
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "validation" / "exudyn"))
import compare  # noqa: E402

MACHINES = ("khang_four_bar:240", "khang_four_bar:2426", "compressor:1450", "watt_six_bar:180", "flying_press:150", "shaper:60", "rocking_sieve:229")
MODELS = ("rest", "first_order", "exact")
ERROR = 1e-6
MOST_STEPS = 16000
RUNS, EXUDYN_RUNS = 15, 3


def shortest(runs, work):
    """The shortest time of several runs (s), and the result of the last one."""
    best = math.inf
    for _ in range(runs):
        start = time.perf_counter()
        result = work()
        best = min(best, time.perf_counter() - start)
    return best, result


def off(rho, reference):
    return max(np.min(abs(reference - value)) for value in rho)


def inside(program, file, speed):
    """Shortest times (s) of verdict and vibration by each model, as the program measures them itself."""
    best = dict.fromkeys(MODELS, math.inf)
    for _ in range(RUNS):
        with tempfile.TemporaryDirectory() as folder:
            out = subprocess.run([program, "-o", folder, "-s", "case.tasks=trade", "-s", f"drive.speed_rpm={speed!r}", "-s",
                                  "accuracy.tolerance=1e-9", file], check=True, capture_output=True, text=True).stdout
        for model, milliseconds in re.findall(r"^  (rest|first_order|exact) .* ([0-9.]+)$", out, re.M):
            best[model] = min(best[model], float(milliseconds) / 1e3)
    return [best[model] for model in MODELS]


def whole(program, file, speed):
    """The shortest time (s) of the whole program with the exact frame."""
    with tempfile.TemporaryDirectory() as folder:
        return shortest(RUNS, lambda: subprocess.run(
            [program, "-q", "-o", folder, "-s", "case.tasks=stability,response", "-s", "model.frame=exact", "-s",
             f"drive.speed_rpm={speed!r}", file], check=True))[0]


def multibody(machine, start, reference):
    """Steps, error of the multipliers and shortest time (s) of Exudyn; None if no number of steps is accurate enough."""
    scale = compare.STEP * np.repeat([1.0, abs(machine.speed)], len(machine.free))
    model = compare.Model(machine)

    def solve():
        return np.linalg.eigvals(model.periodic(start, scale)[1])

    compare.STEPS = 125
    while compare.STEPS <= MOST_STEPS:
        try:
            missed = off(solve(), reference)
        except SystemExit:
            missed = math.inf
        if missed <= ERROR:
            return compare.STEPS, missed, shortest(EXUDYN_RUNS, solve)[0]
        compare.STEPS *= 2
    return None


def seconds(value):
    """Three digits and a unit."""
    return f"{value:.3g} s" if value >= 1 else f"{1e3 * value:.3g} ms"


def row(program, name, speed):
    file = str(ROOT / "data" / f"{name}.nml")
    machine = compare.Machine(Path(file).read_text())
    machine.speed = speed * math.pi / 30
    with tempfile.TemporaryDirectory() as folder:
        reference = compare.gestell(program, file, speed, folder, "-s", "accuracy.tolerance=1e-13")[0]
        rho = compare.gestell(program, file, speed, folder, "-s", "accuracy.tolerance=1e-9")[0]
        start = compare.gestell(program, file, speed, folder, "-s", "model.frame=rest")[1]
    rest, first_order, exact = inside(program, file, speed)
    found = multibody(machine, start[machine.free + [3 + k for k in machine.free]], reference)
    program_time = whole(program, file, speed)
    cells = [f"{name} at {speed:g} rpm", seconds(rest), f"{first_order / rest:.2f}", f"{exact / rest:.2f}", seconds(exact),
             f"{off(rho, reference):.0e}", seconds(program_time)]
    if found:
        steps, missed, spent = found
        cells += [f"{steps}, {2 * steps}", f"{missed:.0e}", seconds(spent), f"{spent / exact:.3g}", f"{spent / program_time:.3g}"]
    else:
        cells += [f"{MOST_STEPS} do not do", "", "", "", ""]
    return "| " + " | ".join(cells) + " |"


def main():
    program, *machines = sys.argv[1:]
    print(f"""## Beside a general program of multibody dynamics

`bench/multibody.py`, in one run: vibration (360 rows with their errors) and multipliers by the models of the frame, ordered to 1e-9,
beside Exudyn {compare.exu.__version__}, which integrates the map of one turn by the trapezoidal rule with so many steps, and with twice
as many, extrapolated, that central differences give all multipliers to {ERROR:.0e}, and Newton's method the fixed point, from the
vibration about rest. Errors are those of the multipliers against the exact frame's to 1e-13. Shortest of {RUNS} runs (each the median of
5 solutions), of Exudyn's solution alone of {EXUDYN_RUNS}. The last columns divide Exudyn's time by that of the exact frame inside the
program, and by that of the whole program with its start and its files.

| machine | rest | first order over rest | exact over rest | exact | error | whole program | Exudyn's steps | error | Exudyn | over exact | over the program |
|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|""")
    for machine in machines or MACHINES:
        name, speed = machine.split(":")
        print(row(program, name, float(speed)), flush=True)


if __name__ == "__main__":
    main()
