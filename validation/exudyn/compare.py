"""The exact frame against Exudyn, a general program of multibody dynamics: periodic vibration and multipliers.

    python compare.py GESTELL INPUT [SPEED_RPM ...]

needs numpy and Exudyn (pip install exudyn==1.13.6 numpy). The machine is built anew from the input: every link a rigid body, joined
by constraints, the frame on springs and dampers; nothing of Gestell is used for it. The map of one turn comes from integration in
time (trapezoidal rule, extrapolated from two numbers of steps), its fixed point is the vibration, its central differences give the
multipliers. Joints: ground, crank, RRR, RRP, RPR, rigid; supports along x and y.
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

# Of the integration, the first time, and of differences (m, rad; times the speed for velocities).
STEPS = 4000
STEP = 1e-4
LENGTHS = ("position", "radius", "lengths", "guide_point", "offset", "center", "origin")
UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "kN/mm": 1e6, "N/m": 1.0, "kN s/m": 1e3, "N s/m": 1.0}


class Machine:
    """An input as this script reads it."""

    def __init__(self, text):
        text = re.sub(r"!.*", "", text)
        self.joints, self.links, self.supports, self.foundation, units = {}, [], [], {}, {}
        for name, body in re.findall(r"&(\w+)(.*?)/\s*(?=&|$)", text, re.S):
            keys = {}
            for key, value in re.findall(r"(\w+)\s*=\s*((?:'[^']*'|[^=])*?)(?=,?\s+\w+\s*=|,?\s*$)", body.strip(), re.S):
                words = [word.strip() for word in value.split(",") if word.strip()]
                keys[key] = [word.strip("'") if word[0] == "'" else float(word) for word in words]
            if name == "units":
                units = {key: UNITS[words[0]] for key, words in keys.items()}
                continue
            for key in keys:
                factor = units.get("length" if key in LENGTHS else key, 1.0)
                if factor != 1.0:
                    keys[key] = [factor * word for word in keys[key]]
            if name == "joint":
                self.joints[keys["name"][0]] = keys
            elif name == "link":
                self.links.append(keys)
            elif name == "support":
                self.supports.append(keys)
            elif name == "foundation":
                self.foundation = keys
            elif name == "frame":
                self.frame = keys
            elif name == "drive":
                self.speed = keys["speed_rpm"][0] * math.pi / 30
        free = self.frame.get("dof", ["xi", "eta", "psi"])
        self.free = [k for k, dof in enumerate(("xi", "eta", "psi")) if dof in free]
        self.origin = np.array(self.frame.get("origin", [0.0, 0.0]))

    def points(self, turned):
        """The joints in the frame's axes where the crank has turned by an angle from its phase."""
        at = {}
        for name, joint in self.joints.items():
            kind = joint["type"][0]
            if kind == "ground":
                at[name] = self.origin + joint["position"]
            elif kind == "crank":
                angle = turned + math.radians(joint.get("phase", [0.0])[0])
                at[name] = at[joint["pivot"][0]] + joint["radius"][0] * np.array([np.cos(angle), np.sin(angle)])
            elif kind == "rigid":
                one, other = (at[end] for end in joint["ends"])
                along = (other - one) / np.hypot(*(other - one))
                x, y = joint["offset"]
                at[name] = one + x * along + y * np.array([-along[1], along[0]])
            elif kind == "RRR":
                one, other = (at[end] for end in joint["ends"])
                a, b = joint["lengths"]
                base = other - one
                d = np.hypot(*base)
                x = (d * d + a * a - b * b) / (2 * d)
                y = np.sqrt(a * a - x * x) * joint.get("branch", [1.0])[0]
                at[name] = one + (x * base + y * np.array([-base[1], base[0]])) / d
            elif kind == "RRP":
                end = at[joint["ends"][0]]
                place, along = self.guide(joint, at)
                away = place - end
                s = away @ along
                rest = away @ away - joint["lengths"][0] ** 2
                at[name] = end + away + (-s + joint.get("branch", [1.0])[0] * np.sqrt(s * s - rest)) * along
            elif kind == "RPR":
                block, pivot = (at[end] for end in joint["ends"])
                at[name] = pivot + joint.get("branch", [1.0])[0] * joint["lengths"][0] * (block - pivot) / np.hypot(*(block - pivot))
            else:
                raise SystemExit(f"joint type {kind} is not built here")
        return at

    def guide(self, joint, at):
        """A point of a guide and its direction, in the frame's axes."""
        angle = math.radians(joint.get("guide_angle", [0.0])[0])
        place = self.origin + joint.get("guide_point", [0.0, 0.0])
        if "guide" in joint:
            one, other = (at[end] for end in joint["guide"])
            along = (other - one) / np.hypot(*(other - one))
            angle += math.atan2(along[1], along[0])
            x, y = joint.get("guide_point", [0.0, 0.0])
            place = one + x * along + y * np.array([-along[1], along[0]])
        return place, np.array([math.cos(angle), math.sin(angle)])

    def carrier(self, ends):
        """The body that two points belong to: 0 the frame, k + 1 link k."""
        if all(self.joints[end]["type"][0] == "ground" for end in ends):
            return 0
        return 1 + next(k for k, link in enumerate(self.links) if {link["from"][0], *link.get("to", [])} == set(ends))

    def sliding(self, at, later):
        """Links that slide on another body: the distance between their points changes."""
        return [k for k, link in enumerate(self.links) if "to" in link and abs(
            np.hypot(*(at[link["to"][0]] - at[link["from"][0]])) - np.hypot(*(later[link["to"][0]] - later[link["from"][0]]))) > 1e-9]

    def pose(self, link, at):
        """Centre of mass and angle of a link in the frame's axes."""
        one = at[link["from"][0]]
        x, y = link.get("center", [0.0, 0.0])
        if "to" not in link:
            return one + [x, y], 0.0
        along = at[link["to"][0]] - one
        angle = math.atan2(along[1], along[0])
        along = along / np.hypot(*along)
        return one + x * along + y * np.array([-along[1], along[0]]), angle


class Model:
    """The machine in Exudyn; `turn` maps the frame's state over one turn of the crank."""

    def __init__(self, machine):
        self.machine = machine
        self.period = 2 * math.pi / abs(machine.speed)
        self.container = exu.SystemContainer()
        self.mbs = mbs = self.container.AddSystem()
        at = machine.points(0.0)
        self.poses = [machine.pose(link, at) for link in machine.links]
        self.bodies, self.nodes = [], []
        self.add_body(machine.frame["mass"][0], machine.frame["inertia"][0], np.zeros(2), 0.0)
        for link, (center, angle) in zip(machine.links, self.poses):
            self.add_body(link["mass"][0], max(link["inertia"][0], 1e-12), center, angle)
        ground = mbs.AddObject(item.ObjectGround())
        for support in machine.supports:
            place = [*support["position"], 0.0]
            markers = [mbs.AddMarker(item.MarkerBodyPosition(bodyNumber=body, localPosition=place))
                       for body in (ground, self.bodies[0])]
            mbs.AddObject(item.CartesianSpringDamper(
                markerNumbers=markers, stiffness=[*support["stiffness"], 0.0], damping=[*support.get("damping", [0, 0]), 0.0]))
        self.add_foundation(ground)
        # Links that meet in a point turn about it; the frame's own points are its grounds and guides. What slides is held by its
        # first point and by its guide.
        sliding = machine.sliding(at, machine.points(1.0))
        for name, joint in machine.joints.items():
            meeting = [k + 1 for k, link in enumerate(machine.links)
                       if link["from"] == [name] or (link.get("to") == [name] and k not in sliding)]
            kind = joint["type"][0]
            if kind == "ground":
                meeting.insert(0, 0)
            elif kind == "rigid" and machine.carrier(joint["ends"]) not in meeting:
                meeting.insert(0, machine.carrier(joint["ends"]))
            places = [self.marker(k, at[name]) for k in meeting]
            for place in places[1:]:
                mbs.AddObject(item.RevoluteJoint2D(markerNumbers=[places[0], place]))
            if kind == "RRP":
                self.add_slider(joint, name, at)
            elif kind == "RPR":
                block, pivot = joint["ends"]
                for k in sliding:
                    if machine.links[k]["from"] == [block]:
                        self.add_guide(machine.carrier([pivot, name]), k + 1, at[block], at[name] - at[pivot])
        crank = next(name for name, joint in machine.joints.items() if joint["type"][0] == "crank")
        pivot = machine.joints[crank]["pivot"][0]
        driven = next(k for k, link in enumerate(machine.links) if link["from"] == [pivot] and link.get("to") == [crank])
        turning = [mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=self.nodes[k], coordinate=2)) for k in (0, driven + 1)]
        mbs.AddObject(item.CoordinateConstraint(markerNumbers=turning, velocityLevel=True, offset=machine.speed))
        mbs.Assemble()

    def add_body(self, mass, inertia, center, angle):
        node = self.mbs.AddNode(item.NodeRigidBody2D(referenceCoordinates=[*center, angle]))
        self.nodes.append(node)
        self.bodies.append(self.mbs.AddObject(item.ObjectRigidBody2D(nodeNumber=node, mass=mass, inertia=inertia)))

    def local(self, k, point):
        center, angle = ((np.zeros(2), 0.0), *self.poses)[k]
        x, y = point - center
        c, s = math.cos(angle), math.sin(angle)
        return [c * x + s * y, -s * x + c * y, 0.0]

    def marker(self, k, point):
        return self.mbs.AddMarker(item.MarkerBodyRigid(bodyNumber=self.bodies[k], localPosition=self.local(k, point)))

    def add_slider(self, joint, name, at):
        machine = self.machine
        body = machine.carrier(joint["guide"]) if "guide" in joint else 0
        _, along = machine.guide(joint, at)
        # The slider itself keeps its direction on the guide; without one the point alone is held.
        own = [k + 1 for k, link in enumerate(machine.links) if link["from"] == [name] and (
            "to" not in link or link["to"][0] in joint.get("guide", []))]
        other = [k + 1 for k, link in enumerate(machine.links) if link.get("to") == [name]]
        self.add_guide(body, (own or other)[0], at[name], along, bool(own))

    def add_guide(self, body, slider, place, along, turns_with=True):
        angle = math.atan2(along[1], along[0])
        axes = []
        for k, turned in ((body, angle), (slider, angle + math.pi / 2)):
            own = turned - ((np.zeros(2), 0.0), *self.poses)[k][1]
            axes.append([math.cos(own), math.sin(own), 0.0])
        self.mbs.AddObject(item.PrismaticJoint2D(markerNumbers=[self.marker(body, place), self.marker(slider, place)],
                                                 axisMarker0=axes[0], normalMarker1=axes[1], constrainRotation=turns_with))

    def add_foundation(self, ground):
        nothing = self.mbs.AddNode(item.NodePointGround())
        still = self.mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=nothing, coordinate=0))
        entries = {}
        for key in ("stiffness", "damping"):
            values = self.machine.foundation.get(key, [0.0, 0.0, 0.0])
            if len(values) == 9:
                matrix = np.array(values).reshape(3, 3)
                if np.any(matrix != np.diag(np.diag(matrix))):
                    raise SystemExit("only a diagonal foundation is built here")
                values = np.diag(matrix)
            entries[key] = values
        for k in range(3):
            moving = self.mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=self.nodes[0], coordinate=k))
            if k not in self.machine.free:
                self.mbs.AddObject(item.CoordinateConstraint(markerNumbers=[still, moving]))
            self.mbs.AddObject(item.CoordinateSpringDamper(markerNumbers=[still, moving], stiffness=float(entries["stiffness"][k]),
                                                           damping=float(entries["damping"][k])))

    def start(self, state):
        """Coordinates and velocities of all bodies for xi, eta, psi and their velocities, the crank at its phase."""
        machine, step = self.machine, 1e-3
        u, psi, v, rate = np.array(state[:2]), state[2], np.array(state[3:5]), state[5]
        stations = [[machine.pose(link, machine.points(j * step)) for link in machine.links] for j in (-3, -2, -1, 1, 2, 3)]
        weights = np.array([-1, 9, -45, 45, -9, 1]) / (60 * step)
        c, s = math.cos(psi), math.sin(psi)
        turn = np.array([[c, -s], [s, c]])
        q, w = [*u, psi], [*v, rate]
        for k, (center, angle) in enumerate(self.poses):
            moving = sum(weight * station[k][0] for weight, station in zip(weights, stations)) * machine.speed
            angles = np.unwrap([angle] + [station[k][1] for station in stations])[1:]
            spin = float(weights @ angles) * machine.speed
            place = turn @ center
            q += [*(u + place - center), psi]
            w += [*(v + rate * np.array([-place[1], place[0]]) + turn @ moving), rate + spin]
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
        settings.timeIntegration.newton.relativeTolerance = 1e-9
        settings.timeIntegration.newton.absoluteTolerance = 1e-11
        settings.timeIntegration.verboseMode = 0
        settings.solution.file.write = False
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
        for _ in range(8):
            phi = self.derivative(state, scale)
            change = np.linalg.solve(np.eye(len(state)) - phi, self.turn(state) - state)
            state = state + change
            if np.all(abs(change) < 1e-9 * (abs(state) + scale)):
                break
        return state, self.derivative(state, scale)


def gestell(program, file, speed, folder):
    subprocess.run([program, "-q", "-o", folder, "-s", "case.tasks=stability,response", "-s", "model.frame=exact",
                    "-s", f"drive.speed_rpm={speed!r}", file], check=True)
    tables = {}
    for name in ("multipliers", "response"):
        with open(Path(folder) / f"{name}.csv") as lines:
            tables[name] = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    rho = np.array([complex(float(row["re"]), float(row["im"])) for row in tables["multipliers"]])
    first = tables["response"][0]
    names = [name for name in first if re.match(r"(xi|eta|psi)(_dot)?(\W|_|$)", name) and "error" not in name]
    return rho, np.array([float(first[name]) for name in names])


def main():
    program, file, *speeds = sys.argv[1:]
    text = Path(file).read_text()
    worst = 0.0
    for speed in [float(word) for word in speeds] or [Machine(text).speed * 30 / math.pi]:
        machine = Machine(text)
        machine.speed = speed * math.pi / 30
        model = Model(machine)
        with tempfile.TemporaryDirectory() as folder:
            rho, state = gestell(program, file, speed, folder)
        state = state[machine.free + [3 + k for k in machine.free]]
        scale = STEP * np.repeat([1.0, abs(machine.speed)], len(machine.free))
        found, phi = model.periodic(state, scale)
        ours, theirs = (values[np.argsort(-abs(values) - 1e-9 * values.imag)] for values in (rho, np.linalg.eigvals(phi)))
        miss = max(np.min(abs(theirs - value)) for value in ours)
        moved = np.max(abs(found - state) / np.max(abs(state.reshape(2, -1)), axis=1).repeat(len(machine.free)))
        worst = max(worst, miss, moved)
        print(f"{Path(file).name} at {speed:g} rpm: |rho| {abs(ours[0]):.9f}, Exudyn {abs(theirs[0]):.9f}; multipliers differ by "
              f"{miss:.1e}, the vibration at the start by {moved:.1e} of its size")
    return 0 if worst < 1e-6 else 1


if __name__ == "__main__":
    sys.exit(main())
