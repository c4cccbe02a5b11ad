"""Watt's six-bar beside the middle plane of its frame as a right-hand side y' = P y + f, with matrices as one writes them with numpy;
space.h in Python. y holds the rows of [Phi | x_p], twelve of thirteen numbers each, in balanced units.
"""
from math import cos, pi, sin

import numpy as np

from model import joints

MASS, LINKS = 60.0, 5.2
TENSOR = np.array([[2.2, 0.1, -0.2], [0.1, 2.4, 0.15], [-0.2, 0.15, 2.5]])
STATES = 12


def mounting(factor=1.0):
    """Stiffness, times a factor, and damping of the four supports."""
    c, b = np.zeros((6, 6)), np.zeros((6, 6))
    for x, z in ((-0.30, 0.18), (0.30, 0.18), (-0.30, -0.18), (0.30, -0.18)):
        y = -0.20
        g = np.array([[1.0, 0.0, 0.0, 0.0, z, -y], [0.0, 1.0, 0.0, -z, 0.0, x], [0.0, 0.0, 1.0, y, -x, 0.0]])
        c = c + factor * g.T @ np.diag([4.0e4, 1.0e5, 4.0e4]) @ g
        b = b + g.T @ np.diag([40.0, 75.0, 40.0]) @ g
    return c, b


def side_of(compiled):
    """side(t, y, w, unit, size, stiffness, damping): y'. `compiled` decorates the functions: numba's njit, or nothing."""
    dyad, _, carried = joints(compiled)

    @compiled
    def cross_matrix(a):
        return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])

    @compiled
    def add(s, j, h, p, q, length, m, along, across, normal, ahead, left, z):
        x, y, vx, vy, ax, ay = carried(p, q, length, ahead, left)
        r, v, a = np.array([x, y, z]), np.array([vx, vy, 0.0]), np.array([ax, ay, 0.0])
        e, f = np.array([q[0] - p[0], q[1] - p[1], 0.0]) / length, np.array([q[2] - p[2], q[3] - p[3], 0.0]) / length
        n, d = np.array([-e[1], e[0], 0.0]), np.array([-f[1], f[0], 0.0])
        s[0] += m * r
        s[1] += m * v
        s[2] += m * a
        j[0] += m * (np.dot(r, r) * np.eye(3) - np.outer(r, r)) + along * np.outer(e, e) + across * np.outer(n, n)
        j[0, 2, 2] += normal
        j[1] += m * (2 * np.dot(r, v) * np.eye(3) - np.outer(r, v) - np.outer(v, r)) \
            + along * (np.outer(e, f) + np.outer(f, e)) + across * (np.outer(n, d) + np.outer(d, n))
        h[0] += m * np.cross(r, v)
        h[1] += m * np.cross(r, a)
        h[0, 2] += normal * (e[0] * f[1] - e[1] * f[0])
        h[1, 2] += normal * (e[0] * (q[5] - p[5]) - e[1] * (q[4] - p[4])) / length

    @compiled
    def side(t, y, w, unit, size, stiffness, damping, tensor):
        xi, eta = -0.10, 0.15
        x, y0 = 0.08 * cos(w * t), 0.08 * sin(w * t)
        o, b0 = (xi, eta, 0.0, 0.0, 0.0, 0.0), (xi + 0.22, eta, 0.0, 0.0, 0.0, 0.0)
        a = (xi + x, eta + y0, -y0, x, -x, -y0)
        b = dyad(a, b0, 0.24, 0.18)
        c, e = carried(a, b, 0.24, 0.12, 0.10), carried(b0, b, 0.18, 0.18, -0.12)
        d = dyad(c, e, 0.22, 0.20)
        s, j, h = np.zeros((3, 3)), np.zeros((2, 3, 3)), np.zeros((2, 3))
        add(s, j, h, o, a, 0.08, 0.9, 0.0, 0.0015, 0.0015, 0.02, 0.0, 0.14)
        add(s, j, h, a, b, 0.24, 1.4, 0.0030, 0.0080, 0.0110, 0.12, 0.033, 0.152)
        add(s, j, h, b0, b, 0.18, 1.2, 0.0025, 0.0055, 0.0080, 0.12, -0.04, 0.164)
        add(s, j, h, c, d, 0.22, 0.7, 0.0, 0.0030, 0.0030, 0.11, 0.0, 0.164)
        add(s, j, h, e, d, 0.20, 1.0, 0.0, 0.0060, 0.0060, 0.10, 0.0, 0.152)
        m = np.zeros((6, 6))
        m[:3, :3] = (MASS + LINKS) * np.eye(3)
        m[3:, :3] = cross_matrix(s[0])
        m[:3, 3:] = -cross_matrix(s[0])
        m[3:, 3:] = tensor + j[0]
        right = np.zeros((6, 13))
        right[:, :6] = -stiffness
        right[:, 6:12] = -damping
        right[:3, 3:6] += w * w * cross_matrix(s[2])
        right[:3, 9:12] += 2 * w * cross_matrix(s[1])
        right[3:, 9:12] += w * (cross_matrix(h[0]) - j[1])
        right[:3, 12] = -w * w * s[2]
        right[3:, 12] = -w * w * h[1]
        right[:, :12] *= unit
        right[:, 12] /= size
        p = np.linalg.solve(m, right)
        y = y.reshape(12, 13)
        dy = np.empty((12, 13))
        for i in range(6):
            dy[i] = unit[6 + i] / unit[i] * y[6 + i]
        dy[6:] = p[:, :12].copy() @ y
        dy[6:, 12] += p[:, 12]
        for i in range(6, 12):
            dy[i] /= unit[i]
        return dy.ravel()

    return side


def side_in_space(compiled):
    """side(t, y) of a machine, from its speed, size, units and a factor of its stiffness."""
    side = side_of(compiled)

    def of_machine(rpm, size, unit, factor=1.0):
        c, b = mounting(factor)
        unit = np.array(unit)
        return lambda t, y: side(t, y, rpm * pi / 30, unit, size, c, b, TENSOR)

    return of_machine
