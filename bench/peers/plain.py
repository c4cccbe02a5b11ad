"""The right-hand side of model.py in plain numpy, as in a first version: vectors, and numpy.linalg for equations."""
import numpy as np

from model import MACHINES, mounting


def dyad(p, q, l1, l2):
    """Position, velocity and acceleration of the joint at l1 from p and l2 from q, left of the way from p to q."""
    e = q[0] - p[0]
    along = (e @ e + l1**2 - l2**2) / (2 * e @ e)
    r = p[0] + along * e + np.sqrt(l1**2 / (e @ e) - along**2) * np.array([-e[1], e[0]])
    arms = np.array([r - p[0], r - q[0]])
    v = np.linalg.solve(arms, [arms[0] @ p[1], arms[1] @ q[1]])
    a = np.linalg.solve(arms, [arms[0] @ p[2] - (v - p[1]) @ (v - p[1]), arms[1] @ q[2] - (v - q[1]) @ (v - q[1])])
    return np.array([r, v, a])


def slider(p, length):
    """The point on the y-axis at `length` from p, above it."""
    (x, y), (vx, vy), (ax, ay) = p
    u = np.sqrt(length**2 - x**2)
    v = -x * vx / u
    return np.array([[0.0, y + u], [0.0, vy + v], [0.0, ay - (vx**2 + x * ax + v**2) / u]])


def carried(p, q, length, along, left):
    e = (q - p) / length
    return p + along * e + left * np.array([-e[:, 1], e[:, 0]]).T


def crank(radius, angle):
    u = radius * np.array([np.cos(angle), np.sin(angle)])
    return np.array([u, [-u[1], u[0]], -u])


def ground(x, y):
    return np.array([[x, y], [0.0, 0.0], [0.0, 0.0]])


def links_of(name, angle):
    """Mass, moment of inertia, motion of the centre of mass and angular acceleration of every link."""
    o = ground(0.0, 0.0)
    if name == "khang_four_bar":
        a, b0 = crank(0.07, angle), ground(0.40, 0.0)
        b = dyad(a, b0, 0.37, 0.16)
        bodies = [(o, a, 0.07, 0.50, 0.0035, 0.03, 0.0), (a, b, 0.37, 0.60, 0.0070, 0.18, 0.0),
                  (b0, b, 0.16, 0.25, 0.0060, 0.08, 0.0)]
    elif name == "compressor":
        a = crank(0.05, angle)
        b = slider(a, 0.20)
        bodies = [(o, a, 0.05, 2.0, 0.002, 0.01, 0.0), (a, b, 0.20, 0.6, 0.003, 0.065, 0.0), (b, None, 1.0, 0.5, 0.0, 0.0, 0.0)]
    else:
        a, b0 = crank(0.08, angle), ground(0.22, 0.0)
        b = dyad(a, b0, 0.24, 0.18)
        c, e = carried(a, b, 0.24, 0.12, 0.10), carried(b0, b, 0.18, 0.18, -0.12)
        d = dyad(c, e, 0.22, 0.20)
        bodies = [(o, a, 0.08, 0.9, 0.0015, 0.02, 0.0), (a, b, 0.24, 1.4, 0.0110, 0.12, 0.033),
                  (b0, b, 0.18, 1.2, 0.0080, 0.12, -0.04), (c, d, 0.22, 0.7, 0.0030, 0.11, 0.0),
                  (e, d, 0.20, 1.0, 0.0060, 0.10, 0.0)]
    for p, q, length, mass, inertia, along, left in bodies:
        if q is None:
            yield mass, inertia, p, 0.0
        else:
            u, acceleration = (q[0] - p[0]) / length, (q[2] - p[2]) / length
            yield mass, inertia, carried(p, q, length, along, left), u[0] * acceleration[1] - u[1] * acceleration[0]


def plain_side(name, rpm, size, unit, factor=1.0):
    mass, inertia, xi, eta, links, links_inertia = MACHINES[name][:6]
    w = rpm * np.pi / 30
    stiffness, damping = mounting(name, factor)
    unit = np.array(unit)

    def side(t, y):
        a1, a2, a3 = np.zeros(3), np.zeros(3), np.zeros(2)
        a4 = 0.0
        for m, j, (r, v, a), turn in links_of(name, w * t):
            a1 += m * np.array([r[0], v[0], a[0]])
            a2 += m * np.array([r[1], v[1], a[1]])
            a3 += m * np.array([r @ r, 2 * r @ v])
            a4 += m * (r[0] * a[1] - r[1] * a[0]) + j * turn
        m13, m23 = -(links * eta + a2[0]), links * xi + a1[0]
        m33 = inertia + links_inertia + links * (xi**2 + eta**2) + a3[0] + 2 * (xi * a1[0] + eta * a2[0])
        matrix = np.array([[mass + links, 0.0, m13], [0.0, mass + links, m23], [m13, m23, m33]])
        b, c = damping.copy(), stiffness.copy()
        b[:, 2] += w * np.array([-2 * a2[1], 2 * a1[1], a3[1] + 2 * (xi * a1[1] + eta * a2[1])])
        c[:2, 2] += w**2 * np.array([-a2[2], a1[2]])
        load = -w**2 * np.array([a1[2], a2[2], xi * a2[2] - eta * a1[2] + a4])
        x = y.reshape(6, 7) * unit[:, None]
        forces = -(c @ x[:3] + b @ x[3:])
        forces[:, 6] += load / size
        return (np.vstack([x[3:], np.linalg.solve(matrix, forces)]) / unit[:, None]).ravel()

    return side
