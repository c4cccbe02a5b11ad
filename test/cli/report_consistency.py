"""The numbers of the report agree with each other and with the tables."""

import math
import re

from broken_inputs import SOUND
from harness import Folder, Run, Table, check, equal, near
from verdicts import SIEVE

# A disc with an eccentric mass on mounts that are equal in all directions: its force rotates with constant size.
DISC = """&case title='Disc', tasks='stability','response','forces' /
&drive speed_rpm=600 /
&joint name='O', type='ground', position=0,0 /
&joint name='A', type='crank', pivot='O', radius=0.05 /
&link name='disc', from='O', to='A', mass=2, inertia=0.001, center=0.01,0 /
&frame mass=40, inertia=2, origin=0,0, dof='xi','eta' /
&support position=-0.3,0, stiffness=1e5,1e5, damping=100,100 /
&support position= 0.3,0, stiffness=1e5,1e5, damping=100,100 /
"""
# A yoke that moves up and down in the middle of a symmetrical machine, which neither moves sideways nor rotates.
YOKE = """&case title='Yoke', tasks='response','forces','power' /
&drive speed_rpm=600 /
&joint name='O', type='ground', position=0,0 /
&joint name='A', type='crank', pivot='O', radius=0.05 /
&joint name='B', type='RPP', ends='A', guide_point=0,0, guide_angle=90, slot_angle=90 /
&link name='yoke', from='B', mass=2, inertia=0.001 /
&frame mass=40, inertia=2, origin=0,0.2 /
&support position=-0.3,0, stiffness=1e5,1e5, damping=100,100 /
&support position= 0.3,0, stiffness=1e5,1e5, damping=100,100 /
"""
TRIAD = """&case title = 'Three links that hold each other' /
&drive speed_rpm=60 /
&joint name='O', type='ground', position=0,0 /
&joint name='P', type='ground', position=1,0 /
&joint name='A', type='crank', pivot='O', radius=0.05 /
&joint name='C', type='RRR', ends='A','D', lengths=0.9,0.3, branch=1 /
&joint name='D', type='RRR', ends='P','E', lengths=0.4,0.3, branch=1 /
&joint name='E', type='rigid', ends='C','D', offset=0.1,0.1 /
&frame mass=40, inertia=2, origin=0,0 /
"""


def multipliers(report):
    """Frequency (Hz), multiple of the crank speed, and remark of each multiplier; a pair has one row."""
    lines = re.search(r"MULTIPLIERS AND EXPONENTS\n.*\n.*\n((?:  \d.*\n)+)", report)[1].splitlines()
    words = [line.replace(", ", ",").split() for line in lines]
    return [(row[4], row[5], " ".join(row[6:])) for row in words for _ in row[0].split(",")]


def naturals(report):
    lines = re.search(r"NATURAL FREQUENCIES.*\n.*\n.*\n((?:  \d .*\n)+)", report)[1].splitlines()
    return [2 * math.pi * float(line.split()[1]) for line in lines]


def test_frequencies():
    """Frequencies of multipliers agree with natural frequencies and arguments."""
    for speed in (240, 97, 1450):
        with Folder() as folder:
            run = Run(folder, "-s", f"drive.speed_rpm={speed}", "input.nml")
            run.done(f"frequencies at {speed}")
            table, omega = Table(folder / "input/multipliers.csv"), speed * math.pi / 30
            equal(f"multipliers at {speed}", len(multipliers(run.out)), 6)
            for k, (frequency, multiple, words) in enumerate(multipliers(run.out)):
                what = f"multiplier {k + 1} at {speed}"
                if words == "not identified":
                    check(f"{what} is known", False, "a frequency", words)
                    continue
                frequency = 2 * math.pi * float(frequency)
                nearest = min(naturals(run.out), key=lambda natural: abs(natural - frequency))
                near(f"{what}: close to a natural frequency", frequency, nearest, 0.01 * nearest)
                # seven digits are printed
                turns = [(frequency + sign * table["exponent_im_rad_per_s"][k]) / omega for sign in (1, -1)]
                near(f"{what}: fits its argument", min(abs(turn - round(turn)) for turn in turns), 0.0, 1e-6 * frequency / omega)
                near(f"{what}: in crank speeds", float(multiple), frequency / omega, 1e-4 * float(multiple))


def test_kinds_of_frequencies():
    """Overdamped and locked multipliers are described as such."""
    with Folder() as folder:
        run = Run(folder, "-s", "foundation.damping=3e4,2e4,2e3", "input.nml")
        run.done("overdamped")
        check("overdamped: two do not swing", [row for row in multipliers(run.out) if row == ("0", "0", "no oscillation")][1:],
              "no oscillation", multipliers(run.out))
    with Folder(input=SIEVE) as folder:
        run = Run(folder, "-s", "case.tasks=stability", "input.nml")
        words = [row for row in multipliers(run.out) if row[2] == "locked to the crank"]
        check("parametric resonance: a pair is locked", len(words) == 2 and words[0][1] == "0.5", "0.5", multipliers(run.out))


def test_orders():
    """The reported strongest order and its share agree with the harmonics."""
    with Folder(input=DISC) as folder:
        run = Run(folder, "input.nml")
        run.done("orders")
        rows = re.findall(r"^  (?:support \d|total|xi of F|eta of F|force on ground).* 1 \(([\d.]+) %\)$", run.out, re.M)
        equal("orders: all is order 1", rows, ["100"] * 7)
    with Folder() as folder:
        run = Run(folder, "-s", "case.tasks='response','forces'", "input.nml")
        table = Table(folder / "input/harmonics.csv")
        for name, column in (("xi of F", "xi_m"), ("psi velocity", "psi_dot_rad_s"), ("force on ground, y", "fy_N")):
            amplitudes = table[column + "_amplitude"]
            order = max(range(1, len(amplitudes)), key=lambda k: amplitudes[k])
            square = amplitudes[0] ** 2 + sum(value ** 2 for value in amplitudes[1:]) / 2
            reported = re.search(rf"^  {name} .* (\d+) \(([\d.]+) %\)$", run.out, re.M)
            equal(f"orders, {name}: reported", bool(reported), True)
            if reported:
                equal(f"orders, {name}: which", int(reported[1]), order)
                # three digits; twenty orders hold the whole to 1e-6
                near(f"orders, {name}: part", float(reported[2]), 100 * amplitudes[order] ** 2 / 2 / square, 0.06)


def test_noise():
    """What moves only by rounding is reported as zero."""
    with Folder(input=YOKE) as folder:
        run = Run(folder, "input.nml")
        run.done("noise")
        for name in ("xi of F", "psi", "xi velocity", "psi velocity", "force on ground, x", "moment on ground"):
            row = re.search(rf"^  {name}  +(\S+) +\S+ +(\S+) ", run.out, re.M)
            equal(f"noise, {name}", row and (row[1], row[2]), ("0", "0"))
        row = re.search(r"^  total +(\S+) +(\S+)", run.out, re.M)
        equal("noise, fx of all", row and row[1], "0")
        check("noise, fy of all", row and float(row[2]) > 1000, "moves", row and row[0])
        check("noise, no moment", "total moment" not in run.out and "is meaningless" not in run.out, "nothing", run.out)
    with Folder(input=DISC) as folder:
        run = Run(folder, "-s", "case.tasks='power'", "-s", "frame.dof='xi','eta','psi'", "-s", "joint(O).position=0.1,0",
                  "input.nml")
        row = re.search(r"^  on a frame at rest +(\S+) +(\S+) +(\S+) +(\S+)$", run.out, re.M)
        equal("noise, a disc takes no torque", row and row.groups(), ("0", "0.0", "0", "0"))


def test_motor():
    """The report states where the motor is mounted."""
    with Folder() as folder:
        for options in ([], ["--check"]):
            run = Run(folder, *options, "input.nml")
            check("place of the motor", "  motor      on the frame: relative speed constant, torque acts on the frame" in run.out, "it", run.out)


def test_units():
    """Implausibly large dimensions, speeds and accelerations are warned of.

    For example lengths in mm without &units: 70 m in place of 0.07 m.
    """
    metres = [("joint(A0).position=0,0"), ("joint(B0).position=400,0"), ("joint(A).radius=70"), ("joint(B).lengths=370,160")]
    settings = [word for setting in metres for word in ("-s", setting)]
    with Folder() as folder:
        for option in ("--check", "-q"):
            run = Run(folder, *settings, *(["--check"] if option == "--check" else []), "input.nml")
            # r Omega of the crank pin and more of the rocker's: 70 * 8 pi = 1759
            reported = re.search(r"warning joint '(.*)' moves at up to ([\d.]+) m/s, more than 500 m/s: check the units", run.flat)
            check(f"units, {option}: speed", reported and float(reported[2]) >= 1759, "1759 m/s or more", run.out[:1500])
            check(f"units, {option}: width", re.search(r"warning the mechanism is \d+ m wide, more than 20 m: ", run.flat), "it",
                  run.out[:1500])
        # r Omega^2 = 0.07 * 419^2 = 12280, three times as fast 110500, at 88 m/s
        run = Run(folder, "--check", "-s", "drive.speed_rpm=12000", "input.nml")
        check("units: acceleration", re.search(r"warning joint '.' has an acceleration of up to \S+ m/s\^2, more than 1(e5|00000) m/s\^2: ", run.flat), "it", run.out[:1500])
        run = Run(folder, "--check", "input.nml")
        check("units: none of a sound machine", "check the units" not in run.out, "no note", run.out[:1500])


def test_triad():
    """Joints that depend on each other are refused with an explanation."""
    with Folder(input=TRIAD) as folder:
        Run(folder, "--check", "input.nml").refused(
            "triad", 2, "input.nml:6: &joint 'C': ends = 'A', 'D': joint 'D' in line 7 refers to 'C' in turn: joints that can "
            "only be located together (Assur groups of class III) are not supported")
    with Folder(input=SOUND.replace("ends='A','B0'", "ends='A','C'") + "&joint name='C', type='ground', position=0.4,0 /\n") as folder:
        Run(folder, "--check", "input.nml").refused("only late", 2, re.compile(".*joint 'C' comes later, in line 16: list it before "
                                                                              "this joint"))


REPORT_CONSISTENCY_TESTS = (test_frequencies, test_kinds_of_frequencies, test_orders, test_noise, test_motor, test_units, test_triad)
