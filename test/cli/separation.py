"""The task `separation` against closed forms: separation.csv, the report, refused input."""

import csv
import math

from broken_inputs import SOUND
from harness import Folder, Run, check, equal, files, near
from plots import GNUPLOT, ROCKING, drawn

HEADER = ("mode,order,speed_rpm,frequency_Hz,frequency_error_Hz,damping_ratio,share,excitation_Hz,distance_percent,"
          "distance_error_percent,energy_xi,energy_eta,energy_psi,state")
ENERGIES = ("energy_xi", "energy_eta", "energy_psi")
# A crank without mass in a frame on springs: constant coefficients. The block stands on the frame, a height above F.
MASS, INERTIA, SPRINGS = 18.0, 0.8, (4.0e5, 9.0e5, 5.0e4)
BARE = f"""\
&case tasks = 'separation' /
&drive speed_rpm = 750.0 /
&joint name='O', type='ground', position=0.0, 0.0 /
&joint name='A', type='crank', pivot='O', radius=0.1 /
&link name='crank', from='O', to='A', mass=0.0, inertia=0.0 /
&link name='block', from='O', mass=0.0, inertia=0.0, center=0.0,0.0 /
&frame mass={MASS}, inertia={INERTIA}, origin=0.0,0.3 /
&foundation stiffness={SPRINGS[0]},0,0,0,{SPRINGS[1]},0,0,0,{SPRINGS[2]}, damping=0.1,0.1,0.01 /
"""
SWEEP = "&sweep parameter='drive.speed_rpm', from=750, to=900, count=4 /\n"


def rows(folder):
    """Header and rows of separation.csv."""
    lines = [line for line in (folder / "separation.csv").read_text().splitlines() if line[0] != "#"]
    return lines[0], list(csv.DictReader(lines))


def compare(what, found, speed, modes, orders=4, margin=20.0):
    """Compares rows at one speed with frequencies (Hz) and their energies."""
    equal(f"{what}: rows", [(int(row["mode"]), int(row["order"])) for row in found],
          [(mode + 1, order + 1) for mode in range(len(modes)) for order in range(orders)])
    for row in found:
        frequency, energies = modes[int(row["mode"]) - 1]
        excitation = int(row["order"]) * speed / 60
        distance = 100 * abs(frequency / excitation - 1)
        name = f"{what}: mode {row['mode']}, order {row['order']}"
        # The dampers take less than 1e-7 of a frequency.
        near(f"{name}, frequency", float(row["frequency_Hz"]), frequency, 1e-6 * frequency)
        near(f"{name}, order", float(row["excitation_Hz"]), excitation, 1e-12 * excitation)
        near(f"{name}, distance", float(row["distance_percent"]), distance, 1e-3)
        near(f"{name}, error", float(row["distance_error_percent"]), 0, 1e-3)
        near(f"{name}, share", float(row["share"]), 1, 1e-9)
        for key, energy in zip(ENERGIES, energies):
            near(f"{name}, {key}", float(row[key]), energy, 1e-5)
        equal(f"{name}, state", row["state"], "pass" if distance >= margin else "fail")


def test_diagonal():
    """Separations of uncoupled modes agree with the closed form.

    f = sqrt(k / m) / (2 pi), and each mode moves along one axis.
    """
    modes = sorted((math.sqrt(spring / inertia) / (2 * math.pi), tuple(float(i == k) for k in range(3)))
                   for i, (spring, inertia) in enumerate(zip(SPRINGS, (MASS, MASS, INERTIA))))
    with Folder(input=BARE) as folder:
        run = Run(folder, "input.nml")
        if not run.done("separation"):
            return
        equal("separation: files", files(folder / "input"), ["separation.csv"])
        header, found = rows(folder / "input")
        equal("separation: header", header, HEADER)
        compare("separation", found, 750.0, modes)
        check("separation: report", "SEPARATION of the modes from orders 1 to 4 at 750 rpm" in run.out, "a section", run.out)
        check("separation: lines of the report", max(map(len, run.out[run.out.index("SEPARATION"):].splitlines())) <= 80,
              "80 columns", run.out)
        other = ["-s", "separation.orders=2", "-s", "separation.margin_percent=61", "-s", "drive.speed_rpm=-800"]
        if Run(folder, "-q", "input.nml", *other).done("separation, other orders"):
            compare("separation, other orders", rows(folder / "input")[1], 800.0, modes, 2, 61.0)
        if Run(folder, "-q", "input.nml", "-s", "frame.dof='eta','psi'").done("separation, two freedoms"):
            compare("separation, two freedoms", rows(folder / "input")[1], 750.0, [mode for mode in modes if mode[1][0] == 0])


def test_coupled():
    """Separations of coupled modes agree with a calculation by hand.

    A block of mass b at the height h above F: M = (m + b, -b h; -b h, J + b h^2) for xi and psi; eta is uncoupled.
    """
    block, height = 6.0, 0.3
    m11, m12, m22 = MASS + block, -block * height, INERTIA + block * height**2
    k1, k2, k3 = SPRINGS
    # det(K - w M) = 0, w = omega^2
    a, b, c = m11 * m22 - m12**2, -(k1 * m22 + k3 * m11), k1 * k3
    modes = [(math.sqrt(k2 / m11) / (2 * math.pi), (0.0, 1.0, 0.0))]
    for sign in (-1, 1):
        w = (-b + sign * math.sqrt(b * b - 4 * a * c)) / (2 * a)
        ratio = (k1 - w * m11) / (w * m12)
        xi, psi = m11 + m12 * ratio, ratio * (m12 + m22 * ratio)
        modes.append((math.sqrt(w) / (2 * math.pi), (xi / (xi + psi), 0.0, psi / (xi + psi))))
    modes.sort()
    # O stands at the height 0.3 above F.
    text = BARE.replace("origin=0.0,0.3", f"origin=0.0,{height}").replace("name='block', from='O', mass=0.0",
                                                                       f"name='block', from='O', mass={block}")
    with Folder(input=text) as folder:
        if Run(folder, "-q", "input.nml").done("separation, coupled"):
            compare("separation, coupled", rows(folder / "input")[1], 750.0, modes)
            energies = [energy for _, mode in modes for energy in mode]
            check("separation, coupled: shares of the energy", any(0.02 < energy < 0.98 for energy in energies), "mixed", energies)


def test_range():
    """Over a range of speeds the smallest separation is reported.

    It is zero if the range contains a resonance. 750 to 900 rpm: order 2 from 25 to 30 Hz, order 3 from 37.5 to 45.
    """
    with Folder(input=BARE + SWEEP) as folder:
        run = Run(folder, "input.nml")
        if not run.done("separation, range"):
            return
        found = {(int(row["mode"]), int(row["order"])): row for row in rows(folder / "input")[1]}
        frequencies = sorted(math.sqrt(spring / inertia) / (2 * math.pi)
                             for spring, inertia in zip(SPRINGS, (MASS, MASS, INERTIA)))
        for (mode, order), row in found.items():
            frequency = frequencies[mode - 1]
            speed = min(max(60 * frequency / order, 750.0), 900.0)
            distance = 100 * abs(frequency / (order * speed / 60) - 1)
            near(f"range: mode {mode}, order {order}, speed", float(row["speed_rpm"]), speed, 1e-3)
            near(f"range: mode {mode}, order {order}, distance", float(row["distance_percent"]), distance, 1e-3)
            equal(f"range: mode {mode}, order {order}, state", row["state"], "pass" if distance >= 20 else "fail")
        check("range: a resonance lies in it", any(float(row["distance_percent"]) == 0 for row in found.values()), "zero", found)
        check("range: report", "at 750 to 900 rpm" in run.out, "its ends", run.out)
        # with another swept parameter the operating speed is used, as without a sweep
        Run(folder, "-q", "input.nml", "-s", "sweep.parameter='frame.mass'", "-o", "mass").done("separation, other sweep")
        equal("separation, other sweep", {row["speed_rpm"] for row in rows(folder / "mass")[1]}, {"7.5000000000000000E+002"})


def test_averaged_and_unstable():
    """Averaged models and unstable machines are named in the files."""
    averaged = SOUND.replace("'stability', 'response'", "'separation'") + "&model frame='rest', coefficients='averaged' /\n"
    with Folder(input=averaged) as folder:
        if Run(folder, "-q", "input.nml").done("separation, averaged"):
            text = (folder / "input" / "separation.csv").read_text()
            check("separation, averaged: model", "# model: averaged\n" in text, "the model", text)
            row = rows(folder / "input")[1][0]
            near("separation, averaged: energies", sum(float(row[key]) for key in ENERGIES), 1, 1e-12)
    with Folder(input=ROCKING.replace("'sweep','boundary'", "'separation'")) as folder:
        run = Run(folder, "input.nml", "--fail-if-unstable")
        equal("separation, unstable: code", run.code, 10)
        check("separation, unstable", "a free vibration grows" in run.out, "the verdict", run.out)


def test_drawn():
    """Separations are drawn with modes, orders and margins."""
    for what, text in (("one speed", BARE), ("range", BARE + SWEEP), ("two freedoms", BARE.replace("&frame ", "&frame dof='xi','psi', ")),
                       ("many orders", BARE + "&separation orders=50, margin_percent=150 /\n")):
        with Folder(input=text) as folder:
            if Run(folder, "-q", "input.nml").done(f"separation drawn, {what}"):
                texts = drawn(f"separation drawn, {what}", folder / "input").get("separation", "")
                for word in ("frequency (Hz)", "crank speed (rpm)", "mode 2", "1×", "margin"):
                    check(f"separation drawn, {what}, {word}", not GNUPLOT or word in texts, word, texts)


def test_refused():
    """Invalid margins and orders are refused and nothing is written."""
    for what, group, message in (
            ("no order", "&separation orders=0 /", "input.nml:9: &separation: orders = 0: must be at least 1"),
            ("no margin", "&separation margin_percent=0 /", "input.nml:9: &separation: margin_percent = 0: must be positive"),
            ("unknown key", "&separation margin=10 /",
             "input.nml:9: &separation: unknown key 'margin': allowed are orders, margin_percent"),
            ("standstill", "&sweep parameter='drive.speed_rpm', from=-750, to=900, count=4 /",
             "input.nml:9: &sweep: to = 900: the range must not include standstill: 'from' and 'to' must have the same sign"),
            ("no range", "&sweep parameter='drive.speed_rpm', from=750, to=750, count=4 /",
             "input.nml:9: &sweep: to = 750: 'from' and 'to' must differ if there are several values")):
        with Folder(input=BARE + group + "\n") as folder:
            Run(folder, "input.nml").refused(f"separation, {what}", 2, message)
            equal(f"separation, {what}: nothing written", files(folder), ["input.nml"])


def test_gyroscopic_design():
    """A design for separation includes gyroscopic moments like the task.

    Dampers of 0.4 % move the task's frequencies by 1e-5 at most.
    """
    text = ("&case tasks='separation','design' /\n&drive speed_rpm=400 /\n&joint name='O', type='ground', position=0,0 /\n"
            "&joint name='A', type='crank', pivot='O', radius=0.1 /\n"
            "&link name='rotor', from='O', to='A', mass=1.999999, inertia=0.28791667,0.28791667,0.5625 /\n"
            "&frame mass=1e-6, inertia=1e-9,1e-9,1e-9, origin=0,0,0, dof='xi','eta','zeta','rot_xi','rot_eta','psi' /\n"
            "&support position=0,0,-0.5, stiffness=800,800,800, damping=0.2263,0.2263,0.2263 /\n"
            "&support position=0,0, 0.5, stiffness=800,800,0, damping=0.2263,0.2263,0 /\n"
            f"&foundation stiffness={'0,' * 14}100{',0' * 21}, damping=0,0,0.1,0,0,0 /\n"
            "&design parameter='frame.mass', from=1e-6, to=2e-6 /\n&objective quantity='added_mass' /\n"
            "&constraint quantity='separation', at_least=1 /\n&model frame='rest' /\n")
    with Folder(input=text) as folder:
        if Run(folder, "input.nml").done("gyroscopic design"):
            table = [line.split(",") for line in (folder / "input" / "separation.csv").read_text().splitlines() if line[0] != "#"]
            task = min(float(row[table[0].index("distance_percent")]) for row in table[1:])
            goals = [line.split(",") for line in (folder / "input" / "design_goals.csv").read_text().splitlines() if line[0] != "#"]
            found = float(goals[2][goals[0].index("before")])
            # 100 (f / (k n) - 1) near 15
            near("gyroscopic design", found, task, 1e-5 * (100 + task))


SEPARATION_TESTS = (test_gyroscopic_design, test_diagonal, test_coupled, test_range, test_averaged_and_unstable, test_drawn, test_refused)
