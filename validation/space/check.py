"""Checks of the reference.

    python check.py INPUT ...                   the loads of inertia, by three ways
    python check.py GESTELL INPUT [SPEED_RPM]   plane machines: beside Gestell, in the plane and in one that is tilted

The inertia forces of random motions, summed link by link (newton_euler.py), are compared with sums S, J, H over the masses, and
with derivatives of momentum and angular momentum, computed only from positions and attitudes in space along an analytic motion.
A plane machine must have Gestell's results, and the same in a plane that is tilted against all axes, with six degrees of
freedom. (About rest the torques differ in third order: here they are computed from the exact kinematics along that vibration.)
"""

import csv
import math
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from machine import Machine, cross_matrix, turn
from newton_euler import ROWS, Reference, cross, dot, rotation, spin_matrix, spin_rate, times


def by_sums(reference, phi, q, v, a):
    """Force in space and moment in the frame's axes by S, J, H of the moving masses and of the frame."""
    machine, speed = reference.machine, reference.machine.speed
    (r, r1, r2), attitude, spin, gain = reference.links.at(phi)
    r1, r2, spin, gain = r1 * speed, r2 * speed ** 2, spin * speed, gain * speed ** 2
    m = reference.links.masses
    own = attitude @ (reference.links.principal[:, :, None] * attitude.transpose(0, 2, 1))
    s, s1, s2 = m @ r, m @ r1, m @ r2
    inertia = machine.inertia + np.sum(own, axis=0) + sum(m * dot(r, r)) * np.eye(3) - np.einsum("k,ki,kj", m, r, r)
    skew = cross_matrix(spin)
    inertia1 = np.sum(skew @ own - own @ skew, axis=0) + 2 * sum(m * dot(r, r1)) * np.eye(3)
    inertia1 -= np.einsum("k,ki,kj", m, r1, r) + np.einsum("k,ki,kj", m, r, r1)
    angular = m @ cross(r, r1) + np.sum(times(own, spin), axis=0)
    angular1 = m @ cross(r, r2) + np.sum(times(own, gain) + cross(spin, times(own, spin)), axis=0)
    turned = rotation(q[3:])
    w = spin_matrix(q[3:]) @ v[3:]
    dw = spin_matrix(q[3:]) @ a[3:] + spin_rate(q[3:], v[3:])
    force = (machine.mass + sum(m)) * a[:3] + turned @ (s2 + 2 * cross(w, s1) + cross(dw, s) + cross(w, cross(w, s)))
    moment = inertia @ dw + inertia1 @ w + cross(w, inertia @ w) + angular1 + cross(w, angular) + cross(s, turned.T @ a[:3])
    return force, moment


def by_places(reference, phi, q, v, a, points=96, radius=0.4):
    """The same from derivatives over time of positions and attitudes in space, by Cauchy's integral on a circle about the time."""
    machine, m, speed = reference.machine, reference.links.masses, reference.machine.speed
    radius /= abs(speed)
    circle = np.exp(2j * math.pi * np.arange(points) / points)
    places, attitudes, frames = [], [], []
    for t in radius * circle:
        r, attitude, _, _ = reference.links.at(phi + speed * t)
        now = q + v * t + a * t * t / 2
        turned = rotation(now[3:])
        places.append(np.vstack([now[:3], now[:3] + r[0] @ turned.T]))
        attitudes.append(turned @ np.concatenate([np.eye(3)[None], attitude]))
        frames.append(turned)

    def derivative(values, order=1):
        return math.factorial(order) * np.tensordot(circle ** -order, np.array(values), 1).real / (points * radius ** order)

    # Angular momentum of every body on the circle, from its attitude's derivative there.
    terms = np.fft.fft(np.array(attitudes), axis=0) / points
    terms[points // 2:] = 0
    rates = np.fft.ifft(terms * np.arange(points)[:, None, None, None], axis=0) * points / (radius * circle[:, None, None, None])
    principal = np.concatenate([machine.inertia[None], [np.diag(row) for row in reference.links.principal]])
    skew = rates @ np.swapaxes(attitudes, 2, 3)
    spin = np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)
    momentum = times(attitudes @ principal @ np.swapaxes(attitudes, 2, 3), spin)
    moving = derivative(places, 2) * np.concatenate([[machine.mass], m])[:, None]
    arms = np.mean(places, axis=0).real - q[:3]
    moment = np.sum(cross(arms, moving), axis=0) + np.sum(derivative(momentum), axis=0)
    return np.sum(moving, axis=0), rotation(q[3:]).T @ moment


def derivation(file):
    """The largest differences of both from the sum over the links, relative to the load's size."""
    reference = Reference(Machine(Path(file).read_text()))
    chance, worst = np.random.default_rng(1), np.zeros(2)
    speed = abs(reference.machine.speed)
    for _ in range(50):
        q, v, a = chance.uniform(-0.5, 0.5, (3, 6)) * np.array([[1.0], [speed], [speed ** 2]])
        phi = chance.uniform(0.0, 7.0)
        force, moment, _ = reference.loads(phi, q, v, a)
        for k, way in enumerate((by_sums, by_places)):
            other = way(reference, phi, q, v, a)
            worst[k] = max(worst[k], *(np.max(abs(x - y)) / np.max(abs(x)) for x, y in zip((force, moment), other)))
    print(f"{Path(file).name}: loads of inertia by S, J, H differ by {worst[0]:.1e} of their size, by places in space by {worst[1]:.1e}")
    return max(worst[0], worst[1] / 10) < 1e-12


def tilted(machine, turned):
    """A plane machine rotated in space as a whole, with six degrees of freedom; supports also hold it across its plane."""
    other = Machine.__new__(Machine)
    other.__dict__.update(machine.__dict__)
    other.free = list(range(6))
    flat = machine.inertia[2, 2]
    other.inertia = turned @ np.diag([0.7 * flat, 0.8 * flat, flat]) @ turned.T
    mechanisms = []
    for mechanism in machine.mechanisms:
        copy = object.__new__(type(mechanism))
        copy.__dict__.update(mechanism.__dict__)
        copy.place, copy.axes = turned @ mechanism.place, turned @ mechanism.axes
        mechanisms.append(copy)
    other.mechanisms = mechanisms
    mounts = [(turned @ place, turned @ axes, np.array([*k[:2], k[0]]), np.array([*b[:2], b[0]]), turning)
              for place, axes, k, b, turning in machine.mounts()]
    # Two mounts do not hold the frame about the line between them: one more is added away from it, acting across the plane only.
    mounts += [(turned @ np.array([0.0, 0.3, 0.0]), turned, np.array([0.0, 0.0, mounts[0][2][2]]), np.zeros(3), False)]
    other.mounts = lambda: mounts
    grounds = {key: machine.grounding(key) for key in ("stiffness", "damping")}
    whole = np.kron(np.eye(2), turned)
    other.grounding = lambda key: whole @ grounds[key] @ whole.T
    g = machine.weight()
    other.weight = lambda: turned @ g
    return other


def gestell(program, file, speed, model, folder):
    """Multipliers, coordinates, forces with the moment, torque over a period."""
    subprocess.run([program, "-q", "-o", folder, "-s", "case.tasks=stability,response,power", "-s", f"model.frame={model}",
                    "-s", f"response.points={ROWS}", "-s", f"drive.speed_rpm={speed!r}", "-s", "accuracy.tolerance=1e-13", file],
                   check=True)
    tables = {}
    for name in ("multipliers", "response", "power"):
        with open(Path(folder) / f"{name}.csv") as lines:
            tables[name] = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    rho = np.array([complex(float(row["re"]), float(row["im"])) for row in tables["multipliers"]])
    response = np.array([[float(row[key]) for key in ("xi_m", "eta_m", "psi_rad", "fx_N", "fy_N", "m_Nm")] for row in tables["response"]])
    return rho, response, np.array([float(row["torque_Nm"]) for row in tables["power"]])


def off(ours, theirs):
    return np.max(abs(ours - theirs)) / np.max(abs(ours))


def beside_gestell(program, file, speed):
    """Compares a plane machine, flat and tilted, with Gestell."""
    text, worst = Path(file).read_text(), 0.0
    machine = Machine(text).driven_by_motor()
    machine.speed = (float(speed) if speed else machine.speed * 30 / math.pi) * math.pi / 30
    turned = turn([0.0, 0.0, 1.0], 0.4) @ turn([0.0, 1.0, 0.0], -0.9) @ turn([1.0, 0.0, 0.0], 0.7)
    for model in ("rest", "exact"):
        with tempfile.TemporaryDirectory() as folder:
            rho, response, torque = gestell(program, file, machine.speed * 30 / math.pi, model, folder)
        for case, back in ((machine, np.eye(3)), (tilted(machine, turned), turned)):
            found = Reference(case, model).solve()
            miss = max(np.min(abs(found.multipliers - value)) for value in rho)
            motion, turns, forces, moment = found.q[:, :3] @ back, found.q[:, 3:] @ back, found.forces[:, -1] @ back, found.moment @ back
            ours = np.column_stack([motion[:, :2], turns[:, 2], forces[:, :2], moment[:, 2]])
            moved, pulled = (max(off(response[:, k], ours[:, k]) for k in some) for some in ((0, 1, 2), (3, 4, 5)))
            twisted = off(torque, found.torque)
            across = max(np.max(abs(motion[:, 2])), np.max(abs(turns[:, :2])))
            worst = max(worst, miss, moved, pulled, twisted if model == "exact" else 0.0, across)
            print(f"{Path(file).name} at {machine.speed * 30 / math.pi:g} rpm, {model}{'' if case is machine else ', tilted'}: multipliers "
                  f"differ from Gestell's by {miss:.1e}, vibration by {moved:.1e}, forces by {pulled:.1e}, torque by {twisted:.1e}; motion "
                  f"across the plane {across:.1e}", flush=True)
    return worst < 1e-9


def main():
    words = sys.argv[1:]
    if all(word.endswith(".nml") for word in words):
        return 0 if all([derivation(word) for word in words]) else 1
    program, file, *speed = words
    return 0 if beside_gestell(program, file, *(speed or [None])) else 1


if __name__ == "__main__":
    sys.exit(main())
