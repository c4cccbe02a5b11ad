"""What engines are judged by: the balance table by orders against the closed forms of engine books."""

import cmath
import math
import re

from harness import Folder, Run, check, equal, near
from space import DATA

# Crank radius, rod, spacing of the cylinders (m), mass of a piston (kg), speed (1/min); massless rods and throws.
R, ROD, SPACING, PISTON, RPM = 0.04, 0.13, 0.1, 0.5, 3000.0
SPEED = RPM * math.pi / 30
FRAME = """\
&drive speed_rpm={0} /
&frame mass=100, inertia=5,6,4, origin=0.01,-0.08,0.03, dof='xi','eta','zeta','rot_xi','rot_eta','psi' /
&support position= 0.3,-0.1, 0.2, stiffness=2e5,2e5,2e5, damping=300,300,300 /
&support position=-0.3,-0.1, 0.2, stiffness=2e5,2e5,2e5, damping=300,300,300 /
&support position= 0.0,-0.1,-0.4, stiffness=2e5,2e5,2e5, damping=300,300,300 /
"""

# Crank pins (deg from the first), banks (deg from eta), places along the shaft in spacings, and of each order that is there the
# force over m r W^2 A_k and the couple over the same times the spacing, along one line (I) or of any shape (V).
ENGINES = {
    "I2": ([0, 180], [0, 0], [-0.5, 0.5], {2: (2, 0), 4: (2, 0), 6: (2, 0), 8: (2, 0), 1: (0, 1)}),
    "I3": ([0, 240, 120], [0, 0, 0], [-1, 0, 1], {1: (0, math.sqrt(3)), 2: (0, math.sqrt(3)), 4: (0, math.sqrt(3)), 6: (3, 0),
                                                  8: (0, math.sqrt(3))}),
    "I4": ([0, 180, 180, 0], [0] * 4, [-1.5, -0.5, 0.5, 1.5], {2: (4, 0), 4: (4, 0), 6: (4, 0), 8: (4, 0)}),
    "I5": ([0, 144, 216, 288, 72], [0] * 5, [-2, -1, 0, 1, 2], {1: (0, 0.449028), 2: (0, 4.979797), 4: (0, 0.449028),
                                                                6: (0, 0.449028), 8: (0, 4.979797)}),
    "I6": ([0, 240, 120, 120, 240, 0], [0] * 6, [-2.5, -1.5, -0.5, 0.5, 1.5, 2.5], {6: (6, 0)}),
    "V2 90": ([0, 0], [45, -45], [0, 0], {1: (None, 0), 2: (math.sqrt(2), 0), 4: (math.sqrt(2), 0), 6: (math.sqrt(2), 0),
                                          8: (math.sqrt(2), 0)}),
    "V8 90": ([0, 0, 90, 90, 270, 270, 180, 180], [45, -45] * 4, [-1.5, -1.5, -0.5, -0.5, 0.5, 0.5, 1.5, 1.5],
              {1: (0, None), 4: (4 * math.sqrt(2), 0), 8: (4 * math.sqrt(2), 0)}),
}


def engine(pins, banks, places, rpm=RPM):
    """Its input: the first cylinder and copies. Crank angles of a mechanism count from its own x-axis, which the bank turns."""
    text = FRAME.format(rpm)
    for i, (pin, bank, place) in enumerate(zip(pins, banks, places)):
        kind = "repeat of='c0', " if i else "mechanism "
        text += f"&{kind}name='c{i}', origin=0,0,{place * SPACING}, angle={bank}, phase={90 + pin - bank} /\n"
    return text + (f"&joint mechanism='c0', name='O', type='ground', position=0,0 /\n"
                   f"&joint mechanism='c0', name='A', type='crank', pivot='O', radius={R} /\n"
                   f"&joint mechanism='c0', name='B', type='RRP', ends='A', lengths={ROD}, guide_point=0,0, guide_angle=90, branch=1 /\n"
                   f"&link name='piston', from='B', mass={PISTON}, inertia=0 /\n")


def factors(orders=8, samples=256):
    """A_k of the inertia force m r W^2 sum of A_k cos(k a) of a piston, a from its upper dead centre: the height is
    r cos a + sqrt(l^2 - r^2 sin(a)^2), whose harmonics fall by (r/2l)^2 from one to the next."""
    heights = [math.cos(a) + math.sqrt((ROD / R)**2 - math.sin(a)**2) for a in (2 * math.pi * i / samples for i in range(samples))]
    return [k * k * 2 / samples * sum(height * math.cos(2 * math.pi * i * k / samples) for i, height in enumerate(heights))
            for k in range(1, orders + 1)]


def expected(pins, banks, places):
    """Of every order the complex amplitudes of force and couple along xi and eta."""
    found = []
    for k, factor in enumerate(factors(), start=1):
        force, couple = [0, 0], [0, 0]
        for pin, bank, place in zip(pins, banks, places):
            size = PISTON * R * SPEED**2 * factor * cmath.exp(1j * k * math.radians(pin - bank))
            along = (-math.sin(math.radians(bank)), math.cos(math.radians(bank)))
            for i in range(2):
                force[i] += size * along[i]
            couple[0] -= place * SPACING * size * along[1]
            couple[1] += place * SPACING * size * along[0]
        found.append((force, couple))
    return found


def table(report, heading):
    """Rows of numbers below a line of the report."""
    lines = report.partition(heading)[2].splitlines()[1:]
    rows = {}
    for line in lines[2 if "order" in lines[0] else 3:]:
        words = line.split()
        if len(words) < 5 or not re.fullmatch(r"\d+|peak|rms", words[0]):
            break
        rows[words[0]] = [float(word) for word in words[1:]]
    return rows


def compare(what, came, value, scale):
    """Five digits are printed; what vanishes is 0."""
    if abs(value) < 1e-9 * scale:
        equal(what, came, 0.0)
    else:
        near(what, came, abs(value), 6e-5 * abs(value))


def engine_tests():
    """Forces and couples that vanish and those that are there, and how they turn."""
    for name, (pins, banks, places, book) in ENGINES.items():
        with Folder(input=engine(pins, banks, places)) as folder:
            run = Run(folder, "--check", "input.nml")
            if not run.done(f"{name}: --check"):
                continue
        axes, turning = table(run.out, "SHAKING FORCES AND COUPLES"), table(run.out, "across the shaft")
        equal(f"{name}: rows", list(axes), [str(k) for k in range(1, 9)] + ["peak", "rms"])
        unit = PISTON * R * SPEED**2
        for k, (force, couple) in enumerate(expected(pins, banks, places), start=1):
            row, turned = axes[str(k)], turning.get(str(k), [0.0] * 4)
            factor = abs(factors()[k - 1])
            equal(f"{name}, order {k}: nothing along the shaft", row[2], 0.0)
            for i in range(2):
                compare(f"{name}, order {k}: force {'xy'[i]}", row[i], force[i], unit)
                compare(f"{name}, order {k}: couple {'xy'[i]}", row[3 + i], couple[i], unit * SPACING)
                sense = (1j, -1j)[i]
                compare(f"{name}, order {k}: force, turning {i}", turned[i], (force[0] + sense * force[1]) / 2, unit)
                compare(f"{name}, order {k}: couple, turning {i}", turned[2 + i], (couple[0] + sense * couple[1]) / 2, unit * SPACING)
            # the books' numbers, that the sums above are these
            for i, size in enumerate(book.get(k, (0, 0))):
                if size is not None:
                    compare(f"{name}, order {k}: {('force', 'couple')[i]} of the book", math.hypot(*row[3 * i:3 * i + 2]),
                            size * unit * factor * (1, SPACING)[i], unit)
        if name == "V8 90":
            # like four masses on the pins: all of it turns with the crank
            compare("V8 90: couple of first order with the crank", turning["1"][2], math.sqrt(10) * unit * SPACING, unit)
            equal("V8 90: none against it", turning["1"][3], 0.0)
    with Folder(input=engine(*ENGINES["V8 90"][:3], rpm=-RPM)) as folder:
        run = Run(folder, "--check", "input.nml")
        if run.done("V8 90, clockwise: --check"):
            turning = table(run.out, "across the shaft")
            compare("V8 90, clockwise: with the crank", turning["1"][2], math.sqrt(10) * PISTON * R * SPEED**2 * SPACING, 1.0)
            equal("V8 90, clockwise: against it", turning["1"][3], 0.0)


def shaft_tests():
    """data/engine_in_space.nml with its balance shafts and without, and the compressor whose shaft is upright."""
    speed = 800 * math.pi / 30
    cylinder = (0.392 + 0.56 * 43 / 145) * 0.043 * speed**2
    # the second factor of A_k by its series in r/l (W. Thomson, Fundamentals of Automotive Engine Balance, 1978)
    ratio = 43 / 145
    second = ratio + ratio**3 / 4 + 15 / 128 * ratio**5 + 35 / 512 * ratio**7
    shaft = 0.9 * 3.9583e-3 * (2 * speed)**2
    bare = ["--set", "link(forward).mass=0", "--set", "link(backward).mass=0"]
    for what, settings, force, couple, roll in (
            ("without shafts", bare, 4 * cylinder * second, 0.0, 0.0),
            ("with shafts", [], 4 * cylinder * second - 2 * shaft, 2 * shaft * 0.020, shaft * math.hypot(0.010, 0.080))):
        run = Run(DATA, "--check", *settings, "engine_in_space.nml")
        if not run.done(f"inline four {what}"):
            continue
        axes = table(run.out, "SHAKING FORCES AND COUPLES")
        equal(f"inline four {what}: no first order", axes["1"], [0.0] * 6)
        # the series' next term, 1e-5 of a force of which the shafts leave a fiftieth
        near(f"inline four {what}: second order", axes["2"][1], force, 2e-5 * 4 * cylinder * second)
        compare(f"inline four {what}: pitching", axes["2"][3], couple, 1.0)
        compare(f"inline four {what}: rolling", axes["2"][5], roll, 1.0)
        check(f"inline four {what}: none of the plane's table", "complete balance" not in run.out, "no complete balance", run.out)
    run = Run(DATA, "--check", "suspended_compressor.nml")
    if run.done("compressor: --check"):
        check("compressor: its shaft", "across the shaft (0, 1, 0), as" in run.out, "(0, 1, 0)", run.out)
        axes = table(run.out, "SHAKING FORCES AND COUPLES")
        equal("compressor: no force along the shaft", [axes[str(k)][1] for k in range(1, 9)], [0.0] * 8)


SPACE_LOOKS_TESTS = [engine_tests, shaft_tests]
