#!/usr/bin/env python3
"""Measures the time of the library and of other programs in turn on the same cases to the same true error; called by run.sh.

usage: compare.py BUILD [--python PYTHON] [--rounds N] [--cases NAME:RPM,...] [--states N] [--accuracies E,...]
                  [--ours-only] [--csv FILE]

BUILD contains the programs that run.sh has built; missing ones are skipped. Every program keeps running and takes requests, a
line each (bench/peers/serve.h). For each case and accuracy the fastest setting of every method is used whose true errors of
Phi(T) and x0, relative and in balanced units, are both small enough; then programs run one after the other, round after round.
Markdown on standard output.
"""
import argparse
import math
import re
import select
import statistics
import subprocess
import sys
from pathlib import Path

BENCH = Path(__file__).resolve().parent
LIMIT = 20.0          # seconds that one run may take
SLOW = 2.0            # slower runs are not bisected
BISECTIONS = 4
TOLERANCE, STEPS = "tolerance", "steps"


class Case:
    """A case of reference.dat."""

    def __init__(self, name, rpm, turns):
        self.name, self.rpm, self.turns = name, rpm, turns
        self.scale, self.phi, self.xp, self.x0, self.rho = [], [], [], [], []

    @property
    def label(self):
        return f"{self.name} at {self.rpm:g} rpm"

    @property
    def states(self):
        return len(self.scale)

    @property
    def size(self):
        """Unit of x_p."""
        return math.hypot(*(x / s for x, s in zip(self.xp, self.scale)))

    def errors(self, method, values):
        """True errors of Phi(T), or of the multipliers, and of x0."""
        n = self.states
        if n == 12 and method in (*GAUSS, *PLAIN, *WHOLE):
            values = reordered(method, values)
        if method in WHOLE:
            rho = [complex(a, b) for a, b in zip(values[:n], values[n:2 * n])]
            found = values[2 * n:]
            first = max(min(abs(r - s) for s in rho) / abs(r) for r in self.rho)
        else:
            d, error, size = self.scale, 0.0, 0.0
            for i in range(n):
                for j in range(n):
                    error += ((values[n * i + j] - self.phi[i][j]) * d[j] / d[i]) ** 2
                    size += (self.phi[i][j] * d[j] / d[i]) ** 2
            first, found = math.sqrt(error / size), values[n * n:]
        if method == "multipliers":
            return first, 0.0
        second = math.hypot(*((a - b) / s for a, b, s in zip(found, self.x0, self.scale)))
        return first, second / math.hypot(*(b / s for b, s in zip(self.x0, self.scale)))


def reordered(method, values):
    """In space the library has xi, eta, psi, zeta, rot_xi, rot_eta, the reference u and theta."""
    order = [k + half for half in (0, 6) for k in (0, 1, 3, 4, 5, 2)]
    if method in WHOLE:
        return values[:24] + [values[24 + k] for k in order]
    return [values[12 * i + j] for i in order for j in order] + [values[144 + k] for k in order]


def read_reference():
    cases = []
    for line in (BENCH / "reference.dat").read_text().splitlines():
        key, *words = line.split()
        if key == "case":
            cases.append(Case(words[0], float(words[1]), float(words[2])))
        elif key == "phi":
            cases[-1].phi.append([float(w) for w in words])
        elif key == "rho":
            cases[-1].rho.append(complex(*map(float, words)))
        elif key in ("scale", "xp", "x0"):
            setattr(cases[-1], key, [float(w) for w in words])
    return cases


class Answer:
    def __init__(self, line):
        words = line.split(",")
        self.shortest, self.median, self.runs, self.evaluations = *map(float, words[:2]), *map(int, words[2:4])
        self.values = [float(w) for w in words[4:]]


class Program:
    """A running program that answers requests; it is restarted after one that took too long."""

    def __init__(self, name, command, methods):
        self.name, self.command, self.methods, self.process = name, command, methods, None

    def ask(self, case, method, setting, seconds):
        if self.process is None:
            self.process = subprocess.Popen(self.command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)
            self.order(case, method, 1e-3 if self.methods[method] == TOLERANCE else 64, 0.0, 120)
        if self.process is None:
            return None
        return self.order(case, method, setting, seconds, LIMIT + seconds)

    def order(self, case, method, setting, seconds, limit):
        numbers = " ".join(repr(x) for x in (setting, seconds, case.size, *case.scale))
        try:
            self.process.stdin.write(f"{case.name} {case.rpm:.17g} {method} {numbers}\n")
            ready, _, _ = select.select([self.process.stdout], [], [], limit)
            line = self.process.stdout.readline() if ready else ""
        except BrokenPipeError:
            line = ""
        if not line:
            self.process.kill()
            self.process.wait()
            self.process = None
            return None
        return None if line.startswith("failed") else Answer(line)

    def peak_memory(self):
        """Peak of the resident memory in MB."""
        if self.process is None:
            return math.nan
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        return int(re.search(r"VmHWM:\s*(\d+)", status).group(1)) / 1024


# Of the library `auto` is the whole solution, `multipliers` the same without x0, `peaks` with all that task response says.
GAUSS = {f"gauss{s}": STEPS for s in range(2, 11)}
PLAIN = {f"gauss{s}-plain": STEPS for s in range(6, 11)}
WHOLE = ("auto", "multipliers", "peaks")


def programs_in(build, python, ours_only, in_space):
    speed = [str(build / "speed" / "bin" / "speed"), str(BENCH.parent / ("validation/space" if in_space else "data"))]
    found = [Program("Gestell", speed, GAUSS), Program("Gestell, all", speed, {"auto": TOLERANCE}),
             Program("Gestell, multipliers", speed, {"multipliers": TOLERANCE}),
             Program("Gestell, with peaks", speed, {"peaks": TOLERANCE}), Program("Gestell, plain", speed, PLAIN)]
    peers = [("GSL", "gsl", {"rk8pd": TOLERANCE, "rk8pd-steps": STEPS, "msadams": TOLERANCE}),
             ("Boost.odeint", "boost", {"rkf78": TOLERANCE, "rkf78-steps": STEPS, "bulirsch-stoer": TOLERANCE}),
             ("SUNDIALS", "sundials", {"erk8": TOLERANCE, "erk8-steps": STEPS, "adams": TOLERANCE})]
    if ours_only:
        return found
    for name, file, methods in peers:
        file += "_space" if in_space else ""
        if (build / file).exists():
            found.append(Program(name, [str(build / file)], methods))
    script = str(BENCH / "peers" / "scipy_peer.py")
    for name, kind, needs, methods in (
            ("numbalsoda", "numbalsoda", "numba, numbalsoda", {"dop853": TOLERANCE, "lsoda": TOLERANCE}),
            ("SciPy with numba", "numba", "scipy, numba", {"DOP853": TOLERANCE}),
            ("SciPy, scalar Python", "python", "scipy", {"DOP853": TOLERANCE}),
            ("SciPy, plain numpy", "plain", "scipy", {"DOP853": TOLERANCE})):
        if in_space:
            if kind not in ("numba", "plain"):
                continue
            kind = "space-numba" if kind == "numba" else "space"
        if subprocess.run([python, "-c", f"import {needs}"], capture_output=True).returncode == 0:
            found.append(Program(name, [python, script, kind], methods))
    return found


class Trial:
    def __init__(self, case, program, method, setting):
        self.program, self.method, self.setting = program, method, setting
        self.answer = program.ask(case, method, setting, 0.02)
        self.late = program.process is None
        self.errors = math.inf, math.inf
        if self.answer and all(abs(value) < 1e100 for value in self.answer.values):
            self.errors = case.errors(method, self.answer.values)
        self.error = max(self.errors)


def settings_of(kind, case, at_once):
    """From coarse to fine; of steps that are done so many `at_once`, fewer cost as much."""
    if kind == TOLERANCE:
        return [10.0 ** -k for k in range(3, 15)]
    return [max(2, at_once, int(case.turns / 16)) * 2 ** k for k in range(14)]


def between(kind, coarse, fine):
    middle = math.sqrt(coarse * fine)
    return middle if kind == TOLERANCE else round(middle)


def explore(case, program, method, accuracies):
    """Trials of a method, enough to find its cheapest setting for each accuracy. A whole solution is requested with the accuracy as
    tolerance, or with a smaller one if that is not accurate enough."""
    kind = program.methods[method]
    trials, worse = [], 0
    for setting in settings_of(kind, case, 8 if method in (*GAUSS, *PLAIN) else 1):
        trials.append(Trial(case, program, method, setting))
        if trials[-1].late:
            break
        if method in WHOLE:
            continue
        worse = worse + 1 if len(trials) > 1 and trials[-1].error >= trials[-2].error < 1 else 0
        if trials[-1].error <= min(accuracies) or worse == 3:
            break
    if method in WHOLE:
        return trials
    ladder = list(trials)
    for accuracy in accuracies:
        place = next((i for i, trial in enumerate(ladder) if trial.error <= accuracy), None)
        if not place or ladder[place].answer.median > SLOW:
            continue
        coarse, fine = ladder[place - 1].setting, ladder[place].setting
        for _ in range(BISECTIONS):
            middle = between(kind, coarse, fine)
            if middle in (coarse, fine):
                break
            trials.append(Trial(case, program, method, middle))
            if trials[-1].error <= accuracy:
                fine = middle
            else:
                coarse = middle
    return trials


def race(case, chosen, rounds):
    """Median over the rounds of each program's median within a round, and its shortest time, both in seconds."""
    medians = [[] for _ in chosen]
    shortest = [trial.answer.shortest for trial in chosen]
    for number in range(rounds):
        for i, trial in enumerate(chosen):
            if number > 0 and number * trial.answer.median > LIMIT:
                continue
            answer = trial.program.ask(case, trial.method, trial.setting, 0.1)
            if answer:
                medians[i].append(answer.median)
                shortest[i] = min(shortest[i], answer.shortest)
    return [(statistics.median(m) if m else math.nan, s) for m, s in zip(medians, shortest)]


def in_words(seconds):
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)):
        if seconds >= size:
            break
    return f"{seconds / size:.3g} {unit}"


def table(case, accuracy, chosen, times, missing):
    lines = [f"### {case.label} to {accuracy:.0e}".replace("e-0", "e-"), "",
             "| | setting | time | shortest | evaluations | error of Phi | error of x0 | over row 1 | over row 2 |",
             "|---|---|--:|--:|--:|--:|--:|--:|--:|"]
    rows = {trial.program.name: time for trial, (time, _) in zip(chosen, times)}
    for trial, (time, shortest) in zip(chosen, times):
        kind = trial.program.methods[trial.method]
        setting = f"{trial.setting:.2g}" if kind == TOLERANCE else f"{trial.setting} steps"
        second = "" if trial.method == "multipliers" else f"{trial.errors[1]:.1e}"
        over = [f"{time / rows[name]:.3g}" if name in rows else "" for name in ("Gestell", "Gestell, all")]
        lines.append(f"| {trial.program.name} | {re.sub('-(steps|plain)', '', trial.method)}, {setting} | {in_words(time)} | "
                     f"{in_words(shortest)} | {trial.answer.evaluations} | {trial.errors[0]:.1e} | {second} | "
                     f"{over[0]} | {over[1]} |")
    lines += ["", *(f"{name}: {why}." for name, why in missing), ""]
    return "\n".join(lines)


def reason(trials):
    best = min((t.error for t in trials), default=math.inf)
    if any(t.late for t in trials):
        return f"a run would take more than {LIMIT:g} s ({best:.1e} within that)"
    return f"not reached, {best:.1e} at best"


def cheapest(good, accuracy):
    """For each method the trial with the fewest evaluations, which do not depend on the clock, and of these the fastest. A whole
    solution is requested with the accuracy as tolerance, or with the next smaller one that is accurate enough."""
    least = {}
    for trial in good:
        if trial.method in WHOLE and trial.setting > 1.001 * accuracy:
            continue
        other = least.get(trial.method)
        if other is None or trial.method not in WHOLE and trial.answer.evaluations < other.answer.evaluations:
            least[trial.method] = trial
    return min(least.values(), key=lambda trial: trial.answer.shortest, default=None)


def compare(case, programs, accuracies, rounds, csv):
    trials = {}
    for program in programs:
        print(f"{case.label}: {program.name}", file=sys.stderr, flush=True)
        trials[program] = [trial for method in program.methods for trial in explore(case, program, method, accuracies)]
        for trial in trials[program]:
            if csv and trial.answer:
                print(case.name, f"{case.rpm:g}", trial.program.name, trial.method, f"{trial.setting:.6g}",
                      f"{trial.answer.median:.6e}", f"{trial.answer.shortest:.6e}", trial.answer.evaluations,
                      f"{trial.errors[0]:.3e}", f"{trial.errors[1]:.3e}", sep=",", file=csv, flush=True)
    for accuracy in accuracies:
        chosen, missing = [], []
        for program in programs:
            best = cheapest([trial for trial in trials[program] if trial.error <= accuracy], accuracy)
            if best:
                chosen.append(best)
            else:
                missing.append((program.name, reason(trials[program])))
        print(table(case, accuracy, chosen, race(case, chosen, rounds), missing), flush=True)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build", type=Path)
    parser.add_argument("--python", default=sys.executable)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--cases", default="")
    parser.add_argument("--states", type=int, help="cases with so many states alone")
    parser.add_argument("--accuracies", default="1e-6,1e-9,1e-12")
    parser.add_argument("--ours-only", action="store_true")
    parser.add_argument("--csv")
    order = parser.parse_args()
    cases = [case for case in read_reference() if not order.cases or f"{case.name}:{case.rpm:g}" in order.cases.split(",")]
    cases = [case for case in cases if order.states in (None, case.states)]
    programs = {n: programs_in(order.build, order.python, order.ours_only, n > 6) for n in {case.states for case in cases}}
    csv = open(order.csv, "w", encoding="utf-8") if order.csv else None
    if csv:
        print("machine,rpm,program,method,setting,median,shortest,evaluations,error_phi_or_rho,error_x0", file=csv)
    for case in cases:
        if not case.rho:  # the reference of six degrees of freedom has Phi alone
            import numpy
            case.rho = list(numpy.linalg.eigvals(numpy.array(case.phi)))
        compare(case, programs[case.states], [float(a) for a in order.accuracies.split(",")], order.rounds, csv)
    print("| program | peak of resident memory, MB |", "|---|--:|", sep="\n")
    for program in programs.get(6, []):
        print(f"| {program.name} | {program.peak_memory():.1f} |")
    for program in [program for some in programs.values() for program in some]:
        if program.process:
            program.process.stdin.close()
            program.process.wait()


if __name__ == "__main__":
    main()
