"""Broken inputs: how each differs from a valid one, and the expected exit code and single line on standard error.

A message is a text, or a pattern if a number in it depends on how finely the turn was searched. `{group.key}` in a text stands
for the words that the program allows there, as `--help group.key` lists them.
"""

import re

# The four-bar mechanism of data/khang_four_bar.nml; messages name its lines.
SOUND = """\
&case title = 'four-bar', tasks = 'stability', 'response' /
&drive speed_rpm = 240.0 /
&joint name='A0', type='ground', position=0.0, 0.0 /
&joint name='B0', type='ground', position=0.40, 0.0 /
&joint name='A', type='crank', pivot='A0', radius=0.07, phase=0.0 /
&joint name='B', type='RRR', ends='A','B0', lengths=0.37,0.16, branch=1 /
&link name='crank', from='A0', to='A', mass=0.50, inertia=0.0035, center=0.03,0.0 /
&link name='coupler', from='A', to='B', mass=0.60, inertia=0.0070, center=0.18,0.0 /
&link name='rocker', from='B0', to='B', mass=0.25, inertia=0.0060, center=0.08,0.0 /
&frame mass=18.0, inertia=0.78, origin=-0.20,0.20 /
&support position=-0.30,-0.20, stiffness=196133.0,196133.0 /
&support position=-0.10,-0.20, stiffness=196133.0,196133.0 /
&support position=0.10,-0.20, stiffness=196133.0,196133.0 /
&support position=0.30,-0.20, stiffness=196133.0,196133.0 /
&foundation damping=0.5,0.5,0.05 /
"""
# The paper's equations, about rest: for tests whose numbers are the paper's, and for those that need not pay for the exact frame.
REST = "&model frame='rest' /\n"


def changed(old, new):
    """The valid input with `old`, which it contains once, replaced."""
    assert SOUND.count(old) == 1, old
    return SOUND.replace(old, new)


def added(line):
    """The valid input with an additional line 16."""
    return SOUND + line + "\n"


LINES = SOUND.splitlines(keepends=True)


def without(*numbers):
    """The valid input without these lines."""
    return "".join(line for number, line in enumerate(LINES, 1) if number not in numbers)


RRR = "lengths=0.37,0.16, branch=1"

# description, input, exit code, standard error
INPUTS = [
    # groups
    ("unknown group", changed("&drive speed", "&drve speed"), 2,
     "input.nml:2: unknown group &drve: did you mean &drive?"),
    ("unknown group, nothing near", added("&engine power=1 /"), 2,
     "input.nml:16: unknown group &engine: allowed are &case, &drive, &units, &mechanism, &repeat, &joint, &link, &load, "
     "&mass_functions, &frame, &support, &foundation, &gravity, &probe, &model, &accuracy, &response, &sweep, &boundary, "
     "&resonance, &joints, &balance, &sensitivity, &separation, &design, &objective, &constraint, &robust"),
    ("group given twice", added("&drive speed_rpm=1 /"), 2,
     "input.nml:16: &drive: may occur only once (first in line 2)"),
    ("no drive", without(2), 2,
     "input.nml: the group &drive is missing"),
    ("no frame", without(10), 2,
     "input.nml: the group &frame is missing"),
    ("no joint", without(3, 4, 5, 6), 2,
     "input.nml: the mechanism is missing: groups &joint and &link (or &mass_functions) are required"),
    ("no link", without(7, 8, 9), 2,
     "input.nml: the mechanism has no mass: a group &link is required"),
    ("group without end", changed("speed_rpm = 240.0 /", "speed_rpm = 240.0"), 2,
     "input.nml:2: &drive: has no closing / (the next group begins in line 3)"),
    ("last group without end", changed("0.5,0.5,0.05 /", "0.5,0.5,0.05"), 2,
     "input.nml:15: &foundation: has no closing / (the file ends)"),
    ("group closed with &end", changed("speed_rpm = 240.0 /", "speed_rpm = 240.0 &end"), 2,
     "input.nml:2: &drive: close the group with / instead of &end"),
    ("group opened with $", changed("&drive", "$drive"), 2,
     "input.nml:2: write &drive ... / instead of $drive"),
    ("text outside of groups", added("power = 3"), 2,
     "input.nml:16: 'power' is outside of any group: the / before it ended &foundation"),
    ("fraction", changed("240.0 /", "240/7 /"), 2,
     "input.nml:2: '7' is outside of any group: the / before it ended &drive (a fraction? write a "
     "decimal number)"),
    ("comment without !", added("# the end"), 2,
     "input.nml:16: '#' is outside of any group: the / before it ended &foundation"),
    ("group without name", added("& /"), 2,
     "input.nml:16: a group's name must follow the &"),
    # keys
    ("unknown key, near", changed("speed_rpm", "sped_rpm"), 2,
     "input.nml:2: &drive: unknown key 'sped_rpm': did you mean 'speed_rpm'?"),
    ("unknown key, nothing near", changed("&drive ", "&drive torque=3.0, "), 2,
     "input.nml:2: &drive: unknown key 'torque': allowed are speed_rpm, speed_hz, held_by, flywheel_inertia"),
    ("key given twice", changed("speed_rpm = 240.0", "speed_rpm=240.0, speed_rpm=250.0"), 2,
     "input.nml:2: &drive: speed_rpm = 250.0: is given twice (first in line 2)"),
    ("element given twice", changed("damping=0.5,0.5,0.05", "damping(2)=1.0, damping(2)=2.0"), 2,
     "input.nml:15: &foundation: damping(2) = 2.0: is given twice (first in line 15)"),
    ("required key missing", changed("speed_rpm = 240.0", ""), 2,
     "input.nml:2: &drive: speed_rpm: must be given"),
    ("frame without mass", changed("mass=18.0, ", ""), 2,
     "input.nml:10: &frame: mass: must be given"),
    ("frame without inertia", changed("inertia=0.78, ", ""), 2,
     "input.nml:10: &frame: inertia: must be given"),
    ("frame without origin", changed(", origin=-0.20,0.20", ""), 2,
     "input.nml:10: &frame: origin: must be given"),
    ("support without stiffness", changed("position=0.10,-0.20, stiffness=196133.0,196133.0", "position=0.10,-0.20"), 2,
     "input.nml:13: &support 3: stiffness: must be given"),
    ("support without position", added("&support stiffness=1.0,1.0 /"), 2,
     "input.nml:16: &support 5: position: must be given"),
    ("link without mass", changed("mass=0.60, ", ""), 2,
     "input.nml:8: &link 'coupler': mass: must be given"),
    ("link without inertia", changed("inertia=0.0070, ", ""), 2,
     "input.nml:8: &link 'coupler': inertia: must be given"),
    ("link without from", changed("from='A', ", ""), 2,
     "input.nml:8: &link 'coupler': from: must be given"),
    ("link without name", changed("name='coupler', ", ""), 2,
     "input.nml:8: &link 2: name: must be given"),
    ("joint without type", changed("type='RRR', ", ""), 2,
     "input.nml:6: &joint 'B': type: must be given"),
    ("joint without name", changed("name='B', ", ""), 2,
     "input.nml:6: &joint 4: name: must be given"),
    ("key without =", changed("speed_rpm = 240.0", "speed_rpm 240.0"), 2,
     "input.nml:2: &drive: = is missing after 'speed_rpm'"),
    ("key without value", changed("speed_rpm = 240.0", "speed_rpm ="), 2,
     "input.nml:2: &drive: 'speed_rpm' has no value"),
    # values
    ("text for a number", changed("= 240.0", "= 'fast'"), 2,
     "input.nml:2: &drive: speed_rpm = 'fast': must be a number, without quotes"),
    ("word for a number", changed("= 240.0", "= fast"), 2,
     "input.nml:2: &drive: speed_rpm = fast: must be a number"),
    ("number for a text", changed("'four-bar'", "4"), 2,
     "input.nml:1: &case: title = 4: must be in quotes: '4'"),
    ("text without quotes", changed("'four-bar'", "four"), 2,
     "input.nml:1: &case: title = four: must be in quotes: 'four'"),
    ("text without end", changed("'four-bar'", "'four-bar"), 2,
     "input.nml:1: &case: a blank or comma is missing before 'stability' (a quote within a text is "
     "written twice)"),
    ("real for an integer", changed("branch=1", "branch=1.0"), 2,
     "input.nml:6: &joint 'B': branch = 1.0: must be a whole number, written without decimal point and exponent"),
    ("too many values", changed("origin=-0.20,0.20", "origin=-0.20,0.20,0.0,0.0"), 2,
     "input.nml:10: &frame: origin = -0.20, 0.20, 0.0, 0.0: takes at most 3 values, has 4"),
    ("too few values", changed("origin=-0.20,0.20", "origin=-0.20"), 2,
     "input.nml:10: &frame: origin = -0.20: takes at least 2 values, has 1"),
    ("two values for a scalar", changed("mass=18.0", "mass=18.0,19.0"), 2,
     "input.nml:10: &frame: mass = 18.0, 19.0: takes 1 value, has 2"),
    ("decimal comma", changed("= 240.0", "= 240,0"), 2,
     "input.nml:2: &drive: speed_rpm = 240, 0: takes 1 value, has 2 (a decimal comma? use a point)"),
    ("decimal comma in a vector", changed("position=0.40, 0.0", "position=0,40, 0,0"), 2,
     "input.nml:4: &joint 'B0': position = 0, 40, 0, 0: takes 2 values, has 4 (a decimal comma? use a "
     "point)"),
    ("typeset quotes", changed("name='crank'", "name=\u2018crank\u2019"), 2,
     "input.nml:7: &link '\u2018crank\u2019': name = \u2018crank\u2019: must be in straight quotes, ' or \""),
    ("typeset quotes about two words", changed("'four-bar'", "\u201cfour-bar linkage\u201d"), 2,
     "input.nml:1: &case: title = \u201cfour-bar, linkage\u201d: takes 1 value, has 2 (must be in straight quotes, ' or \")"),
    ("copy of no mechanism", SOUND + "&repeat of='main', name='two', origin=0.1,0.0 /\n", 2,
     "input.nml:16: &repeat 'two': of = 'main': the input has no &mechanism: to copy a mechanism, first give it a name: &mechanism name='main' /"),
    ("ratio of a copy", "&mechanism name='main' /\n" + SOUND + "&repeat of='main', name='two', ratio=1480,1450 /\n", 2,
     "input.nml:17: &repeat 'two': ratio = 1480, 1450: the mechanism repeats only after 145 turns of the drive; at most 64 "
     "are allowed"),
    ("ratio of a crank that turns too often", "&mechanism name='main' /\n" + SOUND + "&repeat of='main', name='two', ratio=1,2 /\n"
     "&repeat of='main', name='three', ratio=4096 /\n", 2,
     "input.nml:18: &repeat 'three': ratio = 4096: before the motion of the mechanism repeats, the crank turns more than the permitted 4096 times"),
    ("repeat count too large", changed("0.5,0.5,0.05", "4*0.5"), 2,
     "input.nml:15: &foundation: damping = 4*0.5: takes 3 or 6 values, has 4"),
    ("gap in a vector", changed("origin=-0.20,0.20", "origin=,0.20"), 2,
     "input.nml:10: &frame: a value is missing before a comma of 'origin'"),
    ("subscript out of range", changed("damping=0.5,0.5,0.05", "damping(7)=0.5"), 2,
     "input.nml:15: &foundation: damping(7) = 0.5: has no such element: the subscript runs from 1 to 6"),
    ("subscript where none belongs", changed("mass=18.0", "mass(1)=18.0"), 2,
     "input.nml:10: &frame: mass(1) = 18.0: takes no subscript"),
    ("not a number", changed("= 240.0", "= NaN"), 2,
     "input.nml:2: &drive: speed_rpm = NaN: must be finite"),
    ("infinite", changed("= 240.0", "= -Infinity"), 2,
     "input.nml:2: &drive: speed_rpm = -Infinity: must be finite"),
    ("too large", changed("mass=18.0", "mass=1e309"), 2,
     "input.nml:10: &frame: mass = 1e309: is too large"),
    ("integer too large", changed("branch=1", "branch=99999999999"), 2,
     "input.nml:6: &joint 'B': branch = 99999999999: is too large"),
    ("speed zero", changed("= 240.0", "= 0.0"), 2,
     "input.nml:2: &drive: speed_rpm = 0.0: must not be zero"),
    ("speed that vanishes in double precision", changed("= 240.0", "= 1e-400"), 2,
     "input.nml:2: &drive: speed_rpm = 1e-400: must not be zero"),
    ("negative mass of a link", changed("mass=0.60", "mass=-0.60"), 2,
     "input.nml:8: &link 'coupler': mass = -0.60: must not be negative"),
    ("negative inertia of a link", changed("inertia=0.0070", "inertia=-0.0070"), 2,
     "input.nml:8: &link 'coupler': inertia(1) = -0.0070: must not be negative"),
    ("negative mass of the frame", changed("mass=18.0", "mass=-18.0"), 2,
     "input.nml:10: &frame: mass = -18.0: must be positive"),
    ("frame without mass: zero", changed("mass=18.0", "mass=0"), 2,
     "input.nml:10: &frame: mass = 0: must be positive"),
    ("inertia of the frame zero", changed("inertia=0.78", "inertia=0.0"), 2,
     "input.nml:10: &frame: inertia = 0.0: must be positive"),
    ("negative stiffness", changed("position=0.10,-0.20, stiffness=196133.0,196133.0",
                                   "position=0.10,-0.20, stiffness=196133.0,-1.0"), 2,
     "input.nml:13: &support 3: stiffness(2) = -1.0: must not be negative"),
    ("negative damping of a support", changed("position=0.10,-0.20, ", "position=0.10,-0.20, damping=-1.0,0.0, "), 2,
     "input.nml:13: &support 3: damping(1) = -1.0: must not be negative"),
    ("negative damping of the foundation", changed("0.5,0.5,0.05", "0.5,0.5,-0.05"), 2,
     "input.nml:15: &foundation: damping(3) = -0.05: must not be negative"),
    ("foundation's matrix not symmetric", changed("&foundation ", "&foundation stiffness(1,2)=5.0, "), 2,
     "input.nml:15: &foundation: stiffness(1,2) = 5.0: must be symmetric, but c12 is 5 and c21 is 0"),
    ("foundation's matrix not symmetric, third row", changed("&foundation ", "&foundation stiffness=9.0,0.0,4.5,  "
                                                             "0.0,9.0,0.0,  4.0,0.0,9.0, "), 2,
     "input.nml:15: &foundation: stiffness(3,1) = 4.5: must be symmetric, but c31 is 4.5 and c13 "
     "is 4"),
    ("foundation that pushes", changed("&foundation ", "&foundation stiffness=-4.4e5,8*0.0, "), 2,
     "input.nml:15: &foundation: stiffness = -4.4e5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0: must be "
     "positive semidefinite: in some direction this matrix pushes a displaced frame farther away instead of back"),
    ("foundation's matrix too short", changed("&foundation ", "&foundation stiffness=1.0,2.0,3.0, "), 2,
     "input.nml:15: &foundation: stiffness = 1.0, 2.0, 3.0: takes 9 or 36 values, has 3"),
    ("sums of finite numbers overflow", changed("position=0.10,-0.20, stiffness=196133.0,196133.0",
                                                "position=1e200,-0.20, stiffness=196133.0,196133.0"), 2,
     "input.nml:13: &support 3: position = 1e200, -0.20: is so far from F that the stiffness or damping about F "
     "overflows"),
    ("unknown degree of freedom", changed("mass=18.0", "dof='xi','etta', mass=18.0"), 2,
     "input.nml:10: &frame: dof(2) = 'etta': unknown; did you mean 'eta'?"),
    ("degree of freedom twice", changed("mass=18.0", "dof='xi','xi', mass=18.0"), 2,
     "input.nml:10: &frame: dof = 'xi', 'xi': names a degree of freedom twice"),
    # orders
    ("unknown task", changed("'stability', 'response'", "'stabilty'"), 2,
     "input.nml:1: &case: tasks(1) = 'stabilty': unknown; did you mean 'stability'?"),
    ("unknown task, nothing near", changed("'stability', 'response'", "'stability', 'paint'"), 2,
     "input.nml:1: &case: tasks(2) = 'paint': unknown; choose from {case.tasks}"),
    ("empty task", changed("'stability', 'response'", "''"), 2,
     "input.nml:1: &case: tasks(1) = '': unknown; choose from {case.tasks}"),
    ("probe without name", added("&probe position=0.0,0.0 /"), 2,
     "input.nml:16: &probe: name: must be given"),
    ("probe without position", added("&probe name='p' /"), 2,
     "input.nml:16: &probe 'p': position: must be given"),
    ("probe, empty name", added("&probe name='', position=0.0,0.0 /"), 2,
     "input.nml:16: &probe: name = '': must not be blank"),
    ("probe, parenthesis", added("&probe name='p(1)', position=0.0,0.0 /"), 2,
     "input.nml:16: &probe 'p(1)': name = 'p(1)': must have 1 to 64 characters and no parentheses"),
    ("probe twice", added("&probe name='p', position=0.0,0.0 / &probe name='p', position=0.0,0.1 /"), 2,
     "input.nml:16: &probe 'p': name = 'p': is already the name of another probe"),
    ("probe, limit of zero", added("&probe name='p', position=0.0,0.0, limit_mm_s=0.0 /"), 2,
     "input.nml:16: &probe 'p': limit_mm_s = 0.0: must be positive"),
    ("probe, empty band", added("&probe name='p', position=0.0,0.0, band_hz=100.0,10.0 /"), 2,
     "input.nml:16: &probe 'p': band_hz = 100.0, 10.0: the second frequency must be greater than the first"),
    ("probe, negative frequency", added("&probe name='p', position=0.0,0.0, band_hz=-1.0,10.0 /"), 2,
     "input.nml:16: &probe 'p': band_hz(1) = -1.0: must not be negative"),
    ("misspelt coefficients", added("&model coefficients='avaraged' /"), 2,
     "input.nml:16: &model: coefficients = 'avaraged': unknown; did you mean 'averaged'?"),
    ("unknown coefficients, nothing near", added("&model coefficients='exact' /"), 2,
     "input.nml:16: &model: coefficients = 'exact': unknown; choose from 'periodic', 'averaged'"),
    ("misspelt key of the model", added("&model coeficients='averaged' /"), 2,
     "input.nml:16: &model: unknown key 'coeficients': did you mean 'coefficients'?"),
    ("model given twice", added("&model coefficients='averaged' /\n&model coefficients='averaged' /"), 2,
     "input.nml:17: &model: may occur only once (first in line 16)"),
    ("unknown method", added("&accuracy method='gauss66' /"), 2,
     "input.nml:16: &accuracy: method = 'gauss66': unknown; did you mean 'gauss6'?"),
    ("unknown method, nothing near", added("&accuracy method='simpson' /"), 2,
     "input.nml:16: &accuracy: method = 'simpson': unknown; choose from {accuracy.method}"),
    ("reduction with steps", added("&accuracy method='reduced', steps=10 /"), 2,
     "input.nml:16: &accuracy: steps = 10: must be 0, because method='reduced' does not integrate in steps"),
    ("tolerance too small", added("&accuracy tolerance=1e-16 /"), 2,
     "input.nml:16: &accuracy: tolerance = 1e-16: must lie between 1e-15 and 0.1"),
    ("tolerance too large", added("&accuracy tolerance=0.5 /"), 2,
     "input.nml:16: &accuracy: tolerance = 0.5: must lie between 1e-15 and 0.1"),
    ("tolerance negative", added("&accuracy tolerance=-1e-9 /"), 2,
     "input.nml:16: &accuracy: tolerance = -1e-9: must be positive"),
    ("steps negative", added("&accuracy steps=-1 /"), 2,
     "input.nml:16: &accuracy: steps = -1: must be at least 0"),
    ("steps too many", added("&accuracy steps=1048577 /"), 2,
     "input.nml:16: &accuracy: steps = 1048577: must be at most 1048576"),
    ("no points", added("&response points=0 /"), 2,
     "input.nml:16: &response: points = 0: must be at least 1"),
    ("points too many", added("&response points=1000001 /"), 2,
     "input.nml:16: &response: points = 1000001: must be at most 1000000"),
    ("harmonics negative", added("&response harmonics=-1 /"), 2,
     "input.nml:16: &response: harmonics = -1: must be at least 0"),
    ("harmonics too many", added("&response harmonics=8001 /"), 2,
     "input.nml:16: &response: harmonics = 8001: must be at most 8000"),
    # joints and links
    ("unknown type", changed("type='RRR'", "type='RR'"), 2,
     "input.nml:6: &joint 'B': type = 'RR': unknown; choose from {joint.type}"),
    ("unknown joint, near", changed("ends='A','B0'", "ends='A','B00'"), 2,
     "input.nml:6: &joint 'B': ends = 'A', 'B00': there is no joint 'B00'; did you mean 'B0'?"),
    ("unknown joint, nothing near", changed("pivot='A0'", "pivot='hinge'"), 2,
     "input.nml:5: &joint 'A': pivot = 'hinge': there is no joint 'hinge'; choose from 'A0', 'B0'"),
    ("joint used before it is defined", "".join(LINES[:4] + [LINES[5], LINES[4]] + LINES[6:]), 2,
     "input.nml:5: &joint 'B': ends = 'A', 'B0': joint 'A' comes later, in line 6: list it before this joint"),
    ("joint built on itself", changed("ends='A','B0'", "ends='A','B'"), 2,
     "input.nml:6: &joint 'B': ends = 'A', 'B': a joint cannot refer to itself"),
    ("joint of a link unknown", changed("from='A', to='B'", "from='A', to='C'"), 2,
     "input.nml:8: &link 'coupler': to = 'C': there is no joint 'C'; choose from 'A0', 'B0', 'A', 'B'"),
    ("joint's name twice", changed("name='B0'", "name='A0'"), 2,
     "input.nml:4: &joint 'A0': name = 'A0': is already used"),
    ("link's name twice", changed("name='rocker'", "name='coupler'"), 2,
     "input.nml:9: &link 'coupler': name = 'coupler': is already used"),
    ("name empty", changed("name='rocker'", "name=''"), 2,
     "input.nml:9: &link 3: name = '': must not be blank"),
    ("name too long", changed("name='rocker'", "name='" + "r" * 65 + "'"), 2,
     "input.nml:9: &link 'rrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrr...': name = "
     "'rrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrr...': must not be longer than 64 "
     "characters"),
    ("no crank", changed("type='crank', pivot='A0', radius=0.07, phase=0.0", "type='ground', position=0.07, 0.0"), 2,
     "input.nml: every mechanism needs a joint of type 'crank' or 'cylinder'"),
    ("key of another type", changed("position=0.40, 0.0", "position=0.40, 0.0, radius=1.0"), 2,
     "input.nml:4: &joint 'B0': radius = 1.0: is not a key of a joint of type 'ground'; its keys are position"),
    ("key that the type needs", changed(", radius=0.07", ""), 2,
     "input.nml:5: &joint 'A': a joint of type 'crank' needs the key 'radius'"),
    ("crank's phase at a dyad", changed(RRR, RRR + ", phase=3.0"), 2,
     "input.nml:6: &joint 'B': phase = 3.0: is not a key of a joint of type 'RRR'; its keys are ends, lengths, "
     "branch"),
    ("radius negative", changed("radius=0.07", "radius=-0.07"), 2,
     "input.nml:5: &joint 'A': radius = -0.07: must be positive"),
    ("length negative", changed("0.37,0.16", "0.37,-0.16"), 2,
     "input.nml:6: &joint 'B': lengths(2) = -0.16: must be positive"),
    ("length zero", changed("0.37,0.16", "0.0,0.16"), 2,
     "input.nml:6: &joint 'B': lengths(1) = 0.0: must be positive"),
    ("one length", changed("0.37,0.16", "0.37"), 2,
     "input.nml:6: &joint 'B': lengths(2): must be given"),
    ("branch zero", changed("branch=1", "branch=0"), 2,
     "input.nml:6: &joint 'B': branch = 0: must be 1 or -1"),
    ("one end", changed("ends='A','B0'", "ends='A'"), 2,
     "input.nml:6: &joint 'B': ends = 'A': must name 2 joints"),
    ("ends the same joint", changed("ends='A','B0'", "ends='A','A'"), 2,
     "input.nml:6: &joint 'B': ends = 'A', 'A': must name 2 different joints"),
    ("link from and to the same joint", changed("from='A', to='B'", "from='A', to='A'"), 2,
     "input.nml:8: &link 'coupler': to = 'A': must differ from the joint in 'from'"),
    # mechanisms
    ("cannot be assembled at 0 deg", changed("0.37,0.16", "0.07,0.16"), 3,
     "input.nml:6: joint 'B' cannot be assembled or is at a dead point at a crank angle of 0.000 deg: "
     "its ends are 0.33 m apart; lengths of 0.07 m and 0.16 m allow 0.09 m to 0.23 m; it cannot be assembled at any crank angle; the four-bar linkage is not a Grashof "
     "linkage: the shortest and the longest bar, together 0.47 m, are longer than the other two, together 0.23 m"),
    ("cannot be assembled over part of the turn", changed("0.37,0.16", "0.27,0.16"), 3,
     "input.nml:6: joint 'B' cannot be assembled or is at a dead point at a crank angle of 110.925 "
     "deg: its ends are 0.43 m apart; lengths of 0.27 m and 0.16 m allow 0.11 m to 0.43 m; it can be assembled from 249.08 to 110.92 "
     "deg; the four-bar linkage is not a Grashof linkage: the shortest and the longest bar, together 0.47 m, are longer than the other two, together 0.43 m"),
    ("dead point at 180 deg", changed("0.37,0.16", "0.31,0.16"), 3,
     re.compile(r"input\.nml:6: joint 'B' cannot be assembled or is at a dead point at a crank angle of "
                r"(179\.99\d|180\.000) deg: its ends are 0\.47 m apart; lengths of 0\.31 m and 0\.16 m allow "
                r"0\.15 m to 0\.47 m; it can be assembled at all other angles that were tested; gaps narrower than 4 deg may have been missed")),
    ("parallelogram", changed("radius=0.07", "radius=0.16").replace("0.37,0.16", "0.40,0.16"), 3,
     "input.nml:6: joint 'B' cannot be assembled or is at a dead point at a crank angle of 0.000 deg: "
     "its ends are 0.24 m apart; lengths of 0.4 m and 0.16 m allow 0.24 m to 0.56 m; it can be assembled at all other angles that were "
     "tested; gaps narrower than 4 deg may have been missed; it belongs to a parallelogram linkage: describe the second arm by another joint "
     "of type 'crank', with the same radius and phase, about the arm's own pivot"),
    ("ends of a dyad meet at 180 deg",
     changed("position=0.40, 0.0", "position=-0.07, 0.0").replace("0.37,0.16", "0.37,0.37"), 3,
     re.compile(r"input\.nml:6: joint 'B' cannot be assembled or is at a dead point at a crank angle of "
                r"(179\.99\d|180\.000) deg: its ends are .*; lengths of 0\.37 m and 0\.37 m allow "
                r"0 m to 0\.74 m; it can be assembled at all other angles that were tested; gaps narrower than 4 deg may have been missed")),
    ("joints of a link meet at 0 deg", added("&joint name='C', type='ground', position=0.07, 0.0 /\n"
                                             "&link name='belt', from='C', to='A', mass=1.0, inertia=0.0 /"), 3,
     "input.nml:17: link 'belt': the link's two joints coincide at a crank angle of 0.000 deg"),
    ("joints of a link meet at 40 deg", added("&joint name='C', type='ground', position=0.05362311101832846, "
                                              "0.04499513267805774 /\n"
                                              "&link name='belt', from='C', to='A', mass=1.0, inertia=0.0 /"), 3,
     re.compile(r"input\.nml:17: link 'belt': the link's two joints coincide at a crank angle of (39\.99\d|40\.000) deg")),
    # files
    ("empty file", "", 2,
     "input.nml: the file is empty"),
    ("only comments", "! nothing\n", 2,
     "input.nml: contains no group &name ... /"),
    ("binary file", b"\x7fELF\x02\x01\x01\x00\x00\x00" + bytes(range(256)), 2,
     "input.nml:1: not a text file (character code 127); save it as UTF-8 text"),
    ("UTF-16", SOUND.encode("utf-16"), 2,
     "input.nml:1: not a text file (character code 0); save it as UTF-8 text"),
]

# description, options, exit code, standard error; the input itself is valid
OPTIONS = [
    ("unknown option, near", ["--outpt", "x", "input.nml"], 1,
     "unknown option '--outpt'; did you mean '--output'?"),
    ("unknown option, nothing near", ["--frobnicate", "input.nml"], 1,
     "unknown option '--frobnicate'; choose from '--set', '--output', '--check', '--quiet', '--verbose', '--fail-if-unstable', "
     "'--part', '--merge', '--one-line', '--plot', '--report', '--json', '--new', '--help', '--version'"),
    ("unknown short option", ["-x", "input.nml"], 1,
     "unknown option '-x'; choose from '--set', '--output', '--check', '--quiet', '--verbose', '--fail-if-unstable', "
     "'--part', '--merge', '--one-line', '--plot', '--report', '--json', '--new', '--help', '--version'"),
    ("--set without value", ["input.nml", "--set"], 1,
     "option '--set' needs a value"),
    ("-s without value", ["input.nml", "-s"], 1,
     "option '-s' needs a value"),
    ("-o without value", ["input.nml", "-o"], 1,
     "option '-o' needs a value"),
    ("-o before an option", ["-o", "--one-line", "input.nml"], 1,
     "option '-o' needs a value"),
    ("-o before a short option", ["-o", "-q", "input.nml"], 1,
     "option '-o' needs a value"),
    ("empty output", ["input.nml", "--output="], 1,
     "option '--output' needs the name of a folder"),
    ("value for a flag", ["input.nml", "--quiet=yes"], 1,
     "option '--quiet' takes no value"),
    ("part with a verdict", ["input.nml", "--part", "1/2", "--fail-if-unstable"], 1,
     "options '--part' and '--fail-if-unstable' exclude each other: a part of a sweep has no verdict; use --fail-if-unstable with --merge"),
    ("no input", [], 1,
     "no input file; usage: gestell [options] input.nml (gestell --help lists the options)"),
    ("options but no input", ["-q"], 1,
     "no input file; usage: gestell [options] input.nml (gestell --help lists the options)"),
    ("two inputs", ["input.nml", "other.nml"], 1,
     "more than one input file: 'input.nml' and 'other.nml'"),
    ("missing file", ["inptu.nml"], 2,
     "inptu.nml: there is no such file"),
    ("a name that ends in a blank", [". "], 2,
     ". : there is no such file"),
    ("directory", ["."], 2,
     ".: is a directory, not a file"),
    ("empty name", [""], 1,
     "the name of the input file is empty"),
    ("empty output, short", ["input.nml", "-o", ""], 1,
     "option '-o' needs the name of a folder"),
    ("--set without =", ["input.nml", "-s", "drive.speed_rpm"], 1,
     "--set drive.speed_rpm: must be PATH=VALUE, such as drive.speed_rpm=240"),
    ("--set without key", ["input.nml", "-s", "drive=3"], 1,
     "--set drive=3: the path must be GROUP.KEY, GROUP(NAME).KEY or GROUP.KEY(INDEX), such as drive.speed_rpm"),
    ("--set, unknown group", ["input.nml", "-s", "drve.speed_rpm=3"], 2,
     "--set drve.speed_rpm=3: unknown group &drve: did you mean &drive?"),
    ("--set, unknown key", ["input.nml", "-s", "drive.speed=3"], 2,
     "--set drive.speed=3: unknown key 'speed': allowed are speed_rpm, speed_hz, held_by, flywheel_inertia"),
    ("--set, unknown joint", ["input.nml", "-s", "joint(BB).lengths(1)=3"], 2,
     "--set joint(BB).lengths(1)=3: unknown joint 'BB'; choose from 'A0', 'B0', 'A', 'B'"),
    ("--set, unknown link", ["input.nml", "-s", "link(copler).mass=3"], 2,
     "--set link(copler).mass=3: unknown link 'copler'; did you mean 'coupler'?"),
    ("--set, no such support", ["input.nml", "-s", "support(5).angle=3"], 2,
     "--set support(5).angle=3: there is no &support 5: the groups are numbered from 1 to 4"),
    ("--set, no such element", ["input.nml", "-s", "joint(B).lengths(3)=3"], 2,
     "--set joint(B).lengths(3)=3: lengths: the subscript runs from 1 to 2"),
    ("--set, index of a single group", ["input.nml", "-s", "frame(1).mass=3"], 2,
     "--set frame(1).mass=3: there is only one &frame: write frame.mass"),
    ("--set, not a number", ["input.nml", "-s", "frame.mass=heavy"], 2,
     "--set frame.mass=heavy: must be a number"),
    ("--set, not finite", ["input.nml", "-s", "frame.mass=inf"], 2,
     "--set frame.mass=inf: must be finite"),
    ("--set, out of range", ["input.nml", "-s", "frame.mass=-3"], 2,
     "--set frame.mass=-3: must be positive"),
    ("--set, element out of range", ["input.nml", "-s", "joint(B).lengths(2)=-0.16"], 2,
     "--set joint(B).lengths(2)=-0.16: must be positive"),
    ("--set, decimal comma", ["input.nml", "-s", "frame.mass=3,5"], 2,
     "--set frame.mass=3,5: takes 1 value, has 2 (a decimal comma? use a point)"),
    ("--set, empty value", ["input.nml", "-s", "frame.mass="], 2,
     "--set frame.mass=: a value is missing"),
    ("--set, the mechanism cannot be assembled", ["input.nml", "-s", "joint(B).lengths(1)=0.1"], 3,
     "input.nml:6: joint 'B' cannot be assembled or is at a dead point at a crank angle of 0.000 deg: "
     "its ends are 0.33 m apart; lengths of 0.1 m and 0.16 m allow 0.06 m to 0.26 m; it cannot be assembled at any crank angle; the four-bar linkage is not a Grashof "
     "linkage: the shortest and the longest bar, together 0.47 m, are longer than the other two, together 0.26 m"),
    ("--fail-if-unstable without a verdict", ["input.nml", "--fail-if-unstable", "-s", "case.tasks='drawing'"], 1,
     "--fail-if-unstable needs a task with a verdict: 'stability', 'modes', 'matrices', 'response', 'forces', 'joints', 'power', "
     "'balance', 'sensitivity', 'separation', 'design', 'sweep', 'campbell', 'critical' or 'resonance'"),
]
