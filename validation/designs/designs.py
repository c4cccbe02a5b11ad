#!/usr/bin/env python3
"""Random designs over ranges of speeds, checked between the speeds.

usage: validation/designs/designs.py PROGRAM [COUNT [SEED]]

COUNT machines (default 100), four-bars and slider-cranks on supports with little damping, with a disc and mounts as parameters,
an objective and limits over a range of 3 to 21 speeds, by the exact frame or about rest, some with a scatter of speed,
stiffness and damping of the mounting. Each design is judged by independent runs of its design.nml, at up to three corners of
the scatter: the task `sweep` at 401 speeds; the task `resonance`, which finds maxima that a scan with equal steps misses; for
the torque the task `power` at single speeds; for the separation the task `modes` with averaged coefficients, without damping.
Prints a line for every design whose reported values are exceeded by more than their stated error, that is unstable but called
stable, or that is worse than the initial machine, and the time that designs took. The last line is "N passed, M failed".
"""
import csv
import itertools
import math
import os
import random
import re
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

FOUR_BAR = """\
&joint name='A0', type='ground', position=0.0,0.0 /
&joint name='B0', type='ground', position=0.40,0.0 /
&joint name='A', type='crank', pivot='A0', radius=0.07 /
&joint name='B', type='RRR', ends='A','B0', lengths=0.37,0.16, branch=1 /
&link name='crank', from='A0', to='A', mass=0.50, inertia=0.0035, center=0.03,0.0 /
&link name='coupler', from='A', to='B', mass={m1:.3f}, inertia=0.0070, center=0.18,0.0 /
&link name='rocker', from='B0', to='B', mass={m2:.3f}, inertia=0.0060, center=0.08,0.0 /
&link name='disc', from='A0', to='A', mass=0.50, inertia=0.0004, center=0.0,0.0 /
"""
SLIDER = """\
&joint name='A0', type='ground', position=0.0,0.0 /
&joint name='A', type='crank', pivot='A0', radius=0.05 /
&joint name='B', type='RRP', ends='A', lengths=0.2, guide_point=0.0,0.01, guide_angle=80, branch=1 /
&link name='crank', from='A0', to='A', mass=1.0, inertia=0.002, center=0.01,0.002 /
&link name='rod', from='A', to='B', mass={m1:.3f}, inertia=0.003, center=0.065,0.0 /
&link name='piston', from='B', mass={m2:.3f}, inertia=0 /
&link name='disc', from='A0', to='A', mass=0.50, inertia=0.0004, center=0.0,0.0 /
"""
MACHINE = """\
&case title='random design', tasks='design' /
&model frame='{model}' /
&drive speed_rpm={speed:.1f} /
{mechanism}&frame mass={mass:.2f}, inertia={inertia:.3f}, origin={x:.3f},{y:.3f} /
&support position=-0.30,-0.20, stiffness={k:.0f},{kb:.0f} /
&support position=0.25,-0.20, stiffness={k:.0f},{kb:.0f} /
&foundation damping={b:.2f},{b:.2f},{bp:.3f} /
&probe name='p', position=0.1,0.2, band_hz=1,1000 /
&sweep parameter='drive.speed_rpm', from={low:.1f}, to={high:.1f}, count={count} /
"""
GOALS = (("f", "peak"), ("f", "rms"), ("probe(p).v", "band"), ("xi", "peak"), ("m", "rms"), ("torque", "peak"), ("torque", "rms"))
# In per cent: of the speed, the stiffness and the damping of the mounting.
SCATTERS = ((3, 0, 0), (0, 10, 0), (0, 10, 20), (2, 5, 0))
SCATTER_KEYS = ("speed_percent", "mounting_percent", "damping_percent")
SCAN, CURVE, COARSE = 401, 101, 41
MOST_CORNERS = 3


def machine(draw):
    """The input of a machine with its design, its goals, and the scatter."""
    mechanism = draw.choice((FOUR_BAR, SLIDER)).format(m1=draw.uniform(0.3, 1.0), m2=draw.uniform(0.2, 0.8))
    mass = draw.uniform(12, 40)
    low = draw.uniform(150, 500)
    k = draw.uniform(5e4, 4e5)
    damping = draw.choice((0.5, 5.0, 30.0, 150.0))
    text = MACHINE.format(model=draw.choice(("exact", "rest", "rest")), speed=low * 1.1, mechanism=mechanism, mass=mass,
                          inertia=mass * draw.uniform(0.02, 0.06), x=draw.uniform(-0.2, 0.1), y=draw.uniform(0.0, 0.2), k=k,
                          kb=k * draw.uniform(0.7, 1.5), b=damping, bp=damping / 10, low=low, high=low * draw.uniform(1.1, 1.6),
                          count=draw.choice((3, 6, 11, 21)))
    text += f"&design parameter='support.stiffness', from={0.3 * k:.0f}, to={3 * k:.0f}, starts=4 /\n"
    if draw.random() < 0.6:
        text += "&design parameter='link(disc).center(1)', from=-0.12, to=0.12 /\n"
    objective, limited = draw.sample(GOALS, 2)
    text += f"&objective quantity='{objective[0]}', measure='{objective[1]}' /\n"
    goals = [objective]
    if draw.random() < 0.6:
        text += f"&constraint quantity='{limited[0]}', measure='{limited[1]}', at_most={draw.choice((1e-4, 1e-2, 1, 30, 300))} /\n"
        goals.append(limited)
    if draw.random() < 0.2:
        text += f"&constraint quantity='separation', at_least={draw.choice((3, 10, 20))} /\n"
        goals.append(("separation", ""))
    scatter = (0, 0, 0)
    if draw.random() < 0.35:
        scatter = draw.choice(SCATTERS)
        text += "&robust " + ", ".join(f"{key}={value}" for key, value in zip(SCATTER_KEYS, scatter)) + " /\n"
    return text, goals, scatter


def rows(path):
    """The rows of a table."""
    return list(csv.DictReader(line for line in path.read_text().splitlines() if not line.startswith("#")))


def numbers(path, head):
    """The finite numbers of a table's column."""
    table = rows(path)
    column = next(name for name in table[0] if name.strip().startswith(head))
    return [value for value in (float(row[column]) for row in table) if math.isfinite(value)]


class Judge:
    """Judges one machine by tasks other than `design`."""

    def __init__(self, program, folder, text):
        """`text` is an input whose range of speeds is to be judged."""
        self.program, self.folder, self.text = program, folder, text
        self.unstable = False
        self.low, self.high = (float(found) for found in re.search(r"from=([\d.]+), to=([\d.]+), count", text).groups())

    def run(self, tasks, *settings):
        """Runs the program. Returns the folder of its tables and the output of --one-line."""
        (self.folder / "judged.nml").write_text(self.text)
        arguments = [self.program, "-q", "judged.nml", "-s", f"case.tasks='{tasks}'"]
        for setting in settings:
            arguments += [setting] if setting.startswith("--") else ["-s", setting]
        done = subprocess.run(arguments, cwd=self.folder, check=False, capture_output=True, text=True)
        return self.folder / "judged", done.stdout

    def motions(self, goals):
        """The largest values over the speeds of the quantities that sweeps and curves compute, by goal."""
        found = {}
        for measure in sorted({measure for _, measure in goals}):
            names = [quantity for quantity, kind in goals if kind == measure]
            folder, _ = self.run("sweep", f"sweep.count={SCAN}", f"sweep.measures='{measure}'", "sweep.columns=" + quoted(names))
            self.unstable |= any(row["verdict"].strip() == "unstable" for row in rows(folder / "sweep.csv"))
            found.update({(name, measure): numbers(folder / "sweep.csv", f"{name}_{measure}") for name in names})
        curves = [goal for goal in goals if goal[1] != "band"]
        if curves:
            text = self.text
            self.text += "&resonance quantities=" + quoted(sorted({name for name, _ in curves})) + " /\n"
            folder, _ = self.run("resonance", f"sweep.count={CURVE}")
            self.text = text
            for name, measure in curves:
                found[name, measure] += numbers(folder / "resonance.csv", f"{name}_{measure}")
        return {goal: max(values) for goal, values in found.items()}

    def torque(self, measure):
        """The largest torque: at equal steps and across each maximum of the forces."""
        speeds = [self.low + (self.high - self.low) * k / (COARSE - 1) for k in range(COARSE)]
        text = self.text
        self.text += "&resonance quantities='f' /\n"
        folder, _ = self.run("resonance", f"sweep.count={CURVE}")
        if (folder / "peaks.csv").exists():
            for row in rows(folder / "peaks.csv"):
                width = float(row["width_rpm"])
                speeds += [float(row["speed_rpm"]) + (k * width / 16 if math.isfinite(width) else 0) for k in range(-8, 9)]
        # the sweep would run over the speed
        self.text = re.sub(r"&sweep.*\n", "", text)
        found = []
        for speed in (speed for speed in speeds if self.low <= speed <= self.high):
            folder, printed = self.run("power", f"drive.speed_rpm={speed!r}", *(["--one-line"] if measure == "peak" else []))
            if measure == "peak":
                head, line = list(csv.reader(printed.splitlines()))[:2]
                found.append(float(line[[name.strip() for name in head].index("torque_peak_Nm")]))
            else:
                values = numbers(folder / "power.csv", "torque")
                # the last row is the first again
                found.append(math.sqrt(sum(value**2 for value in values[1:]) / (len(values) - 1)))
        self.text = text
        return max(value for value in found if math.isfinite(value))

    def separation(self):
        """The smallest distance of the averaged frame's natural frequencies from the first four orders over the range (per cent)."""
        text = self.text
        averaged = text.replace("&model ", "&model coefficients='averaged', ").replace("'exact'", "'rest'")
        self.text = re.sub(r"&sweep.*\n", "", averaged)
        # exponents are determined up to multiples of the speed; this speed lies above all natural frequencies, which do not depend on it here
        folder, _ = self.run("modes", "foundation.damping=0,0,0", "drive.speed_rpm=60000")
        self.text = text
        found = []
        for exponent in numbers(folder / "multipliers.csv", "exponent_im"):
            frequency = exponent / (2 * math.pi)
            for order in (1, 2, 3, 4):
                ends = [100 * (abs(frequency) / (order * speed / 60) - 1) for speed in (self.low, self.high)]
                found.append(0 if ends[0] > 0 > ends[1] else min(abs(end) for end in ends))
        return min(found)


def quoted(names):
    """Words as a list in an input."""
    return ",".join(f"'{name}'" for name in names)


def corners(text, scatter):
    """The machine at the corners of the scatter."""
    low, high = re.search(r"from=([\d.]+), to=([\d.]+), count", text).groups()
    text = text.replace(f"from={low}, to={high}, count", f"from={float(low) * (1 - scatter[0] / 100):.6f}, "
                        f"to={float(high) * (1 + scatter[0] / 100):.6f}, count")
    sides = [(-1, 0, 1) if part else (0,) for part in scatter[1:]]
    for stiffness, damping in itertools.product(*sides):
        yield scaled(text, 1 + stiffness * scatter[1] / 100, 1 + damping * scatter[2] / 100)


def scaled(text, stiffness, damping):
    """The machine on a mounting with scaled stiffness and damping."""
    def times(factor):
        return lambda found: found[1] + ",".join(repr(float(one) * factor) for one in found[2].split(","))

    # comments of a design contain the previous numbers
    text = re.sub("!.*", "", text)
    text = re.sub(r"(&support.*stiffness=)([\d.,e+]+)", times(stiffness), text)
    return re.sub(r"(&foundation damping=)([\d.,e+]+)", times(damping), text)


def worst_of(program, folder, text, goals, scatter):
    """The worst value of each goal that the judge finds, and whether the machine is unstable anywhere."""
    machines = list(corners(text, scatter))
    judges = [Judge(program, folder, one) for one in random.Random(text).sample(machines, min(MOST_CORNERS, len(machines)))]
    moving = [goal for goal in goals if goal[0] not in ("separation", "torque")]
    motions = [judge.motions(moving) for judge in judges]
    found = []
    for goal in goals:
        if goal[0] == "separation":
            found.append(min(judge.separation() for judge in judges))
        elif goal[0] == "torque":
            found.append(max(judge.torque(goal[1]) for judge in judges))
        else:
            found.append(max(one[goal] for one in motions))
    return found, any(judge.unstable for judge in judges)


def is_exceeded(goal, row, found):
    """True if the judge's value is worse than the reported one by more than its error and the tolerance of both solutions, 1e-9."""
    after, error = float(row["after"]), float(row["after_error"])
    allowed = error + 1e-8 * abs(after)
    return found < after - allowed if goal[0] == "separation" else found > after + allowed


def judge_design(program, folder, number, seed):
    """Makes a design and judges it. Returns the failures and the time it took (s)."""
    text, goals, scatter = machine(random.Random(1000 * seed + number))
    (folder / "input.nml").write_text(text)
    start = time.perf_counter()
    run = subprocess.run([program, "-q", "input.nml"], cwd=folder, check=False, capture_output=True, text=True)
    took = time.perf_counter() - start
    if not (folder / "input" / "design.nml").exists():
        return [f"no design, exit {run.returncode}: {run.stderr.strip()[:200]}"], took
    reported = rows(folder / "input" / "design_goals.csv")
    found, unstable = worst_of(program, folder, (folder / "input" / "design.nml").read_text(), goals, scatter)
    wrong = [f"{goal}: {row['after']} +- {row['after_error']} was reported, the judge found {true}"
             for goal, row, true in zip(goals, reported, found) if is_exceeded(goal, row, true)]
    if unstable and "# verdict: stable" in (folder / "input" / "design_goals.csv").read_text():
        wrong.append("called stable, unstable between the speeds")
    if len(reported) == 1 and float(reported[0]["after"]) > float(reported[0]["before"]) * (1 + 1e-6):
        wrong.append(f"worse than before: {reported[0]['before']} to {reported[0]['after']}")
    return wrong, took


def main():
    """Makes and judges all designs."""
    program = str(Path(sys.argv[1]).resolve())
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 100
    seed = int(sys.argv[3]) if len(sys.argv) > 3 else 47
    os.environ["OMP_NUM_THREADS"] = "1"
    bad = 0
    times = []
    for number in range(count):
        with tempfile.TemporaryDirectory() as name:
            wrong, took = judge_design(program, Path(name), number, seed)
        times.append(took)
        bad += bool(wrong)
        for line in wrong:
            print(f"{number}: {line}", flush=True)
    print(f"a design took {statistics.median(times):.1f} s in the median, {max(times):.1f} s at the most")
    print(f"{count - bad} passed, {bad} failed")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
