"""Broken inputs with all joints, guides, units, mass functions and mountings: how each differs from a valid one, and
the expected exit code and single line on standard error.
"""

import math
import re

# Every type of joint; messages name its lines.
MACHINE = """\
&case title = 'all joints' /
&drive speed_rpm = 600.0 /
&joint name='O', type='ground', position=0.0,0.0 /
&joint name='P', type='ground', position=0.0,-0.35 /
&joint name='A', type='crank', pivot='O', radius=0.05 /
&joint name='B', type='RRP', ends='A', lengths=0.20, guide_point=0.0,0.0, guide_angle=90.0, branch=1 /
&joint name='C', type='RPR', ends='A','P', lengths=0.60, branch=1 /
&joint name='D', type='rigid', ends='A','B', offset=0.10,0.02 /
&joint name='E', type='RPP', ends='A', guide_point=0.0,0.3, guide_angle=0.0, slot_angle=90.0 /
&joint name='F', type='PRP', guide='P','C', guide2_point=0.0,0.5, guide2_angle=0.0 /
&joint name='K', type='RRP', ends='D', lengths=0.50, guide='P','C', guide_angle=30.0, branch=-1 /
&link name='crank', from='O', to='A', mass=2.0, inertia=0.002, center=0.01,0.0 /
&link name='rod', from='A', to='B', mass=0.6, inertia=0.003, center=0.065,0.0 /
&link name='yoke', from='E', mass=0.5, inertia=0.0 /
&frame mass=45.0, inertia=1.6, origin=0.0,0.05 /
&support position=-0.20,-0.25, stiffness=6.0e4,1.2e5, damping=60.0,120.0, angle=30.0 /
&support position=0.20,-0.25, stiffness=6.0e4,1.2e5, damping=60.0,120.0, angle=-30.0 /
"""

# The same with mass functions.
FUNCTIONS = """\
&drive speed_rpm = 600.0 /
&mass_functions mass=3.0, inertia=0.01, a1=0.1,0.05,0.0, a2=0.0,0.0,0.05, a3=0.02, moment=0.0,0.0,0.001 /
&frame mass=45.0, inertia=1.6, origin=0.0,0.05 /
&support position=-0.20,-0.25, stiffness=6.0e4,1.2e5, damping=60.0,120.0 /
&support position=0.20,-0.25, stiffness=6.0e4,1.2e5, damping=60.0,120.0 /
"""

LINES = MACHINE.splitlines(keepends=True)


def joint(name, keys):
    """The machine with other keys of a joint."""
    number = next(i for i, line in enumerate(LINES) if f"&joint name='{name}'" in line)
    return "".join(LINES[:number] + [f"&joint name='{name}', {keys} /\n"] + LINES[number + 1:])


def last_joint(keys, *changes):
    """The machine with a last joint of its own in line 8, without the following joints of sliders and guides."""
    text = "".join(LINES[:7] + [f"&joint name='S', {keys} /\n"] + LINES[11:13] + LINES[14:])
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


def machine(old, new):
    assert MACHINE.count(old) == 1, old
    return MACHINE.replace(old, new)


def functions(old, new):
    assert FUNCTIONS.count(old) == 1, old
    return FUNCTIONS.replace(old, new)


def units(words):
    """The machine with a line 2 that selects units."""
    return LINES[0] + f"&units {words} /\n" + "".join(LINES[1:])


def added(line):
    """The machine with an additional line 18."""
    return MACHINE + line + "\n"


def without(*groups):
    return "".join(line for line in LINES if not line.startswith(tuple("&" + group for group in groups)))


def needs_guide(number, name, key="guide"):
    return (f"input.nml:{number}: &joint '{name}': give '{key}_point' and '{key}_angle' for a guide that is fixed to the frame, or "
            f"'{key}' for a guide that two joints carry")


# where the joint can be assembled, and what kind of four-bar it is (tested in headlines.py)
CLOSES = (r"(; it (cannot be assembled at any crank angle|can be assembled from [\d., tofrm]* deg)|; it can be assembled at all other angles that were tested; gaps narrower than 4 deg may have been missed)"
          r"(; [a-z -]*(Grashof|parallelogram).*)?")


def cannot(number, name, degrees, why):
    """Message on a joint that cannot be assembled: where and why; a pattern for the number of degrees."""
    return re.compile(re.escape(f"input.nml:{number}: joint '{name}' cannot be assembled or is at a dead point at a crank angle of "
                                f"@ deg: {why}").replace("@", degrees) + CLOSES)


def about(degrees, number, name, why):
    """Like `cannot`, for a dead point that is found within 0.02 deg, because the search approaches it from one side."""
    steps = range(round(100 * (degrees - 0.02)), round(100 * (degrees + 0.02)) + 1)
    places = "|".join(rf"{step / 100:.2f}\d" for step in steps)
    return cannot(number, name, f"({places})", why)


FIXED = "guide_point=0.0,0.0, guide_angle=90.0"
RRP_HAS = "is not a key of a joint of type 'RRP'; its keys are ends, lengths, branch, guide, guide_point, guide_angle"
RPR_HAS = "is not a key of a joint of type 'RPR'; its keys are ends, lengths, branch"
RPP_HAS = "is not a key of a joint of type 'RPP'; its keys are ends, slot_angle, guide, guide_point, guide_angle"
PRP_HAS = ("is not a key of a joint of type 'PRP'; its keys are guide, guide_point, guide_angle, guide2, guide2_point, "
           "guide2_angle")
PARALLEL = "the guides become parallel, or two joints that carry a guide coincide"
INDEFINITE = "must be positive semidefinite: in some direction this matrix pushes a displaced frame farther away instead of back"
PAIRS = "must have an odd number of values: the mean, then one cosine and one sine coefficient for each order"
MASS_KEYS = "allowed are mass, inertia, a1, a2, a3, moment, energy"
UNITS_KEYS = ("allowed are length, mass, inertia, stiffness, force, moment, damping, rotary_damping, angle, pressure, area, "
              "acceleration, results")

# description, input, exit code, standard error
INPUTS = [
    # sliders
    ("RRP with two ends", joint("B", f"type='RRP', ends='A','P', lengths=0.2, {FIXED}, branch=1"), 2,
     "input.nml:6: &joint 'B': ends = 'A', 'P': must name 1 joint"),
    ("RRP with two lengths", joint("B", f"type='RRP', ends='A', lengths=0.2,0.3, {FIXED}, branch=1"), 2,
     "input.nml:6: &joint 'B': lengths = 0.2, 0.3: takes 1 value, has 2"),
    ("RRP with the second length", joint("B", f"type='RRP', ends='A', lengths(2)=0.2, {FIXED}, branch=1"), 2,
     "input.nml:6: &joint 'B': lengths(2) = 0.2: the element before it is missing"),
    ("RRP without guide", joint("B", "type='RRP', ends='A', lengths=0.2, branch=1"), 2, needs_guide(6, "B")),
    ("RRP without guide_angle", joint("B", "type='RRP', ends='A', lengths=0.2, guide_point=0.0,0.0, branch=1"), 2,
     needs_guide(6, "B")),
    ("RRP without guide_point", joint("B", "type='RRP', ends='A', lengths=0.2, guide_angle=90.0, branch=1"), 2,
     needs_guide(6, "B")),
    ("RRP without branch", joint("B", f"type='RRP', ends='A', lengths=0.2, {FIXED}"), 2,
     "input.nml:6: &joint 'B': a joint of type 'RRP' needs the key 'branch'"),
    ("RRP without ends", joint("B", f"type='RRP', lengths=0.2, {FIXED}, branch=1"), 2,
     "input.nml:6: &joint 'B': a joint of type 'RRP' needs the key 'ends'"),
    ("RRP without lengths", joint("B", f"type='RRP', ends='A', {FIXED}, branch=1"), 2,
     "input.nml:6: &joint 'B': a joint of type 'RRP' needs the key 'lengths'"),
    ("RRP, branch 2", joint("B", f"type='RRP', ends='A', lengths=0.2, {FIXED}, branch=2"), 2,
     "input.nml:6: &joint 'B': branch = 2: must be 1 or -1"),
    ("RRP, negative length", joint("B", f"type='RRP', ends='A', lengths=-0.2, {FIXED}, branch=1"), 2,
     "input.nml:6: &joint 'B': lengths(1) = -0.2: must be positive"),
    ("RRP with a second guide", joint("B", f"type='RRP', ends='A', lengths=0.2, {FIXED}, branch=1, guide2='O','P'"), 2,
     f"input.nml:6: &joint 'B': guide2 = 'O', 'P': {RRP_HAS}"),
    ("RRP with a slot", joint("B", f"type='RRP', ends='A', lengths=0.2, {FIXED}, branch=1, slot_angle=90.0"), 2,
     f"input.nml:6: &joint 'B': slot_angle = 90.0: {RRP_HAS}"),
    ("RRP with an offset", joint("B", f"type='RRP', ends='A', lengths=0.2, {FIXED}, branch=1, offset=0.1,0.0"), 2,
     f"input.nml:6: &joint 'B': offset = 0.1, 0.0: {RRP_HAS}"),
    ("guide's point with one number",
     joint("B", "type='RRP', ends='A', lengths=0.2, guide_point=0.0, guide_angle=90.0, branch=1"), 2,
     "input.nml:6: &joint 'B': guide_point = 0.0: takes 2 values, has 1"),
    ("guide's angle in words",
     joint("B", "type='RRP', ends='A', lengths=0.2, guide_point=0.0,0.0, guide_angle='up', branch=1"), 2,
     "input.nml:6: &joint 'B': guide_angle = 'up': must be a number, without quotes"),
    ("type in lower case", joint("B", f"type='rrp', ends='A', lengths=0.2, {FIXED}, branch=1"), 2,
     "input.nml:6: &joint 'B': type = 'rrp': unknown; did you mean 'RRP'?"),
    # slotted levers
    ("RPR with one end", joint("C", "type='RPR', ends='A', lengths=0.6, branch=1"), 2,
     "input.nml:7: &joint 'C': ends = 'A': must name 2 joints"),
    ("RPR with three ends", joint("C", "type='RPR', ends='A','P','O', lengths=0.6, branch=1"), 2,
     "input.nml:7: &joint 'C': ends = 'A', 'P', 'O': takes at most 2 values, has 3"),
    ("RPR between a joint and itself", joint("C", "type='RPR', ends='P','P', lengths=0.6, branch=1"), 2,
     "input.nml:7: &joint 'C': ends = 'P', 'P': must name 2 different joints"),
    ("RPR with two lengths", joint("C", "type='RPR', ends='A','P', lengths=0.6,0.1, branch=1"), 2,
     "input.nml:7: &joint 'C': lengths = 0.6, 0.1: takes 1 value, has 2"),
    ("RPR, length zero", joint("C", "type='RPR', ends='A','P', lengths=0.0, branch=1"), 2,
     "input.nml:7: &joint 'C': lengths(1) = 0.0: must be positive"),
    ("RPR, branch 0", joint("C", "type='RPR', ends='A','P', lengths=0.6, branch=0"), 2,
     "input.nml:7: &joint 'C': branch = 0: must be 1 or -1"),
    ("RPR with a guide", joint("C", "type='RPR', ends='A','P', lengths=0.6, branch=1, guide='O','A'"), 2,
     f"input.nml:7: &joint 'C': guide = 'O', 'A': {RPR_HAS}"),
    ("RPR on a later joint", joint("C", "type='RPR', ends='A','D', lengths=0.6, branch=1"), 2,
     "input.nml:7: &joint 'C': ends = 'A', 'D': joint 'D' comes later, in line 8: list it before this joint"),
    # points of bodies
    ("rigid without offset", joint("D", "type='rigid', ends='A','B'"), 2,
     "input.nml:8: &joint 'D': a joint of type 'rigid' needs the key 'offset'"),
    ("rigid with one end", joint("D", "type='rigid', ends='A', offset=0.1,0.02"), 2,
     "input.nml:8: &joint 'D': ends = 'A': must name 2 joints"),
    ("rigid between a joint and itself", joint("D", "type='rigid', ends='B','B', offset=0.1,0.02"), 2,
     "input.nml:8: &joint 'D': ends = 'B', 'B': must name 2 different joints"),
    ("rigid with half an offset", joint("D", "type='rigid', ends='A','B', offset=0.1"), 2,
     "input.nml:8: &joint 'D': offset = 0.1: takes 2 values, has 1"),
    ("rigid with lengths", joint("D", "type='rigid', ends='A','B', offset=0.1,0.02, lengths=1.0"), 2,
     "input.nml:8: &joint 'D': lengths = 1.0: is not a key of a joint of type 'rigid'; its keys are ends, offset"),
    ("rigid with a branch", joint("D", "type='rigid', ends='A','B', offset=0.1,0.02, branch=1"), 2,
     "input.nml:8: &joint 'D': branch = 1: is not a key of a joint of type 'rigid'; its keys are ends, offset"),
    ("rigid on itself", joint("D", "type='rigid', ends='A','D', offset=0.1,0.02"), 2,
     "input.nml:8: &joint 'D': ends = 'A', 'D': a joint cannot refer to itself"),
    # yokes
    ("RPP without slot", joint("E", f"type='RPP', ends='A', {FIXED}"), 2,
     "input.nml:9: &joint 'E': a joint of type 'RPP' needs the key 'slot_angle'"),
    ("RPP without guide", joint("E", "type='RPP', ends='A', slot_angle=90.0"), 2, needs_guide(9, "E")),
    ("RPP with two ends", joint("E", f"type='RPP', ends='A','O', {FIXED}, slot_angle=90.0"), 2,
     "input.nml:9: &joint 'E': ends = 'A', 'O': must name 1 joint"),
    ("RPP with a branch", joint("E", f"type='RPP', ends='A', {FIXED}, slot_angle=90.0, branch=1"), 2,
     f"input.nml:9: &joint 'E': branch = 1: {RPP_HAS}"),
    ("RPP with a length", joint("E", f"type='RPP', ends='A', {FIXED}, slot_angle=90.0, lengths=0.1"), 2,
     f"input.nml:9: &joint 'E': lengths = 0.1: {RPP_HAS}"),
    ("RPP with two slots", joint("E", f"type='RPP', ends='A', {FIXED}, slot_angle=90.0,45.0"), 2,
     "input.nml:9: &joint 'E': slot_angle = 90.0, 45.0: takes 1 value, has 2"),
    ("slot parallel to the guide", joint("E", f"type='RPP', ends='A', {FIXED}, slot_angle=0.0"), 2,
     "input.nml:9: &joint 'E': slot_angle = 0.0: the slot is parallel to the guide"),
    ("slot antiparallel to the guide", joint("E", f"type='RPP', ends='A', {FIXED}, slot_angle=180.0"), 2,
     "input.nml:9: &joint 'E': slot_angle = 180.0: the slot is parallel to the guide"),
    # the sine of this angle in double precision is above its rounding
    ("slot parallel to the guide after turns", joint("E", f"type='RPP', ends='A', {FIXED}, slot_angle=-540.0"), 2,
     "input.nml:9: &joint 'E': slot_angle = -540.0: the slot is parallel to the guide"),
    ("slot parallel but for rounding", joint("E", f"type='RPP', ends='A', {FIXED}, slot_angle=1e-9"), 2,
     "input.nml:9: &joint 'E': slot_angle = 1e-9: the slot is parallel to the guide"),
    # two guides
    ("PRP without second guide", joint("F", "type='PRP', guide='P','C'"), 2, needs_guide(10, "F", "guide2")),
    ("PRP without first guide", joint("F", "type='PRP', guide2='P','C'"), 2, needs_guide(10, "F")),
    ("PRP, second guide without angle", joint("F", f"type='PRP', {FIXED}, guide2_point=0.0,0.5"), 2,
     needs_guide(10, "F", "guide2")),
    ("PRP, second guide without point", joint("F", f"type='PRP', {FIXED}, guide2_angle=0.0"), 2,
     needs_guide(10, "F", "guide2")),
    ("PRP with ends", joint("F", f"type='PRP', {FIXED}, guide2='P','C', ends='A'"), 2,
     f"input.nml:10: &joint 'F': ends = 'A': {PRP_HAS}"),
    ("PRP with a slot", joint("F", f"type='PRP', {FIXED}, guide2='P','C', slot_angle=90.0"), 2,
     f"input.nml:10: &joint 'F': slot_angle = 90.0: {PRP_HAS}"),
    ("parallel guides", joint("F", f"type='PRP', {FIXED}, guide2_point=0.0,0.5, guide2_angle=90.0"), 2,
     "input.nml:10: &joint 'F': the two guides are parallel"),
    ("antiparallel guides", joint("F", f"type='PRP', {FIXED}, guide2_point=0.0,0.5, guide2_angle=-90.0"), 2,
     "input.nml:10: &joint 'F': the two guides are parallel"),
    ("parallel guides on one body",
     joint("F", "type='PRP', guide='P','C', guide2='P','C', guide2_point=0.0,0.1, guide2_angle=180.0"), 2,
     "input.nml:10: &joint 'F': the two guides are parallel"),
    # moving guides
    ("guide on an unknown joint", joint("K", "type='RRP', ends='D', lengths=0.5, guide='P','CC', branch=1"), 2,
     "input.nml:11: &joint 'K': guide = 'P', 'CC': there is no joint 'CC'; did you mean 'C'?"),
    ("guide on a later joint", joint("E", "type='RPP', ends='A', guide='P','K', slot_angle=90.0"), 2,
     "input.nml:9: &joint 'E': guide = 'P', 'K': joint 'K' comes later, in line 11: list it before this joint"),
    ("guide on the slider itself", joint("K", "type='RRP', ends='D', lengths=0.5, guide='P','K', branch=1"), 2,
     "input.nml:11: &joint 'K': guide = 'P', 'K': a joint cannot refer to itself"),
    ("guide from a joint to itself", joint("K", "type='RRP', ends='D', lengths=0.5, guide='P','P', branch=1"), 2,
     "input.nml:11: &joint 'K': guide = 'P', 'P': must name 2 different joints"),
    ("guide on one joint", joint("K", "type='RRP', ends='D', lengths=0.5, guide='P', branch=1"), 2,
     "input.nml:11: &joint 'K': guide = 'P': takes 2 values, has 1"),
    ("guide on three joints", joint("K", "type='RRP', ends='D', lengths=0.5, guide='P','C','A', branch=1"), 2,
     "input.nml:11: &joint 'K': guide = 'P', 'C', 'A': takes 2 values, has 3"),
    ("guide on joints by number", joint("K", "type='RRP', ends='D', lengths=0.5, guide=1,2, branch=1"), 2,
     "input.nml:11: &joint 'K': guide(1) = 1: must be in quotes: '1'"),
    ("second guide on an unknown joint", joint("F", f"type='PRP', {FIXED}, guide2='Q','C'"), 2,
     "input.nml:10: &joint 'F': guide2 = 'Q', 'C': there is no joint 'Q'; choose from 'O', 'P', 'A', 'B', 'C', 'D', 'E'"),
    ("second guide from a joint to itself", joint("F", f"type='PRP', {FIXED}, guide2='C','C'"), 2,
     "input.nml:10: &joint 'F': guide2 = 'C', 'C': must name 2 different joints"),
    # mechanisms that cannot turn
    ("slider out of reach",
     joint("B", "type='RRP', ends='A', lengths=0.2, guide_point=0.3,0.0, guide_angle=90.0, branch=1"), 3,
     cannot(6, "B", "0.000", "the joint 'ends(1)' is 0.25 m away from the guide; the link's length of 0.2 m must exceed this distance")),
    # A is 0.05 cos(phi) from the y-axis: 0.16 - 0.05 cos(phi) = 0.2
    ("slider out of reach over part of the turn",
     joint("B", "type='RRP', ends='A', lengths=0.2, guide_point=0.16,0.0, guide_angle=90.0, branch=1"), 3,
     cannot(6, "B", f"{math.degrees(math.acos(-0.8)):.3f}",
            "the joint 'ends(1)' is 0.2 m away from the guide; the link's length of 0.2 m must exceed this distance")),
    ("slider at a dead point",
     joint("B", "type='RRP', ends='A', lengths=0.2, guide_point=0.15,0.0, guide_angle=90.0, branch=1"), 3,
     about(180.0, 6, "B", "the joint 'ends(1)' is 0.2 m away from the guide; the link's length of 0.2 m must exceed this distance")),
    ("rod as long as the crank",
     joint("B", "type='RRP', ends='A', lengths=0.05, guide_point=0.0,0.0, guide_angle=90.0, branch=1"), 3,
     cannot(6, "B", "0.000", "the joint 'ends(1)' is 0.05 m away from the guide; the link's length of 0.05 m must exceed this distance")),
    # the guide turns with the crank, at 90 deg to it: P is 0.35 sin(phi) from it
    ("slider out of reach of a moving guide",
     last_joint("type='RRP', ends='P', lengths=0.30, guide='O','A', guide_angle=90.0, branch=1"), 3,
     cannot(8, "S", f"{math.degrees(math.asin(0.30 / 0.35)):.3f}",
            "the joint 'ends(1)' is 0.3 m away from the guide; the link's length of 0.3 m must exceed this distance")),
    ("lever's pivot on the crank's circle",
     last_joint("type='ground', position=1.0,1.0", ("position=0.0,-0.35", "position=0.0,-0.05")), 3,
     about(270.0, 7, "C", "the joint in the slot coincides with the lever's pivot")),
    ("lever's pivot where the crank begins",
     last_joint("type='ground', position=1.0,1.0", ("position=0.0,-0.35", "position=0.05,0.0")), 3,
     cannot(7, "C", "0.000", "the joint in the slot coincides with the lever's pivot")),
    ("joints of a body meet",
     last_joint("type='rigid', ends='A','P', offset=0.1,0.0", ("position=0.0,-0.35", "position=0.0,0.05"),
                ("ends='A','P', lengths", "ends='A','O', lengths")), 3,
     about(90.0, 8, "S", "the two joints 'ends' of the body coincide")),
    ("joints that carry a guide meet",
     last_joint("type='RPP', ends='O', guide='P','A', slot_angle=60.0", ("position=0.0,-0.35", "position=0.0,0.05"),
                ("ends='A','P', lengths", "ends='A','O', lengths")), 3,
     about(90.0, 8, "S", "the slot, at 60.000 deg to the guide, is parallel to the guide, or the two joints that carry the guide coincide")),
    # the lever's angle from the y-axis reaches 5 deg: 0.05 cos(phi) = tan(5 deg) (0.35 + 0.05 sin(phi))
    ("guides parallel at one angle",
     joint("F", "type='PRP', guide='P','C', guide2_point=0.0,0.5, guide2_angle=85.0"), 3,
     cannot(10, "F", f"{math.degrees(math.acos(7 * math.sin(math.radians(5)))) - 5:.3f}", PARALLEL)),
    ("guides parallel at 90 deg",
     joint("F", "type='PRP', guide='P','C', guide2_point=0.1,0.5, guide2_angle=90.0"), 3,
     about(90.0, 10, "F", PARALLEL)),
    # units
    ("unknown unit, near", units("length='MM'"), 2,
     "input.nml:2: &units: length = 'MM': unknown; did you mean 'mm'?"),
    ("unknown unit, near two", units("length='km'"), 2,
     "input.nml:2: &units: length = 'km': unknown; choose from 'm', 'cm', 'mm', 'in', 'ft'"),
    ("unknown unit of mass", units("mass='stone'"), 2,
     "input.nml:2: &units: mass = 'stone': unknown; choose from {units.mass}"),
    ("unknown unit of inertia", units("inertia='kg cm2'"), 2,
     "input.nml:2: &units: inertia = 'kg cm2': unknown; did you mean 'kg cm^2'?"),
    ("unknown unit of stiffness", units("stiffness='pounds'"), 2,
     "input.nml:2: &units: stiffness = 'pounds': unknown; choose from {units.stiffness}"),
    ("pounds as a force", units("force='lb'"), 2, "input.nml:2: &units: force = 'lb': unknown; did you mean 'lbf'?"),
    ("pounds-force as a mass", units("mass='lbf'"), 2, "input.nml:2: &units: mass = 'lbf': unknown; did you mean 'lb'?"),
    ("unknown unit of results", units("results='inch'"), 2,
     "input.nml:2: &units: results(1) = 'inch': unknown; choose from {units.results}"),
    ("two units of results", units("results='in','lbf','mm'"), 2,
     "input.nml:2: &units: results(3) = 'mm': gives two units of length"),
    ("units of results besides those of the input", units("results='input','lbf'"), 2,
     "input.nml:2: &units: results = 'input', 'lbf': 'input' must stand alone"),
    ("unknown unit of force", units("force='N/m'"), 2,
     "input.nml:2: &units: force = 'N/m': unknown; choose from 'N', 'kN', 'kp', 'lbf', 'kip'"),
    ("unknown unit of a moment", units("moment='Nm'"), 2,
     "input.nml:2: &units: moment = 'Nm': unknown; did you mean 'N m'?"),
    ("unknown unit of damping", units("damping='Ns/m'"), 2,
     "input.nml:2: &units: damping = 'Ns/m': unknown; did you mean 'N s/m'?"),
    ("unknown unit of rotary damping", units("rotary_damping='Nms'"), 2,
     "input.nml:2: &units: rotary_damping = 'Nms': unknown; choose from {units.rotary_damping}"),
    ("unknown unit of angles", units("angle='degrees'"), 2,
     "input.nml:2: &units: angle = 'degrees': unknown; choose from 'deg', 'rad'"),
    ("unknown quantity", units("time='ms'"), 2, f"input.nml:2: &units: unknown key 'time': {UNITS_KEYS}"),
    ("unknown quantity, near", units("lenght='mm'"), 2, "input.nml:2: &units: unknown key 'lenght': did you mean 'length'?"),
    ("unit without quotes", units("length=mm"), 2, "input.nml:2: &units: length = mm: must be in quotes: 'mm'"),
    ("unit empty", units("length=''"), 2, "input.nml:2: &units: length = '': unknown; choose from 'm', 'cm', 'mm', 'in', 'ft'"),
    ("two units", units("length='mm','cm'"), 2, "input.nml:2: &units: length = 'mm', 'cm': takes 1 value, has 2"),
    ("units twice", units("length='mm'") + "&units mass='g' /\n", 2,
     "input.nml:19: &units: may occur only once (first in line 2)"),
    # mass functions
    ("even number of harmonics", functions("a1=0.1,0.05,0.0", "a1=0.1,0.05"), 2,
     f"input.nml:2: &mass_functions: a1 = 0.1, 0.05: {PAIRS}"),
    ("even number of the moment's harmonics", functions("moment=0.0,0.0,0.001", "moment=0.0,0.0,0.001,0.0"), 2,
     f"input.nml:2: &mass_functions: moment = 0.0, 0.0, 0.001, 0.0: {PAIRS}"),
    # 3 (0.02 + 0.0195 cos) < (0.1 + 0.05 cos)^2 + (0.05 sin)^2 first holds at 30 of 64 crank angles
    ("mass functions of no mechanism", functions("a3=0.02", "a3=0.02,0.0195,0.0"), 2,
     "input.nml:2: &mass_functions: these mass functions are physically impossible: at a crank angle of 168.8 deg mass * a3 is less "
     "than a1^2 + a2^2"),
    ("mass functions without mass", functions("mass=3.0, ", ""), 2, "input.nml:2: &mass_functions: mass: must be given"),
    ("mass functions without inertia", functions("inertia=0.01, ", ""), 2,
     "input.nml:2: &mass_functions: inertia: must be given"),
    ("mass functions, negative mass", functions("mass=3.0", "mass=-3.0"), 2,
     "input.nml:2: &mass_functions: mass = -3.0: must not be negative"),
    ("mass functions, negative inertia", functions("inertia=0.01", "inertia=-0.01"), 2,
     "input.nml:2: &mass_functions: inertia = -0.01: must not be negative"),
    ("mass functions, two masses", functions("mass=3.0", "mass=3.0,1.0"), 2,
     "input.nml:2: &mass_functions: mass = 3.0, 1.0: takes 1 value, has 2"),
    ("mass functions, unknown key", functions("a3=0.02", "a4=0.02"), 2,
     f"input.nml:2: &mass_functions: unknown key 'a4': {MASS_KEYS}"),
    ("mass functions, unknown key, near", functions("moment=", "momentum="), 2,
     "input.nml:2: &mass_functions: unknown key 'momentum': did you mean 'moment'?"),
    ("mass functions, not a number", functions("a3=0.02", "a3=NaN"), 2,
     "input.nml:2: &mass_functions: a3(1) = NaN: must be finite"),
    ("mass functions, too many values", functions("a3=0.02", "a3=1003*0.0"), 2,
     "input.nml:2: &mass_functions: a3 = 1003*0.0: takes at most 1001 values, has 1003"),
    ("mass functions, a gap", functions("a1=0.1,0.05,0.0", "a1(5)=0.1"), 2,
     "input.nml:2: &mass_functions: a1(5) = 0.1: the element before it is missing"),
    ("mass functions twice", FUNCTIONS + "&mass_functions mass=3.0, inertia=0.0 /\n", 2,
     "input.nml:6: &mass_functions: may occur only once (first in line 2)"),
    ("mass functions beside joints and links", added("&mass_functions mass=3.0, inertia=0.0 /"), 2,
     "input.nml:18: &mass_functions: cannot be combined with &joint, &link, &load, &mechanism or &repeat"),
    ("mass functions beside a joint", FUNCTIONS + "&joint name='O', type='ground', position=0.0,0.0 /\n", 2,
     "input.nml:2: &mass_functions: cannot be combined with &joint, &link, &load, &mechanism or &repeat"),
    ("mass functions beside a link", FUNCTIONS + "&link name='x', from='O', mass=1.0, inertia=0.0 /\n", 2,
     "input.nml:2: &mass_functions: cannot be combined with &joint, &link, &load, &mechanism or &repeat"),
    ("joints without links", without("link"), 2,
     "input.nml: the mechanism has no mass: a group &link is required"),
    ("links without joints", without("joint"), 2,
     "input.nml: the mechanism is missing: groups &joint and &link (or &mass_functions) are required"),
    # mountings
    ("unknown degree of freedom, near", machine("origin=", "dof='phi', origin="), 2,
     "input.nml:15: &frame: dof(1) = 'phi': unknown; did you mean 'psi'?"),
    ("degree of freedom empty", machine("origin=", "dof='', origin="), 2,
     "input.nml:15: &frame: dof(1) = '': unknown; choose from 'xi', 'eta', 'psi', 'zeta', 'rot_xi', 'rot_eta'"),
    ("degree of freedom by number", machine("origin=", "dof=3, origin="), 2,
     "input.nml:15: &frame: dof(1) = 3: must be in quotes: '3'"),
    ("four degrees of freedom", machine("origin=", "dof='xi','eta','psi','xi', origin="), 2,
     "input.nml:15: &frame: dof = 'xi', 'eta', 'psi', 'xi': names a degree of freedom twice"),
    ("support with two angles", machine(" angle=30.0 ", " angle=30.0,40.0 "), 2,
     "input.nml:16: &support 1: angle = 30.0, 40.0: describes a tilt out of the plane in which the frame moves: add zeta, rot_xi or rot_eta to &frame dof"),
    ("support's angle in quotes", machine(" angle=30.0 ", " angle='30' "), 2,
     "input.nml:16: &support 1: angle(1) = '30': must be a number, without quotes"),
    ("support with one damping", machine("damping=60.0,120.0, angle=30.0", "damping=60.0"), 2,
     "input.nml:16: &support 1: damping = 60.0: takes at least 2 values, has 1"),
    ("foundation not symmetric in 2,3", added("&foundation stiffness(2,3)=4.0 /"), 2,
     "input.nml:18: &foundation: stiffness(2,3) = 4.0: must be symmetric, but c23 is 4 and c32 is 0"),
    ("foundation, negative on the diagonal", added("&foundation stiffness=1.0,3*0.0,1.0,3*0.0,-1.0 /"), 2,
     "input.nml:18: &foundation: stiffness = 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0: " + INDEFINITE),
    ("foundation indefinite in 1,2", added("&foundation stiffness=1.0,2.0,0.0, 2.0,1.0,0.0, 0.0,0.0,1.0 /"), 2,
     "input.nml:18: &foundation: stiffness = 1.0, 2.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0, 1.0: " + INDEFINITE),
    ("foundation indefinite in 1,3", added("&foundation stiffness=1.0,0.0,2.0, 0.0,1.0,0.0, 2.0,0.0,1.0 /"), 2,
     "input.nml:18: &foundation: stiffness = 1.0, 0.0, 2.0, 0.0, 1.0, 0.0, 2.0, 0.0, 1.0: " + INDEFINITE),
    # minors of order 1 and 2 are positive, the determinant is 1 - 3 * 0.36 - 2 * 0.216
    ("foundation indefinite in its determinant",
     added("&foundation stiffness=1.0,-0.6,-0.6, -0.6,1.0,-0.6, -0.6,-0.6,1.0 /"), 2,
     "input.nml:18: &foundation: stiffness = 1.0, -0.6, -0.6, -0.6, 1.0, -0.6, -0.6, -0.6, 1.0: " + INDEFINITE),
    ("foundation's matrix with a seventh row", added("&foundation stiffness(7,1)=1.0 /"), 2,
     "input.nml:18: &foundation: stiffness(7,1) = 1.0: has no such element: the subscripts run from 1 to 6 and 1 to 6"),
    ("foundation's matrix with one subscript", added("&foundation stiffness(4)=1.0 /"), 2,
     "input.nml:18: &foundation: stiffness(4) = 1.0: takes two subscripts"),
]

# description, settings of the machine, exit code, standard error
SETTINGS = [
    ("guide_point(3)", "joint(B).guide_point(3)=0.1", 2, "guide_point: the subscript runs from 1 to 2"),
    ("guide_angle in words", "joint(B).guide_angle=up", 2, "must be a number"),
    ("one carrier", "joint(B).guide=O", 2, "takes 2 values, has 1"),
    ("unknown carrier", "joint(B).guide='O','Q'", 2, "there is no joint 'Q'; choose from 'O', 'P', 'A'"),
    ("later carrier", "joint(B).guide='O','K'", 2, "joint 'K' in line 11 refers to 'B' in turn: joints that can only be "
     "located together (Assur groups of class III) are not supported"),
    ("slot of a slider", "joint(B).slot_angle=3", 2, RRP_HAS),
    ("slot parallel", "joint(E).slot_angle=0", 2, "the slot is parallel to the guide"),
    ("half an offset", "joint(D).offset=0.1", 2, "takes 2 values, has 1"),
    ("misspelt offset", "joint(D).ofset=0.1,0.2", 2, "unknown key 'ofset': did you mean 'offset'?"),
    ("unknown unit", "units.length=parsec", 2, "unknown; choose from 'm', 'cm', 'mm', 'in', 'ft'"),
    ("unknown quantity", "units.time=ms", 2, f"unknown key 'time': {UNITS_KEYS}"),
    ("group without key", "units=mm", 1,
     "the path must be GROUP.KEY, GROUP(NAME).KEY or GROUP.KEY(INDEX), such as drive.speed_rpm"),
    ("number of a single group", "units(1).length=mm", 2, "there is only one &units: write units.length"),
    ("unknown dof", "frame.dof=phi", 2, "unknown; did you mean 'psi'?"),
    ("second dof without a first", "frame.dof(2)=psi", 2, "the element before it is missing"),
    ("foundation that pushes", "foundation.stiffness(3,3)=-100", 2, INDEFINITE),
    ("foundation not symmetric", "foundation.stiffness(1,2)=100", 2,
     "must be symmetric, but c12 is 100 and c21 is 0"),
    ("one value for the matrix", "foundation.stiffness=5", 2, "takes 9 or 36 values, has 1"),
    ("one subscript for the matrix", "foundation.stiffness(9)=5", 2, "stiffness takes two subscripts"),
    ("support's angle", "support(1).angle=x", 2, "must be a number"),
    ("third support", "support(3).angle=5", 2, "there is no &support 3: the groups are numbered from 1 to 2"),
    ("harmonics with a gap", "mass_functions.a1(2)=3", 2, "the element before it is missing"),
]

# the same of the mass functions
FUNCTION_SETTINGS = [
    ("negative mass", "mass_functions.mass=-3", 2, "must not be negative"),
    ("even number", "mass_functions.a1=1,2", 2, PAIRS),
    ("element 1002", "mass_functions.a1(1002)=3", 2, "a1: the subscript runs from 1 to 1001"),
    ("unknown key", "mass_functions.b=2", 2, f"unknown key 'b': {MASS_KEYS}"),
    ("words", "mass_functions.moment=x", 2, "must be a number"),
    ("number of a single group", "mass_functions(1).a1=1", 2,
     "there is only one &mass_functions: write mass_functions.a1"),
    ("no links", "link(rod).mass=2", 2, "the input has no &link"),
    ("no joints", "joint(A).radius=1", 2, "the input has no &joint"),
]

# description, input, arguments, exit code, standard error
BROKEN_MECHANISMS = [(what, text, ["input.nml"], code, message) for what, text, code, message in INPUTS]
for base, settings in ((MACHINE, SETTINGS), (FUNCTIONS, FUNCTION_SETTINGS)):
    kind = "linkage" if base is MACHINE else "mass functions"
    BROKEN_MECHANISMS += [(f"--set of the {kind}, {what}", base, ["input.nml", "--set", setting], code,
                           f"--set {setting}: {message}") for what, setting, code, message in settings]
BROKEN_MECHANISMS += [
    ("--set of the linkage, another type", MACHINE, ["input.nml", "-s", "joint(C).type=RRR"], 2,
     "input.nml:7: &joint 'C': lengths(2): must be given"),
    ("--set of the linkage, mass functions too", MACHINE, ["input.nml", "-s", "mass_functions.mass=3"], 2,
     "input.nml: &mass_functions: cannot be combined with &joint, &link, &load, &mechanism or &repeat"),
    ("--set of the linkage, guides become parallel", MACHINE, ["input.nml", "-s", "joint(F).guide2_angle=90"], 3,
     about(90.0, 10, "F", PARALLEL)),
    ("--check of a slider out of reach", MACHINE, ["--check", "input.nml", "-s", "joint(B).lengths=0.04"], 3,
     cannot(6, "B", "0.000", "the joint 'ends(1)' is 0.05 m away from the guide; the link's length of 0.04 m must exceed this distance")),
]
