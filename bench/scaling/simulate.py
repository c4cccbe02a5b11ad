"""Simulates a sweep by many ranks from the costs of its parts on one computer: python3 bench/scaling/simulate.py

Reads the costs-*.csv beside it and prints the tables that doc/scaling.md quotes. The same costs give the same tables.

A rank requests its next tile, computes the one it has, writes its rows, receives the answer. The costs of tiles,
rows and queue are measured; the tiles of a chart are drawn at random among the measured ones. Only the file system
that many computers share and the start of many ranks are ASSUMED.
"""

import csv
import heapq
import random
import statistics
from collections import deque
from pathlib import Path

HERE = Path(__file__).resolve().parent
POINTS, TILE = 10**10, 62500
# GB/s of file systems: a disk, a small cluster's, a large one's.
RATES = (1, 10, 100)
TILES = POINTS // TILE
# Assumed: a file system over a network. Seconds that it takes longer with the rows of a tile and its mark, as one rank sees them;
# tiles whose rows all ranks together can write in a second.
SHARED_ROWS, SHARED_WRITES = 10e-3, 20000.0


class Costs:
    def __init__(self, name):
        with open(HERE / f"costs-{name}.csv", newline="") as file:
            self.rows = list(csv.DictReader(file))

    def seconds(self, what, key="seconds"):
        return [float(row[key]) for row in self.rows if row["what"] == what]

    def mean(self, what, key="seconds"):
        found = self.seconds(what, key)
        return sum(found) / len(found)


def simulate(ranks, tiles, block, roundtrip, called=False, ahead=True, start=0.0, creations=None, seed=6):
    """Seconds until the last row is written, and the shares of the ranks' time: work, blocks, waiting for numbers, waiting
    for the last one, start.

    tiles: seconds of each. called: the queue moves only when rank 0 calls MPI, between its tiles. ahead: a rank asks before
    it works. creations: blocks per second that the file system takes."""
    taken, files_free = 0, 0.0
    waiting = deque()                   # requests that rank 0 has not received: (rank, time)
    number = [None] * ranks             # answers that have arrived: (tile, time of arrival)
    free = [start] * ranks              # when a rank has nothing more to do but take its answer
    asleep = [False] * ranks            # ranks that wait for an answer
    rank_0_ends = False
    work = [0.0, 0.0, 0.0]
    events = []                         # (time, order, kind, rank)
    order = 0

    def push(time, kind, rank):
        nonlocal order
        order += 1
        heapq.heappush(events, (time, order, kind, rank))

    def give(rank, time):
        nonlocal taken
        number[rank] = (taken if taken < len(tiles) else None, time + (roundtrip if rank else 0.0))
        taken += 1
        if asleep[rank]:
            asleep[rank] = False
            push(max(number[rank][1], time), "take", rank)

    def ask(rank, time):
        if called and rank and not rank_0_ends:
            waiting.append(rank)
        else:
            give(rank, time)

    def serve(time):
        while waiting:
            give(waiting.popleft(), time)

    for rank in range(ranks):
        push(start, "ask", rank)
    end = start
    while events:
        time, _, kind, rank = heapq.heappop(events)
        if rank == 0:
            serve(time)
        if kind == "ask":
            ask(rank, time)
            kind = "take"
        if kind == "take":
            if number[rank] is None:
                asleep[rank] = True
                continue
            tile, arrival = number[rank]
            if arrival > time:
                push(arrival, "take", rank)
                continue
            number[rank] = None
            work[2] += time - free[rank]
            free[rank] = time
            if tile is None:
                if rank == 0:
                    rank_0_ends = True
                    serve(time)
                continue
            if ahead:
                ask(rank, time)
            push(time + tiles[tile], "write", rank)
            work[0] += tiles[tile]
        elif kind == "write":
            begin = time
            if creations:
                begin = max(time, files_free)
                files_free = begin + 1 / creations
            done = begin + block
            work[1] += done - time
            free[rank] = done
            end = max(end, done)
            push(done, "take" if ahead else "ask", rank)
    total = end * ranks
    last = max(0.0, total - sum(work) - start * ranks)
    return end, [part / total for part in [*work, last, start * ranks]]


def drawn(costs, n, seed):
    draw = random.Random(seed)
    return [draw.choice(costs) for _ in range(n)]


def row(*cells):
    print("| " + " | ".join(map(str, cells)) + " |")


def percent(x):
    return f"{100 * x:.1f} %"


def duration(seconds):
    if seconds < 100:
        return f"{seconds:.1f} s"
    return f"{seconds:.0f} s" if seconds < 1000 else f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


def read_runs():
    """Seconds by the clock and of all cores together of every run, by kind and number of ranks or threads."""
    found = {}
    with open(HERE / "runs.csv", newline="") as file:
        for line in csv.DictReader(file):
            found.setdefault((line["what"], line["number"]), []).append(
                (float(line["seconds"]), float(line["user"]) + float(line["system"])))
    return found


def least(what, number):
    return min(times[0] for times in read_runs()[what, str(number)])


def runs():
    """Shortest times of the runs, and medians of the times of two threads or ranks relative to half of their pair in the round."""
    found = read_runs()
    pairs = found["pair", "2"]
    row("runs of the chart of 10^6 points", "seconds", "of all cores together", "efficiency against two programs at once")
    row(*["---"] * 4)
    for (what, number), times in sorted(found.items()):
        against = ""
        if what in ("ranks", "threads") and number == "2":
            parts = sorted(pair[0] / 2 / own[0] for pair, own in zip(pairs, times))
            against = f"{statistics.median(parts):.2f} ({parts[0]:.2f} to {parts[-1]:.2f})"
        row(f"{what} {number}", f"{min(t[0] for t in times):.2f}", f"{min(t[1] for t in times):.2f}", against)


def main():
    chart, easy, huge, columns, npy, memory, network = map(Costs, "chart easy huge columns npy memory network".split())

    print("Measured, one core (mean of the tiles of 62500 points):\n")
    row("sweep", "a tile", "from", "to", "points per second", "making members", "its rows", "plain write", "the end")
    row(*["---"] * 9)
    for name, costs in (("the chart, 10^6 points", chart), ("an easy part of it, 10^6", easy),
                        ("the chart, all columns, 10^6", columns), ("the chart, .npy, 10^6", npy), ("the chart, 10^10", huge)):
        tile = costs.seconds("tile")
        finish = costs.seconds("finish")
        row(name, f"{1e3 * costs.mean('tile'):.0f} ms", f"{1e3 * min(tile):.0f}", f"{1e3 * max(tile):.0f}",
            f"{TILE / costs.mean('tile'):.2g}".replace("e+0", "e"), percent(sum(costs.seconds("tile", "inside")) / sum(tile)),
            f"{1e3 * costs.mean('rows'):.1f} ms", f"{1e3 * costs.mean('plain'):.1f} ms",
            f"{1e3 * finish[0]:.1f} ms" if finish else "")

    print()
    runs()
    for ranks in (1, 2):
        end, _ = simulate(ranks, chart.seconds("tile"), chart.mean("rows"), memory.mean("counter_idle"), start=chart.mean("start"))
        mpi = least("start", ranks)
        print(f"\nSimulated, this chart: {ranks} ranks {mpi + end + chart.seconds('finish')[0]:.2f} s, of which start of MPI "
              f"{mpi:.2f} s, table {chart.seconds('finish')[0]:.2f} s; measured {least('ranks', ranks):.2f} s")
    print("\nMeasured, the queue, two ranks:\n")
    row("transport", "rank 0 waits", "rank 0 computes", "and asked ahead")
    row(*["---"] * 4)
    for name, costs in (("shared memory", memory), ("TCP, by the processes", network)):
        row(name, *(f"{1e6 * costs.mean('counter_' + what):.1f} us" for what in ("idle", "busy", "ahead")))

    print(f"\nSimulated, {TILES} tiles, until the last row is written:\n")
    row("ranks", "time", "efficiency", "rows", "queue", "last tiles", "start")
    row(*["---"] * 7)
    tiles, block, start = drawn(huge.seconds("tile"), TILES, 6), huge.mean("rows"), huge.mean("start")
    slow = network.mean("counter_idle")
    alone = sum(tiles) + TILES * block + start
    usual = dict(block=block, roundtrip=slow, called=True, start=start)
    for ranks in (1, 10, 100, 1000, 10000):
        end, shares = simulate(ranks, tiles, **usual)
        row(ranks, duration(end), percent(alone / (ranks * end)), *map(percent, shares[1:]))

    print("\nSimulated, 1000 ranks, what changes it:\n")
    row("", "time", "efficiency", "rows", "queue", "last tiles", "start")
    row(*["---"] * 7)
    uneven = [t * sum(tiles) / (len(tiles) * chart.mean("tile")) for t in drawn(chart.seconds("tile"), TILES, 6)]
    for name, costs, change in (
            ("as above", tiles, {}),
            ("network that reaches into memory", tiles, dict(called=False, roundtrip=5e-6)),
            ("not asked ahead", tiles, dict(ahead=False)),
            ("tiles as uneven as those of the small chart", uneven, {}),
            ("shared file system, assumed", tiles, dict(block=block + SHARED_ROWS, creations=SHARED_WRITES)),
            ("the same, tiles in ten times the time", [10 * t for t in tiles],
             dict(block=block + SHARED_ROWS, creations=SHARED_WRITES)),
            ("a tenth of the tiles", tiles[:TILES // 10], {})):
        end, shares = simulate(1000, costs, **{**usual, **change})
        work = sum(costs) + len(costs) * block + start
        row(name, duration(end), percent(work / (1000 * end)), *map(percent, shares[1:]))

    print("\nThe bytes of 10^10 points, and the time of a file system that takes so many a second from all ranks together:\n")
    row("table", "bytes a point", "all", *(f"{rate} GB/s" for rate in RATES))
    row(*["---"] * (3 + len(RATES)))
    for name, costs in (("rho_max, .csv", chart), ("rho_max, .npy", npy), ("all columns, .csv", columns)):
        width = costs.seconds("rows", "bytes")[0] / TILE
        row(name, f"{width:.0f}", f"{width * POINTS / 1e12:.2f} TB", *(duration(width * POINTS / rate / 1e9) for rate in RATES))


if __name__ == "__main__":
    main()
