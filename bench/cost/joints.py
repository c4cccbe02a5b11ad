#!/usr/bin/env python3
"""Time of the task `joints` relative to the task `forces`: python3 bench/cost/joints.py PROGRAM [RUNS]

Runs the whole program with either task in turn, and compares the shortest times of both, which other work on the computer disturbs
least. Markdown on standard output.
"""
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MACHINES = ("data/khang_four_bar.nml", "data/compressor.nml", "data/press.nml", "data/engine_four_stroke.nml",
            "validation/space/v_twin.nml")


def main():
    program, runs = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 40
    print("| machine | `forces` ms | `joints` ms | ratio |\n|---|---|---|---|")
    for machine in MACHINES:
        least = {"forces": float("inf"), "joints": float("inf")}
        with tempfile.TemporaryDirectory() as folder:
            for task in [*least] * runs:
                begin = time.perf_counter()
                subprocess.run([program, "-q", "-o", folder, "-s", f"case.tasks={task}", ROOT / machine], check=True)
                least[task] = min(least[task], time.perf_counter() - begin)
        forces, joints = (1000 * seconds for seconds in least.values())
        print(f"| {Path(machine).stem} | {forces:.1f} | {joints:.1f} | {joints / forces:.2f} |", flush=True)


if __name__ == "__main__":
    main()
