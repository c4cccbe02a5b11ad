"""Cam laws by segments: the vibration that they excite against Duhamel's integral, their report, and refusals."""

import csv
import math
import re

from harness import Folder, Run, Table, check, equal, near

# A tappet of 2 kg on a vertical guide; only eta is free, so that the frame is an oscillator: M eta'' + D eta' + K eta = -m s''.
TAPPET, FRAME, STIFFNESS, DAMPING, RPM = 2.0, 30.0, 1e6, 800.0, 600.0
MACHINE = """\
&case title='Cam', tasks='response' /
&units length='mm' /
&drive speed_rpm = 600.0 /
&joint name='O', type='ground', position=0.0,0.0 /
&joint name='A', type='crank', pivot='O', radius=30.0 /
&joint name='T', type='follower', cam='O','A', guide_point=0.0,50.0, guide_angle=90.0, lift_phase=90.0, {} /
&link name='cam', from='O', to='A', mass=0.5, inertia=0.001 /
&link name='tappet', from='T', mass=2.0, inertia=0.0 /
&frame mass=29.5, inertia=2.0, origin=0.0,0.0, dof={} /
&support position=-300.0,-200.0, stiffness=2e5,5e5, damping=100.0,400.0 /
&support position=400.0,-200.0, stiffness=2e5,5e5, damping=100.0,400.0 /
&response quantities='eta','eta_dot','eta_ddot', points=72 /
"""
Q, A = 4 + math.pi, 8 * math.pi / (2 + math.pi)


def modified_trapezoid(z):
    if z > 0.5:
        return -modified_trapezoid(1 - z)
    return A * (math.sin(4 * math.pi * z) if z < 1 / 8 else math.cos(4 * math.pi * (z - 3 / 8)) if z > 3 / 8 else 1)


def modified_sine(z):
    if z > 0.5:
        return -modified_sine(1 - z)
    return 4 * math.pi**2 / Q * math.sin(4 * math.pi * z if z < 1 / 8 else (4 * math.pi * z + math.pi) / 3)


# Second derivative of each law: VDI 2143.
LAWS = {
    "harmonic": lambda z: math.pi**2 / 2 * math.cos(math.pi * z),
    "polynomial_345": lambda z: 60 * z - 180 * z**2 + 120 * z**3,
    "polynomial_4567": lambda z: 420 * z**2 - 1680 * z**3 + 2100 * z**4 - 840 * z**5,
    "modified_sine": modified_sine,
    "modified_trapezoid": modified_trapezoid,
}
# Rise in 60 deg, dwell, return in 120 deg, dwell.
LIFT, ENDS = 0.02, (60, 150, 270, 360)


def cam(law, lift=20.0):
    return f"law='{law}','dwell','{law}','dwell', law_angle=60.0,90.0,120.0,90.0, law_lift={lift},0.0"


def acceleration(law, degrees):
    """d2s/dtheta2 in m."""
    if degrees < 60:
        return LIFT * LAWS[law](degrees / 60) / math.radians(60) ** 2
    if 150 < degrees < 270:
        return -LIFT * LAWS[law]((degrees - 150) / 120) / math.radians(120) ** 2
    return 0.0


# Nodes and weights of Gauss's rule with 5 points on [0, 1].
NODES = [(0.5 + sign * x / 2, w / 2) for x, w in ((0.0, 0.5688888888888889), (0.5384693101056831, 0.47862867049936647),
                                                (0.9061798459386640, 0.23692688505618908)) for sign in ((1,) if x == 0 else (1, -1))]


def oscillator(law):
    """The periodic motion eta, eta', eta'' at 720 instants, by Duhamel's integral over parts of half a degree or less."""
    mass = FRAME + TAPPET
    decay, rate = DAMPING / (2 * mass), 2 * math.pi * RPM / 60
    swing = math.sqrt(STIFFNESS / mass - decay**2)

    def free(t, x, v):
        c, s, fade = math.cos(swing * t), math.sin(swing * t), math.exp(-decay * t)
        return (fade * (x * c + (v + decay * x) / swing * s), fade * (v * c - (decay * v + STIFFNESS / mass * x) / swing * s))

    def step(x, v, start, width):
        t = math.radians(width) / rate
        x, v = free(t, x, v)
        for node, weight in NODES:
            kick = free(t * (1 - node), 0.0, -TAPPET / mass * rate**2 * acceleration(law, start + node * width) * weight * t)
            x, v = x + kick[0], v + kick[1]
        return x, v

    def turn(x, v):
        states = [(x, v)]
        for k in range(720):
            states.append(step(*states[-1], k / 2, 0.5))
        return states

    # The map over the turn is affine: x_T = P x_0 + p.
    (a, b), (c, d), (e, f) = (turn(*start)[-1] for start in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)))
    m = [[1 - (c - a), -(e - a)], [-(d - b), 1 - (f - b)]]
    det = m[0][0] * m[1][1] - m[0][1] * m[1][0]
    states = turn((a * m[1][1] - b * m[0][1]) / det, (b * m[0][0] - a * m[1][0]) / det)
    return [(x, v, -(DAMPING * v + STIFFNESS * x + TAPPET * rate**2 * acceleration(law, k / 2)) / mass)
            for k, (x, v) in enumerate(states)]


def quantities(folder):
    """Value and error of each quantity."""
    lines = (line for line in (folder / "input" / "quantities.csv").read_text().splitlines() if line[0] != "#")
    return {row["quantity"]: (float(row["value"]), float(row["error"])) for row in csv.DictReader(lines)}


def test_oscillator():
    """The vibration differs from Duhamel's integral by less than its error bound, with every law and tolerance."""
    for law in LAWS:
        exact = oscillator(law)
        with Folder(input=MACHINE.format(cam(law), "'eta'")) as folder:
            for tolerance in ("1e-3", "1e-9"):
                run = Run(folder, "-q", "input.nml", "-s", f"accuracy.tolerance={tolerance}")
                if not run.done(f"{law}, {tolerance}"):
                    continue
                peaks = quantities(folder)
                history = Table(folder / "input" / "response.csv")
                for i, name, column in ((0, "eta", "eta_m"), (1, "eta_dot", "eta_dot_m_s")):
                    error = max(abs(a - b[i]) for a, b in zip(history[column], exact[::10]))
                    # Half of 1e-15 of the largest value is rounding of the oracle.
                    check(f"{law}, {tolerance}, {name}", error <= peaks[name][1] + 1e-13 * peaks[name][0], f"<= {peaks[name][1]}", error)
                for i, name in enumerate(("eta", "eta_dot", "eta_ddot")):
                    # The largest of 720 samples falls short of the peak; next to a jump, the oracle knows one side only.
                    largest = max(abs(row[i]) for row in exact)
                    slack = 2e-3 if name == "eta_ddot" else 1e-3
                    value, error = peaks[name]
                    check(f"{law}, {tolerance}, peak of {name}", largest * (1 - 1e-12) - error <= value <= largest * (1 + slack) + error,
                          f"{largest}", f"{value} +- {error}")
                    if law != "harmonic":
                        check(f"{law}, {tolerance}, error of {name}", error <= 1e-2 * value, "1 %", error / value)


def test_tolerances():
    """Vibrations of the exact frame with different tolerances differ by less than the sum of their bounds."""
    for held, laws in (("motor", ("harmonic", "modified_trapezoid")), ("outside", ("polynomial_345",))):
        for law in laws:
            with Folder(input=MACHINE.format(cam(law), "'xi','eta','psi'").replace("guide_angle=90.0", "guide_angle=60.0")) as folder:
                results = []
                for tolerance in ("1e-4", "1e-11"):
                    words = ["-s", f"accuracy.tolerance={tolerance}", "-s", f"drive.held_by={held}",
                             "-s", "response.quantities='xi','eta','psi','psi_dot','eta_ddot'"]
                    if Run(folder, "-q", "input.nml", *words).done(f"{law}, {held}, {tolerance}"):
                        results.append(quantities(folder))
                if len(results) < 2:
                    continue
                for name, (value, error) in results[0].items():
                    finer, rest = results[1][name]
                    check(f"{law}, {held}, {name}", abs(value - finer) <= error + rest, f"{finer} +- {rest}", f"{value} +- {error}")


def test_report():
    """--check lists the segments, the peaks of the slider and the jumps of the acceleration; a run warns of jumps."""
    with Folder(input=MACHINE.format(cam("polynomial_345"), "'eta'")) as folder:
        run = Run(folder, "--check", "input.nml")
        run.done("3-4-5")
        omega, width = 2 * math.pi * RPM / 60, math.radians(60)
        # Closed form: 15/8 h/beta and 10/sqrt(3) h/beta^2.
        row = f"T 0.02 {1.875 * LIFT / width * omega:.5g} {5.7735026918963 * LIFT / (width / omega) ** 2:.5g}"
        check("3-4-5, slider", row in run.flat, row, run.out)
        table = ("slider law angle lift jump deg m m T polynomial_345 60 0.02 0 T dwell 150 0.02 0 T polynomial_345 270 0 0 "
                 "T dwell 360 0 0")
        check("3-4-5, laws", table in run.flat, table, run.out)
        check("3-4-5, no warning", "jumps" not in run.flat, "no warning", run.out)
    with Folder(input=MACHINE.format(cam("harmonic"), "'eta'")) as folder:
        run = Run(folder, "--check", "input.nml")
        run.done("harmonic")
        # pi^2/2 h/beta^2 at 0 and, with the opposite sign of both factors, at 60 deg; a quarter at 150 and 270 deg
        jump = math.pi**2 / 2 * LIFT / math.radians(60) ** 2
        table = (f"T harmonic 60 0.02 {jump:.5g} T dwell 150 0.02 {-jump / 4:.5g} T harmonic 270 0 {-jump / 4:.5g} "
                 f"T dwell 360 0 {jump:.5g}")
        check("harmonic, laws", table in run.flat, table, run.out)
        check("harmonic, warning", "joint 'T': the acceleration of its law jumps" in run.flat, "a warning", run.out)
        Run(folder, "input.nml", "-s", "drive.held_by=outside").refused("harmonic, outside", 2, re.compile(
            r".*: &drive: held_by = 'outside' requires cam laws without jumps of the acceleration"))


def test_harmonics():
    """`harmonics` omits the high orders of a table of rounded lifts, and the warning names it."""
    lifts = [round(10 - 10 * math.cos(math.radians(5 * k)), 2) for k in range(72)]
    text = MACHINE.format("lift_table=" + ",".join(map(str, lifts)), "'eta'")
    with Folder(input=text) as folder:
        run = Run(folder, "input.nml")
        run.done("rounded table")
        words = "of its acceleration (rms) comes from the upper half of the orders that lift_table can represent, 19 to 36"
        check("rounded table, warning", words in run.flat and "limit the orders with harmonics=18" in run.flat, words, run.out)
        run = Run(folder, "input.nml", "-s", "joint(T).harmonics=1", "-s", "accuracy.tolerance=1e-12")
        run.done("one order")
        check("one order, no warning", "upper half" not in run.flat, "no warning", run.out)
        limited = quantities(folder)
    coefficient = sum(lift * math.cos(math.radians(5 * k)) for k, lift in enumerate(lifts)) / 36
    other = sum(lift * math.sin(math.radians(5 * k)) for k, lift in enumerate(lifts)) / 36
    with Folder(input=MACHINE.format(f"lift={sum(lifts) / 72!r},{coefficient!r},{other!r}", "'eta'")) as folder:
        Run(folder, "-q", "input.nml", "-s", "accuracy.tolerance=1e-12").done("first order by lift")
        for name, (value, _) in quantities(folder).items():
            near(f"one order, {name}", limited[name][0], value, 1e-9 * value)


def test_refused():
    """Segments that define no cam are refused with the line and the key."""
    start = "input.nml:6: &joint 'T': "
    for what, words, message in (
            ("two lifts", cam("harmonic") + ", lift=1.0", "give one of 'lift' (harmonics), 'lift_table' and 'law'"),
            ("no lift", "law='harmonic','harmonic', law_angle=180,180", "'law', 'law_angle' and 'law_lift' belong together"),
            ("no law", "lift=1.0, law_angle=180,180", "'law', 'law_angle' and 'law_lift' belong together"),
            ("harmonics of a lift", "lift=1.0, harmonics=3", "'harmonics' limits the orders of 'lift_table' only"),
            ("harmonics 0", "lift_table=1.0,2.0,3.0, harmonics=0", "harmonics = 0: must be at least 1"),
            ("sum", cam("harmonic").replace("90.0,120.0", "90.0,121.0"),
             "law_angle = 60.0, 90.0, 121.0, 90.0: must add up to 360 deg"),
            ("widths", cam("harmonic").replace("60.0,90.0,", "150.0,"),
             "law_angle = 150.0, 120.0, 90.0: must have one value for each segment of 'law'"),
            ("lifts", cam("harmonic") + ",0.0",
             "law_lift = 20.0, 0.0, 0.0: must have one value for each segment of 'law' that is not 'dwell'"),
            ("negative width", cam("harmonic").replace("60.0", "-60.0"), "law_angle(1) = -60.0: must be positive"),
            ("no return", "law='harmonic','dwell', law_angle=180,180, law_lift=20,20",
             "law = 'harmonic', 'dwell': must have at least two segments that are not 'dwell': the follower must return"),
            ("unknown", cam("harmonics"), "law(1) = 'harmonics': unknown; did you mean 'harmonic'?")):
        with Folder(input=MACHINE.format(words, "'eta'")) as folder:
            Run(folder, "input.nml").refused(f"law, {what}", 2, start + message)


def test_names():
    """A joint may have the name of a law, also in a copied mechanism."""
    text = MACHINE.format(cam("harmonic"), "'eta'").replace("'A'", "'dwell'")
    text = text.replace("&joint ", "&joint mechanism='one', ").replace("&link ", "&link mechanism='one', ")
    text += "&mechanism name='one', origin=0.0,0.0 /\n&repeat of='one', name='two', phase=90.0 /\n"
    with Folder(input=text) as folder:
        Run(folder, "-q", "input.nml").done("a joint called dwell")


CAM_LAW_TESTS = (test_oscillator, test_tolerances, test_report, test_harmonics, test_refused, test_names)
