"""Reads a frame in space that carries plane mechanisms from an input: positions, axes, speeds, mounts. Nothing of Gestell is used.

`Machine(text)` reads the groups; a `Mechanism` is a linkage of the plane with its place on the frame.
"""

import math
import sys
from fractions import Fraction
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "exudyn"))
from linkage import Linkage, groups  # noqa: E402

FREEDOMS = ("xi", "eta", "zeta", "rot_xi", "rot_eta", "psi")


def cross_matrix(a):
    """[a]x: of a vector, or of many along the leading axes."""
    a = np.asarray(a)
    matrix = np.zeros((*a.shape, 3), dtype=a.dtype)
    matrix[..., 0, 1], matrix[..., 0, 2], matrix[..., 1, 2] = -a[..., 2], a[..., 1], -a[..., 0]
    matrix[..., 1, 0], matrix[..., 2, 0], matrix[..., 2, 1] = a[..., 2], -a[..., 1], a[..., 0]
    return matrix


def turn(axis, angle):
    """The rotation about a unit vector."""
    skew = cross_matrix(np.array(axis, dtype=float))
    return np.eye(3) + math.sin(angle) * skew + (1 - math.cos(angle)) * skew @ skew


def in_space(values, rest=0.0):
    """Extends two values to three."""
    return np.array([*values, rest][:3], dtype=float)


class Mechanism(Linkage):
    """A linkage of the plane at its place on the frame. Columns of `axes`: its x, y and normal in the frame's axes."""

    def __init__(self, name, keys, joints, links, origin):
        super().__init__(joints, links)
        self.name = name
        self.place = in_space(origin) + in_space(keys.get("origin", [0.0, 0.0]))
        normal = np.array(keys.get("axis", [0.0, 0.0, 1.0]))
        normal = normal / np.linalg.norm(normal)
        if "x_axis" in keys:
            x = np.array(keys["x_axis"])
            x = x - (x @ normal) * normal
        elif normal[2] < -1 + 1e-14:
            x = np.array([1.0, 0.0, 0.0])
        else:
            # The shortest turn that takes zeta to the normal: about zeta x normal.
            about = np.cross([0.0, 0.0, 1.0], normal)
            skew = cross_matrix(about)
            x = (np.eye(3) + skew + skew @ skew / (1 + normal[2]))[:, 0]
        x = turn(normal, math.radians(keys.get("angle", [0.0])[0])) @ (x / np.linalg.norm(x))
        self.axes = np.array([x, np.cross(normal, x), normal]).T
        self.phase = math.radians(keys.get("phase", [0.0])[0])
        self.ratio = Fraction(*(int(word) for word in keys.get("ratio", [1.0])))

    def crank(self, phi):
        """The angle by which its crank has turned, without its own phase, at the drive's angle phi."""
        return self.phase + float(self.ratio) * phi


def inertias(link):
    """Moments of inertia of a link about its own axes: along, across, normal."""
    values = link["inertia"]
    return np.array(values if len(values) == 3 else [0.0, values[0], values[0]])


class Machine:
    """An input: frame, mounts, mechanisms. `free`: the numbers of the free degrees of freedom."""

    def __init__(self, text):
        self.supports, self.foundation, self.gravity, found, repeats = [], {}, None, {}, []
        joints, links = [], []
        for name, keys in groups(text):
            if name == "joint":
                joints.append(keys)
            elif name == "link":
                links.append(keys)
            elif name == "support":
                self.supports.append(keys)
            elif name == "foundation":
                self.foundation = keys
            elif name == "gravity":
                self.gravity = keys
            elif name == "frame":
                self.frame = keys
            elif name == "mechanism":
                found[keys["name"][0]] = keys
            elif name == "repeat":
                repeats.append(keys)
            elif name == "drive":
                self.speed = keys["speed_rpm"][0] * math.pi / 30
                self.held_by = keys.get("held_by", ["motor"])[0]
                self.flywheel = keys.get("flywheel_inertia", [0.0])[0]
        found = found or {"": {}}
        origin = self.frame.get("origin", [0.0, 0.0])
        only = next(iter(found)) if len(found) == 1 else None
        parts = {name: ({joint["name"][0]: joint for joint in joints if joint.get("mechanism", [only])[0] == name},
                        [link for link in links if link.get("mechanism", [only])[0] == name]) for name in found}
        for keys in repeats:
            name, of = keys["name"][0], keys["of"][0]
            parts[name] = parts[of]
            found[name] = {**found[of], **keys}
        self.mechanisms = [Mechanism(name, keys, *parts[name], origin) for name, keys in found.items()]
        dof = self.frame.get("dof", ["xi", "eta", "psi"])
        self.free = [k for k, name in enumerate(FREEDOMS) if name in dof]
        self.mass, self.inertia = self.frame["mass"][0], self.tensor(self.frame["inertia"])
        # Turns of the drive after which every mechanism is where it was.
        self.turns = math.lcm(*(mechanism.ratio.denominator for mechanism in self.mechanisms))

    def driven_by_motor(self):
        """The machine itself; fails unless a motor on the frame drives it."""
        if self.held_by != "motor":
            raise SystemExit("held_by: only the motor's drive is built here")
        return self

    def changed(self, links=1.0, damping=1.0):
        """The machine with the masses of all links and the dampers of all supports multiplied."""
        moving = {id(link): link for mechanism in self.mechanisms for link in mechanism.links}
        for parts, keys, factor in ((self.supports, ("damping",), damping), (moving.values(), ("mass", "inertia"), links)):
            for part in parts:
                part.update({key: [factor * value for value in part[key]] for key in keys if key in part})
        return self

    def tensor(self, values):
        """The frame's tensor of inertia about F."""
        if len(values) == 1:
            if {3, 4} & set(self.free):
                raise SystemExit("the frame's inertia needs 3 or 6 values")
            return np.diag([0.0, 0.0, values[0]])
        xx, yy, zz, xy, xz, yz = [*values, 0.0, 0.0, 0.0][:6]
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    @property
    def period(self):
        return self.turns * 2 * math.pi / abs(self.speed)

    def mounts(self):
        """Place, axes (columns), stiffness and damping along them, whether the axes turn with the frame, of every support."""
        found = []
        for support in self.supports:
            yaw, pitch, roll = (math.radians(word) for word in [*support.get("angle", [0.0]), 0.0, 0.0][:3])
            axes = turn([0, 0, 1], yaw) @ turn([0, 1, 0], pitch) @ turn([1, 0, 0], roll)
            found.append((in_space(support["position"]), axes, in_space(support["stiffness"]),
                          in_space(support.get("damping", [0.0, 0.0])), support.get("axes") == ["frame"]))
        return found

    def grounding(self, key):
        """The foundation's matrix of stiffness or damping in the six coordinates."""
        values = np.array(self.foundation.get(key, [0.0]))
        order, whole = [0, 1, 5, 2, 3, 4], np.zeros((6, 6))  # xi, eta, psi, zeta, rot_xi, rot_eta
        if len(values) in (3, 9):
            whole[np.ix_(order[:3], order[:3])] = np.diag(values) if len(values) == 3 else values.reshape(3, 3)
        elif len(values) in (6, 36):
            whole[np.ix_(order, order)] = np.diag(values) if len(values) == 6 else values.reshape(6, 6)
        return whole

    def weight(self):
        """The acceleration of gravity in space."""
        if self.gravity is None:
            return np.zeros(3)
        size, direction = self.gravity.get("acceleration", [9.80665])[0], self.gravity.get("direction", [-90.0])
        if len(direction) == 3:
            return size * np.array(direction) / np.linalg.norm(direction)
        angle = math.radians(direction[0])
        return size * np.array([math.cos(angle), math.sin(angle), 0.0])
