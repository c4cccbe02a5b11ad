"""The frame of three mechanisms of data/ as a right-hand side y' = P y + f, as one would write it by hand; model.h in Python.

y holds the six rows of [Phi | x_p], seven numbers each, in balanced units: D^-1 [Phi D | x_p / size] with D = diag(unit).
A point is (x, y, x', y', x'', y''), derivatives with respect to the crank angle.
"""
from math import cos, pi, sin, sqrt

import numpy as np

# mass, inertia, xi_0, eta_0; mass and inertia of the links; supports (x, y, kx, ky, bx, by); foundation's damping
MACHINES = {
    "khang_four_bar": (18.0, 0.78, -0.20, 0.20, 1.35, 0.0165,
                       [(x, -0.20, 196133.0, 196133.0, 0.0, 0.0) for x in (-0.30, -0.10, 0.10, 0.30)], (0.5, 0.5, 0.05)),
    "compressor": (45.0, 1.6, 0.0, 0.05, 3.1, 0.005,
                   [(x, -0.25, 6.0e4, 1.2e5, 60.0, 120.0) for x in (-0.20, 0.20)], (0.0, 0.0, 0.0)),
    "watt_six_bar": (60.0, 2.5, -0.10, 0.15, 5.2, 0.0295,
                     [(x, -0.20, 8.0e4, 2.0e5, 80.0, 150.0) for x in (-0.30, 0.30)], (0.0, 0.0, 0.0)),
}



def mounting(name, factor=1.0):
    """Stiffness, times a factor, and damping of supports and foundation."""
    supports, foundation = MACHINES[name][6:]
    c, b = np.zeros((3, 3)), np.diag(foundation)
    for x, y, kx, ky, bx, by in supports:
        along, across = np.array([1.0, 0.0, -y]), np.array([0.0, 1.0, x])
        c = c + factor * (kx * np.outer(along, along) + ky * np.outer(across, across))
        b = b + bx * np.outer(along, along) + by * np.outer(across, across)
    return c, b


def joints(compiled):
    """dyad, slider and a point of a body. `compiled` decorates the functions: numba's njit, or nothing."""

    @compiled
    def dyad(p, q, l1, l2):
        px, py, pvx, pvy, pax, pay = p
        qx, qy, qvx, qvy, qax, qay = q
        ex, ey = qx - px, qy - py
        d2 = ex * ex + ey * ey
        along = (d2 + (l1 - l2) * (l1 + l2)) / (2 * d2)
        across = sqrt(l1 * l1 / d2 - along * along)
        ux, uy = along * ex - across * ey, along * ey + across * ex
        wx, wy = ux - ex, uy - ey
        one = 1 / (ux * wy - uy * wx)
        gu, gw = ux * pvx + uy * pvy, wx * qvx + wy * qvy
        vx, vy = (gu * wy - gw * uy) * one, (gw * ux - gu * wx) * one
        hu = ux * pax + uy * pay - (vx - pvx) ** 2 - (vy - pvy) ** 2
        hw = wx * qax + wy * qay - (vx - qvx) ** 2 - (vy - qvy) ** 2
        return px + ux, py + uy, vx, vy, (hu * wy - hw * uy) * one, (hw * ux - hu * wx) * one

    @compiled
    def slider(p, length):
        x, y, vx, vy, ax, ay = p
        u = sqrt(length * length - x * x)
        v = -x * vx / u
        return 0.0, y + u, 0.0, vy + v, 0.0, ay - (vx * vx + x * ax + v * v) / u

    @compiled
    def carried(p, q, length, along, left):
        px, py, pvx, pvy, pax, pay = p
        qx, qy, qvx, qvy, qax, qay = q
        a, b = along / length, left / length
        ex, ey, fx, fy, gx, gy = qx - px, qy - py, qvx - pvx, qvy - pvy, qax - pax, qay - pay
        return (px + a * ex - b * ey, py + a * ey + b * ex, pvx + a * fx - b * fy, pvy + a * fy + b * fx,
                pax + a * gx - b * gy, pay + a * gy + b * gx)

    return dyad, slider, carried


def kinematics(compiled):
    """The sums (a1, a1', a1'', a2, a2', a2'', a3, a3', a4) at a crank angle, by machine."""
    dyad, slider, carried = joints(compiled)

    @compiled
    def with_mass(s, m, c):
        x, y, vx, vy, ax, ay = c
        return (s[0] + m * x, s[1] + m * vx, s[2] + m * ax, s[3] + m * y, s[4] + m * vy, s[5] + m * ay,
                s[6] + m * (x * x + y * y), s[7] + 2 * m * (x * vx + y * vy), s[8] + m * (x * ay - y * ax))

    @compiled
    def with_link(s, p, q, length, m, inertia, along, left):
        s = with_mass(s, m, carried(p, q, length, along, left))
        turn = ((q[0] - p[0]) * (q[5] - p[5]) - (q[1] - p[1]) * (q[4] - p[4])) / (length * length)
        return s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7], s[8] + inertia * turn

    @compiled
    def four_bar(angle):
        x, y = 0.07 * cos(angle), 0.07 * sin(angle)
        o, b0, a = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.40, 0.0, 0.0, 0.0, 0.0, 0.0), (x, y, -y, x, -x, -y)
        b = dyad(a, b0, 0.37, 0.16)
        s = with_link((0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), o, a, 0.07, 0.50, 0.0035, 0.03, 0.0)
        s = with_link(s, a, b, 0.37, 0.60, 0.0070, 0.18, 0.0)
        return with_link(s, b0, b, 0.16, 0.25, 0.0060, 0.08, 0.0)

    @compiled
    def slider_crank(angle):
        x, y = 0.05 * cos(angle), 0.05 * sin(angle)
        o, a = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (x, y, -y, x, -x, -y)
        b = slider(a, 0.20)
        s = with_link((0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), o, a, 0.05, 2.0, 0.002, 0.01, 0.0)
        s = with_link(s, a, b, 0.20, 0.6, 0.003, 0.065, 0.0)
        return with_mass(s, 0.5, b)

    @compiled
    def six_bar(angle):
        x, y = 0.08 * cos(angle), 0.08 * sin(angle)
        o, b0, a = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.22, 0.0, 0.0, 0.0, 0.0, 0.0), (x, y, -y, x, -x, -y)
        b = dyad(a, b0, 0.24, 0.18)
        c, e = carried(a, b, 0.24, 0.12, 0.10), carried(b0, b, 0.18, 0.18, -0.12)
        d = dyad(c, e, 0.22, 0.20)
        s = with_link((0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), o, a, 0.08, 0.9, 0.0015, 0.02, 0.0)
        s = with_link(s, a, b, 0.24, 1.4, 0.0110, 0.12, 0.033)
        s = with_link(s, b0, b, 0.18, 1.2, 0.0080, 0.12, -0.04)
        s = with_link(s, c, d, 0.22, 0.7, 0.0030, 0.11, 0.0)
        return with_link(s, e, d, 0.20, 1.0, 0.0060, 0.10, 0.0)

    return {"khang_four_bar": four_bar, "compressor": slider_crank, "watt_six_bar": six_bar}


def python_side(name, rpm, size, unit, factor=1.0):
    """side(t, y) in Python: numbers for the kinematics, numpy for the products."""
    sums = kinematics(lambda function: function)[name]
    mass, inertia, xi, eta, links, links_inertia = MACHINES[name][:6]
    w = rpm * pi / 30
    c, b = mounting(name, factor)
    unit = np.array(unit)
    steady = -np.hstack([c, b]) * unit
    rate = (unit[3:] / unit[:3])[:, None]
    u1, u2, u3 = 1 / unit[3:]
    turn, turning = unit[2], unit[5]
    one_m, all_inertia = 1 / (mass + links), inertia + links_inertia + links * (xi * xi + eta * eta)

    def side(t, y):
        a1, a1d, a1dd, a2, a2d, a2dd, a3, a3d, a4 = sums(w * t)
        m13, m23 = -(links * eta + a2), links * xi + a1
        p, q = m13 * one_m, m23 * one_m
        one_j = 1 / (all_inertia + a3 + 2 * (xi * a1 + eta * a2) - m13 * p - m23 * q)
        g = steady.copy()                                                # -[C B]
        g[0, 2] += w * w * a2dd * turn
        g[1, 2] -= w * w * a1dd * turn
        g[0, 5] += 2 * w * a2d * turning
        g[1, 5] -= 2 * w * a1d * turning
        g[2, 5] -= w * (a3d + 2 * (xi * a1d + eta * a2d)) * turning
        inverse = np.array([[u1 * (one_m + p * p * one_j), u1 * p * q * one_j, -u1 * p * one_j],
                            [u2 * p * q * one_j, u2 * (one_m + q * q * one_j), -u2 * q * one_j],
                            [-u3 * p * one_j, -u3 * q * one_j, u3 * one_j]])
        y = y.reshape(6, 7)
        forces = g @ y
        load = -w * w / size
        forces[0, 6] += load * a1dd
        forces[1, 6] += load * a2dd
        forces[2, 6] += load * (xi * a2dd - eta * a1dd + a4)
        dy = np.empty((6, 7))
        np.multiply(rate, y[3:], out=dy[:3])
        np.matmul(inverse, forces, out=dy[3:])
        return dy.ravel()

    return side


def compiled_sides(compiled):
    """side(t, y, dy, d) by machine, for numba; d from `numbers`, y and dy of 42 numbers."""

    def build(sums):
        @compiled
        def side(t, y, dy, d):
            w, mass, inertia, xi, eta, links, links_inertia, size = d[0], d[1], d[2], d[3], d[4], d[5], d[6], d[7]
            a1, a1d, a1dd, a2, a2d, a2dd, a3, a3d, a4 = sums(w * t)
            one_m = 1 / (mass + links)
            m13, m23 = -(links * eta + a2), links * xi + a1
            p, q = m13 * one_m, m23 * one_m
            one_j = 1 / (inertia + links_inertia + links * (xi * xi + eta * eta) + a3 + 2 * (xi * a1 + eta * a2)
                         - m13 * p - m23 * q)
            for c in range(7):
                f1, f2, f3 = 0.0, 0.0, 0.0
                for j in range(6):
                    f1 += d[14 + j] * y[7 * j + c]
                    f2 += d[20 + j] * y[7 * j + c]
                    f3 += d[26 + j] * y[7 * j + c]
                turn, turning = y[14 + c] * d[10], y[35 + c] * d[13]
                f1 += w * w * a2dd * turn + 2 * w * a2d * turning
                f2 -= w * w * a1dd * turn + 2 * w * a1d * turning
                f3 -= w * (a3d + 2 * (xi * a1d + eta * a2d)) * turning
                if c == 6:
                    f1 -= w * w / size * a1dd
                    f2 -= w * w / size * a2dd
                    f3 -= w * w / size * (xi * a2dd - eta * a1dd + a4)
                r3 = (f3 - p * f1 - q * f2) * one_j
                dy[21 + c] = (f1 * one_m - p * r3) / d[11]
                dy[28 + c] = (f2 * one_m - q * r3) / d[12]
                dy[35 + c] = r3 / d[13]
                dy[c] = d[11] / d[8] * y[21 + c]
                dy[7 + c] = d[12] / d[9] * y[28 + c]
                dy[14 + c] = d[13] / d[10] * y[35 + c]

        return side

    return {name: build(sums) for name, sums in kinematics(compiled).items()}


def numbers(name, rpm, size, unit, factor=1.0):
    """0 the crank's speed, 1 to 6 as in MACHINES, 7 size, 8 to 13 units, 14 to 31 -[C B] by rows, times the units."""
    c, b = mounting(name, factor)
    steady = -np.hstack([c, b]) * np.array(unit)
    return np.concatenate([[rpm * pi / 30], MACHINES[name][:6], [size], unit, steady.ravel()])
