"""The joint `cylinder` against cam followers, closed forms, and copies of itself."""

import math
import re
import shutil
from pathlib import Path

from follower import GUIDE, HARMONICS, MACHINE, compute, follower, listed, same
from harness import Folder, Run, check, equal, files, near
from several_mechanisms import own, rows

DATA = Path(__file__).resolve().parents[2] / "data"
# A slider of 2 kg that a cylinder moves upward, in a frame that moves only up and down.
MASS, SLIDER, SPRING, DAMPING, SPEED = 50.0, 2.0, 3.0e5, 400.0, 300.0
STROKE = (0.5, 0.03, -0.01, 0.004, 0.002)
SHAKER = (f"&case tasks='response' /\n&model frame='rest' /\n&drive speed_rpm={SPEED} /\n"
          f"&frame mass={MASS}, inertia=1.5, origin=0,0, dof='eta' /\n"
          f"&foundation stiffness={SPRING},0,0,0,{SPRING},0,0,0,0, damping={DAMPING},{DAMPING},0 /\n")
RAM = (f"&joint name='S', type='cylinder', stroke={listed(STROKE)}, guide_point=0,0, guide_angle=90 /\n"
       f"&link name='ram', from='S', mass={SLIDER}, inertia=0 /\n")


def cylinder(words):
    return MACHINE.format(f"type='cylinder', {words}")


def test_follower():
    """A slider moved by a cylinder gives the same results as a cam follower on the drive's shaft.

    The cam's angle is measured from the guide at 70 deg.
    """
    stroke = "stroke=" + listed(HARMONICS)
    sound = compute("follower", follower("lift=" + listed(HARMONICS)))
    same("a cylinder for a follower", sound, compute("cylinder", cylinder(f"{stroke}, {GUIDE}, phase=-70")), 1e-9)
    changed = listed([0.5 * value for value in HARMONICS])
    same("half the stroke by --set", compute("half", cylinder(f"stroke={changed}, {GUIDE}")), compute("set", cylinder(
        f"{stroke}, {GUIDE}"), *(word for k, value in enumerate(HARMONICS) for word in (
            "-s", f"joint(T).stroke({k + 1})={0.5 * value!r}"))), 1e-12)


def response(what, mechanism):
    """Amplitudes of eta by order."""
    with Folder(input=SHAKER + mechanism) as folder:
        if not Run(folder, "-q", "input.nml").done(what):
            return {}
        return {float(row["order"]): float(row["eta_m_amplitude"]) for row in rows(folder / "input" / "harmonics.csv")}


def amplitude(order, part, moving):
    """Amplitude of eta from the inertia force of `part` times the slider's stroke."""
    w = order * SPEED * math.pi / 30
    force = SLIDER * abs(complex(*STROKE[2 * order - 1:2 * order + 1])) * w**2 * part
    return abs(force / complex(SPRING - (MASS + moving) * w**2, DAMPING * w))


def test_harmonics():
    """Cylinders without a crank shake the frame as their harmonics say; copies with other phases or ratios too."""
    greatest = amplitude(1, 1, SLIDER)
    found = response("one cylinder", RAM)
    for order in (1, 2) if found else ():
        near(f"cylinder, order {order}", found[order], amplitude(order, 1, SLIDER), 1e-9 * greatest)
    pair = "&mechanism name='m' /\n" + own(RAM, "m") + "&repeat of='m', name='n', phase=180 /\n"
    found = response("two cylinders", pair)
    for order, part in ((1, 0), (2, 2)) if found else ():
        near(f"opposed cylinders, order {order}", found[order], amplitude(order, part, 2 * SLIDER), 1e-9 * greatest)
    slow = response("a cylinder of half the speed", "&mechanism name='m', ratio=0.5 /\n" + own(RAM, "m"))
    w = SPEED * math.pi / 30
    if slow:
        near("cylinder, ratio 1/2: order 1", slow[1], SLIDER * math.hypot(*STROKE[3:]) * w**2 / abs(
            complex(SPRING - (MASS + SLIDER) * w**2, DAMPING * w)), 1e-9 * greatest)


def test_table():
    """The tilting table in data/ is stable, and --check reports its stroke and transmission angle.

    The stroke is 0.12 m; the angle between lever and cylinder follows from the law of cosines.
    """
    with Folder() as folder:
        shutil.copy(DATA / "tilting_table.nml", folder)
        run = Run(folder, "--check", "tilting_table.nml")
        run.done("tilting table, --check")
        lengths = [0.75 - 0.06 * math.cos(angle) + 0.008 * math.cos(2 * angle)
                   for angle in (math.pi * k / 5000 for k in range(5001))]
        least = min(math.degrees(math.asin(math.sqrt(1 - ((0.36 + length**2 - 0.89) / (1.2 * length))**2))) for length in lengths)
        for word in ("mobility 1 (4 links including the frame, 4 pairs)", f"{max(lengths) - min(lengths):.5g}",
                     f"smallest transmission angle {least:.3g} deg at joint 'B'"):
            check(f"tilting table, --check: {word}", word in run.out, word, run.out)
        run = Run(folder, "tilting_table.nml")
        run.done("tilting table")
        equal("tilting table, verdict", run.out.splitlines()[-1], "VERDICT  stable")


def test_refused():
    """Invalid cylinders are refused with the exact message."""
    start = "input.nml:5: &joint 'T': "
    lever = "ends='O','A', lengths=0.4, branch=1"
    either = "give either 'ends', 'lengths' and 'branch', or a guide"
    for what, words, message in (
            ("nothing", "stroke=0.4,0.1,0.0", either),
            ("both", f"stroke=0.4,0.1,0.0, {lever}, {GUIDE}", either),
            ("no branch", "stroke=0.4,0.1,0.0, ends='O','A', lengths=0.4", either),
            ("lengths on a guide", f"stroke=0.4,0.1,0.0, lengths=0.4, {GUIDE}", either),
            ("half a guide", "stroke=0.4,0.1,0.0, guide_angle=20",
             "give 'guide_point' and 'guide_angle' for a guide that is fixed to the frame, or 'guide' for a guide that two joints carry"),
            ("no stroke", lever, "a joint of type 'cylinder' needs the key 'stroke'"),
            ("short", f"{lever}, stroke=0.4", "stroke = 0.4: takes at least 3 values, has 1"),
            ("even", f"{lever}, stroke=0.4,0.1,0.0,0.1",
             "the stroke must have an odd number of values: the mean, then one cosine and one sine coefficient for each order"),
            ("ratio", f"{lever}, stroke=0.4,0.1,0.0, ratio=0.123456", re.compile("ratio = .*must be a fraction.*"))):
        with Folder(input=cylinder(words)) as folder:
            if isinstance(message, str):
                message = start + message
            else:
                message = re.compile(re.escape(start) + message.pattern)
            Run(folder, "input.nml").refused(f"cylinder, {what}", 2, message)
            equal(f"cylinder, {what}: nothing written", files(folder), ["input.nml"])
    with Folder(input=cylinder(f"{lever}, stroke=0.4,0.1,0.0")) as folder:
        Run(folder, "input.nml").refused("cylinder, too long a stroke", 3, re.compile(
            r"input.nml:5: joint 'T' cannot be assembled or is at a dead point at a crank angle of 0.000 deg: its ends are 0.03 m "
            r"apart; the lever is 0.4 m long, the cylinder 0.3 m to 0.5 m; it can be assembled from 7\d.*"))
    # in the plane and in space
    for machine in ((DATA / "tilting_table.nml").read_text(), SHAKER.replace("dof='eta'", "dof='eta','zeta'") + RAM):
        with Folder(input=machine) as folder:
            for holder in ("flywheel", "outside"):
                Run(folder, "-s", f"drive.held_by={holder}", "input.nml").refused(f"a cylinder's drive, {holder}", 2, re.compile(
                    rf".*&drive: held_by.*{holder}.* requires a (crank: a cylinder has no shaft|mechanism with ratio=1.*)"))


CYLINDER_TESTS = (test_follower, test_harmonics, test_table, test_refused)
