"""A frame in space by d'Alembert's principle: an independent reference for vibration, multipliers, forces and torque.

    python newton_euler.py INPUT [SPEED_RPM ...] [model=exact|rest] [scale=FACTOR] [damping=FACTOR] ['&GROUP KEY=VALUE /' ...]
                           [out=FILE.csv]

needs numpy and SciPy. Inertia forces are summed link by link, from position, velocity, acceleration, angular velocity and
angular acceleration of each; these come from Fourier series of its position and angle, which are exact because they end where
their terms vanish. It does not use sums over the masses as functions of the crank angle. The map over a period and its
derivative are integrated by DOP853; complex steps of 1e-30 yield derivatives without loss of digits. `exact`: the fixed point
of the map, and its derivative there. `rest`: the same equations, those of forces in space and those of moments in the frame's
axes, linear in displacements and rotation vector about rest.
"""

import csv
import math
import re
import sys
from pathlib import Path

import numpy as np
from machine import FREEDOMS, Machine, cross_matrix, inertias
from scipy.integrate import solve_ivp

STEP = 1e-30
ROWS = 400
TOLERANCE = 1e-13
# Of (1 - cos x)/x^2, (x - sin x)/x^3 and sin x/x in powers of s = x^2, highest first, for np.polyval.
ORDERS = range(13, -1, -1)
VERSINE = np.array([(-1) ** k / math.factorial(2 * k + 2) for k in ORDERS])
REMAINDER = np.array([(-1) ** k / math.factorial(2 * k + 3) for k in ORDERS])
SINC = np.array([(-1) ** k / math.factorial(2 * k + 1) for k in ORDERS])


def times(matrix, vector):
    """Matrices times vectors, both along leading axes."""
    return np.einsum("...ij,...j->...i", matrix, vector)


def cross(a, b):
    return np.stack([a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1], a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2],
                     a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]], axis=-1)


def dot(a, b):
    return np.sum(a * b, axis=-1)


def rotation(theta):
    """The matrix of a rotation vector, which takes the frame's axes to space; complex ones and many are allowed."""
    skew, s = cross_matrix(theta), dot(theta, theta)[..., None, None]
    return np.eye(3) + np.polyval(SINC, s) * skew + np.polyval(VERSINE, s) * skew @ skew


def spin_matrix(theta):
    """T: the angular velocity in the frame's axes is T theta'."""
    skew, s = cross_matrix(theta), dot(theta, theta)[..., None, None]
    return np.eye(3) - np.polyval(VERSINE, s) * skew + np.polyval(REMAINDER, s) * skew @ skew


def spin_rate(theta, rate):
    """T' theta'."""
    skew, moved, s = cross_matrix(theta), cross_matrix(rate), dot(theta, theta)[..., None, None]
    change = 2 * dot(theta, rate)[..., None, None]
    both = skew @ moved + moved @ skew
    matrix = (-np.polyval(np.polyder(VERSINE), s) * change * skew - np.polyval(VERSINE, s) * moved
              + np.polyval(np.polyder(REMAINDER), s) * change * skew @ skew + np.polyval(REMAINDER, s) * both)
    return times(matrix, rate)


class Series:
    """Functions of period 2 pi plus a linear part, by Fourier series up to negligible terms."""

    def __init__(self, function):
        size = 128
        while True:
            size *= 2
            values = np.array([function(2 * math.pi * k / size) for k in range(size)])
            self.slope = np.array(function.slope)
            values = values - np.outer(2 * math.pi * np.arange(size) / size, self.slope)
            terms = np.fft.rfft(values, axis=0) / size
            heights = np.max(abs(terms), axis=1) / np.max(abs(terms))
            if np.all(heights[size // 4:] < 1e-15) or size >= 8192:
                break
        # The series end where the terms are as small as rounding errors.
        last = min(np.nonzero(heights > 1e-16)[0][-1], 5 * np.nonzero(heights > 1e-14)[0][-1] // 4 + 3, size // 2 - 1)
        terms = 2 * terms[:last + 1].T
        terms[:, 0] /= 2
        orders = 1j * np.arange(last + 1)
        self.orders, self.size = orders, len(self.slope)
        self.terms = np.concatenate([orders ** k * terms for k in range(4)])

    def __call__(self, x):
        """Values and their first three derivatives; x may be complex."""
        turning = np.exp(self.orders * x)
        found = (self.terms @ turning).real if np.isreal(x) else (self.terms @ turning + self.terms.conj() @ (1 / turning)) / 2
        found = found.reshape(4, self.size)
        return found + np.outer([x, 1.0, 0.0, 0.0], self.slope)


class Poses:
    """Centres of mass and angles of a mechanism's links over its crank's angle, without jumps."""

    def __init__(self, mechanism):
        self.mechanism = mechanism
        angles = np.unwrap([self.angles(x) for x in np.arange(721) * math.pi / 360], axis=0)
        self.angle = angles
        turns = np.round((angles[-1] - angles[0]) / (2 * math.pi))
        self.slope = [slope for k in turns for slope in (0.0, 0.0, k)]

    def angles(self, x):
        at = self.mechanism.points(x)
        return [self.mechanism.pose(link, at)[1] for link in self.mechanism.links]

    def __call__(self, x):
        at, found = self.mechanism.points(x), []
        for k, link in enumerate(self.mechanism.links):
            center, angle = self.mechanism.pose(link, at)
            near = np.interp(x, np.arange(721) * math.pi / 360, self.angle[:, k])
            found += [*center, angle + 2 * math.pi * round((near - angle) / (2 * math.pi))]
        return found


class Links:
    """All links of a machine in the frame's axes."""

    def __init__(self, machine):
        self.machine, self.mechanisms = machine, [m for m in machine.mechanisms if m.links]
        known, self.series = {}, []
        for mechanism in self.mechanisms:
            key = id(mechanism.joints)
            if key not in known:
                known[key] = Series(Poses(mechanism))
            self.series.append(known[key])
        links = [link for mechanism in self.mechanisms for link in mechanism.links]
        self.masses = np.array([link["mass"][0] for link in links])
        self.principal = np.array([inertias(link) for link in links]).reshape(-1, 3)

    def at(self, phi):
        """At the drive's angle phi, for speed 1: positions with first and second derivatives, attitudes, angular velocities and
        angular accelerations, all in the frame's axes."""
        places, attitudes = [], []
        for mechanism, series in zip(self.mechanisms, self.series):
            ratio, axes = float(mechanism.ratio), mechanism.axes
            values = series(mechanism.crank(phi))[:3].reshape(3, -1, 3) * np.array([1.0, ratio, ratio ** 2])[:, None, None]
            height = np.array([link.get("z", [0.0])[0] for link in mechanism.links])
            flat = np.stack([values[..., 0], values[..., 1], height * np.array([[1.0], [0.0], [0.0]])], axis=-1)
            place = flat @ axes.T
            place[0] += mechanism.place
            c, s, no = np.cos(values[0, :, 2]), np.sin(values[0, :, 2]), np.zeros(len(height))
            attitude = axes @ np.array([[c, -s, no], [s, c, no], [no, no, no + 1]]).transpose(2, 0, 1)
            places.append(place)
            attitudes.append((attitude, values[1, :, 2, None] * axes[:, 2], values[2, :, 2, None] * axes[:, 2]))
        if not places:
            return np.zeros((3, 0, 3)), np.zeros((0, 3, 3)), np.zeros((0, 3)), np.zeros((0, 3))
        return (np.concatenate(places, axis=1), *(np.concatenate(parts) for parts in zip(*attitudes)))


    def third(self, phi):
        """Third derivatives of the positions, second derivatives of the angular velocities."""
        places, spins = [np.zeros((0, 3))], [np.zeros((0, 3))]
        for mechanism, series in zip(self.mechanisms, self.series):
            values = series(mechanism.crank(phi))[3].reshape(-1, 3) * float(mechanism.ratio) ** 3
            places.append(values[:, :2] @ mechanism.axes[:, :2].T)
            spins.append(values[:, 2, None] * mechanism.axes[:, 2])
        return np.concatenate(places), np.concatenate(spins)


def integrate(right, end, start, least, tolerance, **options):
    found = solve_ivp(right, (0.0, end), start, "DOP853", rtol=tolerance, atol=least, **options)
    if not found.success:
        raise SystemExit(found.message)
    return found.y


class Reference:
    """The equations of a machine at its speed. Motions q, q', q'' are those of the six coordinates, along leading axes."""

    def __init__(self, machine, model="exact"):
        self.machine, self.model, self.free = machine, model, machine.free
        self.links, self.mounts = Links(machine), machine.mounts()
        self.stiffness, self.damping = (machine.grounding(key) for key in ("stiffness", "damping"))
        self.g = machine.weight()
        self.place = np.array([mount[0] for mount in self.mounts]).reshape(-1, 3)
        self.springs, self.dampers = (np.array([mount[1] @ np.diag(mount[k]) @ mount[1].T for mount in self.mounts]).reshape(-1, 3, 3)
                                      for k in (2, 3))
        self.turning = np.array([mount[4] for mount in self.mounts], dtype=bool)
        self.static()

    def static(self):
        """Finds the static forces of supports and foundation that carry the weights at rest, with the mean of the weights' moment
        over the turn."""
        machine, self.sag, load = self.machine, np.zeros(6), np.zeros(6)
        whole = self.stiffness.copy()
        arms = [np.hstack([np.eye(3), -cross_matrix(p)]) for p in self.place]
        for arm, spring in zip(arms, self.springs):
            whole += arm.T @ spring @ arm
        if self.g.any():
            turns = 2 * math.pi * machine.turns
            mean = np.mean([self.links.masses @ self.links.at(turns * k / 720)[0][0] for k in range(720)], axis=0)
            load[:] = np.concatenate([(machine.mass + sum(self.links.masses)) * self.g, np.cross(mean, self.g)])
            free = np.ix_(self.free, self.free)
            self.sag[self.free] = np.linalg.lstsq(whole[free], load[self.free], rcond=1e-12)[0]
        # Forces on the frame; foundation and guides carry the rest.
        self.held = np.array([-spring @ arm @ self.sag for spring, arm in zip(self.springs, arms)]).reshape(-1, 3)
        self.held_ground = -load - sum((arm.T @ force for arm, force in zip(arms, self.held)), np.zeros(6))

    def driven(self, phi, q, v, a):
        """Places of the links with their first and second derivatives, attitudes, angular velocities and accelerations over time."""
        (r, r1, r2), attitude, spin, gain = self.links.at(phi)
        speed = self.machine.speed
        return r, r1 * speed, r2 * speed ** 2, attitude, spin * speed, gain * speed ** 2

    def loads(self, phi, q, v, a):
        """d'Alembert: masses times accelerations less the weights, in space, and moments of that and of the attitudes about F, in the
        frame's axes; with it the power that the drive gives."""
        machine = self.machine
        theta, rate = q[..., 3:], v[..., 3:]
        turned, matrix = rotation(theta), spin_matrix(theta)
        w, dw = times(matrix, rate), times(matrix, a[..., 3:]) + spin_rate(theta, rate)
        falling = times(np.swapaxes(turned, -1, -2), a[..., :3] - self.g)
        r, r1, r2, attitude, spin, gain = self.driven(phi, q, v, a)
        wl, dwl = w[..., None, :], dw[..., None, :]
        lead = falling[..., None, :] + r2 + 2 * cross(wl, r1) + cross(dwl, r) + cross(wl, cross(wl, r))
        # Of each link the change of I (w + spin) as seen from space; its principal axes turn with it.
        whole = wl + spin
        tensor = (attitude * self.links.principal[:, None, :]) @ np.swapaxes(attitude, -1, -2)
        momentum = times(tensor, whole)
        change = times(tensor, dwl + gain + cross(wl, spin)) + cross(whole, momentum)
        force = np.einsum("k,...ki->...i", self.links.masses, lead) + machine.mass * falling
        pulls = self.links.masses[:, None] * lead
        moment = np.sum(cross(r, pulls) + change, axis=-2) + dw @ machine.inertia + cross(w, w @ machine.inertia)
        power = np.sum(dot(pulls, r1) + dot(change, spin), axis=-1)
        return times(turned, force), moment, power

    def mounting(self, q, v):
        """Forces of all supports on the frame, static ones too, and their arms, both in space; forces and moments of the foundation.

        Axes that turn are those of a second frame, fixed to the first: the ground's point of the support is seen from there, moves and
        is pulled at; the force acts where it is."""
        theta = q[..., 3:]
        turned, matrix = rotation(theta), spin_matrix(theta)
        each = turned[..., None, :, :]
        heads = times(each, self.place)
        w = times(matrix, v[..., 3:])[..., None, :]
        away = q[..., None, :3] + heads - self.place
        moving = v[..., None, :3] + times(each, cross(w, self.place))
        forces = self.held - times(self.springs, away) - times(self.dampers, moving)
        # The ground's point as seen from the frame: R^T (p - u), and its rate there.
        back = np.swapaxes(each, -1, -2)
        seen = times(back, self.place - q[..., None, :3])
        rate = -times(back, v[..., None, :3]) - cross(w, seen)
        drawn = times(each, self.held + times(self.springs, seen - self.place) + times(self.dampers, rate))
        forces = np.where(self.turning[:, None], drawn, forces)
        arms = np.where(self.turning[:, None], times(each, seen), heads)
        ground = -q @ self.stiffness - v @ self.damping
        return forces, arms, ground, turned, matrix

    def missing(self, phi, q, v, a):
        """Residuals of the forces (space) and moments (frame's axes): zero along a motion."""
        force, moment, _ = self.loads(phi, q, v, a)
        forces, heads, ground, turned, matrix = self.mounting(q, v)
        ground = ground + self.held_ground
        force = force - np.sum(forces, axis=-2) - ground[..., :3]
        back = np.swapaxes(turned, -1, -2)
        moment = moment - times(back, np.sum(cross(heads, forces), axis=-2))
        # What the foundation does to the coordinates belongs to a moment by the virtual work of the rotation vector.
        moment = moment - np.linalg.solve(np.swapaxes(matrix, -1, -2), ground[..., 3:, None])[..., 0]
        return np.concatenate([force, moment], axis=-1)

    def guides(self, q, v, phi, a):
        """Generalised forces of the guides, from the residuals of the held coordinates."""
        left = self.missing(phi, q, v, a)
        matrix = spin_matrix(q[..., 3:])
        return np.concatenate([left[..., :3], times(np.swapaxes(matrix, -1, -2), left[..., 3:])], axis=-1)

    def acceleration(self, phi, q, v):
        """q'' of the free coordinates, where the others are held."""
        n = len(self.free)
        q, v = q[..., None, :], v[..., None, :]
        trial = np.zeros((n + 1, 6))
        trial[range(1, n + 1), self.free] = 1.0
        left = self.guides(q, v, phi, np.broadcast_to(trial, (*q.shape[:-2], n + 1, 6)).astype(q.dtype))[..., self.free]
        mass = np.swapaxes(left[..., 1:, :] - left[..., :1, :], -1, -2)
        return np.linalg.solve(mass, -left[..., 0, :, None])[..., 0]

    def linear(self, phi):
        """M, B, C and h of M q'' + B q' + C q = h about rest."""
        n = len(self.free)
        motions = np.zeros((3, 3 * n + 1, 6), dtype=complex)
        for j in range(3):
            motions[j, range(j * n, (j + 1) * n), self.free] = 1j * STEP
        left = self.missing(phi, *motions)[:, self.free]
        stiffness, damping, mass = (left[j * n:(j + 1) * n].imag.T / STEP for j in range(3))
        return mass, damping, stiffness, -left[-1].real

    def rates(self, phi, state, tangents):
        """Derivatives over phi of the state (q, q'/speed) and of tangents to it, columns."""
        n, speed = len(self.free), self.machine.speed
        if self.model == "rest":
            mass, damping, stiffness, load = self.linear(phi)
            both = np.column_stack([state, tangents])
            right = -damping @ both[n:] * speed - stiffness @ both[:n]
            right[:, 0] += load
            both = np.vstack([both[n:], np.linalg.solve(mass, right) / speed ** 2])
            return both[:, 0], both[:, 1:]
        points = np.vstack([state, state + 1j * STEP * tangents.T]).astype(complex)
        q, v = np.zeros((2, len(points), 6), dtype=complex)
        q[:, self.free], v[:, self.free] = points[:, :n], points[:, n:] * speed
        rates = np.hstack([points[:, n:], self.acceleration(phi, q, v) / speed ** 2])
        return rates[0].real, rates[1:].imag.T / STEP

    def turn(self, state, tolerance=TOLERANCE):
        """The state after a period and the derivative of the map."""
        size = len(state)
        end = 2 * math.pi * self.machine.turns * math.copysign(1.0, self.machine.speed)

        def right(phi, y):
            y = y.reshape(size + 1, size)
            rate, tangents = self.rates(phi, y[0], y[1:].T)
            return np.concatenate([rate, tangents.T.ravel()])

        start = np.concatenate([state, np.eye(size).ravel()])
        # A tangent counts by the whole map's size, a coordinate by the vibration's.
        least = np.concatenate([np.full(size, max(np.max(abs(state)), 1e-6)), np.ones(size * size)]) * tolerance * 1e-2
        last = integrate(right, end, start, least, tolerance)[:, -1]
        return last[:size], last[size:].reshape(size, size).T

    def history(self, state, rows, tolerance=TOLERANCE):
        """The states at `rows` phases of a period and at its end. The steps are so short that interpolation errors are negligible."""
        end = 2 * math.pi * self.machine.turns * math.copysign(1.0, self.machine.speed)
        none = np.zeros((len(state), 0))
        return integrate(lambda phi, y: self.rates(phi, y, none)[0], end, state, np.max(abs(state)) * tolerance * 1e-2, tolerance,
                         t_eval=np.linspace(0.0, end, rows + 1), max_step=2 * math.pi / 200).T

    def solve(self, start=None, rows=ROWS):
        """The periodic vibration, by Newton's method, as `Vibration`."""
        state = np.zeros(2 * len(self.free)) if start is None else start
        if start is None and self.model == "exact":
            state = Reference(self.machine, "rest").solve().state
        for _ in range(20):
            after, map_ = self.turn(state)
            change = np.linalg.solve(np.eye(len(state)) - map_, after - state)
            state = state + change
            if np.max(abs(change)) < 1e-12 * np.max(abs(state)) or self.model == "rest":
                break
        _, map_ = self.turn(state)
        return Vibration(self, state, map_, self.history(state, rows))


class Vibration:
    """A periodic vibration: multipliers, six coordinates and velocities, loads on the ground, torque, at phases of the period."""

    def __init__(self, reference, state, map_, states):
        self.reference, self.state, self.map = reference, state, map_
        machine, n = reference.machine, len(reference.free)
        found = np.linalg.eigvals(map_)
        self.multipliers = found[np.lexsort((-found.imag, -abs(found).round(14)))]
        rows = len(states) - 1
        self.phi = np.linspace(0.0, 2 * math.pi * machine.turns * math.copysign(1.0, machine.speed), rows + 1)
        self.q, self.v, self.a = np.zeros((3, rows + 1, 6))
        self.q[:, reference.free], self.v[:, reference.free] = states[:, :n], states[:, n:2 * n] * machine.speed
        for k, phi in enumerate(self.phi):
            rate, _ = reference.rates(phi, states[k], np.zeros((states.shape[1], 0)))
            self.a[k, reference.free] = rate[n:2 * n] * machine.speed ** 2
        self.forces, self.moment, self.torque = self.measure()

    def measure(self):
        """Forces on the ground of every support, then of all, the moment of all about F at rest, both by the motion, without the static
        ones, the foundation's force as if at F; the torque of the drive. About rest forces and moment are linear in the vibration."""
        own, size = self.reference, 1.0
        if own.model == "rest":
            size = 1j * STEP

        def real(values):
            return values.imag / STEP if own.model == "rest" else values

        q, v = self.q * size, self.v * size
        forces, heads, ground, turned, matrix = own.mounting(q, v)
        forces, ground = own.held - forces, -ground
        # At a head that stays in space forces act where it is, else at its place at rest.
        about = np.where(own.turning[:, None], own.place, heads + q[:, None, :3] if own.model == "exact" else heads)
        moment = np.sum(cross(about, forces), axis=1) + times(turned, np.linalg.solve(np.swapaxes(matrix, 1, 2),
                                                                                      ground[:, 3:, None])[..., 0])
        whole = np.sum(forces, axis=1) + ground[:, :3]
        torque = np.array([self.torque_at(k) for k in range(len(self.phi))])
        return real(np.concatenate([forces, whole[:, None]], axis=1)), real(moment), torque

    def torque_at(self, k):
        """The drive's torque at a phase."""
        own = self.reference
        return own.loads(self.phi[k], self.q[k], self.v[k], self.a[k])[2] / own.machine.speed

    def rms(self):
        return np.sqrt(np.mean(self.q[:-1] ** 2, axis=0))


def write(file, vibration):
    """Writes the time history, one row per phase."""
    places = [*(str(k + 1) for k in range(vibration.forces.shape[1] - 1)), "total"]
    with open(file, "w", newline="") as lines:
        table = csv.writer(lines)
        table.writerow(["crank_deg", *FREEDOMS, *(name + "_dot" for name in FREEDOMS),
                        *(f"f{axis}_{place}_N" for place in places for axis in "xyz"), *(f"m{axis}_total_Nm" for axis in "xyz"),
                        "torque_Nm"])
        for k, phi in enumerate(vibration.phi):
            row = [math.degrees(phi), *vibration.q[k], *vibration.v[k], *vibration.forces[k].ravel(), *vibration.moment[k],
                   vibration.torque[k]]
            table.writerow([f"{value:.16e}" for value in row])


def main():
    from holders import Held

    words = sys.argv[1:]
    file, *rest = words
    text = "\n".join([Path(file).read_text(), *(word for word in rest if word.startswith("&"))]) + "\n"
    options = dict(word.split("=", 1) for word in rest if re.match(r"\w+=", word))
    speeds = [float(word) for word in rest if re.match(r"-?[\d.]+$", word)]
    for speed in speeds or [Machine(text).speed * 30 / math.pi]:
        machine = Machine(text).changed(*(float(options.get(key, 1.0)) for key in ("scale", "damping")))
        machine.speed = speed * math.pi / 30
        for model in options.get("model", "rest,exact").split(","):
            found = (Held if machine.held_by != "motor" else Reference)(machine, model).solve()
            print(f"{Path(file).name} at {speed:g} rpm, {model}: greatest |rho| {max(abs(found.multipliers)):.12f}")
            for rho in found.multipliers:
                print(f"    {rho.real: .14e} {rho.imag: .14e}  {abs(rho):.14f}")
            print("    rms " + " ".join(f"{name} {value:.13e}" for name, value in zip(FREEDOMS, found.rms())))
            print(f"    force on the ground up to {np.max(np.linalg.norm(found.forces[:, -1], axis=1)):.10e} N, moment "
                  f"{np.max(np.linalg.norm(found.moment, axis=1)):.10e} N m, torque {np.max(abs(found.torque)):.10e} N m", flush=True)
            if "out" in options:
                write(options["out"], found)
    return 0


if __name__ == "__main__":
    sys.exit(main())
