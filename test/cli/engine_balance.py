"""Engine balance: the balance table by orders against the closed forms of textbooks, the torque-roll axis, shafts with
fractional ratios."""

import cmath
import math
import re

from harness import Folder, Run, check, equal, near
from several_mechanisms import LINKAGE, PLACES
from several_mechanisms import FRAME as STAND
from space import DATA, VALIDATION, against_reference, rows

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
    """Input of an engine: the first cylinder and copies. Crank angles of a mechanism count from its own x-axis, which the
    bank rotates."""
    text = FRAME.format(rpm)
    for i, (pin, bank, place) in enumerate(zip(pins, banks, places)):
        kind = "repeat of='c0', " if i else "mechanism "
        text += f"&{kind}name='c{i}', origin=0,0,{place * SPACING}, angle={bank}, phase={90 + pin - bank} /\n"
    return text + (f"&joint mechanism='c0', name='O', type='ground', position=0,0 /\n"
                   f"&joint mechanism='c0', name='A', type='crank', pivot='O', radius={R} /\n"
                   f"&joint mechanism='c0', name='B', type='RRP', ends='A', lengths={ROD}, guide_point=0,0, guide_angle=90, "
                   "branch=1 /\n"
                   f"&link name='piston', from='B', mass={PISTON}, inertia=0 /\n")


def factors(orders=8, samples=256):
    """A_k of the inertia force m r W^2 sum of A_k cos(k a) of a piston, a from its upper dead centre: the height is
    r cos a + sqrt(l^2 - r^2 sin(a)^2), whose harmonics fall by (r/2l)^2 from one to the next."""
    heights = [math.cos(a) + math.sqrt((ROD / R)**2 - math.sin(a)**2) for a in (2 * math.pi * i / samples for i in range(samples))]
    return [k * k * 2 / samples * sum(height * math.cos(2 * math.pi * i * k / samples) for i, height in enumerate(heights))
            for k in range(1, orders + 1)]


def expected(pins, banks, places):
    """The complex amplitudes of force and couple along xi and eta, for every order."""
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
    """Compares five printed digits; what vanishes is printed as 0."""
    if abs(value) < 1e-9 * scale:
        equal(what, came, 0.0)
    else:
        near(what, came, abs(value), 6e-5 * abs(value))


def engine_tests():
    """Forces and couples of engines by orders agree with closed forms."""
    for name, (pins, banks, places, book) in ENGINES.items():
        with Folder(input=engine(pins, banks, places)) as folder:
            run = Run(folder, "--check", "input.nml")
            if not run.done(f"{name}: --check"):
                continue
        axes, turning = table(run.out, "SHAKING FORCES AND COUPLES"), table(run.out, "normal to the first shaft")
        equal(f"{name}: rows", list(axes), [str(k) for k in range(1, 9)] + ["peak", "rms"])
        unit = PISTON * R * SPEED**2
        for k, (force, couple) in enumerate(expected(pins, banks, places), start=1):
            row, turned = axes[str(k)], turning.get(str(k), [0.0] * 4)
            factor = abs(factors()[k - 1])
            equal(f"{name}, order {k}: no component along the shaft", row[2], 0.0)
            for i in range(2):
                compare(f"{name}, order {k}: force {'xy'[i]}", row[i], force[i], unit)
                compare(f"{name}, order {k}: couple {'xy'[i]}", row[3 + i], couple[i], unit * SPACING)
                sense = (1j, -1j)[i]
                compare(f"{name}, order {k}: force, turning {i}", turned[i], (force[0] + sense * force[1]) / 2, unit)
                compare(f"{name}, order {k}: couple, turning {i}", turned[2 + i], (couple[0] + sense * couple[1]) / 2,
                        unit * SPACING)
            # the textbooks' values, to check the sums above
            for i, size in enumerate(book.get(k, (0, 0))):
                if size is not None:
                    compare(f"{name}, order {k}: {('force', 'couple')[i]} of the book", math.hypot(*row[3 * i:3 * i + 2]),
                            size * unit * factor * (1, SPACING)[i], unit)
        if name == "V8 90":
            # like four masses on the pins: all of it turns with the crank
            compare("V8 90: couple of first order with the crank", turning["1"][2], math.sqrt(10) * unit * SPACING, unit)
            equal("V8 90: no component against the crank", turning["1"][3], 0.0)
    with Folder(input=engine(*ENGINES["V8 90"][:3], rpm=-RPM)) as folder:
        run = Run(folder, "--check", "input.nml")
        if run.done("V8 90, clockwise: --check"):
            turning = table(run.out, "normal to the first shaft")
            compare("V8 90, clockwise: with the crank", turning["1"][2], math.sqrt(10) * PISTON * R * SPEED**2 * SPACING, 1.0)
            equal("V8 90, clockwise: component against the crank", turning["1"][3], 0.0)


def torque_of_four(speed):
    """Second order (N m) of the torque on the crank of data/engine_in_space.nml: of four cylinders half of d/dt of the sum of m v^2 and
    J w^2, by its sums over a turn."""
    r, rod, samples = 0.043, 0.145, 64
    total = 0
    for k in range(samples):
        angle = 2 * math.pi * k / samples
        pin = cmath.rect(r, angle)
        root = math.sqrt(rod**2 - pin.real**2)
        piston = r * math.cos(angle) * (1 + pin.imag / root)
        turn = 1j * (piston - pin) / rod
        total += (0.392 * piston**2 + 0.56 * abs(1j * pin + 0.043 * turn)**2 + 2.0e-3 * abs(turn)**2) * cmath.exp(-2j * angle)
    return 4 * speed**2 * abs(2 * total / samples)


def shaft_tests():
    """Balance shafts remove exactly the orders they are made for.

    data/engine_in_space.nml and data/inline_twin.nml with and without their shafts, and a compressor with an upright shaft.
    """
    speed = 800 * math.pi / 30
    cylinder = (0.392 + 0.56 * 43 / 145) * 0.043 * speed**2
    # the second factor of A_k by its series in r/l (W. Thomson, Fundamentals of Automotive Engine Balance, 1978)
    ratio = 43 / 145
    second = ratio + ratio**3 / 4 + 15 / 128 * ratio**5 + 35 / 512 * ratio**7
    shaft = 0.9 * 3.9583e-3 * (2 * speed)**2
    bare = ["--set", "link(forward).mass=0", "--set", "link(backward).mass=0"]
    # with a motor on the block the torque's second order acts within the block; with the engine's flywheel it acts on the block
    text = (DATA / "engine_in_space.nml").read_text()
    motor = text.replace("held_by = 'flywheel', flywheel_inertia = 0.12", "held_by = 'motor'")
    for what, text, settings, force, couple, roll in (
            ("without shafts, flywheel", text, bare, 4 * cylinder * second, 0.0, torque_of_four(speed)),
            ("without shafts", motor, bare, 4 * cylinder * second, 0.0, 0.0),
            ("with shafts", motor, [], 4 * cylinder * second - 2 * shaft, 2 * shaft * 0.020, shaft * math.hypot(0.010, 0.080))):
        with Folder(input=text) as folder:
            run = Run(folder, "--check", *settings, "input.nml")
        if not run.done(f"inline four {what}"):
            continue
        axes = table(run.out, "SHAKING FORCES AND COUPLES")
        equal(f"inline four {what}: no first order", axes["1"], [0.0] * 6)
        # the next term of the series, 1e-5 of a force that the shafts reduce to a fiftieth
        near(f"inline four {what}: second order", axes["2"][1], force, 2e-5 * 4 * cylinder * second)
        compare(f"inline four {what}: pitching", axes["2"][3], couple, 1.0)
        compare(f"inline four {what}: rolling", axes["2"][5], roll, 1.0)
        check(f"inline four {what}: none of the plane's table", "complete balance" not in run.out, "no complete balance", run.out)
    # half of the reciprocating masses at both ends of the spacing, turning against the crank
    speed = 40 * math.pi
    couple = (0.34 + 0.38 * 35 / 115) / 2 * 0.034 * 0.090 * speed**2
    run = Run(DATA, "--check", "--set", "link(front).mass=0", "--set", "link(back).mass=0", "inline_twin.nml")
    if run.done("inline twin without its shaft"):
        compare("inline twin: couple against the crank", table(run.out, "normal to the first shaft")["1"][3], couple, 1.0)
    run = Run(DATA, "--check", "inline_twin.nml")
    if run.done("inline twin"):
        near("inline twin: couple with its shaft", table(run.out, "normal to the first shaft")["1"][3], 0, 2e-4)
        equal("inline twin: no force of first order", table(run.out, "SHAKING FORCES AND COUPLES")["1"][:3], [0.0] * 3)
    run = Run(DATA, "--check", "suspended_compressor.nml")
    if run.done("compressor: --check"):
        check("compressor: its shaft", "normal to the first shaft (0, 1, 0), rotating" in run.out, "(0, 1, 0)", run.out)
        axes = table(run.out, "SHAKING FORCES AND COUPLES")
        equal("compressor: no force along the shaft", [axes[str(k)][1] for k in range(1, 9)], [0.0] * 8)
        # rigid ground carries the weights, whoever holds the speed
        for holder in ("motor", "flywheel"):
            held = [Run(DATA, "--check", "--set", f"drive.held_by={holder}", *more, "suspended_compressor.nml")
                    for more in ([], ["--set", "gravity.acceleration=98"])]
            if all(one.done(f"compressor, {holder}: --check") for one in held):
                equal(f"compressor, {holder}: weights are no part of it", *(table(one.out, "SHAKING FORCES") for one in held))


BLOCK = """\
&case tasks='separation' /
&drive speed_rpm=600 /
&mechanism name='m', origin=0,0,0 {4} /
&joint name='O', type='ground', position=0,0 /
&joint name='A', type='crank', pivot='O', radius=0.1 /
&link name='wheel', from='O', to='A', mass=0, inertia=0 /
&frame mass=50, inertia={0}, origin=0,0, dof='xi','eta','zeta','rot_xi','rot_eta','psi' /
&support position={1}, stiffness={2}, damping={3} /
"""


def torque_roll_tests():
    """The torque-roll axis agrees with a calculation by hand.

    Held by springs in proportion to its mass, the block has this motion as a mode.
    """
    # J^-1 e of J = [[3, .2, .5], [.2, 4, -.3], [.5, -.3, 2]] by Cramer's rule
    j = [[3.0, 0.2, 0.5], [0.2, 4.0, -0.3], [0.5, -0.3, 2.0]]

    def cross(a, b):
        return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]

    for what, key, shaft in (("zeta", "", (0, 0, 1)), ("inclined", ", axis=0,1,1", (0, math.sqrt(0.5), math.sqrt(0.5)))):
        rows_of = (cross(j[1], j[2]), cross(j[2], j[0]), cross(j[0], j[1]))
        # the adjugate of a symmetric matrix is symmetric
        axis = [sum(a * b for a, b in zip(row, shaft)) for row in rows_of]
        axis = [a / math.hypot(*axis) for a in axis]
        angle = math.degrees(math.acos(sum(a * b for a, b in zip(axis, shaft))))
        with Folder(input=BLOCK.format("3,4,2,0.2,0.5,-0.3", "0,0,0", "1e4,1e4,1e4", "1,1,1", key)) as folder:
            run = Run(folder, "--check", "input.nml")
            if run.done(f"torque-roll axis, {what}"):
                words = re.search(r"TORQUE-ROLL AXIS of the unsupported machine: direction \(([^)]*)\), (\S+) deg", run.flat)
                check(f"torque-roll axis, {what}: reported", words, "TORQUE-ROLL AXIS", run.out)
                for k, word in enumerate(words[1].split(",") if words else ()):
                    near(f"torque-roll axis, {what}: {k}", float(word), axis[k], 6e-5)
                near(f"torque-roll axis, {what}: angle", float(words[2]) if words else math.nan, angle, 0.006)
            if Run(folder, "-q", "input.nml").done(f"torque-roll axis, {what}: table"):
                row, = rows(folder / "input" / "torque_roll.csv")
                for k, name in enumerate("xyz"):
                    # a wheel without mass causes only rounding errors
                    near(f"torque-roll axis, {what}: axis_{name}", float(row[f"axis_{name}"]), axis[k], 1e-13)
                    near(f"torque-roll axis, {what}: center_{name}", float(row[f"center_{name}_m"]), 0, 1e-13)
                near(f"torque-roll axis, {what}: angle_deg", float(row["angle_deg"]), angle, 1e-9)
    # principal axes and mounts in the planes of symmetry: the roll is a mode of its own; mounts below F couple it with xi (damping
    # in proportion to stiffness: real modes, whose parts add up)
    four = "".join(f"&support position={x},{{0}},{z}, stiffness=4e4,9e4,5e4, damping=20,45,25 /\n"
                   for x in (-0.3, 0.3) for z in (-0.4, 0.4))
    for what, height, whole in (("centred", 0.0, True), ("low", -0.25, False)):
        text = BLOCK.format("3,4,2", "0,0,0", "0,0,0", "0,0,0", "") + four.format(height)
        with Folder(input=text) as folder:
            run = Run(folder, "-o", "out", "input.nml")
            if not run.done(f"torque-roll, {what}"):
                continue
            table = rows(folder / "out" / "separation.csv")
            shares = {row["mode"]: float(row["energy_torque_roll"]) for row in table}
            psi = {row["mode"]: float(row["energy_psi"]) for row in table}
            near(f"torque-roll, {what}: all of it", sum(shares.values()), 1, 1e-9)
            for mode, share in shares.items():
                # the axis is zeta: the share of a mode about this axis is its energy of psi
                near(f"torque-roll, {what}: mode {mode}", share, psi[mode], 1e-9)
            check(f"torque-roll, {what}: whole", (max(shares.values()) > 1 - 1e-9) == whole, whole, shares)
            check(f"torque-roll, {what}: line", "motion about the torque-roll axis: " in run.flat, "the line", run.out)


SHAFT = """\
&mechanism name='cam', origin=0.05,0.1{1}, ratio={0}, phase=30 /
&joint mechanism='cam', name='K', type='ground', position=0,0 /
&joint mechanism='cam', name='k', type='crank', pivot='K', radius=0.03 /
&link name='cam', from='K', to='k', mass=0.5, inertia=0.002, center=0.02,0.005 /
"""
TABLES = ("multipliers", "harmonics", "response", "quantities", "supports", "supports_history", "supports_harmonics", "power",
          "probes", "probes_history", "probes_harmonics")
ORDERED = "'stability','response','forces','power'"
RATIO_TASKS = (f"&case tasks={ORDERED} /\n&model frame='exact' /\n"
               "&response points=64, harmonics={}, quantities='f','psi' /\n")


# Of SavedResults/file1_res.mat, stage0 (data/powertrain.nml says where): natural frequencies (Hz), and of each mode the parts (%) of
# the kinetic energy along x, y, z and about them.
PUBLISHED = (
    (9.610674, (29.713703, 27.501222, 2.167606, 2.470990, 18.693761, 19.452719)),
    (11.579060, (17.613710, 68.403245, 4.680076, 1.915775, 6.611387, 0.775807)),
    (12.815326, (17.465307, 0.474608, 79.763722, 1.669170, 0.620929, 0.006263)),
    (16.372142, (34.709423, 2.214751, 12.270667, 6.802197, 22.356795, 21.646167)),
    (24.621964, (0.079736, 1.384062, 1.080884, 37.218274, 11.734044, 48.503000)),
    (26.047577, (0.418121, 0.022112, 0.037045, 49.923594, 39.983085, 9.616043)),
)


def published_tests():
    """Modes of data/powertrain.nml agree with published values."""
    free = [option for i in (1, 2, 3) for option in ("--set", f"support({i}).damping=0,0,0")]
    with Folder() as folder:
        run = Run(folder, "-q", *free, "--set", "gravity.acceleration=0", "-o", "out", DATA / "powertrain.nml")
        run.done("powertrain")
        found = {row["mode"]: row for row in rows(folder / "out" / "separation.csv")}
        equal("powertrain: modes", len(found), len(PUBLISHED))
        for row, (frequency, parts) in zip(found.values(), PUBLISHED):
            near(f"powertrain, {frequency} Hz", float(row["frequency_Hz"]), frequency, 6e-7)
            for name, part in zip(("xi", "eta", "zeta", "rot_xi", "rot_eta", "psi"), parts):
                near(f"powertrain, {frequency} Hz: {name}", 100 * float(row[f"energy_{name}"]), part, 6e-7)


def ratio_tests():
    """Results do not depend on how fractional ratios are written.

    The drive may turn at the given speed with fractional ratios, or once in the whole period with integer ratios.
    """
    pins, banks, places, _ = ENGINES["I3"]
    own = "".join(line.replace("&joint ", "&joint mechanism='m', ") + "\n" for line in LINKAGE.format(*PLACES).splitlines())
    plane = "&drive speed_rpm={0} /\n" + STAND + "&mechanism name='m', ratio={1} /\n" + own
    space = engine(pins, banks, places, rpm="{0}").replace("&mechanism name='c0'", "&mechanism ratio={1}, name='c0'")
    for what, text, rpm, place in (("plane", plane, 240.0, ""), ("space", space, 700.0, ",0.02")):
        for ratio, turns, slow in (("0.5", 2, 1), ("-3,2", 2, -3), ("0.333333333333", 3, 1), ("17,23", 23, 17)):
            if turns > 3 and what == "space":
                continue
            name = f"ratio {ratio}, {what}"
            one = RATIO_TASKS.format(min(6 * turns, 30)) + text.format(rpm, 1) + SHAFT.format(ratio, place)
            other = RATIO_TASKS.format(min(6 * turns, 30)) + text.format(repr(rpm / turns), turns) + SHAFT.format(slow, place)
            with Folder(one=one, other=other) as folder:
                runs = [Run(folder, which) for which in ("one.nml", "other.nml")]
                if not all([run.done(f"{name}: run {k}") for k, run in enumerate(runs)]):
                    continue
                found = [{table: rows(folder / which / f"{table}.csv")
                          for table in TABLES[:8 if what == "space" else 11]} for which in ("one", "other")]
                compare_ratios(name, turns, runs, found)
                compare_drive(name, turns, found)
                compare_reports(name, turns, runs)
                reported = Run(folder, "--check", "one.nml")
                order = {2: "0.5", 3: "0.3333", 23: "0.7391"}[turns] if slow > 0 else "1.5"
                check(f"{name}: its order in the balance table", re.search(rf"^ +{re.escape(order)} ", reported.out, re.M), order,
                      reported.out)
    with Folder(input=RATIO_TASKS.format(4) + plane.format(240, 1) + SHAFT.format("0.5", "")) as folder:
        sweep = "&sweep parameter='drive.speed_rpm', from={}, to={}, count=3 /\n"
        text = (folder / "input.nml").read_text().replace(ORDERED, "'sweep'")
        slow = RATIO_TASKS.format(4).replace(ORDERED, "'sweep'") + plane.format(120, 2) + SHAFT.format("1", "")
        (folder / "one.nml").write_text(text + sweep.format(200, 400))
        (folder / "other.nml").write_text(slow + sweep.format(100, 200))
        if Run(folder, "-q", "one.nml").done("ratio: sweep") and Run(folder, "-q", "other.nml").done("ratio: slow sweep"):
            for a, b in zip(rows(folder / "one" / "sweep.csv"), rows(folder / "other" / "sweep.csv")):
                near("ratio: rho_max of a sweep", float(a["rho_max"]), float(b["rho_max"]), 1e-10)


# validation/space/twin_balance_shaft.nml with ratio=-1,2 by validation/space/newton_euler.py, exact, at 625 rpm: greatest abs(rho)
# over the two turns of the period, rms of the six coordinates.
HALF = (0.785660339307, (1.3510204626367e-06, 5.5859292676651e-05, 6.7120551721022e-05, 1.2807738869258e-04, 1.8906845242009e-04,
                         3.0899669780043e-05))


def half_speed_tests():
    """A shaft at half speed satisfies d'Alembert's principle."""
    text = re.sub(r"&case title = ('[^']*') /", "&response points=64, harmonics=60 /\n&model frame='exact' /\n"
                  "&case title = \\1, tasks='stability','response' /", (VALIDATION / "twin_balance_shaft.nml").read_text())
    with Folder(input=text.replace("ratio=-1", "ratio=-1,2")) as folder:
        if Run(folder, "-q", "-o", "out", "--set", "drive.speed_rpm=625", "input.nml").done("half the speed"):
            against_reference(folder, "half the speed", *HALF)


def compare_drive(name, turns, found):
    """Compares forces on the ground and the drive: its torque is smaller by the factor by which it turns faster, its power
    the same."""
    for which in ("supports", "supports_history", "supports_harmonics", "power"):
        a, b = (one[which] for one in found)
        equal(f"{name}: rows of {which}", len(a), len(b))
        for key in b[0]:
            if key in ("support",) or key.endswith(("_error", "_error_N", "_error_N_m", "_error_Nm", "_phase_rad")):
                continue
            factor = 1.0
            if key.endswith("crank_deg"):
                factor = turns
            elif key == "order" or key.endswith("_strongest_order") or key.endswith("torque_Nm"):
                factor = 1 / turns
            one, other = ([float(row[key]) for row in table] for table in (a, b))
            # angles of peaks are accurate to the root of rounding
            scale = (1e-5 if key.endswith("peak_crank_deg") else 1e-10) * factor * max(abs(x) for x in other)
            near(f"{name}: {key} of {which}", max(abs(x - factor * y) for x, y in zip(one, other)), 0, scale + 1e-11)
    near(f"{name}: the power is torque times the drive's speed", float(found[0]["power"][5]["torque_Nm"])
         * 2 * math.pi * turns / float(found[0]["power"][-1]["t_s"]), float(found[0]["power"][5]["drive_W"]),
         1e-9 * abs(float(found[0]["power"][5]["drive_W"])))


def compare_reports(name, turns, runs):
    """Compares the report's lines on forces and the drive, in orders and angles of the drive."""
    reported = [[re.findall(pattern, run.out, re.M) for run in runs] for pattern in
            (r"peak of the total force: (\S+) N at crank angle (\S+) deg", r"on the vibrating frame +(\S+) +(\S+) +(\S+) +(\S+) +(\S+)",
             r"^ *total .* (\S+) \(", r"maximum of the drive (\S+) W")]
    for pairs, factors in zip(reported, ((1, turns), (1 / turns, None, turns, 1 / turns, None), (1 / turns,), (1,))):
        check(f"{name}: lines of the report", all(pairs), "a line", runs[0].out)
        if not all(pairs):
            continue
        a, b = ([one] if isinstance(one, str) else one for one in (pairs[0][0], pairs[1][0]))
        for x, y, factor in zip(a, b, factors):
            if factor:
                scale = abs(factor * float(y))
                near(f"{name}: reported {x}", float(x), factor * float(y), 2e-3 * scale + 0.1 * turns * (factor == turns))


def compare_ratios(name, turns, runs, found):
    """Compares the same machine with both kinds of ratios. Rounding of the ratios is 1e-16 of the angles, of the loads by
    orders 1e-13."""
    rho = [sorted(abs(complex(float(row["re"]), float(row["im"]))) for row in one["multipliers"]) for one in found]
    near(f"{name}: multipliers", max(abs(a - b) for a, b in zip(*rho)), 0, 1e-11)
    for a, b in zip(found[0]["quantities"], found[1]["quantities"]):
        near(f"{name}: {a['quantity']}", float(a["value"]) / float(b["value"]) - 1, 0, 1e-10)
    for a, b in zip(found[0]["harmonics"], found[1]["harmonics"]):
        near(f"{name}: order {b['order']}", float(a["order"]), int(b["order"]) / turns, 1e-15 * turns)
        near(f"{name}: frequency of order {b['order']}", float(a["frequency_Hz"]), float(b["frequency_Hz"]),
             1e-13 * float(b["frequency_Hz"]))
    for key in ("xi_m_amplitude", "psi_rad_amplitude"):
        scale = max(abs(float(row[key])) for row in found[1]["harmonics"])
        apart = max(abs(float(a[key]) - float(b[key])) for a, b in zip(found[0]["harmonics"], found[1]["harmonics"]))
        near(f"{name}: {key}", apart, 0, 1e-10 * scale)
    for which in ("probes", "probes_harmonics", "probes_history"):
        for a, b in zip(found[0].get(which, ()), found[1].get(which, ())):
            for key in ("v_rms_band_mm_s", "vx_p_m_s_amplitude", "t_s"):
                if key in a:
                    near(f"{name}: {key} of {which}", float(a[key]), float(b[key]), 1e-10 * (abs(float(b[key])) + 1e-3))
            if "crank_deg" in a:
                near(f"{name}: crank of {which}", float(a["crank_deg"]), turns * float(b["crank_deg"]), 1e-9)
            if "order" in a:
                near(f"{name}: order of {which}", float(a["order"]), int(b["order"]) / turns, 1e-15 * turns)
    near(f"{name}: crank angle", float(found[0]["response"][-1]["crank_deg"]), 360.0 * turns, 1e-9)
    near(f"{name}: period", float(found[0]["response"][-1]["t_s"]) / float(found[1]["response"][-1]["t_s"]), 1, 1e-13)
    check(f"{name}: period", f" s, {turns} turns" in runs[0].flat, f"{turns} turns", runs[0].out[:900])
    halving = [re.search(r"halve within (\S+) turns", run.flat) for run in runs]
    if all(halving):
        near(f"{name}: halves in turns", float(halving[0][1]) / float(halving[1][1]), turns, 0.01 * turns)


ENGINE_BALANCE_TESTS = [published_tests, engine_tests, shaft_tests, torque_roll_tests, ratio_tests, half_speed_tests]
