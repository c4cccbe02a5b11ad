"""The reference of a frame in space whose speed is held by a flywheel, or by a drive outside the frame (newton_euler.py).

`outside`: the shaft's axis moves by the shortest rotation from its original direction; about this axis the shaft turns evenly.
The angle is a function of the rotation vector; the torque acts along its gradient. `flywheel`: the spin of the shaft about its
axis is constant. Its angle in the frame is an additional state, whose multiplier 1 is omitted; the mean rate of the frame about
the axis and the motor's torque, the mean of the drive's, are computed together with the vibration.
"""

import math

import numpy as np
from machine import cross_matrix
from newton_euler import ROWS, SINC, STEP, Reference, Vibration, cross, dot, spin_matrix, spin_rate, times

COSINE = np.array([(-1) ** k / math.factorial(2 * k) for k in range(13, -1, -1)])


def twist(n, theta, rate=None, gain=None):
    """The twist about n of a rotation vector, chi = 2 atan(p), p = (n theta) g, g = tan(a/2)/a; its gradient, and chi', chi''."""
    s = dot(theta, theta)[..., None]
    above, below = np.polyval(SINC, s / 4), np.polyval(COSINE, s / 4)
    above1, below1 = np.polyval(np.polyder(SINC), s / 4) / 4, np.polyval(np.polyder(COSINE), s / 4) / 4
    above2, below2 = np.polyval(np.polyder(SINC, 2), s / 4) / 16, np.polyval(np.polyder(COSINE, 2), s / 4) / 16
    g = above / below / 2
    g1 = (above1 - 2 * g * below1) / below / 2
    g2 = (above2 - 4 * g1 * below1 - 2 * g * below2) / below / 2
    along = dot(theta, n)[..., None]
    p = along * g
    change = g * n + 2 * along * g1 * theta
    gradient = 2 * change / (1 + p ** 2)
    chi = 2 * np.arctan(p)[..., 0]
    if rate is None:
        return chi, gradient
    ds, dalong = 2 * dot(theta, rate)[..., None], dot(rate, n)[..., None]
    second = g1 * ds * n + 2 * (dalong * g1 * theta + along * g2 * ds * theta + along * g1 * rate)
    turning = 2 * second / (1 + p ** 2) - 4 * p * dot(change, rate)[..., None] * change / (1 + p ** 2) ** 2
    return chi, gradient, dot(gradient, rate), dot(turning, rate) + dot(gradient, gain)


class Held(Reference):
    """Like `Reference`. `chi`, `drift` and `motor`, along leading axes, are the flywheel's states while the loads are summed."""

    def __init__(self, machine, model="exact"):
        super().__init__(machine, model)
        self.axis = next(mechanism.axes[:, 2] for mechanism in machine.mechanisms if mechanism.ratio == 1)
        self.wheel = machine.held_by == "flywheel"
        self.chi = self.drift = self.motor = None

    def turned(self, q, v, a):
        """chi, chi', chi'' of motions."""
        theta, rate, gain = q[..., 3:], v[..., 3:], a[..., 3:]
        if not self.wheel:
            chi, _, *rates = twist(self.axis, theta, rate, gain)
            return (chi, *rates)
        matrix = spin_matrix(theta)
        w, dw = times(matrix, rate), times(matrix, gain) + spin_rate(theta, rate)
        if self.chi is None:
            return dot(theta, self.axis), dot(w, self.axis), dot(dw, self.axis)
        return self.chi, dot(w, self.axis) - self.drift, dot(dw, self.axis)

    def driven(self, phi, q, v, a):
        chi, chi1, chi2 = self.turned(q, v, a)
        # All angles have the same real part; imaginary ones, of complex steps, by the derivative there.
        angles = np.asarray(phi - chi)
        real = angles.ravel()[0].real
        (r, r1, r2), attitude, spin, gain = self.links.at(real)
        r3, jerk = self.links.third(real)
        pairs = ((r, r1), (r1, r2), (r2, r3), (attitude, cross_matrix(spin) @ attitude), (spin, gain), (gain, jerk))
        r, r1, r2, attitude, spin, gain = (part + 1j * angles.imag.reshape(*angles.shape, *(1,) * part.ndim) * change
                                           for part, change in pairs)
        # as phi' and phi'' are
        self.rate, faster = self.machine.speed - chi1, -chi2
        one, two = self.rate[..., None, None], faster[..., None, None]
        return r, r1 * one, r2 * one ** 2 + r1 * two, attitude, spin * one, gain * one ** 2 + spin * two

    def loads(self, phi, q, v, a):
        force, moment, power = super().loads(phi, q, v, a)
        self.torque = power / self.rate if np.iscomplexobj(q) else power.real / self.rate
        # so that power/speed is the torque
        return force, moment, self.torque * self.machine.speed

    def missing(self, phi, q, v, a):
        left = super().missing(phi, q, v, a)
        torque, matrix = self.torque[..., None], spin_matrix(q[..., 3:])
        if self.wheel:
            moment = -self.axis * torque
            spin = self.machine.speed
            if self.motor is not None:
                moment = moment + self.axis * np.asarray(self.motor)[..., None]
                spin = spin + self.drift
            w = times(matrix, v[..., 3:])
            moment = moment + cross(w, self.machine.flywheel * self.axis * np.ones_like(w)) * np.asarray(spin)[..., None]
        else:
            _, gradient = twist(self.axis, q[..., 3:])
            moment = -np.linalg.solve(np.swapaxes(matrix, -1, -2), gradient[..., None])[..., 0] * torque
        return np.concatenate([left[..., :3], left[..., 3:] + moment], axis=-1)

    def rates(self, phi, state, tangents):
        """Derivatives of the state. With a flywheel the exact model's state is (q, q'/speed, chi, sum of the torque, mean rate,
        motor's torque)."""
        if not self.wheel or self.model == "rest":
            self.chi = None
            return super().rates(phi, state, tangents)
        n, speed = len(self.free), self.machine.speed
        points = np.vstack([state, state + 1j * STEP * tangents.T]).astype(complex)
        q, v, a = np.zeros((3, len(points), 6), dtype=complex)
        q[:, self.free], v[:, self.free] = points[:, :n], points[:, n:2 * n] * speed
        self.chi, self.drift, self.motor = (points[:, 2 * n + k, None] for k in (0, 2, 3))
        found = self.acceleration(phi, q, v)
        a[:, self.free] = found
        self.chi, self.drift, self.motor = (points[:, 2 * n + k] for k in (0, 2, 3))
        self.loads(phi, q, v, a)
        _, lag, _ = self.turned(q, v, a)
        rates = np.column_stack([points[:, n:2 * n], found / speed ** 2, lag / speed, self.torque, 0 * lag, 0 * lag])
        return rates[0].real, rates[1:].imag.T / STEP

    def solve(self, start=None, rows=ROWS):
        if not self.wheel or self.model == "rest":
            return super().solve(start, rows)
        n = 2 * len(self.free)
        rest = Held(self.machine, "rest").solve()
        state = np.concatenate([rest.state, np.zeros(4)])
        turn = 2 * math.pi * self.machine.turns * math.copysign(1.0, self.machine.speed)
        unknown = [*range(n), n + 2, n + 3]
        for _ in range(20):
            after, map_ = self.turn(state)
            left = np.concatenate([(after - state)[:n + 1], [after[n + 1] / turn - state[n + 3]]])
            change = np.vstack([(map_ - np.eye(n + 4))[:n + 1], map_[n + 1] / turn - np.eye(n + 4)[n + 3]])[:, unknown]
            step = np.linalg.solve(change, -left)
            state[unknown] += step
            if np.max(abs(step[:n])) < 1e-12 * np.max(abs(state[:n])):
                break
        _, map_ = self.turn(state)
        found = HeldVibration(self, state, map_[:n + 1, :n + 1], self.history(state, rows))
        kept = np.argsort(abs(found.multipliers - 1))[1:]
        found.multipliers = found.multipliers[np.sort(kept)]
        return found


class HeldVibration(Vibration):
    """Like `Vibration`, with a flywheel."""

    def __init__(self, reference, state, map_, states):
        self.wheel = states[:, 2 * len(reference.free):]
        super().__init__(reference, state, map_, states)

    def torque_at(self, k):
        own = self.reference
        own.chi, _, own.drift, own.motor = self.wheel[k]
        return np.asarray(super().torque_at(k)).item()
