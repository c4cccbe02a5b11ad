#!/usr/bin/env python3
"""Processor time of a change on the live page: python3 bench/cost/live.py [FILE ...]

Needs the Python package (doc/python.md). For each machine the crank speed is changed by 1 % again and again; the shortest time of all
changes is reported, which other work on the computer disturbs least. It comprises everything but the browser. Markdown on standard
output.
"""
import json
import sys
import time
from pathlib import Path

from gestell._live_solver import solve

ROOT = Path(__file__).resolve().parents[2]
CHANGES = 10


def main():
    files = [Path(file) for file in sys.argv[1:]] or sorted((ROOT / "data").glob("*.nml"))
    print("| machine | ms per change | kB |\n|---|---|---|")
    for file in files:
        text = file.read_text(encoding="utf-8")
        state = solve(text, [])
        speed = next(one["values"][0] for one in state["parameters"] if one["path"] == "drive.speed_rpm")
        least, size = float("inf"), 0
        for n in range(CHANGES):
            start = time.process_time()
            size = len(json.dumps(solve(text, [["drive.speed_rpm", repr(speed * (1 + 0.01 * (n % 2)))]])))
            least = min(least, time.process_time() - start)
        print(f"| {file.stem} | {1e3 * least:.0f} | {size / 1000:.0f} |", flush=True)


if __name__ == "__main__":
    main()
