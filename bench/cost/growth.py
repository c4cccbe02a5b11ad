#!/usr/bin/env python3
"""How the cost of one run grows with the size of the input, counted in instructions, which other work on the computer does not
disturb.

usage: growth.py PROGRAM [FAMILY ...]

Each family doubles one number of the paper's machine (data/khang_four_bar.nml, about rest) three times or more; valgrind counts
the instructions of the whole run, including its start and the writing of files. The exponent is that of the instructions added
by the last two doublings: 1 if twice the size costs twice as much. Markdown on standard output.
"""
import math
import re
import subprocess
import sys
import tempfile
from pathlib import Path

DATA = (Path(__file__).resolve().parents[2] / "data" / "khang_four_bar.nml").read_text(encoding="utf-8")


def supports(n):
    """n supports, together as stiff as the original four."""
    lines = "".join(f"&support position={-0.3 + 0.6 * k / (n - 1):.9f},-0.20, stiffness={4 * 196133 / n},{4 * 196133 / n} /\n"
                    for k in range(n))
    return re.sub(r"(&support.*\n)+", lines, DATA), []


def probes(n):
    return DATA + "".join(f"&probe name='p{k}', position={-0.3 + 0.6 * k / n:.9f},0.1 /\n" for k in range(n)), []


def joints(n):
    """n dyads behind the rocker, each forming a parallelogram with the one before."""
    text, last, x = DATA, "B", 0.40
    for k in range(n):
        text += (f"&joint name='G{k}', type='ground', position={x + 0.2 * (k + 1):.6f},0.0 /\n"
                 f"&joint name='P{k}', type='RRR', ends='{last}','G{k}', lengths=0.2,0.16, branch=1 /\n"
                 f"&link name='r{k}', from='G{k}', to='P{k}', mass=0.02, inertia=0.0001, center=0.08,0.0 /\n")
        last = f"P{k}"
    return text, []


def mechanisms(n):
    """n copies of the mechanism with staggered phases."""
    text = re.sub(r"(&joint name='A0')", r"&mechanism name='one' /\n\1", DATA, count=1)
    return text + "".join(f"&repeat of='one', name='m{k}', phase={360 * k / n:.6f} /\n" for k in range(1, n)), []


def setting(path, text=DATA):
    return lambda n: (text, ["--set", f"{path}={n}"])


def sweep(n):
    return DATA + f"&sweep parameter='drive.speed_rpm', from=230, to=240, count={n}, engine='direct', columns='rho_max' /\n", \
        ["--set", "case.tasks=sweep"]


def resonance(n):
    return DATA + f"&sweep parameter='drive.speed_rpm', from=230, to=240, count={n} /\n", ["--set", "case.tasks=resonance"]


FAMILIES = {
    "supports": (supports, [32, 64, 128, 256]),
    "probes": (probes, [16, 32, 64, 128]),
    "joints in one chain": (joints, [32, 64, 128, 256]),
    "mechanisms": (mechanisms, [4, 8, 16, 32]),
    "rows of the time history": (setting("response.points"), [1000, 2000, 4000, 8000]),
    "harmonics": (setting("response.harmonics"), [250, 500, 1000, 2000]),
    "points of a sweep, one by one": (sweep, [50, 100, 200, 400]),
    "points of a resonance curve": (resonance, [20, 40, 80, 160]),
}


def instructions(program, text, words):
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "case.nml").write_text(text, encoding="utf-8")
        done = subprocess.run(["valgrind", "--tool=callgrind", f"--callgrind-out-file={folder}/out", program, "-q", "-o", folder, *words,
                               f"{folder}/case.nml"], capture_output=True, text=True, check=False, env={"OMP_NUM_THREADS": "1"})
        found = re.search(r"Collected : (\d+)", done.stderr)
        if done.returncode != 0 or not found:
            sys.exit(done.stderr)
        return int(found[1])


def main():
    program, *wanted = sys.argv[1:]
    print("| twice as many | from | to | million instructions for one more | exponent |", "|---|--:|--:|--:|--:|", sep="\n")
    for name, (make, sizes) in FAMILIES.items():
        if wanted and name not in wanted:
            continue
        counts = [instructions(program, *make(n)) for n in sizes]
        added = [b - a for a, b in zip(counts, counts[1:])]
        exponent = math.log2(added[-1] / added[-2])
        print(f"| {name} | {sizes[0]} | {sizes[-1]} | {added[-1] / (sizes[-1] - sizes[-2]) / 1e6:.3g} | {exponent:.2f} |", flush=True)


if __name__ == "__main__":
    main()
