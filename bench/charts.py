#!/usr/bin/env python3
"""Measures the time of stability charts, and of other programs for the same points; called by run.sh.

usage: charts.py BUILD [--python PYTHON] [--rounds N] [--points N] [--ours-only]

BUILD contains the programs that run.sh has built. At random points of the chart the other programs compute Phi(T), each with
its fastest setting whose rho_max is accurate enough at all of them, compared with the reference. Programs take turns. Markdown
on standard output.
"""
import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import textwrap
from pathlib import Path

from compare import BENCH, BISECTIONS, SLOW, STEPS, TOLERANCE, between, programs_in

DATA = "data/khang_chart.nml"
STIFFNESS = 196133.0            # of the paper's supports
ACCURACY = 1e-8                 # of rho_max
CHECKED = 10000                 # points at which the sweep is compared with solutions of their own
HANDFUL = 5                     # points for peers in interpreted Python, and for the check of the reference
SECONDS = 0.004                 # that a peer repeats a point in a round
EASY = ["sweep(1).from=200", "sweep(1).to=300", f"sweep(2).from={0.8 * STIFFNESS}", f"sweep(2).to={1.2 * STIFFNESS}"]
CHARTS = {"hard": [], "easy": EASY}
BOUNDS = "sweep.columns='rho_max','rho_error','verdict'"
PEAKS = "sweep.columns='rho_max','xi_peak_m','eta_peak_m','psi_peak_rad'"
# chart, label, settings, points compared
ROWS = [("hard", "rho_max", [], CHECKED), ("hard", "with rho_error and verdict", [BOUNDS], CHECKED),
        ("hard", "with peaks", [PEAKS], 1000),
        ("hard", "rho_max, engine 'direct'", ["sweep.engine='direct'", "sweep.count=32"], 1000),
        ("easy", "rho_max", [], CHECKED), ("easy", "with rho_error and verdict", [BOUNDS], CHECKED),
        ("easy", "with peaks", [PEAKS], 1000),
        ("easy", "rho_max, engine 'direct'", ["sweep.engine='direct'", "sweep.count=32"], 1000)]
NUMPY = """
import json, sys, time
import numpy as np
matrices, shortest = np.array(json.load(sys.stdin)), 1.0
for _ in range(5):
    begin = time.process_time()
    for matrix in matrices:
        abs(np.linalg.eigvals(matrix)).max()
    shortest = min(shortest, (time.process_time() - begin) / len(matrices))
print(shortest)
"""


class Point:
    """A point of the chart as an order for the peers (Program.order). x_p, which they integrate too, gets a unit so large that
    it does not matter for their steps."""

    size = 1e30

    def __init__(self, line):
        self.rpm, stiffness, self.rho_max, *self.scale = map(float, line.split())
        self.factor = stiffness / STIFFNESS
        self.name = f"khang_four_bar*{self.factor!r}"

    def setting(self, kind, setting):
        """Steps in proportion to the phase that vibrations run through in a period: so many where it is that of the paper's
        machine at 240 rpm."""
        return setting if kind == TOLERANCE else max(1, round(setting * self.factor ** 0.5 * 240 / self.rpm))


class Trial:
    """Method and setting of a program at some points."""

    def __init__(self, program, method, setting, points, chart, seconds=0.0):
        self.program, self.method, self.setting, self.points = program, method, setting, points
        self.kind = program.methods[method]
        self.answers, self.error = [], float("inf")
        for point in points:
            answer = self.ask(point, seconds)
            if answer is None or not all(abs(value) < 1e100 for value in answer.values[:36]):
                return
            self.answers.append(answer)
        _, radii = chart.radii([answer.values[:36] for answer in self.answers])
        self.error = max(abs(radius - point.rho_max) for radius, point in zip(radii, points))

    def ask(self, point, seconds):
        return self.program.ask(point, self.method, point.setting(self.kind, self.setting), seconds)

    @property
    def evaluations(self):
        return statistics.mean(answer.evaluations for answer in self.answers)

    @property
    def time(self):
        return sum(answer.shortest for answer in self.answers)


class Chart:
    """The program bench/chart."""

    def __init__(self, build):
        self.program = str(build / "chart" / "bin" / "chart")

    def run(self, *words, matrices=""):
        return subprocess.run([self.program, *map(str, words)], input=matrices, capture_output=True, text=True, check=True).stdout

    def solve(self, settings, checked):
        return [float(word) for word in self.run("solve", DATA, checked, *settings).split(",")]

    def sample(self, settings, count):
        return [Point(line) for line in self.run("sample", DATA, count, 1e-13, *settings).splitlines()]

    def radii(self, matrices):
        """Seconds of dgeev for one, and the radii."""
        lines = "\n".join(" ".join(map(repr, matrix)) for matrix in matrices) + "\n"
        seconds, *radii = map(float, self.run("radii", matrices=lines).split())
        return seconds, radii

    def libraries(self):
        lines = subprocess.run(["ldd", self.program], capture_output=True, text=True, check=True).stdout.splitlines()
        found = [Path(os.path.realpath(line.split()[2])) for line in lines if "blas" in line or "lapack" in line]
        return ", ".join(f"`{path.parent.name}/{path.name}`" for path in found) or "linked into the program"


def paragraph(text):
    print(textwrap.fill(" ".join(text.split()), 120, break_long_words=False, break_on_hyphens=False), end="\n\n", flush=True)


def say(text):
    print(f"charts: {text}", file=sys.stderr, flush=True)


def cheapest(program, points, chart):
    """The fastest trial, of all methods, among those that are accurate enough; None if there is none."""
    found = []
    for method, kind in program.methods.items():
        ladder = [10.0 ** -k for k in range(3, 15)] if kind == TOLERANCE else [8 * 2 ** k for k in range(9)]
        trials = []
        for setting in ladder:
            trials.append(Trial(program, method, setting, points, chart))
            if trials[-1].error <= ACCURACY or trials[-1].time > SLOW * len(points):
                break
        if trials[-1].error > ACCURACY:
            continue
        good = trials[-1]
        if len(trials) > 1:
            coarse = trials[-2].setting
            for _ in range(BISECTIONS):
                middle = between(kind, coarse, good.setting)
                if middle in (coarse, good.setting):
                    break
                trial = Trial(program, method, middle, points, chart)
                if trial.error <= ACCURACY:
                    good = trial
                else:
                    coarse = middle
        found.append(good)
    return min(found, key=lambda trial: trial.time, default=None)


def chosen_trials(programs, points, chart):
    """One trial for each program. An interpreted program takes the setting of the same integrator in its compiled form."""
    trials = []
    for program in programs:
        say(f"looking for the setting of {program.name}")
        compiled = next((t for t in trials if t.program.name == "SciPy with numba"), None)
        if program.name not in ("SciPy, scalar Python", "SciPy, plain numpy"):
            trials.append(cheapest(program, points, chart))
        elif compiled:
            trials.append(Trial(program, compiled.method, compiled.setting, points[:HANDFUL], chart))
        else:
            trials.append(cheapest(program, points[:HANDFUL], chart))
        if trials[-1] is None:
            trials.pop()
            say(f"{program.name}: no setting is near enough")
    return trials


def race(chart, settings, trials, rounds):
    """Seconds per point, median and shortest: of the chart, and of every trial."""
    ours, medians, shortest = [], [[[] for _ in t.points] for t in trials], [[a.shortest for a in t.answers] for t in trials]
    for number in range(rounds):
        say(f"round {number + 1} of {rounds}")
        points, seconds, *_ = chart.solve(settings, 0)
        ours.append(seconds / points)
        for k, trial in enumerate(trials):
            for i, point in enumerate(trial.points):
                answer = trial.ask(point, SECONDS)
                if answer:
                    medians[k][i].append(answer.median)
                    shortest[k][i] = min(shortest[k][i], answer.shortest)
    theirs = [(statistics.mean(statistics.median(m) for m in medians[k]), statistics.mean(shortest[k])) for k in range(len(trials))]
    return (statistics.median(ours), min(ours)), theirs


def numpy_seconds(python, matrices):
    squares = [[matrix[6 * i:6 * i + 6] for i in range(6)] for matrix in matrices]
    answer = subprocess.run([python, "-c", NUMPY], input=json.dumps(squares), capture_output=True, text=True, check=False)
    return float(answer.stdout) if answer.returncode == 0 else 0.0


def beside_peers(name, programs, chart, python, count, rounds):
    points = chart.sample(CHARTS[name], count)
    trials = chosen_trials(programs, points, chart)
    (median, best), theirs = race(chart, CHARTS[name], trials, rounds)
    matrices = [answer.values[:36] for answer in trials[0].answers] if trials else []
    lapack = chart.radii(matrices)[0] if matrices else 0.0
    numpy = numpy_seconds(python, matrices) if matrices else 0.0
    print(f"| {name} chart | setting | evaluations a point | points | rho_max off by | points/s | at best | Gestell over it |",
          "|---|---|--:|--:|--:|--:|--:|--:|", sep="\n")
    print(f"| Gestell | tolerance 1e-9 | | all | | {1 / median:.0f} | {1 / best:.0f} | 1 |")
    for trial, (usual, short) in zip(trials, theirs):
        roots = numpy if trial.program.command[0] == python else lapack
        setting = f"{trial.setting:.2g}" if trial.kind == TOLERANCE else f"{trial.setting} steps"
        print(f"| {trial.program.name} | {trial.method.replace('-steps', '')}, {setting} | {trial.evaluations:.0f} | "
              f"{len(trial.points)} | {trial.error:.1e} | {1 / (usual + roots):.4g} | {1 / (short + roots):.4g} | "
              f"{(short + roots) / best:.3g} |", flush=True)
    if not trials:
        print(flush=True)
        return
    checks = []
    for trial in (t for t in trials if len(t.points) > HANDFUL):
        method = next(m for m, kind in trial.program.methods.items() if kind == TOLERANCE)
        sharp = Trial(trial.program, method, 1e-13, points[:HANDFUL], chart)
        checks.append(f"{trial.program.name} {method} {sharp.error:.1e}")
    print()
    paragraph(f"""Of the peers' times {1e6 * lapack:.2g} us are dgeev's for the eigenvalues of Phi(T), with Python
        {1e6 * numpy:.2g} us those of numpy.linalg.eigvals. The reference differs from the peers' own rho_max to a tolerance of
        1e-13, at {HANDFUL} of the points, by no more than: {', '.join(checks)}.""")


def own_rows(chart, rounds):
    times, facts = [[] for _ in ROWS], []
    for name, label, settings, checked in ROWS:
        say(f"{name} chart, {label}: {checked} points compared")
        facts.append(chart.solve(CHARTS[name] + settings, checked))
    for number in range(rounds):
        say(f"round {number + 1} of {rounds}")
        for k, (name, _, settings, _) in enumerate(ROWS):
            times[k].append(chart.solve(CHARTS[name] + settings, 0)[1])
    print("| chart, columns | points | points/s | at best | solutions | comparisons | deviation of Phi | rho_max off by | "
          "at points | memory, MB |", "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|", sep="\n")
    for (name, label, _, checked), seconds, (points, _, solutions, checks, deviation, off, memory) in zip(ROWS, times, facts):
        print(f"| {name}, {label} | {points:.0f} | {points / statistics.median(seconds):.0f} | {points / min(seconds):.0f} | "
              f"{solutions:.0f} | {checks:.0f} | {deviation:.1e} | {off:.1e} | {checked} | {memory:.0f} |")
    print(flush=True)


def whole_program(build, rounds):
    """Reading, computing and writing."""
    program, folder = str(build / "gestell" / "bin" / "gestell"), build / "chart-written"
    orders = [(name, label, CHARTS[name] + settings) for name, label, settings, _ in ROWS if "sweep.count" not in str(settings)]
    walls, seconds, sizes = ([[] for _ in orders] for _ in range(3))
    for number in range(rounds):
        say(f"whole program, round {number + 1} of {rounds}")
        for k, (_, _, settings) in enumerate(orders):
            shutil.rmtree(folder, ignore_errors=True)
            words = [word for setting in settings for word in ("--set", setting)]
            before = os.times()
            subprocess.run([program, DATA, "--quiet", "--output", str(folder), *words], check=True)
            after = os.times()
            walls[k].append(after.elapsed - before.elapsed)
            seconds[k].append(after.children_user + after.children_system - before.children_user - before.children_system)
            sizes[k].append((folder / "sweep.csv").stat().st_size)
    shutil.rmtree(folder, ignore_errors=True)
    print("| whole program with writing | processor time, s | at best | wall time, s | at best | "
          "points/s of processor time, at best | sweep.csv, MB |", "|---|--:|--:|--:|--:|--:|--:|", sep="\n")
    for (name, label, _), wall, second, size in zip(orders, walls, seconds, sizes):
        print(f"| {name}, {label} | {statistics.median(second):.2f} | {min(second):.2f} | {statistics.median(wall):.2f} | "
              f"{min(wall):.2f} | {1e6 / min(second):.0f} | {size[0] / 1e6:.0f} |")
    print(flush=True)


def by_models(build, rounds):
    """A chart of 100 x 100 machines by each of the frame's models, in turn."""
    program, folder = str(build / "gestell" / "bin" / "gestell"), build / "chart-written"
    models = ("rest", "first_order", "exact")
    seconds = {model: [] for model in models}
    for number in range(rounds):
        say(f"models, round {number + 1} of {rounds}")
        for model in models:
            shutil.rmtree(folder, ignore_errors=True)
            before = os.times()
            subprocess.run([program, DATA, "--quiet", "--output", str(folder), "--set", "sweep.count=100",
                            "--set", f"model.frame='{model}'"], check=True)
            after = os.times()
            seconds[model].append(after.children_user - before.children_user)
    shutil.rmtree(folder, ignore_errors=True)
    print("| 100 x 100 machines of the hard chart | processor time, s | at best | over rest | at best |", "|---|--:|--:|--:|--:|",
          sep="\n")
    middle, best = ({model: pick(seconds[model]) for model in models} for pick in (statistics.median, min))
    for model in models:
        print(f"| `{model}` | {middle[model]:.2f} | {best[model]:.2f} | {middle[model] / middle['rest']:.1f} | "
              f"{best[model] / best['rest']:.1f} |")
    print(flush=True)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build", type=Path)
    parser.add_argument("--python", default=sys.executable)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--points", type=int, default=100)
    parser.add_argument("--ours-only", action="store_true")
    order = parser.parse_args()
    os.chdir(BENCH.parent)
    chart = Chart(order.build)
    print("## Charts\n")
    paragraph(f"""`{DATA}`: rho_max of the paper's machine at 100 to 500 rpm times a quarter to twice the stiffness of its
        supports, 1000 x 1000 points, tolerance 1e-9 (hard); the same at 200 to 300 rpm times 0.8 to 1.2 of the stiffness (easy).
        One thread, everything held in memory, seconds of processor time, in turn in {order.rounds} rounds: medians, and the best.
        Solutions: integrations over the period on which a chart rests. Comparisons and the deviation of Phi, relative, are
        those the sweep makes itself; besides, rho_max was compared with solutions of their own to 1e-12 at points of the chart
        drawn at random, which is not timed. BLAS and LAPACK: {chart.libraries()}.""")
    own_rows(chart, order.rounds)
    whole_program(order.build, order.rounds)
    by_models(order.build, order.rounds)
    if order.ours_only:
        return
    paragraph(f"""The peers integrate Phi(T) at {order.points} points of the chart drawn at random, the same for all, in interpreted
        Python at the first {HANDFUL} of them; each with the cheapest method and setting whose rho_max is within {ACCURACY:.0e} of
        the reference at all of these points: solutions of their own to 1e-13. Equal steps are in proportion to the phase that
        vibrations run through in a period; their number is that for the paper's machine at 240 rpm. The right-hand sides carry
        x_p along, a seventh of the numbers, in a unit in which it has no influence on the steps. Gestell gets the tolerance of
        the file and does what it always does, its own comparisons included. Times of the peers are of the wall, of every
        point the median and the shortest of many runs; the last column compares the best ones.""".replace("e-0", "e-"))
    programs = [program for program in programs_in(order.build, order.python, False, False) if not program.name.startswith("Gestell")]
    for name in CHARTS:
        beside_peers(name, programs, chart, order.python, order.points, order.rounds)
    for program in programs:
        if program.process:
            program.process.stdin.close()
            program.process.wait()


if __name__ == "__main__":
    main()
