"""The first lines that a user reads: the verdict, the resonating mode, and warnings of typical mistakes."""

import json
import math
import re

from broken_inputs import SOUND
from harness import Folder, Run, check, equal, near

FOUR_BAR = """&case title='Four-bar', tasks='stability','response' /
&drive speed_rpm=240 /
&joint name='A0', type='ground', position=0,0 /
&joint name='B0', type='ground', position=0.40,0 /
&joint name='A', type='crank', pivot='A0', radius=0.07 /
&joint name='B', type='RRR', ends='A','B0', lengths=0.37,0.16, branch=1 /
&link name='crank', from='A0', to='A', mass=0.5, inertia=0.0035, center=0.03,0 /
&link name='coupler', from='A', to='B', mass=0.6, inertia=0.007, center=0.18,0 /
&link name='rocker', from='B0', to='B', mass=0.25, inertia=0.006, center=0.08,0 /
&frame mass=18, inertia=0.78, origin=-0.2,0.2 /
&support position=-0.3,-0.2, stiffness=392266,392266, damping=0.25,0.25 /
&support position= 0.3,-0.2, stiffness=392266,392266, damping=0.25,0.25 /
"""
SLIDER = """&case title='Heavy slider', tasks='stability','response' /
&drive speed_rpm=580 /
&joint name='O', type='ground', position=0,0 /
&joint name='A', type='crank', pivot='O', radius=0.1 /
&joint name='B', type='RRP', ends='A', lengths=0.25, guide_point=0,0, guide_angle=0, branch=1 /
&link name='crank', from='O', to='A', mass=2, inertia=0.01, center=0.05,0 /
&link name='rod', from='A', to='B', mass=3, inertia=0.03, center=0.1,0 /
&link name='slider', from='B', mass=20, inertia=0 /
&frame mass=25, inertia=0.6, origin=0,0.1 /
&support position=-0.25,-0.2, stiffness=6e4,9e4, damping=60,80 /
&support position=0.3,-0.2, stiffness=6e4,9e4, damping=60,80 /
"""
# A balanced rotor on two bearings 1 m apart of 800 N/m each way.
TRANSVERSE, POLAR = 0.28791667, 0.5625
ROTOR = f"""&case title='Rigid rotor', tasks='stability','response' /
&drive speed_rpm=207.1 /
&joint name='O', type='ground', position=0,0 /
&joint name='A', type='crank', pivot='O', radius=0.1 /
&link name='rotor', from='O', to='A', mass=1.999999, inertia={TRANSVERSE},{TRANSVERSE},{POLAR} /
&frame mass=1e-6, inertia=1e-9,1e-9,1e-9, origin=0,0,0, dof='xi','eta','zeta','rot_xi','rot_eta','psi' /
&support position=0,0,-0.5, stiffness=800,800,800, damping=0.2263,0.2263,0.2263 /
&support position=0,0, 0.5, stiffness=800,800,0, damping=0.2263,0.2263,0 /
&foundation stiffness=0,0,0,0,0,0, 0,0,0,0,0,0, 0,0,100,0,0,0, 0,0,0,0,0,0, 0,0,0,0,0,0, 0,0,0,0,0,0, damping=0,0,0.1,0,0,0 /
"""
CAM = """&case title='cam', tasks='response' /
&drive speed_rpm=420 /
&joint name='O', type='ground', position=0,0 /
&joint name='A', type='crank', pivot='O', radius=0.03 /
&joint name='R', type='follower', cam='O','A', lift_table={lifts}, guide_point=0,0.05, guide_angle=90, lift_phase=90 /
&link name='shaft', from='O', to='A', mass=18, inertia=0.085 /
&link name='ram', from='R', mass=14, inertia=0 /
&frame mass=350, inertia=38, origin=0,0 /
&support position=-0.28,-0.25, stiffness=9e4,1.7e5, damping=250,450 /
&support position=0.28,-0.25, stiffness=9e4,1.7e5, damping=250,450 /
"""


def multipliers(run):
    """Frequency (Hz) of each multiplier and its multiple of the crank speed, from the table of the report."""
    found = {}
    for one, two, rest in re.findall(r"^  (\d+)(?:, (\d+))? +(\S.*)$", run.out.partition("MULTIPLIERS AND EXPONENTS")[2], re.M):
        numbers = rest.split()
        for number in (one, two):
            if number:
                found[int(number)] = (float(numbers[3]), float(numbers[4]))
    return found


def test_resonating_mode():
    """The headline names the resonating mode, and only near its order."""
    with Folder(input=SLIDER) as folder:
        named = 0
        for speed in (60, 140, 220, 300, 380, 560, 580, 600, 640, 680):
            run = Run(folder, "input.nml", "-s", f"drive.speed_rpm={speed}")
            if not run.done(f"{speed} rpm"):
                continue
            sentence = re.search(r"near resonance: the natural frequency (\S+) Hz is (\S+) times the crank speed \(order (\S+)\); "
                                 r"multiplier (\d+) is", run.flat)
            if not sentence:
                continue
            named += 1
            hertz, ratio, order = map(float, sentence.groups()[:3])
            right = multipliers(run)[int(sentence[4])]
            near(f"{speed} rpm, frequency", hertz, right[0], 1e-5 * right[0])
            near(f"{speed} rpm, ratio", ratio, right[1], 1e-4 * right[1])
            check(f"{speed} rpm, near", abs(ratio / order - 1) < 0.05, "within 5 %", sentence[0])
        check("speeds with a resonance", named > 3, "some", named)
        run = Run(folder, "input.nml")
        check("580 rpm", "the natural frequency 9.27912 Hz is 0.959909 times the crank speed (order 1)" in run.flat, "9.28 Hz", run.out)


def test_gyroscopic():
    """Gyroscopic natural frequencies agree with the closed form everywhere.

    It w^2 -+ Ip W w = k L^2 / 2 in the table of natural frequencies, in the headline and in --check.
    """
    with Folder(input=ROTOR) as folder:
        for rpm in (207.1, 270.095, -207.1):
            g = POLAR * abs(rpm) * math.pi / 30
            conical = [(math.sqrt(g * g + 4 * TRANSVERSE * 400) + sign * g) / (2 * TRANSVERSE) / (2 * math.pi) for sign in (-1, 1)]
            run = Run(folder, "input.nml", "-s", f"drive.speed_rpm={rpm}")
            run.done(f"rotor, {rpm} rpm")
            table = run.out.partition("NATURAL FREQUENCIES")[2].partition("MULTIPLIERS")[0]
            listed = [float(row.split()[1]) for row in table.splitlines() if re.match(r"  \d ", row)]
            equal(f"rotor, {rpm} rpm, frequencies", len(listed), 6)
            for hertz in conical:
                near(f"rotor, {rpm} rpm, {hertz:.3f} Hz", min(listed, key=lambda f: abs(f - hertz)), hertz, 1e-5 * hertz)
            check(f"rotor, {rpm} rpm, not at rest", min(abs(f - 5.93221) for f in listed) > 0.1, "no 5.93 Hz", listed)
            # the coefficients are constant
            check(f"rotor, {rpm} rpm, no parametric resonance", "parametric" not in table, "none", table)
            short = Run(folder, "--check", "input.nml", "-s", f"drive.speed_rpm={rpm}").flat
            check(f"rotor, {rpm} rpm, --check", f"{conical[0]:.6g}" in short and f"{conical[1]:.6g}" in short, conical, short)
        run = Run(folder, "input.nml")
        check("rotor, headline", "the natural frequency 3.45168 Hz is 1 times the crank speed (order 1); multiplier 5" in run.flat,
              "3.4517 Hz", run.out)


def test_no_critical_speed():
    """A balanced rotor has no critical speed."""
    sweep = "&sweep parameter='drive.speed_rpm', from=200, to=215, count=2 /\n"
    with Folder(input=ROTOR + sweep) as folder:
        run = Run(folder, "input.nml", "-s", "case.tasks=campbell,critical")
        run.done("rotor, critical")
        check("rotor, no critical speed", "the vibration has no noticeable peak at any crossing" in run.out
              and "Critical speeds:" not in run.out, "none", run.out)
        undamped = [word for i in (1, 2) for word in ("-s", f"support({i}).damping=0,0,0")]
        run = Run(folder, "input.nml", "-s", "case.tasks=critical", "-s", "foundation.damping=0,0,0", *undamped)
        run.done("undamped rotor, critical")
        check("undamped rotor, no critical speed", "unbounded" not in run.out, "none", run.out)
        # the exact frame takes a hundred times as long
        run = Run(folder, "input.nml", "-s", "case.tasks=sensitivity", "-s", "sensitivity.parameters='frame.mass'",
                  "-s", "model.frame=first_order")
        run.done("rotor, sensitivity")
        check("rotor, sensitivity", "failed" not in run.out and "zero within its error" in run.out, "zero", run.out)


def test_undamped_rotor():
    """Equal modes of a rotor on an isotropic mounting are undamped by every model."""
    supports = "".join(f"&support position={x},{y},{z}, stiffness=200,200,200 /\n"
                       for x, y in ((0.3, 0), (-0.3, 0), (0, 0.3), (0, -0.3)) for z in (-0.5, 0.5))
    text = (ROTOR.partition("&frame")[0].replace(",'response'", "") + "&frame mass=1, inertia=0.1,0.1,0.1, origin=0,0,0, "
            "dof='xi','eta','zeta','rot_xi','rot_eta','psi' /\n" + supports)
    speeds = "&sweep parameter='drive.speed_rpm', from=150, to=215, count=2 /\n"
    with Folder(input=text, speeds=text + speeds) as folder:
        for model in ("exact", "first_order", "rest"):
            run = Run(folder, "input.nml", "-s", f"model.frame={model}")
            run.done(f"undamped rotor, {model}")
            check(f"undamped rotor, {model}", "VERDICT  undamped" in run.out, "undamped", run.out)
        run = Run(folder, "input.nml", "-s", "support(1).damping=1e-12,0,0")
        check("rotor with a damper", "VERDICT  undamped" not in run.out, "not undamped", run.out)
        run = Run(folder, "speeds.nml", "-s", "case.tasks=campbell")
        run.done("undamped rotor, campbell")
        check("undamped rotor, campbell", "undecided" not in run.out.lower(), "undamped", run.out)


def test_last_line():
    """The worst verdict of two tasks comes last and in results.json."""
    sweep = "&sweep parameter='drive.speed_rpm', from=1570, to=1578, count=5 /\n"
    text = FOUR_BAR.replace(", damping=0.25,0.25", "").replace("'stability','response'", "'campbell','resonance'") + sweep
    with Folder(input=text) as folder:
        run = Run(folder, "input.nml", "--json", "--fail-if-unstable", "-s", "link(coupler).mass=1.2")
        sections = set(re.findall(r"^  (UNSTABLE|UNDECIDED|UNDAMPED) at", run.out, re.M))
        order = [word for word in ("UNSTABLE", "UNDECIDED", "UNDAMPED") if word in sections]
        check("worst verdict, sections", order, "one that is not stable", run.out)
        equal("worst verdict, code", run.code, 10)
        last = run.out.splitlines()[-1]
        if order:
            check("worst verdict, last line", last.startswith(f"VERDICT  {order[0]} at "), order, last)
            found = json.loads((folder / "input" / "results.json").read_text())
            equal("worst verdict, JSON", found["verdict"], order[0].lower())


def test_undamped():
    """A machine is called undamped only if no damper acts."""
    with Folder(input=FOUR_BAR.replace(", damping=0.25,0.25", "")) as folder:
        for model in ("exact", "first_order", "rest"):
            run = Run(folder, "input.nml", "--json", "-s", f"model.frame={model}", "-o", model)
            run.done(f"undamped, {model}")
            check(f"undamped, {model}, headline", "VERDICT  undamped: disturbances neither grow nor decay" in run.out, "it", run.out)
            check(f"undamped, {model}, no advice", "tolerance" not in run.out.partition("NATURAL")[0], "no tolerance", run.out)
            equal(f"undamped, {model}, last line", run.out.splitlines()[-1], "VERDICT  undamped")
            equal(f"undamped, {model}, JSON", json.loads((folder / model / "results.json").read_text())["verdict"], "undamped")
            equal(f"undamped, {model}, code", Run(folder, "-q", "--fail-if-unstable", "input.nml", "-s", f"model.frame={model}").code, 10)
        along = FOUR_BAR.replace("&frame ", "&frame dof='xi','eta','psi','zeta', ")
        for old, new in (("392266,392266", "392266,392266,392266"), ("damping=0.25,0.25", "damping=0.25,0.25,0")):
            along = along.replace(old, new)
        (folder / "along.nml").write_text(along)
        run = Run(folder, "along.nml", "-s", "case.tasks='stability','modes'")
        check("no damper along zeta", "VERDICT  undamped" in run.out, "undamped", run.out)
        hertz = math.sqrt(2 * 392266 / (18 + 1.35)) / (2 * math.pi)
        check("no damper along zeta: its frequency", any(abs(pair[0] - hertz) < 1e-5 * hertz for pair in multipliers(run).values()), hertz,
              run.out)
        run = Run(folder, "along.nml", "-s", "support(1).angle=0,20,0")
        check("no damper along zeta, a mount that leans", "VERDICT  stable" in run.out, "stable", run.out)
        run = Run(folder, "input.nml", "-s", "support(1).damping(2)=1e-6")
        check("the least damper", "VERDICT  undamped" not in run.out, "not undamped", run.out)
        settings = ("-s", "case.tasks=sweep", "-s", "sweep.engine=direct", "-s", "sweep.columns=verdict")
        text = FOUR_BAR.replace(", damping=0.25,0.25", "") + "&sweep parameter='drive.speed_rpm', from=200, to=300, count=3 /\n"
        (folder / "sweep.nml").write_text(text)
        Run(folder, "sweep.nml", *settings).done("undamped, sweep")
        rows = (folder / "sweep" / "sweep.csv").read_text().splitlines()
        equal("undamped, sweep", [row.rpartition(",")[2].strip() for row in rows if row[0] != "#"][1:], ["undamped"] * 3)


# On one mount, which does not resist two rotations of the frame: about rest the frame turns by hundreds of radians.
ON_ONE_MOUNT = """&model frame='first_order' /
&drive speed_rpm=3665.4 /
&joint name='J1', type='ground', position=0,0 /
&joint name='J2', type='crank', pivot='J1', radius=0.026, phase=117.242 /
&joint name='J3', type='ground', position=0.063299,0.027 /
&joint name='J4', type='RPP', ends='J2', guide_point=0,-0.0150268, guide_angle=-63, slot_angle=137.08 /
&link name='L2', from='J4', to='J3', mass=0.365, inertia=0.00113285,7.9e-4,0.000841825, z=-0.032, center=0.016793,-0.00700539 /
&frame mass=15, inertia=0.298529,0.206486,0.228, origin=-0.122845,-0.045, dof='rot_eta','psi','zeta','rot_xi' /
&support position=-0.149796,-0.183609, stiffness=1.11166e6,18170,153264, damping=0.428831,2.53694 /
"""


def test_not_held():
    """A frame that is not held is reported with advice."""
    alone = "".join(line for line in FOUR_BAR.splitlines(True) if "support" not in line)
    with Folder(input=alone, one=ON_ONE_MOUNT, mount=alone + "&support position=0,-0.35, stiffness=100,100, damping=1,1 /\n",
                along=alone + "&support position=0,0, stiffness=0,1e5 /\n&foundation stiffness=0,0,0,0,0,0,0,0,1e4 /\n") as folder:
        sentence = "the frame is not held in xi, eta, psi: add a &support"
        Run(folder, "-q", "input.nml").refused("not held", 4, f"there is no periodic vibration: {sentence}")
        run = Run(folder, "--check", "input.nml")
        check("not held, --check", f"warning {sentence}" in run.flat, sentence, run.out)
        run = Run(folder, "input.nml", "-s", "model.frame=rest", "-s", "case.tasks=stability")
        check("not held, verdict", f"VERDICT  undecided" in run.out and sentence in run.out.partition("VERDICT")[2], sentence, run.out)
        Run(folder, "-q", "one.nml").refused("one mount in space, first order", 4, "there is no periodic vibration: the frame is not held "
                                             "in 2 directions: add &support groups that hold it in these directions")
        Run(folder, "-q", "mount.nml").refused("one mount", 4, "there is no periodic vibration: the frame can turn freely about the point "
                                               "(0, -0.35) m from F: add another &support")
        Run(folder, "-q", "along.nml").refused("one direction", 4, "there is no periodic vibration: the frame is not held in xi: "
                                               "add a &support")


def warnings(folder, *settings):
    found = re.findall(r"^  warning    (.*(?:\n {13}.*)*)", Run(folder, "--check", "input.nml", *settings).out, re.M)
    return [" ".join(line.split()) for line in found]


def test_typical_mistakes():
    """Typical mistakes in the input are warned of, correct inputs are not."""
    with Folder(input=FOUR_BAR) as folder:
        equal("no slip", warnings(folder), [])
        for what, setting, words in (
                ("another pin", "link(coupler).to=B0", ("link 'coupler' connects 'A' and 'B0'", "0.33 to 0.47 m")),
                ("kg for t", "frame.mass=0.018", ("the frame has 0.018 kg, the mechanism 1.35 kg",)),
                # 19.35 kg on 784.532 N/m
                ("N/m for N/mm", "support.stiffness=392.266", ("would sink by 0.242 m even along the stiffest axis of its mounts (1.01 Hz)",)),
                # 2e5 N s/m compared with 2 sqrt(784532 N/m 19.35 kg)
                ("N s/m for N s/mm", "support.damping=1e5", ("at least 25.7 times its critical damping",)),
                ("softer along one axis", "support(1).stiffness(1)=0.4", ()),
                ("inertia", "frame.inertia=0.00078", ("the frame's radius of gyration is 0.00658 m",)),
                ("inertia of a link", "link(rocker).inertia=6", ("link 'rocker': its radius of gyration is 4.9 m",)),
                ("no mass to speak of", "link(rocker).mass=4.9e-324", ("link 'rocker': its radius of gyration is 3.48e160 m",)),
                ("no inertia to speak of", "link(rocker).inertia=6e-7", ("link 'rocker': its radius of gyration is 0.00155 m",)),
                ("mm for m", "link(coupler).center(1)=180", ("link 'coupler': its centre of mass is 180 m from joint 'A'",))):
            came = warnings(folder, "-s", setting)
            check(f"slip: {what}", len(came) == (1 if words else 0) and all(word in " ".join(came[0].split()) for word in words), words, came)
        flat = "the third value of {} is ignored, because the frame moves in a plane"
        for key, old, new, spread in (("position", "0.3,-0.2, st", "0.3,-0.2,0.1, st", ""), ("origin", "-0.2,0.2", "-0.2,0.2,0.1", ""),
                                      ("stiffness", "392266,392266", "392266,392266,392266", ""),
                                      ("position", "0.3,-0.2, st", "0.3,-0.2,0.0, st", "zero"),
                                      ("position", "0.3,-0.2, st", "0.3,-0.2,0.1, st", "dof")):
            text = FOUR_BAR.replace(old, new)
            if spread == "dof":
                text = text.replace("&frame ", "&frame dof='xi','eta','psi', ")
            with Folder(input=text) as other:
                came = warnings(other)
            check(f"out of the plane: {key} {spread}", len(came) == (not spread) and all(flat.format(key) in " ".join(one.split())
                                                                                         for one in came), flat.format(key), came)
        run = Run(folder, "input.nml", "-s", "link(coupler).to=B0")
        check("slip: last line", run.out.splitlines()[-1].startswith("VERDICT  stable; 1 warning above"), "1 warning", run.out)
        equal("sound: last line", Run(folder, "input.nml").out.splitlines()[-1], "VERDICT  stable")


ECCENTRIC = """&case title='Eccentric', tasks='stability' /
&drive speed_rpm={speed} /
&joint name='O', type='ground', position=0,0 /
&joint name='A', type='crank', pivot='O', radius={radius} /
&link name='eccentric', from='O', to='A', mass=9, inertia=0.02, center={radius},0 /
"""


def test_foundation_alone():
    """A foundation without supports causes no warning on positions."""
    with Folder(input=ECCENTRIC.format(speed=900, radius=0.01) + "&frame mass=40, inertia=6.4, origin=0.3,0 /\n"
                "&foundation stiffness=2e5,0,0, 0,2e5,0, 0,0,3e4, damping=100,100,20 /\n") as folder:
        equal("a foundation alone", warnings(folder), [])


def test_falls_over():
    """A frame too heavy for its springs is warned of.

    The mechanism of 9 kg is 1 m above F; the spring of 500 N/m acts 0.3 m below.
    """
    with Folder(input=ECCENTRIC.format(speed=100, radius=0.12) + "&model frame='rest' /\n&gravity direction=-90 /\n"
                "&frame mass=40, inertia=2, origin=0,1, dof='psi' /\n&support position=0,-0.3, stiffness=500,1e4, damping=10,10 /\n") as folder:
        run = Run(folder, "input.nml")
        # the mean of (1 + 0.12 sin)^2 + (0.12 cos)^2 is 1 + 0.12^2
        growth = math.sqrt((9 * 9.80665 - 500 * 0.3 ** 2) / (2 + 0.02 + 9 * (1 + 0.12 ** 2)))
        check("falls over", f"unstable, growth rate {growth:.4g} 1/s" in run.out, growth, run.out)


def test_far_orders():
    """Natural frequencies between high orders are not called near resonance.

    At 9 rpm they lie between two of the orders 30 to 60, at most half a distance away.
    """
    near = {}
    for speed in (9.0, 9.1, 9.2, 9.3, 9.4):
        with Folder(input=ECCENTRIC.format(speed=speed, radius=0.12) + "&model frame='rest' /\n&frame mass=40, inertia=2, origin=0.5,0 /\n"
                    "&support position=-0.3,-0.3, stiffness=1e4,2e4, damping=1,1 /\n"
                    "&support position=0.3,-0.3, stiffness=1e4,2e4, damping=1,1 /\n") as folder:
            run = Run(folder, "input.nml")
            for line in re.findall(r"^  \d +[\d.]+ +[\d.]+ +([\d.]+) +\d+ .*%(.*)$", run.out, re.M):
                near[float(line[0])] = "near" in line[1]
    equal("far orders", {ratio for ratio, marked in near.items() if marked},
          {ratio for ratio in near if abs(ratio - round(ratio)) < 0.125 and ratio < 50})
    check("far orders: both kinds", len(near) >= 15 and 0 < sum(near.values()) < 8, "a quarter of them", near)


def rise(x):
    """3-4-5 polynomial."""
    return 10 * x ** 3 - 15 * x ** 4 + 6 * x ** 5


def lift(angle):
    """Rise 120, dwell 60, fall 120, dwell 60 deg; 20 mm."""
    return 0.02 * (rise(angle / 120) if angle < 120 else 1 if angle < 180 else rise((300 - angle) / 120) if angle < 300 else 0)


def test_lifts():
    """Lifts typed with too few digits are warned of.

    Typed to 0.01 mm the upper half of the orders contributes to the acceleration; of exact lifts next to nothing.
    """
    for count, digits, warned in ((120, 5, True), (120, 9, False), (72, 9, False)):
        lifts = [round(lift(360 * i / count), digits) for i in range(count)]
        power = [0.0] * (count // 2 + 1)
        for k in range(1, count // 2 + 1):
            c = sum(l * math.cos(2 * math.pi * k * i / count) for i, l in enumerate(lifts)) / count
            s = sum(l * math.sin(2 * math.pi * k * i / count) for i, l in enumerate(lifts)) / count
            power[k] = k ** 4 * (c * c + s * s) * (0.25 if 2 * k == count else 1)
        share = 100 * math.sqrt(sum(power[count // 4 + 1:]) / sum(power))
        with Folder(input=CAM.format(lifts=", ".join(map(repr, lifts)))) as folder:
            came = warnings(folder)
            found = [re.search(r"joint 'R': (\S+) % of its acceleration \(rms\) comes from the upper half", line) for line in came]
            equal(f"{count} lifts, {digits} digits: warned", [bool(one) for one in found], [True] * warned)
            if warned and found and found[0]:
                near(f"{count} lifts, {digits} digits: share", float(found[0][1]), share, 0.06 * share)


def test_closure():
    """The reported range where a four-bar closes agrees with the closed form."""
    crank, coupler, rocker, ground = 0.04559282, 0.04347065, 0.04386785, 0.0462379
    text = (FOUR_BAR.replace("radius=0.07", f"radius={crank}").replace("lengths=0.37,0.16", f"lengths={coupler},{rocker}")
            .replace("position=0.40,0", f"position={ground},0"))
    stretched = math.degrees(math.acos((crank ** 2 + ground ** 2 - (coupler + rocker) ** 2) / (2 * crank * ground)))
    with Folder(input=text, parallel=FOUR_BAR.replace("radius=0.07", "radius=0.16").replace("lengths=0.37,0.16", "lengths=0.4,0.16")
                ) as folder:
        run = Run(folder, "-q", "input.nml")
        equal("no Grashof linkage, code", run.code, 3)
        angles = re.search(r"it can be assembled from (\S+) to (\S+) deg(.*)", run.err)
        check("no Grashof linkage", angles and "not a Grashof linkage" in run.err, "angles", run.err)
        if angles:
            # its ends never come so close that it folds
            near("no Grashof linkage, from", float(angles[1]), 360 - stretched, 0.006)
            near("no Grashof linkage, to", float(angles[2]), stretched, 0.006)
        run = Run(folder, "-q", "parallel.nml")
        check("parallelogram", run.code == 3 and "parallelogram linkage: describe the second arm by another joint of type 'crank'" in run.err,
              "a second crank", run.err)


HEADLINE_TESTS = [test_resonating_mode, test_gyroscopic, test_no_critical_speed, test_undamped_rotor, test_last_line, test_undamped, test_not_held,
              test_typical_mistakes, test_foundation_alone, test_falls_over, test_far_orders, test_lifts, test_closure]
