"""Reads inputs for the validation, and builds plane linkages: joints, links and the constraints between bodies. Nothing of Gestell
is used."""

import math
import re

import numpy as np

LENGTHS = ("position", "radius", "lengths", "guide_point", "guide2_point", "offset", "center", "origin", "z")
UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "kN/mm": 1e6, "N/m": 1.0, "kN s/m": 1e3, "N s/m": 1.0}


def groups(text):
    """Name and keys of every group of an input, in SI units: lists of numbers and words."""
    units, found = {}, []
    for name, body in re.findall(r"&(\w+)(.*?)/\s*(?=&|$)", re.sub(r"!.*", "", text), re.S):
        keys = {}
        for key, value in re.findall(r"(\w+)\s*=\s*((?:'[^']*'|[^=])*?)(?=,?\s+\w+\s*=|,?\s*$)", body.strip(), re.S):
            words = re.findall(r"'[^']*'|[^',\s]+", value)
            keys[key] = [word.strip("'") if word[0] == "'" else float(word) for word in words]
        if name == "units":
            units = {key: UNITS[words[0]] for key, words in keys.items()}
        else:
            found.append((name, keys))
    for _, keys in found:
        for key in keys:
            factor = units.get("length" if key in LENGTHS else key, 1.0)
            if factor != 1.0:
                keys[key] = [factor * word for word in keys[key]]
    return found


class Linkage:
    """Joints and links of a plane mechanism; joints on the frame have coordinates from `origin`."""

    def __init__(self, joints, links, origin=(0.0, 0.0)):
        self.joints, self.links, self.origin = joints, links, np.array(origin)

    def points(self, turned):
        """The joints in the axes of `origin` when the crank has turned by an angle from its phase."""
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
            elif kind in ("PRP", "RPP"):
                one, along = self.guide(joint, at)
                other, across = self.guide(joint, at, "guide2") if kind == "PRP" else (at[joint["ends"][0]], self.slot(joint, along))
                at[name] = one + along * cross(other - one, across) / cross(along, across)
            else:
                raise SystemExit(f"joint type {kind} is not built here")
        return at

    def guide(self, joint, at, key="guide"):
        """A point of a guide and its direction, in the frame's axes."""
        angle = math.radians(joint.get(key + "_angle", [0.0])[0])
        x, y = joint.get(key + "_point", [0.0, 0.0])
        place = self.origin + [x, y]
        if key in joint:
            one, other = (at[end] for end in joint[key])
            along = (other - one) / np.hypot(*(other - one))
            angle += math.atan2(along[1], along[0])
            place = one + x * along + y * np.array([-along[1], along[0]])
        return place, np.array([math.cos(angle), math.sin(angle)])

    def slot(self, joint, along):
        """The direction of a yoke's slot, in the frame's axes."""
        angle = math.atan2(along[1], along[0]) + math.radians(joint["slot_angle"][0])
        return np.array([math.cos(angle), math.sin(angle)])

    def assemble(self):
        """The constraints between bodies at the crank's phase (0: the frame, 1, 2, ...: the links): the bodies to which each joint
        belongs; pairs of bodies that rotate together; joints that lie on a line of a body, with a point and the direction of the
        line in the frame's axes. The second joint of a sliding link lies on its axis."""
        at, *others = (self.points(0.7 * k) for k in range(6))
        order = list(self.joints)
        points, alike, lines, slots = {name: [] for name in order}, [], [], []
        self.sliding = {}

        def carrier(one, other):
            body = [k for k in points[one] if k in points[other]] or [
                k for k, ends in self.sliding.items() if ends in ((one, other), (other, one))]
            if not body:
                raise SystemExit(f"no link carries both {one} and {other}")
            return body[0]

        for name in order:
            joint = self.joints[name]
            kind = joint["type"][0]
            if kind == "ground":
                points[name].append(0)
            elif kind == "rigid":
                points[name].append(carrier(*joint["ends"]))
            for k, link in enumerate(self.links, 1):
                one, other = link["from"][0], link.get("to", link["from"])[0]
                if name != max(one, other, key=order.index):
                    continue
                if one == other:
                    points[one].append(k)
                    alike.append((0, k))
                    continue
                away = [np.hypot(*(place[other] - place[one])) for place in (at, *others)]
                known = [body for body in points[one] if body in points[other]]
                points[one].append(k)
                if max(away) - min(away) > 1e-9:
                    self.sliding[k] = (one, other)
                elif known:
                    alike.append((known[0], k))
                else:
                    points[other].append(k)
            for key in ("guide", "guide2"):
                if key + "_angle" in joint or key in joint:
                    body = carrier(*joint[key]) if key in joint else 0
                    lines.append((name, body, *self.guide(joint, at, key)))
            if kind == "RPR":
                block, pivot = joint["ends"]
                lines.append((block, carrier(pivot, name), at[pivot], at[name] - at[pivot]))
            elif kind == "RPP":
                slots.append((name, joint["ends"][0]))
        for k, (one, other) in self.sliding.items():
            lines.append((other, k, at[one], at[other] - at[one]))
        for name, pin in slots:
            yoke = next(k for k in points[name] if k in self.sliding or (0, k) in alike)
            lines.append((pin, yoke, at[name], self.slot(self.joints[name], self.guide(self.joints[name], at)[1])))
        return at, points, alike, lines

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


def cross(one, other):
    return one[0] * other[1] - one[1] * other[0]
