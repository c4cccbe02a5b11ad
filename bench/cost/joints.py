#!/usr/bin/env python3
"""Time of the task `joints` relative to the task `forces`: python3 bench/cost/joints.py PROGRAM [RUNS]

Runs the whole program with either task in turn, and compares the shortest processor times of both, which other work on the
computer disturbs least. Markdown on standard output.
"""
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MACHINES = ("data/khang_four_bar.nml", "data/compressor.nml", "data/press.nml", "data/engine_four_stroke.nml",
            "validation/space/v_twin.nml")


def spent():
    """Processor time of all programs that have ended (s)."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main():
    program, runs = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 40
    print("| machine | `forces` ms | `joints` ms | ratio |\n|---|---|---|---|")
    for machine in MACHINES:
        least = {"forces": float("inf"), "joints": float("inf")}
        with tempfile.TemporaryDirectory() as folder:
            for task in [*least] * runs:
                begin = spent()
                subprocess.run([program, "-q", "-o", folder, "-s", f"case.tasks={task}", ROOT / machine], check=True)
                least[task] = min(least[task], spent() - begin)
        forces, joints = (1000 * seconds for seconds in least.values())
        print(f"| {Path(machine).stem} | {forces:.1f} | {joints:.1f} | {joints / forces:.2f} |", flush=True)


if __name__ == "__main__":
    main()
