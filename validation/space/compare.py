"""Compares the frame in space by Exudyn, a general program of multibody dynamics, with the reference of newton_euler.py.

    python compare.py INPUT [SPEED_RPM ...] ['&GROUP KEY=VALUE /' ...] [steps=N] [step=H] [scale=FACTOR] [damping=FACTOR]
        [gestell=PROGRAM]

needs numpy, SciPy and Exudyn (pip install exudyn==1.13.6 numpy scipy). The machine is built from the input: the frame and all
links are rigid bodies, joined by revolute and prismatic joints to a tree, by constraints where loops close; supports are
springs and dampers with axes fixed in space; the cranks are driven by constraints. Of Gestell and the reference only the state
is used from which the search for the fixed point starts. The map of one period comes from integration in time (trapezoidal
rule, extrapolated from three numbers of steps), its fixed point is the vibration, its central differences give the multipliers.
From that vibration on six coordinates, forces of supports and torque of the drive are measured over the period. With scale= the
masses of all links are multiplied: the model about rest then differs by the square of it. With damping= all dampers are
multiplied. With gestell= the forces in the pins that close loops (Lagrange multipliers) are compared with Gestell's joint forces.
"""

import csv
import math
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import exudyn as exu
import exudyn.itemInterface as item
import numpy as np
from machine import Machine, cross_matrix, inertias
from newton_euler import Reference
from scipy.spatial.transform import Rotation

# Steps of the integration in a turn of the drive, the first time; rows of a period, all at even steps, where errors have even powers of
# the step; step of the differences (m, rad).
STEPS = 400
ROWS = 200
STEP = 3e-5
JOINTS = exu.JointType
SLIDES, HINGES = ([getattr(JOINTS, kind + axis) for axis in "XYZ"] for kind in ("Prismatic", "Revolute"))


def about(k, angle):
    """The rotation about the axis k of three."""
    return Rotation.from_rotvec(angle * np.eye(3)[k]).as_matrix()


def spin(theta, rate):
    """The angular velocity in space of a rotation vector and its rate."""
    s = np.linalg.norm(theta)
    skew = cross_matrix(theta)
    near = s < 1e-3
    a = 0.5 - s * s / 24 if near else (1 - math.cos(s)) / s ** 2
    b = 1 / 6 - s * s / 120 if near else (s - math.sin(s)) / s ** 3
    return np.eye(3) + a * skew + b * skew @ skew if rate is None else (np.eye(3) + a * skew + b * skew @ skew) @ rate


def gimbal(angles):
    """The angular velocity in space by the rates of rotations about xi, the new eta, the new zeta."""
    first = about(0, angles[0])
    return np.column_stack([[1.0, 0.0, 0.0], first[:, 1], (first @ about(1, angles[1]))[:, 2]])


def extrapolated(found):
    """Extrapolates to steps of zero length from three step lengths, each half of the one before; errors have even powers only."""
    first, second, third = found
    first, second = second + (second - first) / 3, third + (third - second) / 3
    return second + (second - first) / 15


class Body:
    """A link of the tree: its parent, the joint to it, its mass."""

    def __init__(self, parent, kind, turned, offset):
        self.parent, self.kind, self.turned, self.offset = parent, kind, turned, offset
        self.mass, self.center, self.inertia = 0.0, np.zeros(3), np.zeros((3, 3))

    def add(self, mass, center, inertia):
        """Adds another mass with its inertia about its own centre."""
        whole = self.mass + mass
        if whole == 0.0:
            self.inertia = self.inertia + inertia
            return
        between = np.array(center) - self.center
        reduced = self.mass * mass / whole
        self.inertia = self.inertia + inertia + reduced * (between @ between * np.eye(3) - np.outer(between, between))
        self.center = (self.mass * self.center + mass * np.array(center)) / whole
        self.mass = whole


class Assembly:
    """One mechanism as part of the tree: bodies, constraints, its coordinates at a crank angle."""

    def __init__(self, mechanism, tree, frame):
        self.mechanism, self.tree, self.frame = mechanism, tree, frame
        self.at, self.points, alike, lines = mechanism.assemble()
        pairs = dict((k, one) for one, k in alike if one != 0)
        still = [k for one, k in alike if one == 0]
        order = list(mechanism.joints)
        # Number in the tree and point of origin of each body; 0 is the frame.
        self.number, self.origin, self.angle = {0: frame}, {0: np.zeros(2)}, {0: 0.0}
        self.pivot, self.coordinates, self.met = {}, [], set()
        links = list(enumerate(mechanism.links, 1))
        links.sort(key=lambda pair: max(order.index(pair[1][key][0]) for key in ("from", "to") if key in pair[1]))
        sliding = {}
        for k, link in links:
            start = link["from"][0]
            if k in pairs:
                self.join(k, pairs[k])
            elif k in still:
                known = 0 if 0 in self.points[start] else sliding.get(start)
                if known is not None:
                    self.join(k, known)
                else:
                    self.slide(k, start, [line for line in lines if line[0] == start and line[1] == 0])
                    sliding[start] = k
            else:
                self.hinge(k, link)
        for k, link in enumerate(mechanism.links, 1):
            self.load(k, link)
        # Where bodies meet without being joined by the tree.
        self.meetings = []
        for name, bodies in self.points.items():
            groups = []
            for body in dict.fromkeys(self.root(k) for k in bodies):
                joined = [group for group in groups if any((name, *sorted((body, other))) in self.met for other in group)]
                groups = [group for group in groups if group not in joined] + [sum(joined, []) + [body]]
            self.meetings += [(name, groups[0][0], group[0]) for group in groups[1:]]
        self.lines = [(next(k for k in map(self.root, self.points[point]) if k != self.root(body)), point, self.root(body), place, along)
                      for point, body, place, along in lines if (point, body) not in self.met]
        crank = next(name for name, joint in mechanism.joints.items() if joint["type"][0] == "crank")
        pivot = mechanism.joints[crank]["pivot"][0]
        self.driven = self.number[next(k for k, link in links if link["from"] == [pivot] and link.get("to") == [crank])]

    def root(self, k):
        """The body that carries a link."""
        return next(j for j in self.number if j in self.pivot or j == 0 if self.number[j] == self.number[k])

    def join(self, k, other):
        self.number[k], self.origin[k], self.angle[k] = self.number[other], self.origin[other], self.angle[other]

    def local(self, k, point, height=0.0):
        """A point of the plane at the reference in a body's axes."""
        if self.root(k) == 0:
            return self.mechanism.place + self.mechanism.axes @ np.array([*point, height])
        away = point - self.origin[k]
        c, s = math.cos(self.angle[k]), math.sin(self.angle[k])
        return np.array([c * away[0] + s * away[1], -s * away[0] + c * away[1], height])

    def within(self, k, direction):
        """The matrix whose columns are a direction of the plane, the one across it and the normal, in a body's axes."""
        angle = math.atan2(direction[1], direction[0]) - self.angle[k]
        return (self.mechanism.axes if self.root(k) == 0 else np.eye(3)) @ about(2, angle)

    def hinge(self, k, link):
        start = link["from"][0]
        parent = self.root(next(j for j in self.points[start] if j != k and j in self.number))
        _, angle = self.mechanism.pose(link, self.at)
        turned = self.within(parent, np.array([1.0, 0.0])) if parent == 0 else np.eye(3)
        self.tree.append(Body(self.number[parent], JOINTS.RevoluteZ, turned, self.local(parent, self.at[start])))
        self.number[k], self.origin[k], self.angle[k] = len(self.tree) - 1, self.at[start], angle
        self.pivot[k] = start
        self.met.add((start, *sorted((parent, k))))

        def value(poses, links=self.mechanism.links, one=k - 1, other=parent - 1):
            return poses[one][1] - (poses[other][1] if other >= 0 else 0.0)

        self.coordinates.append(value)

    def slide(self, k, start, guides):
        """A link that does not turn, on a guide of the frame or on two slides."""
        along = [guides[0][3] / np.hypot(*guides[0][3])] if guides else [np.array([1.0, 0.0]), np.array([0.0, 1.0])]
        parent, offset, turned = self.frame, self.local(0, self.at[start]), self.mechanism.axes
        for axis, kind in zip(along, (JOINTS.PrismaticX, JOINTS.PrismaticY)):
            if guides:
                turned = self.within(0, axis)
                self.met.add((start, 0))
            self.tree.append(Body(parent, kind, turned, offset))
            parent, turned, offset = len(self.tree) - 1, np.eye(3), np.zeros(3)

            def value(poses, one=k - 1, axis=axis, origin=self.at[start]):
                return axis @ (poses[one][2] - origin)

            self.coordinates.append(value)
        self.number[k], self.origin[k], self.pivot[k] = parent, self.at[start], start
        self.angle[k] = math.atan2(along[0][1], along[0][0])

    def load(self, k, link):
        """Its mass on the body that carries it."""
        center, angle = self.mechanism.pose(link, self.at)
        turned = self.within(k, np.array([math.cos(angle), math.sin(angle)]))
        place = self.local(k, center, link.get("z", [0.0])[0])
        self.tree[self.number[k]].add(link["mass"][0], place, turned @ np.diag(inertias(link)) @ turned.T)

    def poses(self, x):
        at = self.mechanism.points(x)
        return [(*self.mechanism.pose(link, at), at[link["from"][0]]) for link in self.mechanism.links]

    def start(self, speed):
        """Coordinates and velocities at the drive's angle 0."""
        x, step = self.mechanism.crank(0.0), 1e-3
        stations = [[value(self.poses(x + j * step)) for value in self.coordinates] for j in (0, -3, -2, -1, 1, 2, 3)]
        stations = np.unwrap(stations, axis=0)
        weights = np.array([-1, 9, -45, 45, -9, 1]) / (60 * step)
        return stations[0], weights @ stations[1:] * speed * float(self.mechanism.ratio)


class Model:
    """The machine in Exudyn; `turn` maps the frame's state (six coordinates, six velocities by the speed) over a period."""

    def __init__(self, machine, recording=False):
        self.machine, self.recording, self.free = machine, recording, machine.free
        if machine.foundation or any(mount[4] for mount in machine.mounts()) or self.free not in ([0, 1, 5], [0, 1, 2, 3, 4, 5]):
            raise SystemExit("not built here: a foundation, axes that turn, freedoms but those of the plane or all six")
        self.container = exu.SystemContainer()
        self.mbs = mbs = self.container.AddSystem()
        self.tree = tree = [Body(k - 1, kind, np.eye(3), np.zeros(3)) for k, kind in enumerate(SLIDES + HINGES)]
        tree[5].add(machine.mass, np.zeros(3), machine.inertia)
        self.parts = [Assembly(mechanism, tree, 5) for mechanism in machine.mechanisms]
        node = mbs.AddNode(item.NodeGenericODE2(referenceCoordinates=[0.0] * len(tree), initialCoordinates=[0.0] * len(tree),
                                                initialCoordinates_t=[0.0] * len(tree), numberOfODE2Coordinates=len(tree)))
        self.body = mbs.AddObject(item.ObjectKinematicTree(
            nodeNumber=node, gravity=machine.weight(), jointTypes=[body.kind for body in tree], linkParents=[body.parent for body in tree],
            jointTransformations=exu.Matrix3DList([body.turned for body in tree]),
            jointOffsets=exu.Vector3DList([body.offset for body in tree]), linkMasses=[body.mass for body in tree],
            linkCOMs=exu.Vector3DList([body.center for body in tree]), linkInertiasCOM=exu.Matrix3DList([body.inertia for body in tree])))
        still = mbs.AddObject(item.ObjectGround())
        self.springs = []
        # Springs carry the weights in the position in which the frame is drawn.
        self.static = Reference(machine).held
        for (place, axes, stiffness, damping, _), static in zip(machine.mounts(), self.static):
            ends = [mbs.AddMarker(item.MarkerBodyRigid(bodyNumber=still, localHT=exu.HT(rotation=axes, translation=place))),
                    self.marker(5, place, axes)]
            self.springs.append((axes, mbs.AddObject(item.RigidBodySpringDamper(
                markerNumbers=ends, stiffness=np.diag([*stiffness, 0.0, 0.0, 0.0]), damping=np.diag([*damping, 0.0, 0.0, 0.0]),
                offset=[*np.divide(axes.T @ static, stiffness, out=np.zeros(3), where=stiffness > 0), 0.0, 0.0, 0.0]))))
        # Pins that close loops: their joints in Exudyn, under Gestell's names
        self.pins = {}
        for part in self.parts:
            self.close(part)
        nothing = mbs.AddNode(item.NodePointGround())
        for k in range(6):
            if k not in self.free:
                self.constrain(nothing, node, k)
        for part in self.parts:
            ratio = float(part.mechanism.ratio)
            self.constrain(nothing, node, part.driven, machine.speed * ratio)
        if recording:
            kinds = exu.OutputVariableType
            self.sensors = [mbs.AddSensor(item.SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=kind))
                            for kind in (kinds.Coordinates, kinds.Coordinates_t)]
            self.gauges = [mbs.AddSensor(item.SensorObject(objectNumber=spring, storeInternal=True, outputVariableType=kinds.ForceLocal))
                           for _, spring in self.springs]
            self.multipliers = mbs.AddSensor(item.SensorUserFunction(
                sensorNumbers=[], factors=[], storeInternal=True,
                sensorUserFunction=lambda mbs, *_: list(mbs.systemData.GetAECoordinates())))
        mbs.Assemble()

    def marker(self, number, place, axes):
        return self.mbs.AddMarker(item.MarkerKinematicTreeRigid(
            objectNumber=self.body, linkNumber=number, localHT=exu.HT(rotation=axes, translation=place)))

    def constrain(self, nothing, node, coordinate, speed=None):
        markers = [self.mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=one, coordinate=k))
                   for one, k in ((nothing, 0), (node, coordinate))]
        driven = {} if speed is None else {"velocityLevel": True, "offset": speed}
        self.mbs.AddObject(item.CoordinateConstraint(markerNumbers=markers, **driven))

    def close(self, part):
        """Closes the loops of a mechanism, in its plane only: the tree keeps its bodies there."""
        for name, one, other in part.meetings:
            pin = self.meet(part, one, other, part.at[name], part.at[name], np.eye(3), [1, 1, 0, 0, 0, 0])
            body = part.mechanism.links[one - 1]["name"][0]
            # Gestell names the parts of copies after the copy.
            copy = any(other.joints is part.mechanism.joints for other in self.machine.mechanisms[:self.parts.index(part)])
            prefix = f"{part.mechanism.name}." if copy else ""
            self.pins[f"{prefix}{name}:{prefix}{body}"] = pin
        for one, point, body, place, along in part.lines:
            self.meet(part, body, one, place, part.at[point], part.within(body, along), [0, 1, 0, 0, 0, 0])

    def meet(self, part, one, other, place, point, turned, axes):
        markers = [self.marker(part.number[one], part.local(one, place), turned),
                   self.marker(part.number[other], part.local(other, point), np.eye(3))]
        return self.mbs.AddObject(item.GenericJoint(markerNumbers=markers, constrainedAxes=axes))

    def start(self, state):
        """Coordinates and velocities of the tree for the frame's state."""
        q, v = np.zeros((2, 6))
        q[self.free], v[self.free] = state[:len(self.free)], state[len(self.free):] * self.machine.speed
        turned = Rotation.from_rotvec(q[3:]).as_matrix()
        angles = np.array([math.atan2(-turned[1, 2], turned[2, 2]), math.asin(turned[0, 2]), math.atan2(-turned[0, 1], turned[0, 0])])
        rates = np.linalg.solve(gimbal(angles), spin(q[3:], v[3:]))
        parts = [part.start(self.machine.speed) for part in self.parts]
        return (np.concatenate([q[:3], angles, *(part[0] for part in parts)]),
                np.concatenate([v[:3], rates, *(part[1] for part in parts)]))

    def frame(self, q, v):
        """Six coordinates and velocities from those of the tree."""
        turned = about(0, q[3]) @ about(1, q[4]) @ about(2, q[5])
        theta = Rotation.from_matrix(turned).as_rotvec()
        rate = np.linalg.solve(spin(theta, None), gimbal(q[3:6]) @ v[3:6])
        return np.concatenate([q[:3], theta]), np.concatenate([v[:3], rate])

    def integrate(self, state, steps):
        q, v = self.start(state)
        data = self.mbs.systemData
        data.SetODE2Coordinates(q, configuration=exu.ConfigurationType.Initial)
        data.SetODE2Coordinates_t(v, configuration=exu.ConfigurationType.Initial)
        settings = exu.SimulationSettings()
        settings.timeIntegration.numberOfSteps = steps
        settings.timeIntegration.endTime = self.machine.period
        settings.timeIntegration.generalizedAlpha.spectralRadius = 1
        # Constraints of the velocities: with those of the positions the multipliers oscillate from step to step.
        settings.timeIntegration.generalizedAlpha.useNewmark = self.recording
        settings.timeIntegration.generalizedAlpha.useIndex2Constraints = self.recording
        settings.timeIntegration.newton.relativeTolerance = 1e-12
        settings.timeIntegration.newton.absoluteTolerance = 1e-12
        settings.timeIntegration.newton.useModifiedNewton = True
        settings.timeIntegration.verboseMode = 0
        settings.solution.file.write = False
        settings.solution.sensors.active = self.recording
        settings.solution.sensors.writePeriod = self.machine.period / ROWS
        settings.show.computationTime = False
        if not self.mbs.SolveDynamic(settings):
            raise SystemExit("Exudyn did not get round")
        q, v = self.frame(data.GetODE2Coordinates(), data.GetODE2Coordinates_t())
        return np.concatenate([q[self.free], v[self.free] / self.machine.speed])

    def turn(self, state):
        return extrapolated([self.integrate(state, k * STEPS * self.machine.turns) for k in (1, 2, 4)])

    def derivative(self, state):
        columns = [(self.turn(state + step) - self.turn(state - step)) / (2 * STEP) for step in STEP * np.eye(len(state))]
        return np.array(columns).T

    def periodic(self, state):
        """The vibration and the derivative of the map there, computed again if the vibration has moved."""
        map_, taken = self.derivative(state), state
        for _ in range(8):
            change = np.linalg.solve(np.eye(len(state)) - map_, self.turn(state) - state)
            state = state + change
            if np.all(abs(change) < 1e-9 * (np.max(abs(state)) + STEP)):
                break
            if np.any(abs(state - taken) > 1e-2 * STEP):
                map_, taken = self.derivative(state), state
        return state, map_

    def record(self, state, steps):
        self.integrate(state, steps)
        q, v = (self.mbs.GetSensorStoredData(sensor)[:, 1:] for sensor in self.sensors)
        moved = np.array([self.frame(*row)[0] for row in zip(q, v)])
        forces = np.array([self.mbs.GetSensorStoredData(gauge)[:, 1:4] @ axes.T + static
                           for gauge, (axes, _), static in zip(self.gauges, self.springs, self.static)])
        energy, lost = np.array([self.energy(*row) for row in zip(q, v)]).T
        found = self.mbs.GetSensorStoredData(self.multipliers)[:, 1:]
        pins = np.array([found[:, self.mbs.systemData.GetObjectLTGAE(pin)[:2]] for pin in self.pins.values()])
        return moved, forces.transpose(1, 0, 2), energy, lost, pins

    def energy(self, q, v):
        """Energy of bodies and springs, and the dampers' power."""
        # Of each body its axes, its joint's place and velocity, its angular velocity.
        known, kinetic = {-1: (np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3))}, 0.0
        for k, body in enumerate(self.tree):
            axes, place, speed, w = known[body.parent]
            arm, axes = axes @ body.offset, axes @ body.turned
            if body.kind in SLIDES:
                along = axes[:, SLIDES.index(body.kind)]
                arm = arm + along * q[k]
                speed = speed + np.cross(w, arm) + along * v[k]
            else:
                k_axis = HINGES.index(body.kind)
                speed, w = speed + np.cross(w, arm), w + axes[:, k_axis] * v[k]
                axes = axes @ about(k_axis, q[k])
            known[k] = axes, place + arm, speed, w
            moving, own = speed + np.cross(w, axes @ body.center), axes.T @ w
            kinetic += (body.mass * moving @ moving + own @ body.inertia @ own) / 2
            kinetic -= body.mass * self.machine.weight() @ (known[k][1] + axes @ body.center)
        axes, middle, speed, w = known[5]
        potential = lost = 0.0
        for (place, own, stiffness, damping, _), static in zip(self.machine.mounts(), self.static):
            away, moving = own.T @ (middle + axes @ place - place), own.T @ (speed + np.cross(w, axes @ place))
            potential -= static @ own @ away
            potential, lost = potential + stiffness @ away ** 2 / 2, lost + damping @ moving ** 2
        return kinetic + potential, lost

    def history(self, state):
        """Six coordinates, forces on the ground of every support, the torque from the power of energy and dampers, and the forces in
        the pins that close loops, along the axes of the body on which they act, over a period."""
        found = [self.record(state, k * STEPS * self.machine.turns) for k in (1, 2, 4)]
        q, forces, energy, lost, pins = (extrapolated(values) for values in zip(*found))
        # The residual at the end of the period is spread over the period, so that it is no jump.
        drift = energy[-1] - energy[0]
        orders = np.fft.rfft(energy[:-1] - drift * np.arange(ROWS) / ROWS) * 2j * math.pi / self.machine.period * np.arange(ROWS // 2 + 1)
        orders[-1] = 0.0
        gain = np.fft.irfft(orders, ROWS) + drift / self.machine.period
        return q, forces, (np.append(gain, gain[0]) + lost) / self.machine.speed, dict(zip(self.pins, pins))


def off(ours, theirs):
    """The largest difference over the period, relative to the peak."""
    return np.max(abs(theirs - ours)) / np.max(abs(ours))


def moved(ours, theirs):
    """The largest change of positions, relative to their peak, or of rotations relative to theirs."""
    return max(off(ours[:, k], theirs[:, k]) for k in (slice(0, 3), slice(3, 6)))


def joint_forces(program, text, speed):
    """Gestell's joint forces over a period, along the axes of the body on which they act."""
    with tempfile.TemporaryDirectory() as folder:
        case = Path(folder) / "case.nml"
        case.write_text(text)
        subprocess.run([program, "-q", "-o", folder, "-s", "case.tasks=joints", "-s", "model.frame=exact", "-s", f"response.points={ROWS}",
                        "-s", f"drive.speed_rpm={speed!r}", str(case)], check=True)
        with open(Path(folder) / "joints_history.csv") as lines:
            rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    return {name[6:-2]: np.array([[float(row[name]), float(row["transverse" + name[5:]])] for row in rows])
            for name in rows[0] if name.startswith("axial_")}


def beside(ours, theirs):
    return max(np.min(abs(theirs - value)) for value in ours)


def main():
    global STEPS, STEP
    file, *rest = sys.argv[1:]
    text = "\n".join([Path(file).read_text(), *(word for word in rest if word.startswith("&"))]) + "\n"
    options = dict(word.split("=", 1) for word in rest if re.match(r"\w+=", word))
    STEPS, STEP, scale = int(options.get("steps", STEPS)), float(options.get("step", STEP)), float(options.get("scale", 1.0))
    if "gestell" in options and options.keys() & {"scale", "damping"}:
        raise SystemExit("gestell= compares the unchanged machine only")
    worst = 0.0
    for speed in [float(word) for word in rest if re.match(r"-?[\d.]+$", word)] or [Machine(text).speed * 30 / math.pi]:
        machine = Machine(text).driven_by_motor().changed(scale, float(options.get("damping", 1.0)))
        machine.speed = speed * math.pi / 30
        rest_, exact = (Reference(machine, model).solve(rows=ROWS) for model in ("rest", "exact"))
        state, map_ = Model(machine).periodic(exact.state)
        q, forces, torque, pins = Model(machine, recording=True).history(state)
        rho = np.linalg.eigvals(map_)
        misses = [[beside(found.multipliers, rho), moved(q, found.q), off(forces, found.forces[:, :-1]), off(torque, found.torque)]
                  for found in (rest_, exact)]
        worst = max(worst, *misses[1])
        words = "".join(f", {key} {options[key]}" for key in ("scale", "damping") if key in options)
        print(f"{Path(file).name}{words} at {speed:g} rpm: |rho| rest "
              f"{max(abs(rest_.multipliers)):.9f}, exact {max(abs(exact.multipliers)):.9f}, Exudyn {max(abs(rho)):.9f}")
        for name, miss in zip(("rest ", "exact"), misses):
            print(f"    {name} off Exudyn: multipliers {miss[0]:.1e}, vibration {miss[1]:.1e}, forces {miss[2]:.1e}, torque {miss[3]:.1e}",
                  flush=True)
        if "gestell" in options:
            ours = joint_forces(options["gestell"], text, speed)
            miss = max((off(ours[name], theirs) for name, theirs in pins.items()), default=0.0)
            worst = max(worst, miss)
            print(f"    forces in {len(pins)} pins: Gestell off Exudyn {miss:.1e}", flush=True)
    return 0 if worst < 1e-5 else 1


if __name__ == "__main__":
    sys.exit(main())
