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
            for tolerance in ("1e-3", "1e-6", "1e-10"):
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


CAM_LAW_TESTS = (test_oscillator,)
