"""The joint `follower` against a Scotch yoke, closed forms, and a table against its harmonics."""

import csv
import math
import re
import shutil
from pathlib import Path

from harness import Folder, Run, Table, check, equal, files, series, tables

DATA = Path(__file__).resolve().parents[2] / "data"
# A tappet of 2 kg above its shaft in a frame on springs; JOINT is how it is driven.
MACHINE = """\
&case title='Cam', tasks='response','power' /
&drive speed_rpm = 600.0 /
&joint name='O', type='ground', position=0.02,0.0 /
&joint name='A', type='crank', pivot='O', radius=0.03 /
&joint name='T', {} /
&link name='cam', from='O', to='A', mass=0.5, inertia=0.001, center=0.01,0.0 /
&link name='tappet', from='T', mass=2.0, inertia=0.0 /
&frame mass=50.0, inertia=2.0, origin=0.0,0.1 /
&support position=-0.3,-0.2, stiffness=2e5,2e5, damping=100.0,100.0 /
&support position=0.4,-0.2, stiffness=2e5,2e5, damping=100.0,100.0 /
"""
GUIDE = "guide_point=0.02,0.05, guide_angle=70.0"
# The centre of a round cam lies 30 mm off its shaft; the slot of the yoke passes through it at a right angle to the guide.
ORIGIN = -0.05 * math.sin(math.radians(70))
YOKE = MACHINE.format(f"type='RPP', ends='A', slot_angle=90.0, {GUIDE}")
ECCENTRIC = MACHINE.format(f"type='follower', cam='O','A', lift={ORIGIN!r},0.03,0.0, {GUIDE}")
HARMONICS = [0.012, -0.01, 0.002, -0.002, 0.0, 0.0005, 0.001]


def follower(lift):
    return MACHINE.format(f"type='follower', cam='O','A', {GUIDE}, {lift}")


def lift_at(angle):
    return HARMONICS[0] + sum(HARMONICS[2 * k - 1] * math.cos(k * angle) + HARMONICS[2 * k] * math.sin(k * angle)
                              for k in range(1, 4))


def listed(numbers):
    return ",".join(repr(number) for number in numbers)


def compute(what, text, *options):
    """The result files of a valid input."""
    with Folder(input=text) as folder:
        if Run(folder, "-q", "input.nml", "-s", "accuracy.tolerance=1e-12", *options).done(what):
            return {**tables(folder / "input"), "power.csv": Table(folder / "input" / "power.csv")}
    return {}


def same(what, one, two, part):
    """Compares all columns of vibration and torque, relative to the largest number of the column or of its kind."""
    equal(f"{what}: files", sorted(one), sorted(two))
    for name in ("response.csv", "power.csv") if one and two else ():
        for column in one[name].columns:
            if column not in two[name].columns:
                equal(f"{what}: {name}", two[name].columns, one[name].columns)
                continue
            size = max(map(abs, one[name][column]))
            series(f"{what}: {name} {column}", two[name][column], one[name][column], part * size + 1e-12)


def test_yoke():
    """An eccentric cam gives the same results as a Scotch yoke."""
    same("a round cam and a yoke", compute("yoke", YOKE), compute("round cam", ECCENTRIC), 1e-9)


def test_tables():
    """A tabulated lift gives the same results as its harmonics."""
    sound = compute("follower by harmonics", follower("lift=" + listed(HARMONICS)))
    for count in (7, 8, 36, 361):
        table = [lift_at(2 * math.pi * k / count) for k in range(count)]
        same(f"table of {count}", sound, compute(f"table of {count}", follower("lift_table=" + listed(table))), 1e-8)
    # a cam keyed 40 deg ahead is equivalent to a crank whose joint lies 40 deg behind
    moved = [lift_at(2 * math.pi * k / 36 + math.radians(40)) for k in range(36)]
    phase = compute("follower, phase", follower("lift_phase=40.0, lift=" + listed(HARMONICS)))
    same("a phase and a table that begins there", phase, compute("table, moved", follower("lift_table=" + listed(moved))), 1e-8)
    check("a phase has an effect", phase and phase["response.csv"]["eta_m"] != sound["response.csv"]["eta_m"], "other numbers", "same")
    # one harmonic by --set
    changed = [0.03 if i == 1 else value for i, value in enumerate(HARMONICS)]
    same("one harmonic by --set", compute("changed", follower("lift=" + listed(changed))),
         compute("--set", follower("lift=" + listed(HARMONICS)), "-s", "joint(T).lift(2)=0.03"), 1e-12)


def test_units():
    """Lifts in millimetres give the same results as in metres."""
    lengths = "&units length='mm' /\n"
    text = follower("lift=" + listed(HARMONICS))
    for old, new in (("position=0.02,0.0", "position=20.0,0.0"), ("radius=0.03", "radius=30.0"), ("0.02,0.05", "20.0,50.0"),
                     (listed(HARMONICS), listed([1000 * value for value in HARMONICS])), ("center=0.01,0.0", "center=10.0,0.0"),
                     ("origin=0.0,0.1", "origin=0.0,100.0"), ("position=-0.3,-0.2", "position=-300.0,-200.0"),
                     ("position=0.4,-0.2", "position=400.0,-200.0")):
        text = text.replace(old, new)
    same("lifts in mm", compute("m", follower("lift=" + listed(HARMONICS))), compute("mm", text + lengths), 1e-9)


def test_check_report():
    """--check reports stroke, mobility and inertia force of a follower.

    Lift 10 mm above the shaft, h/2 (1 - cos): the inertia force is m h/2 Omega^2.
    """
    text = follower("lift=0.01,-0.01,0.0").replace("guide_angle=70.0", "guide_angle=90.0")
    text = text.replace("mass=0.5, inertia=0.001", "mass=0.0, inertia=0.0")
    with Folder(input=text) as folder:
        run = Run(folder, "--check", "input.nml")
        run.done("follower, --check")
        force = 2 * 0.01 * (20 * math.pi) ** 2
        for word in ("mobility 1 (3 links including the frame, 2 pairs, 1 higher pair)", "0.05 to 0.07", "0.02", f"{force:.5g}",
                     "deg at joint 'T', crank angle "):
            check(f"follower, --check: {word}", word in run.out, word, run.out)
    swept = follower("lift=" + listed(HARMONICS)).replace("'response','power'", "'sweep'")
    swept += "&sweep parameter='joint(T).lift(2)', from=-0.01, to=-0.02, count=3 /\n"
    with Folder(input=swept) as folder:
        if Run(folder, "-q", "input.nml").done("follower, sweep"):
            lines = (line for line in (folder / "input" / "sweep.csv").read_text().splitlines() if line[0] != "#")
            peaks = [float(row["eta_peak_m"]) for row in csv.DictReader(lines)]
            check("follower, sweep: more lift, more vibration", len(peaks) == 3 and sorted(peaks) == peaks, "rising", peaks)


def test_press():
    """The cam press in data/ agrees with its closed form.

    Its ram has the inertia force 9/16 m h Omega^2 in the orders 1 and 3; it is stable and 20 % away from the orders 1 to 4.
    """
    with Folder() as folder:
        shutil.copy(DATA / "cam_press.nml", folder)
        run = Run(folder, "--check", "cam_press.nml")
        run.done("cam press, --check")
        omega = 14 * math.pi
        rod = 0.8 * 0.03 * 2 / 3 * omega**2
        ram = 14 * 0.04 * 9 / 16 * omega**2
        for order, force in ((1, math.hypot(ram, rod)), (3, ram)):
            row = next((line.split() for line in run.out.splitlines() if line.split()[:1] == [str(order)]), [])
            check(f"cam press, order {order} of fy", f"{force:.5g}" in row, f"{force:.5g}", row)
        run = Run(folder, "cam_press.nml")
        run.done("cam press")
        equal("cam press, verdict", run.out.splitlines()[-1], "VERDICT  stable")
        states = [line.split()[-1] for line in run.out.splitlines() if line.endswith((" pass", " fail"))]
        equal("cam press, separation", states, ["pass"] * 3)


def test_refused():
    """Invalid followers are refused with the exact message."""
    start = "input.nml:5: &joint 'T': "
    for what, words, message in (
            ("no lift", f"type='follower', cam='O','A', {GUIDE}",
             "give one of 'lift' (harmonics), 'lift_table' and 'law'"),
            ("two lifts", f"type='follower', cam='O','A', {GUIDE}, lift=0.01, lift_table=0.0,0.1,0.2",
             "give one of 'lift' (harmonics), 'lift_table' and 'law'"),
            ("even", f"type='follower', cam='O','A', {GUIDE}, lift=0.01,0.02",
             "lift = 0.01, 0.02: must have an odd number of values: the mean, then one cosine and one sine coefficient for each order"),
            ("short table", f"type='follower', cam='O','A', {GUIDE}, lift_table=0.01,0.02", "lift_table = 0.01, 0.02: takes at least 3 values, has 2"),
            ("one joint", f"type='follower', cam='A', {GUIDE}, lift=0.01", "cam = 'A': takes 2 values, has 1"),
            ("the same twice", f"type='follower', cam='A','A', {GUIDE}, lift=0.01", "cam = 'A', 'A': must name 2 different joints"),
            ("itself", f"type='follower', cam='O','T', {GUIDE}, lift=0.01", "cam = 'O', 'T': a joint cannot refer to itself"),
            ("no cam", f"type='follower', {GUIDE}, lift=0.01", "a joint of type 'follower' needs the key 'cam'"),
            ("no guide", "type='follower', cam='O','A', lift=0.01",
             "give 'guide_point' and 'guide_angle' for a guide that is fixed to the frame, or 'guide' for a guide that two joints carry"),
            ("ends", f"type='follower', ends='A', cam='O','A', {GUIDE}, lift=0.01",
             "is not a key of a joint of type 'follower'; its keys are cam, lift, lift_table, harmonics, law, law_angle, law_lift, "
             "lift_phase, guide, guide_point, guide_angle")):
        with Folder(input=MACHINE.format(words)) as folder:
            message = ("ends = 'A': " if what == "ends" else "") + message
            Run(folder, "input.nml").refused(f"follower, {what}", 2, start + message)
            equal(f"follower, {what}: nothing written", files(folder), ["input.nml"])
    meeting = MACHINE.format(f"type='follower', cam='O','A', {GUIDE}, lift=0.01").replace(
        "&joint name='T'", "&joint name='B', type='rigid', ends='O','A', offset=0.03,0.0 /\n&joint name='T'").replace(
        "cam='O','A'", "cam='A','B'")
    with Folder(input=meeting) as folder:
        Run(folder, "input.nml").refused("follower, the cam's joints meet", 3, re.compile(
            "input.nml:6: joint 'T' cannot be assembled or is at a dead point at a crank angle of 0.000 deg: the two joints of "
            "the cam, or the two joints that carry the guide, coincide; .*assembled.*"))


FOLLOWER_TESTS = (test_yoke, test_tables, test_units, test_check_report, test_press, test_refused)
