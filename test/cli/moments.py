"""The moment on the ground in space: for any guides it equals the loss of angular momentum about F at rest."""

import cmath
import csv
import math

from harness import Folder, Run, check

POINTS, PERIOD = 96, 60 / 500
# A crank with a point mass outside the frame's plane; the frame turns by up to 3 deg, so that guides of single rotations do not hold
# axes that stay in space.
MACHINE = """&case tasks='response','forces' /
&drive speed_rpm=500 /
&joint name='O', type='ground', position=0,0 /
&joint name='A', type='crank', pivot='O', radius=0.05 /
&link name='crank', from='O', to='A', mass=2.0, inertia=0, center=0.1,0, z=0.15 /
&frame mass=20, inertia=0.8,0.7,0.9, origin=-0.02,0.05 /
&support position=-0.25,-0.15,0.1, stiffness=3e4,4e4,3e4, damping=250,350,300, angle=10,5,0 /
&support position=0.22,-0.12,-0.14, stiffness=3e4,2e4,2e4, damping=200,400,300 /
&support position=0.1,0.14,0.12, stiffness=2e4,3e4,2e4, damping=200,200,300 /
&accuracy tolerance=1e-12 /
"""
SETS = ("'xi','eta','psi','zeta','rot_xi','rot_eta'", "'xi','psi','zeta'", "'psi','rot_xi'", "'rot_xi','rot_eta','eta'",
        "'psi','rot_eta','zeta','xi'", "'rot_xi'")
WAVES = [cmath.exp(2j * math.pi * k / POINTS) for k in range(POINTS)]


def derivative(values):
    """The derivative of the trigonometric polynomial through equidistant samples over the period."""
    slope = [0.0] * POINTS
    for k in range(1, POINTS // 2):
        c = sum(f * WAVES[-k * i % POINTS] for i, f in enumerate(values)) * 2 / POINTS * 2j * math.pi * k / PERIOD
        slope = [s + (c * WAVES[k * i % POINTS]).real for i, s in enumerate(slope)]
    return slope


def rates(vectors):
    return list(zip(*(derivative(component) for component in zip(*vectors))))


def cross(a, b):
    return [a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)]


def rotation(theta):
    """Rodrigues' formula."""
    a = math.hypot(*theta)
    first, second = (math.sin(a) / a, (1 - math.cos(a)) / a**2) if a > 0 else (1.0, 0.5)
    columns = []
    for i in range(3):
        e = [float(i == k) for k in range(3)]
        once = cross(theta, e)
        columns.append([x + first * y + second * z for x, y, z in zip(e, once, cross(theta, once))])
    return [list(row) for row in zip(*columns)]


def times(matrix, vector):
    return [sum(x * y for x, y in zip(row, vector)) for row in matrix]


def lost(places, turns):
    """-dL/dt of the frame and the mass on its crank about the point where F rests."""
    rotations = [rotation(theta) for theta in turns]
    angles = [2 * math.pi * k / POINTS for k in range(POINTS)]
    mass = [[u + x for u, x in zip(place, times(r, [-0.02 + 0.1 * math.cos(a), 0.05 + 0.1 * math.sin(a), 0.15]))]
            for place, r, a in zip(places, rotations, angles)]
    flat = rates([[x for row in r for x in row] for r in rotations])
    momenta = []
    for k, (r, r_dot) in enumerate(zip(rotations, flat)):
        # in the frame's axes [w] = R^T R'
        spin = [[sum(r[m][i] * r_dot[3 * m + j] for m in range(3)) for j in range(3)] for i in range(3)]
        momenta.append(times(r, [0.8 * spin[2][1], 0.7 * spin[0][2], 0.9 * spin[1][0]]))
    for body, kilograms in ((places, 20.0), (mass, 2.0)):
        for k, (place, velocity) in enumerate(zip(body, rates(body))):
            momenta[k] = [p + kilograms * x for p, x in zip(momenta[k], cross(place, velocity))]
    return [[-x for x in vector] for vector in rates(momenta)]


def columns(path, names):
    rows = list(csv.DictReader(line for line in path.read_text().splitlines() if line[0] != "#"))[:POINTS]
    return [[float(row.get(name, 0)) for name in names] for row in rows]


def test_moments():
    """The moment on the ground equals the rate of angular momentum lost.

    In space, for any guides, about the point where F rests.
    """
    for dofs in SETS:
        with Folder(input=MACHINE) as folder:
            if not Run(folder, "-q", "-s", f"frame.dof={dofs}", "-s", f"response.points={POINTS}", "input.nml").done(dofs):
                continue
            places = columns(folder / "input/response.csv", ("xi_m", "eta_m", "zeta_m"))
            turns = columns(folder / "input/response.csv", ("rot_xi_rad", "rot_eta_rad", "psi_rad"))
            came = columns(folder / "input/supports_history.csv", ("mx_total_Nm", "my_total_Nm", "m_total_Nm"))
            right = lost(places, turns)
            largest = max(abs(x) for vector in right for x in vector)
            off = max(abs(x - y) for a, b in zip(came, right) for x, y in zip(a, b))
            # the motion is accurate to some 1e-12, two derivatives of up to 48 orders cost three digits
            check(f"{dofs}: moment on the ground and loss of angular momentum", off < 1e-8 * largest,
                  f"less than 1e-8 of {largest}", off)


MOMENT_TESTS = (test_moments,)
