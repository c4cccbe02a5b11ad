#!/usr/bin/env python3
"""Random designs over ranges of speeds, checked between the speeds.

usage: validation/designs/designs.py PROGRAM [COUNT [SEED]]

COUNT machines (default 100), four-bars and slider-cranks on supports with little damping, with a disc and mounts as parameters, an
objective and a limit over a range of 3 to 21 speeds, by the exact frame or about rest. Each design is judged by two scans of its
design.nml that know nothing of the design: the task `sweep` at 2001 speeds, and the task `resonance`, which looks for what a scan
with equal steps misses. Prints a line for every design that is exceeded by more than its stated error, or that is worse than the
machine that it began with. The last line is "N passed, M failed".
"""
import csv
import random
import subprocess
import sys
import tempfile
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
GOALS = (("f", "peak"), ("f", "rms"), ("probe(p).v", "band"), ("xi", "peak"), ("m", "rms"))


def machine(draw):
    """The text of a machine with its design."""
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
        text += "&robust speed_percent=3 /\n"
    return text, goals


def rows(path):
    """The rows of a table."""
    return list(csv.DictReader(line for line in path.read_text().splitlines() if not line.startswith("#")))


def worst_of(program, folder, text, goals):
    """The greatest value of each goal that the two scans find."""
    (folder / "scan.nml").write_text(text)
    found = []
    for quantity, measure in goals:
        subprocess.run([program, "-q", "scan.nml", "-s", "case.tasks='sweep'", "-s", "sweep.count=2001", "-s",
                        f"sweep.columns='{quantity}'", "-s", f"sweep.measures='{measure}'"], cwd=folder, check=False,
                       stdout=subprocess.DEVNULL)
        table = rows(folder / "scan" / "sweep.csv")
        column = next(name for name in table[0] if name.strip().startswith(f"{quantity}_{measure}"))
        values = [float(row[column]) for row in table]
        found.append(max(value for value in values if value == value))
    peaks = [i for i, goal in enumerate(goals) if goal[1] == "peak"]
    if peaks:
        text += "".join(f"&resonance quantities='{goals[i][0]}' /\n" for i in peaks[:1])
        (folder / "curve.nml").write_text(text)
        subprocess.run([program, "-q", "curve.nml", "-s", "case.tasks='resonance'", "-s", "sweep.count=101"], cwd=folder, check=False,
                       stdout=subprocess.DEVNULL)
        table = rows(folder / "curve" / "resonance.csv")
        column = next(name for name in table[0] if name.startswith(f"{goals[peaks[0]][0]}_peak"))
        values = [float(row[column]) for row in table]
        found[peaks[0]] = max([found[peaks[0]]] + [value for value in values if value == value])
    return found


def main():
    """Runs them all."""
    program = str(Path(sys.argv[1]).resolve())
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 100
    seed = int(sys.argv[3]) if len(sys.argv) > 3 else 47
    bad = set()
    for number in range(count):
        text, goals = machine(random.Random(1000 * seed + number))
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            (folder / "input.nml").write_text(text)
            run = subprocess.run([program, "-q", "input.nml"], cwd=folder, check=False, capture_output=True, text=True)
            if not (folder / "input" / "design.nml").exists():
                bad.add(number)
                print(f"{number}: no design, exit {run.returncode}: {run.stderr.strip()[:200]}")
                continue
            told = rows(folder / "input" / "design_goals.csv")
            found = worst_of(program, folder, (folder / "input" / "design.nml").read_text(), goals)
            for goal, row, true in zip(goals, told, found):
                after, error = float(row["after"]), float(row["after_error"])
                # the scan's own values have the tolerance of the solution, 1e-9
                if true > after + error + 1e-8 * abs(after):
                    bad.add(number)
                    print(f"{number}: {goal}: {after} +- {error} is told, {true} is found: {100 * (true / after - 1):.3g} %")
            if len(told) == 1 and float(told[0]["after"]) > float(told[0]["before"]) * (1 + 1e-6):
                bad.add(number)
                print(f"{number}: worse than before: {told[0]['before']} to {told[0]['after']}")
    print(f"{count - len(bad)} passed, {len(bad)} failed")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
