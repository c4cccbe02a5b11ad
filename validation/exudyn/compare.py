"""The exact frame against Exudyn, a general program of multibody dynamics: vibration, multipliers, forces, torque.

    python compare.py GESTELL INPUT [SPEED_RPM ...] ['&GROUP KEY=VALUE /' ...] [steps=N] [step=H] [from=RPM]

needs numpy and Exudyn (pip install exudyn==1.13.6 numpy). The machine is built from the input and the groups given as
arguments, such as '&gravity /': every link a rigid body, joined by constraints, the frame on springs and dampers; nothing of
Gestell is used for it. The map of one turn comes from integration in time (trapezoidal rule, extrapolated from two numbers of
steps), its fixed point is the vibration, its central differences give the multipliers. From that vibration on the forces of
supports and foundation on the ground are measured over a turn, the forces in pins that join two bodies (Lagrange multipliers),
and the torque of the drive: the power of energy and dampers over the crank speed. With from=RPM the search for the fixed point
starts from Gestell's state at that speed, for machines with several vibrations. Links without mass are not built.
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
from linkage import Linkage, cross, groups

# Steps of the integration, the first time; rows of a turn; step of the differences (m, rad; times the speed for velocities).
STEPS = 4000
ROWS = 400
STEP = 1e-4


class Machine(Linkage):
    """An input as this script reads it."""

    def __init__(self, text):
        joints, links, self.supports, self.foundation, self.gravity = {}, [], [], {}, {}
        for name, keys in groups(text):
            if name == "joint":
                joints[keys["name"][0]] = keys
            elif name == "link":
                links.append(keys)
            elif name == "support":
                self.supports.append(keys)
            elif name == "foundation":
                self.foundation = keys
            elif name == "gravity":
                self.gravity = {"acceleration": [9.80665], "direction": [-90.0], **keys}
            elif name == "frame":
                self.frame = keys
            elif name == "drive":
                self.speed = keys["speed_rpm"][0] * math.pi / 30
                self.held_by = keys.get("held_by", ["motor"])[0]
        super().__init__(joints, links, self.frame.get("origin", [0.0, 0.0]))
        free = self.frame.get("dof", ["xi", "eta", "psi"])
        self.free = [k for k, dof in enumerate(("xi", "eta", "psi")) if dof in free]


def turning(support):
    """True if the support's axes turn with the frame."""
    return support.get("axes") == ["frame"]


class Model:
    """The machine in Exudyn; `turn` maps the frame's state over one turn of the crank."""

    def __init__(self, machine, recording=False, torque=0.0, free=False):
        self.machine = machine
        self.recording = recording
        self.period = 2 * math.pi / abs(machine.speed)
        self.container = exu.SystemContainer()
        self.mbs = mbs = self.container.AddSystem()
        at, points, alike, lines = machine.assemble()
        self.poses = [machine.pose(link, at) for link in machine.links]
        self.masses = np.array([machine.frame["mass"][0], *(link["mass"][0] for link in machine.links)])
        self.inertias = np.array([machine.frame["inertia"][0], *(max(link["inertia"][0], 1e-12) for link in machine.links)])
        self.references = [np.zeros(3), *(np.array([*center, angle]) for center, angle in self.poses)]
        self.bodies, self.nodes = [], []
        self.g = np.zeros(2)
        if machine.gravity:
            angle = math.radians(machine.gravity["direction"][0])
            self.g = machine.gravity["acceleration"][0] * np.array([math.cos(angle), math.sin(angle)])
        for mass, inertia, place in zip(self.masses, self.inertias, self.references):
            self.add_body(mass, inertia, place)
        self.add_mounting()
        # Bodies that share a point rotate about it.
        self.pins = {}
        for name, bodies in points.items():
            for body in bodies[1:]:
                pin = mbs.AddObject(item.RevoluteJoint2D(markerNumbers=[self.marker(bodies[0], at[name]), self.marker(body, at[name])]))
                if len(bodies) == 2:
                    self.pins[f"{name}:{machine.links[body - 1]['name'][0]}"] = pin
        for one, other in alike:
            mbs.AddObject(item.CoordinateConstraint(markerNumbers=self.angles(one, other)))
        # Without rotation the slider's line belongs to the body of the second marker.
        for point, body, place, along in lines:
            # The last link of the point slides there and bears the guide's force.
            bodies = [k for k in points[point] if k != body]
            if not bodies:
                raise SystemExit(f"no link holds joint {point} on its line")
            angle = math.atan2(along[1], along[0]) + math.pi / 2 - self.references[body][2]
            mbs.AddObject(item.PrismaticJoint2D(
                markerNumbers=[self.marker(bodies[-1], at[point]), self.marker(body, place)], axisMarker0=[1.0, 0.0, 0.0],
                normalMarker1=[math.cos(angle), math.sin(angle), 0.0], constrainRotation=False))
        crank = next(name for name, joint in machine.joints.items() if joint["type"][0] == "crank")
        pivot = machine.joints[crank]["pivot"][0]
        driven = next(k for k, link in enumerate(machine.links, 1) if link["from"] == [pivot] and link.get("to") == [crank])
        # The drive holds the crank's speed against the frame, or in space; a motor on the frame acts on that by its mean torque. A `free`
        # crank is driven by its inertia alone.
        self.even = machine.held_by != "motor"
        self.torque = torque
        markers = self.angles(0, driven)
        if self.even:
            markers[0] = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(item.NodePointGround()), coordinate=0))
        self.loads = [mbs.AddLoad(item.LoadCoordinate(markerNumber=self.angles(0)[0], load=-torque))]
        self.driven, self.initial = driven, machine.speed
        if free:
            self.loads.append(mbs.AddLoad(item.LoadCoordinate(markerNumber=self.angles(driven)[0], load=torque)))
        else:
            mbs.AddObject(item.CoordinateConstraint(markerNumbers=markers, velocityLevel=True, offset=machine.speed))
        if recording:
            kinds = exu.OutputVariableType
            self.sensors = [[mbs.AddSensor(item.SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=kind))
                             for kind in (kinds.Coordinates, kinds.Coordinates_t)] for node in self.nodes]
            self.gauges = [[mbs.AddSensor(item.SensorObject(objectNumber=spring, storeInternal=True, outputVariableType=kinds.ForceLocal))
                            for spring in np.ravel(springs)] for springs in self.springs]
            self.multipliers = mbs.AddSensor(item.SensorUserFunction(
                sensorNumbers=[], factors=[], storeInternal=True,
                sensorUserFunction=lambda mbs, *_: list(mbs.systemData.GetAECoordinates())))
        mbs.Assemble()

    def angles(self, *bodies):
        return [self.mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=self.nodes[k], coordinate=2)) for k in bodies]

    def add_mounting(self):
        """Supports and foundation, with the static forces that carry the weights."""
        machine, mbs = self.machine, self.mbs
        self.stiffness, self.damping = (self.foundation(key) for key in ("stiffness", "damping"))
        self.arms, self.pads = [], []
        whole = self.stiffness.copy()
        for support in machine.supports:
            angle, place = math.radians(support.get("angle", [0.0])[0]), support["position"]
            turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
            arm = np.array([[1.0, 0.0, -place[1]], [0.0, 1.0, place[0]]])
            pad = [turn @ np.diag(support.get(key, [0.0, 0.0])) @ turn.T for key in ("stiffness", "damping")]
            self.arms.append(arm)
            self.pads.append((turn, *pad))
            whole += arm.T @ pad[0] @ arm
        stations = [[machine.pose(link, at)[0] for link in machine.links] for at in map(machine.points, np.arange(720) * math.pi / 360)]
        moment = np.mean([self.masses[1:] @ np.array(station) for station in stations], axis=0) if machine.links else np.zeros(2)
        load = np.array([*(sum(self.masses) * self.g), cross(moment, self.g)])
        free = np.ix_(machine.free, machine.free)
        self.sag = np.zeros(3)
        self.sag[machine.free] = np.linalg.lstsq(whole[free], load[machine.free], rcond=1e-12)[0]
        still = mbs.AddObject(item.ObjectGround())
        self.springs = []
        for support, arm, (turn, _, _) in zip(machine.supports, self.arms, self.pads):
            if turning(support):
                self.springs.append(self.add_slide(still, support, turn, turn.T @ arm @ self.sag))
                continue
            axes = np.eye(3)
            axes[:2, :2] = turn
            place = exu.HT(rotation=axes, translation=[*support["position"], 0.0])
            self.springs.append(mbs.AddObject(item.RigidBodySpringDamper(
                markerNumbers=[mbs.AddMarker(item.MarkerBodyRigid(bodyNumber=body, localHT=place)) for body in (still, self.bodies[0])],
                offset=[*(-turn.T @ arm @ self.sag), 0.0, 0.0, 0.0, 0.0],
                stiffness=np.diag([*support["stiffness"], 0.0, 0.0, 0.0, 0.0]),
                damping=np.diag([*support.get("damping", [0.0, 0.0]), 0.0, 0.0, 0.0, 0.0]))))
        if self.stiffness.any() or self.damping.any():
            mbs.AddObject(item.ObjectGenericODE2(
                nodeNumbers=[self.nodes[0]], massMatrix=np.zeros((3, 3)), stiffnessMatrix=self.stiffness,
                dampingMatrix=self.damping, forceVector=list(-self.stiffness @ self.sag)))
        nothing = mbs.AddNode(item.NodePointGround())
        for k in set(range(3)) - set(machine.free):
            markers = [mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))
                       for node, coordinate in ((nothing, 0), (self.nodes[0], k))]
            mbs.AddObject(item.CoordinateConstraint(markerNumbers=markers))

    def add_slide(self, still, support, turn, sag):
        """Adds a support whose axes turn with the frame. An almost massless slide is guided along the frame's first axis, and along
        the second one by a point fixed in space. These joints transmit the forces of the springs and dampers between them."""
        mbs, place = self.mbs, support["position"]
        node = mbs.AddNode(item.NodeRigidBody2D(referenceCoordinates=[*place, 0.0]))
        slide = mbs.AddObject(item.ObjectRigidBody2D(nodeNumber=node, mass=1e-9, inertia=1e-9))
        head, middle, foot = [mbs.AddMarker(item.MarkerBodyRigid(bodyNumber=body, localPosition=[*at, 0.0]))
                              for body, at in ((self.bodies[0], place), (slide, (0.0, 0.0)), (still, place))]
        first, second = ([*axis, 0.0] for axis in turn.T)
        for ends, axis, normal, alike in (([middle, head], first, second, True), ([foot, middle], second, first, False)):
            mbs.AddObject(item.PrismaticJoint2D(markerNumbers=ends, axisMarker0=axis, normalMarker1=normal, constrainRotation=alike))
        return [mbs.AddObject(item.LinearSpringDamper(
            markerNumbers=ends, axisMarker0=axis, stiffness=support["stiffness"][k], damping=support.get("damping", [0.0, 0.0])[k],
            offset=sag[k])) for k, (ends, axis) in enumerate((([head, middle], first), ([middle, foot], second)))]

    def foundation(self, key):
        values = np.array(self.machine.foundation.get(key, [0.0, 0.0, 0.0]))
        return values.reshape(3, 3) if len(values) == 9 else np.diag(values)

    def add_body(self, mass, inertia, place):
        node = self.mbs.AddNode(item.NodeRigidBody2D(referenceCoordinates=list(place)))
        self.nodes.append(node)
        body = self.mbs.AddObject(item.ObjectRigidBody2D(nodeNumber=node, mass=mass, inertia=inertia))
        self.bodies.append(body)
        if self.g.any():
            marker = self.mbs.AddMarker(item.MarkerBodyMass(bodyNumber=body))
            self.mbs.AddLoad(item.LoadMassProportional(markerNumber=marker, loadVector=[*self.g, 0.0]))

    def marker(self, k, point):
        x, y, angle = self.references[k]
        c, s = math.cos(angle), math.sin(angle)
        x, y = point - np.array([x, y])
        return self.mbs.AddMarker(item.MarkerBodyRigid(bodyNumber=self.bodies[k], localPosition=[c * x + s * y, -s * x + c * y, 0.0]))

    def start(self, state):
        """Coordinates and velocities of all bodies for xi, eta, psi and their velocities, the crank at its phase."""
        machine, step = self.machine, 1e-3
        u, psi, v, rate = np.array(state[:2]), state[2], np.array(state[3:5]), state[5]
        # The crank against the frame.
        turned, turns = (-psi, self.initial - rate) if self.even else (0.0, self.initial)
        poses, *stations = [[machine.pose(link, machine.points(turned + j * step)) for link in machine.links]
                            for j in (0, -3, -2, -1, 1, 2, 3)]
        weights = np.array([-1, 9, -45, 45, -9, 1]) / (60 * step)
        c, s = math.cos(psi), math.sin(psi)
        turn = np.array([[c, -s], [s, c]])
        q, w = [*u, psi], [*v, rate]
        for k, ((first, reference), (center, angle)) in enumerate(zip(self.poses, poses)):
            moving = sum(weight * station[k][0] for weight, station in zip(weights, stations)) * turns
            angles = np.unwrap([reference, angle] + [station[k][1] for station in stations])[1:]
            spin = float(weights @ angles[1:]) * turns
            place = turn @ center
            q += [*(u + place - first), psi + angles[0] - reference]
            w += [*(v + rate * np.array([-place[1], place[0]]) + turn @ moving), rate + spin]
        for support, (axes, _, _) in zip(machine.supports, self.pads):
            if not turning(support):
                continue
            p, first = np.array(support["position"]), axes[:, 0]
            away = turn.T @ (u - p)
            moved, moving = first @ (p + away), first @ (turn.T @ v - rate * np.array([-away[1], away[0]]))
            place = turn @ (p - moved * first)
            q += [*(u + place - p), psi]
            w += [*(v + rate * np.array([-place[1], place[0]]) - moving * (turn @ first)), rate]
        return q, w

    def integrate(self, state, steps):
        q, w = self.start(self.whole(state))
        data = self.mbs.systemData
        data.SetODE2Coordinates(q, configuration=exu.ConfigurationType.Initial)
        data.SetODE2Coordinates_t(w, configuration=exu.ConfigurationType.Initial)
        settings = exu.SimulationSettings()
        settings.timeIntegration.numberOfSteps = steps
        settings.timeIntegration.endTime = self.period
        settings.timeIntegration.generalizedAlpha.spectralRadius = 1
        # Constraints of the velocities: with those of the positions the multipliers oscillate from step to step.
        settings.timeIntegration.generalizedAlpha.useNewmark = self.recording
        settings.timeIntegration.generalizedAlpha.useIndex2Constraints = self.recording
        settings.timeIntegration.newton.relativeTolerance = 1e-9
        settings.timeIntegration.newton.absoluteTolerance = 1e-11
        settings.timeIntegration.verboseMode = 0
        settings.solution.file.write = False
        settings.solution.sensors.active = self.recording
        settings.solution.sensors.writePeriod = self.period / ROWS
        settings.show.computationTime = False
        if not self.mbs.SolveDynamic(settings):
            raise SystemExit("Exudyn did not get round")
        free = self.machine.free
        return np.concatenate([data.GetODE2Coordinates()[free], data.GetODE2Coordinates_t()[free]])

    def whole(self, state):
        whole = np.zeros(6)
        free = self.machine.free
        whole[free + [3 + k for k in free]] = state
        return whole

    def turn(self, state):
        coarse, fine = self.integrate(state, STEPS), self.integrate(state, 2 * STEPS)
        return fine + (fine - coarse) / 3

    def derivative(self, state, scale):
        columns = []
        for k in range(len(state)):
            step = np.zeros(len(state))
            step[k] = scale[k]
            columns.append((self.turn(state + step) - self.turn(state - step)) / (2 * scale[k]))
        return np.array(columns).T

    def periodic(self, state, scale):
        """The vibration and the derivative of the map of one turn there, computed again if the vibration has moved."""
        phi, taken = self.derivative(state, scale), state
        for _ in range(8):
            change = np.linalg.solve(np.eye(len(state)) - phi, self.turn(state) - state)
            state = state + change
            if np.all(abs(change) < 1e-9 * (abs(state) + scale)):
                break
            if np.any(abs(state - taken) > 1e-3 * scale):
                phi, taken = self.derivative(state, scale), state
        return state, phi

    def record(self, state, steps):
        """Coordinates and velocities of all bodies, shape (rows, 2, bodies, 3), the supports' forces on the ground, and the forces
        in the pins along the frame's axes, shape (pins, rows, 2), over a turn."""
        self.integrate(state, steps)
        data = np.array([[self.mbs.GetSensorStoredData(sensor) for sensor in pair] for pair in self.sensors])
        c, s = np.cos(data[0, 0, :, 3]), np.sin(data[0, 0, :, 3])
        forces = []
        for gauges, (turn, _, _) in zip(self.gauges, self.pads):
            force = np.concatenate([self.mbs.GetSensorStoredData(gauge)[:, 1:3] for gauge in gauges], axis=1)[:, :2] @ turn.T
            if len(gauges) > 1:
                force = -np.array([c * force[:, 0] - s * force[:, 1], s * force[:, 0] + c * force[:, 1]]).T
            forces.append(force)
        found = self.mbs.GetSensorStoredData(self.multipliers)[:, 1:]
        pins = [-found[:, self.mbs.systemData.GetObjectLTGAE(pin)] for pin in self.pins.values()]
        pins = [np.array([c * x + s * y, c * y - s * x]).T for x, y in (pin.T for pin in pins)]
        return data[..., 1:].transpose(2, 1, 0, 3), np.array(forces or np.zeros((0, data.shape[2], 2))), np.array(pins)

    def history(self, state):
        """Over a turn: forces on the ground due to the motion of each support, of the foundation with its moment; the moment of all
        of them about F at rest; the driving torque. Also the supports' static forces, and the forces in the pins."""
        found = zip(*(self.record(state, steps) for steps in (STEPS, 2 * STEPS)))
        data, forces, pins = (fine + (fine - coarse) / 3 for coarse, fine in found)
        if len(data) != ROWS + 1:
            raise SystemExit(f"Exudyn returned {len(data)} rows")
        q, v = data[:, 0], data[:, 1]
        static = [pad @ arm @ self.sag for arm, (_, pad, _) in zip(self.arms, self.pads)]
        moved = q + self.references
        energy = np.sum(self.masses * np.sum(v[..., :2] ** 2, axis=2) + self.inertias * v[..., 2] ** 2, axis=1) / 2
        forces = [force - part for force, part in zip(forces, static)]
        ground = q[:, 0] @ self.stiffness.T + v[:, 0] @ self.damping.T
        moment = ground[:, 2].copy()
        energy -= (moved[..., :2] @ self.g) @ self.masses
        frame, rate = q[:, 0] + self.sag, v[:, 0]
        energy += np.sum(frame @ self.stiffness * frame, axis=1) / 2
        lost = np.sum(rate @ self.damping * rate, axis=1)
        c, s = np.cos(q[:, 0, 2]), np.sin(q[:, 0, 2])
        for support, arm, (_, spring, damper), force in zip(self.machine.supports, self.arms, self.pads, forces):
            x, y = support["position"]
            head = q[:, 0, :2] + np.array([c * x - s * y, s * x + c * y]).T
            speed = v[:, 0, :2] + v[:, 0, 2:] * np.array([-s * x - c * y, c * x - s * y]).T
            if turning(support):
                # displacement of the support's head in the frame's axes
                moment += x * force[:, 1] - y * force[:, 0]
                away, rate = head - [x, y], v[:, 0, 2]
                speed = speed - np.array([-rate * away[:, 1], rate * away[:, 0]]).T
                away, speed = (np.array([c * a[:, 0] + s * a[:, 1], c * a[:, 1] - s * a[:, 0]]).T for a in (away, speed))
                head = away + arm @ self.sag
            else:
                moment += head[:, 0] * force[:, 1] - head[:, 1] * force[:, 0]
                head = head - [x, y] + arm @ self.sag
            energy += np.sum(head @ spring * head, axis=1) / 2
            lost += np.sum(speed @ damper * speed, axis=1)
        # The residual at the end of the turn is spread over the turn, so that it is no jump.
        drift = energy[-1] - energy[0]
        energy -= drift * np.linspace(0.0, 1.0, ROWS + 1)
        orders = np.fft.rfft(energy[:-1]) * 2j * math.pi / self.period * np.arange(ROWS // 2 + 1)
        orders[ROWS // 4:] = 0.0
        gain = np.fft.irfft(orders, ROWS) + drift / self.period
        torque = (np.append(gain, gain[0]) + lost + self.torque * v[:, 0, 2]) / self.machine.speed
        return [*forces, ground[:, :2], ground[:, 2], moment], torque, np.array(static).reshape(-1, 2), dict(zip(self.pins, pins))


def gestell(program, file, speed, folder, *words):
    def solve(tasks):
        return subprocess.run([program, "-q", "-o", folder, "-s", f"case.tasks={tasks}", "-s", "model.frame=exact", "-s",
                               f"response.points={ROWS}", "-s", f"drive.speed_rpm={speed!r}", *words, file]).returncode

    if solve("stability,response,forces,power"):
        raise SystemExit("Gestell failed")
    tables = {}
    # Code 2: the forces at a guide that no body carries are not determined.
    code = solve("joints")
    if code not in (0, 2):
        raise SystemExit("Gestell failed")
    joints = () if code else ("joints_history",)
    for name in ("multipliers", "response", "supports", "supports_history", "power", *joints):
        with open(Path(folder) / f"{name}.csv") as lines:
            tables[name] = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    rho = np.array([complex(float(row["re"]), float(row["im"])) for row in tables["multipliers"]])
    first = tables["response"][0]
    names = [name for name in first if re.match(r"(xi|eta|psi)(_dot)?(\W|_|$)", name) and "error" not in name]

    def column(name, table="supports_history"):
        return np.array([float(row.get(name, 0.0)) for row in tables[table]])

    places = [row["support"] for row in tables["supports"] if row["support"].isdigit()]
    forces = [np.array([column(f"f{axis}_{place}_N") for axis in "xy"]).T for place in [*places, "foundation"]]
    forces += [column("m_foundation_Nm"), column("m_total_Nm")]
    static = np.array([[float(row.get(f"static_f{axis}_N", 0.0)) for axis in "xy"] for row in tables["supports"]])[:len(places)]
    pins = {name[3:-2]: np.array([column(name, "joints_history"), column("fy" + name[2:], "joints_history")]).T
            for name in (tables["joints_history"][0] if joints else ()) if name.startswith("fx_")}
    return rho, np.array([float(first[name]) for name in names]), (forces, column("torque_Nm", "power"), static, pins)


def off(ours, theirs):
    """The largest difference over the turn, relative to the peak."""
    return np.max(abs(theirs - ours)) / np.max(abs(ours)) if np.any(ours) else np.max(abs(theirs), initial=0.0)


def main():
    global STEPS, STEP
    program, file, *rest = sys.argv[1:]
    groups = [word for word in rest if word.startswith("&")]
    STEPS = int(next((word[6:] for word in rest if word.startswith("steps=")), STEPS))
    STEP = float(next((word[5:] for word in rest if word.startswith("step=")), STEP))
    origin = [float(word[5:]) for word in rest if word.startswith("from=")]
    speeds = [float(word) for word in rest if not re.match(r"&|steps?=|from=", word)]
    text = "\n".join([Path(file).read_text(), *groups]) + "\n"
    worst = 0.0
    for speed in speeds or [Machine(text).speed * 30 / math.pi]:
        machine = Machine(text)
        machine.speed = speed * math.pi / 30
        model = Model(machine)
        with tempfile.TemporaryDirectory() as folder:
            case = Path(folder) / Path(file).name
            case.write_text(text)
            rho, state, (forces, torque, static, joints) = gestell(program, str(case), speed, folder)
            start = gestell(program, str(case), origin[0], folder)[1] if origin else state
        state, start = (values[machine.free + [3 + k for k in machine.free]] for values in (state, start))
        scale = STEP * np.repeat([1.0, abs(machine.speed)], len(machine.free))
        found, phi = model.periodic(start, scale)
        mean = 0.0
        for _ in range(3 if machine.held_by == "flywheel" else 0):
            # The dampers' power is of second order in the vibration: its change by the motor's mean torque is small.
            mean = np.mean(Model(machine, recording=True, torque=mean).history(found)[1][:-1])
            model = Model(machine, torque=mean)
            found, phi = model.periodic(found, scale)
        ours, theirs = (values[np.argsort(-abs(values) - 1e-9 * values.imag)] for values in (rho, np.linalg.eigvals(phi)))
        miss = max(np.min(abs(theirs - value)) for value in ours)
        moved = np.max(abs(found - state) / np.max(abs(state.reshape(2, -1)), axis=1).repeat(len(machine.free)))
        recorder = Model(machine, recording=True, torque=mean)
        pulls, drive, load, pins = recorder.history(found)
        if len(machine.free) < 3:
            # The total moment includes that of the frame's guides.
            forces, pulls = forces[:-1], pulls[:-1]
        pulled = max([off(mine, their) for mine, their in zip(forces, pulls)] + [off(static, load)])
        turned = off(torque, drive)
        both = joints.keys() & pins.keys()
        joined = max((off(joints[name], pins[name]) for name in both), default=0.0)
        worst = max(worst, miss, moved, pulled, turned, joined)
        print(f"{Path(file).name} at {speed:g} rpm: |rho| {abs(ours[0]):.9f}, Exudyn {abs(theirs[0]):.9f}; multipliers differ by "
              f"{miss:.1e}, the vibration at the start by {moved:.1e} of its size, over the turn forces by {pulled:.1e} of their peaks, "
              f"the torque by {turned:.1e} of {np.max(abs(torque)):.6g} N m, the forces in {len(both)} pins by {joined:.1e}", flush=True)
    return 0 if worst < 1e-6 else 1


if __name__ == "__main__":
    sys.exit(main())
