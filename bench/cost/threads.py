#!/usr/bin/env python3
"""Time that two threads take to solve machines, divided by the time of one: python3 bench/cost/threads.py [MACHINES]

Needs the Python package (doc/python.md) and two idle cores. Every machine is the four-bar at a crank speed of its own, read, set and
solved by its thread. Runs with one and with two threads alternate; the smallest ratio of neighbouring runs is reported, which other
work on the computer disturbs least. The results of both must be equal to the last bit. Markdown on standard output.
"""
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import gestell

FILE = Path(__file__).resolve().parents[2] / "data/khang_four_bar.nml"
REPETITIONS = 5


def solve(speeds, tasks):
    machine = gestell.Machine(FILE)
    results = []
    for speed in speeds:
        machine["drive.speed_rpm"] = speed
        results.append(machine.solve(tasks).multipliers.tobytes())
    return results


def run(threads, count, tasks):
    """Wall time and results of all machines, divided among threads."""
    speeds = [200 + 100 * k / count for k in range(count)]
    parts = [speeds[k * count // threads:(k + 1) * count // threads] for k in range(threads)]
    start = time.perf_counter()
    with ThreadPoolExecutor(threads) as pool:
        results = sum(pool.map(lambda part: solve(part, tasks), parts), [])
    return time.perf_counter() - start, results


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 2000
    print("| tasks | ms per machine, one thread | two threads / one |\n|---|---|---|")
    for tasks in ("stability", "stability, response, forces"):
        ratios, least = [], float("inf")
        for _ in range(REPETITIONS):
            (one, expected), (two, found) = run(1, count, tasks), run(2, count, tasks)
            if expected != found:
                sys.exit("two threads compute other multipliers than one")
            ratios.append(two / one)
            least = min(least, one)
        print(f"| {tasks} | {1e3 * least / count:.2f} | {min(ratios):.2f} |", flush=True)


if __name__ == "__main__":
    main()
