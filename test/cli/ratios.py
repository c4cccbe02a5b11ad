"""Shafts with fractional ratios to the drive, in all tasks, against the same machine with a drive so slow that all ratios are
integers. Who holds the speed is compared with d'Alembert's principle, a flywheel with its closed form."""

import math
import re

from harness import Folder, Run, check, equal, near
from several_mechanisms import FRAME as STAND
from several_mechanisms import LINKAGE, PLACES
from space import DOF, VALIDATION, greatest, rms, rows
from engine_balance import ENGINES, SHAFT, engine

PINS, BANKS, ALONG, _ = ENGINES["I3"]
OWN = "".join(line.replace("&joint ", "&joint mechanism='m', ") + "\n" for line in LINKAGE.format(*PLACES).splitlines())
PLANE = "&drive speed_rpm={0} /\n" + STAND + "&mechanism name='m', ratio={1} /\n" + OWN
SPACE = engine(PINS, BANKS, ALONG, rpm="{0}").replace("&mechanism name='c0'", "&mechanism ratio={1}, name='c0'")
# A ratio as typed, the turns of the drive after which all shafts are back in position, and the turns of the shaft in this time.
HALF, BACKWARD, THIRD, GEAR = ("0.5", 2, 1), ("-3,2", 2, -3), ("0.333333333333", 3, 1), ("17,23", 23, 17)
ALONE = ("0.5", 2, None)


def excited(k, turns, shaft):
    """True if k is a multiple of the number of turns of the drive, or of the shaft, in the period."""
    return k % turns == 0 or k % abs(shaft or 1) == 0


def both(text, rpm, place, ratio):
    """The machine with fractional ratios and with integer ratios. With `alone` all of it turns at the ratio."""
    typed, turns, shaft = ratio
    if shaft is None:
        return text.format(rpm, typed), text.format(repr(rpm / turns), 1)
    return text.format(rpm, 1) + SHAFT.format(typed, place), text.format(repr(rpm / turns), turns) + SHAFT.format(shaft, place)


def each(head, fill, plane=(HALF, BACKWARD, ALONE), space=(HALF,)):
    """Runs both machines for every ratio, in the plane and in space, and yields name, folder, ratio and both runs. `fill` returns the
    additions to the head of the input for a speed and a factor of the orders."""
    for what, text, rpm, place, ratios in (("plane", PLANE, 240.0, "", plane), ("space", SPACE, 700.0, ",0.02", space)):
        for ratio in ratios:
            name = f"ratio {ratio[0]}, {what}"
            one, other = both(text, rpm, place, ratio)
            with Folder(one=head.format(*fill(rpm, 1)) + one, other=head.format(*fill(rpm / ratio[1], ratio[1])) + other) as folder:
                runs = [Run(folder, "--verbose", f"{which}.nml") for which in ("one", "other")]
                if all([run.done(f"{name}: run {k}") for k, run in enumerate(runs)]):
                    yield name, folder, ratio, runs


def factor_of(key, turns):
    """The factor between a number of the machine with a slow drive and that of the other one."""
    if key.endswith("_rpm"):
        return turns
    if key == "order" or key.endswith("strongest_order") or key.endswith("torque_Nm"):
        return 1 / turns
    return 1


def alike(name, folder, table, ratio, tolerance):
    """Compares a table of both machines number by number, relative to the largest of the column, except bounds on errors. Of
    the slow drive's orders only those of the shafts appear."""
    _, turns, shaft = ratio
    a, b = (rows(folder / which / f"{table}.csv") for which in ("one", "other"))
    if table in ("crossings", "critical", "separation"):
        b = [row for row in b if excited(float(row["order"]), turns, shaft)]
    equal(f"{name}: rows of {table}", len(a), len(b))
    check(f"{name}: some rows of {table}", len(b) > 0, "rows", len(b))
    keys = [list(one[0]) if one else [] for one in (a, b)]
    keys[1] = [key for key in keys[1] if "_order_" not in key or excited(int(re.search(r"_order_(\d+)", key)[1]), turns, shaft)]
    equal(f"{name}: columns of {table}", len(keys[0]), len(keys[1]))
    for one, other in zip(*keys):
        if "_error" in other:
            continue
        pairs = [(x[one], y[other]) for x, y in zip(a, b)]
        if order := re.search(r"_order_(\d+)", other):
            whole = math.gcd(int(order[1]), turns)
            reported = f"{int(order[1]) // whole}" + (f"/{turns // whole}" if turns > whole else "")
            equal(f"{name}: name of {other}", one, other.replace(f"_order_{order[1]}", f"_order_{reported}"))
        try:
            numbers = [(float(x), float(y)) for x, y in pairs if (x, y) not in (("", ""), ("NaN", "NaN"))]
        except ValueError:
            equal(f"{name}: {one} of {table}", [x for x, _ in pairs], [y for _, y in pairs])
            continue
        factor = factor_of(other, turns)
        scale = max([abs(factor * y) for _, y in numbers], default=0)
        near(f"{name}: {one} of {table}", max([abs(x - factor * y) for x, y in numbers], default=0), 0, tolerance * scale)


SPEEDS = "&sweep parameter='drive.speed_rpm', from={0}, to={1}, count={2} /\n"


def speed_tests():
    """Studies over the speed do not depend on how ratios are written.

    The drive may turn at the given speed with fractional ratios, or once in the whole period with integer ratios.
    Modes, crossings, critical speeds, resonance curves and their maxima. Crossings are accurate to 1e-11, and critical speeds start
    from them; all searches take the same steps.
    """
    head = ("&case tasks='campbell','critical','separation','resonance' /\n&resonance orders={3} /\n"
            "&separation orders={3} /\n" + SPEEDS)
    for upper, cases in ((1.4, {"space": ()}), (0.9, {"plane": ()})):
        def fill(rpm, turns, upper=upper):
            return repr(0.8 * rpm), repr(upper * rpm), 4, 2 * turns

        for name, folder, ratio, runs in each(head, fill, **cases):
            for table in ("campbell", "crossings", "critical", "separation", "resonance", "peaks")[:6 if upper > 1 else 5]:
                alike(name, folder, table, ratio, 1e-8)
            if ratio == HALF and not cases.get("space", True):
                heading = "CRITICAL SPEEDS, orders up to 2,"
                check(f"{name}: orders of the report", heading in runs[0].out, heading, runs[0].out)
                orders = [float(row["order"]) for row in rows(folder / "one" / "crossings.csv")]
                check(f"{name}: a half order", 1.5 in orders, 1.5, orders)


def boundary_tests():
    """Borders and levels do not depend on how ratios are written.

    Of an almost undamped machine with a heavy slider, to 1e-10 of the ranges.
    """
    level = "&boundary quantity='f', level=300 /\n"
    for what, group, (low, high), ratios in (("stability", "", (560.0, 610.0), (HALF, BACKWARD)),
                                             ("level", level, (120.0, 260.0), (HALF, BACKWARD, ALONE))):
        head = "&case tasks='boundary' /\n&model frame='rest' /\n" + SPEEDS + group
        for ratio in ratios:
            one, other = (head.format(repr(low / turns), repr(high / turns), 40) + text.replace("damping=60,60", "damping=1,1")
                          .replace("slider', from='C', mass=0.4", "slider', from='C', mass=8")
                          for text, turns in zip(both(PLANE, 240.0, "", ratio), (1, ratio[1])))
            name = f"ratio {ratio[0]}, borders of {what}"
            with Folder(one=one, other=other) as folder:
                if all([Run(folder, "-q", f"{which}.nml").done(f"{name}: {which}") for which in ("one", "other")]):
                    a, b = ([float(row["drive.speed_rpm"]) for row in rows(folder / which / "boundary.csv")]
                            for which in ("one", "other"))
                    equal(f"{name}: how many", len(a), len(b))
                    check(f"{name}: some", len(b) > 0, "borders", len(b))
                    near(name, max([abs(x - ratio[1] * y) for x, y in zip(a, b)], default=0), 0, 1e-9 * (high - low))


def study_tests():
    """Sensitivities, designs and counterweights do not depend on how ratios are written."""
    for name, folder, ratio, runs in each("&case tasks='sensitivity','trade' /\n&sensitivity quantities='f','psi', parameters="
                                          "'drive.speed_rpm','frame.mass','support(1).stiffness','link(cam).mass' /\n",
                                          lambda rpm, turns: (), plane=(HALF, BACKWARD)):
        alike(name, folder, "sensitivity", ratio, 1e-7)
        per = f"ln |rho| over {ratio[1]} turns"
        check(f"{name}: growth over the period", per in runs[0].out and "ln |rho| per turn" in runs[1].out, per, runs[0].out)
    head = ("&case tasks='design' /\n&design parameter='support(1).stiffness(2)', from=2e4, to=8e4, starts=2 /\n"
            "&design parameter='link(cam).mass', from=0.1, to=1 /\n&objective quantity='f', measure='rms' /\n"
            "&constraint quantity='shaking.f', measure='rms', at_most=1e4 /\n"
            "&constraint quantity='rho_max', at_most=1 /\n" + SPEEDS)
    for name, folder, ratio, runs in each(head, lambda rpm, turns: (repr(rpm), repr(1.1 * rpm), 2), plane=(HALF, BACKWARD)):
        for table in ("design", "design_goals", "design_range"):
            alike(name, folder, table, ratio, 1e-6)
    # the torque of the slow drive is twice as large; separation from the slow drive's orders 1 to 4 differs from that by 1/2, 1, ..., 4
    head = ("&case tasks='design' /\n&design parameter='link(cam).mass', from=0.1, to=1 /\n&objective quantity='torque', "
            "measure='{0}' /\n&constraint quantity='f', measure='rms', at_most=1e4 /\n")
    for measure in ("rms", "peak"):
        for name, folder, ratio, runs in each(head, lambda rpm, turns, measure=measure: (measure,), plane=(HALF,)):
            goals = [rows(folder / which / "design_goals.csv")[0] for which in ("one", "other")]
            for key in ("before", "after"):
                near(f"{name}: torque {measure} {key}", float(goals[0][key]), float(goals[1][key]) / 2, 1e-8 * float(goals[0][key]))
    for name, folder, ratio, runs in each("&case tasks='balance' /\n&response harmonics=12 /\n", lambda rpm, turns: (),
                                          plane=(HALF, BACKWARD)):
        for table in ("balance", "balance_links", "balance_harmonics"):
            alike(name, folder, table, ratio, 1e-8)


# validation/space/twin_balance_shaft.nml with ratio=-1,2 at 625 rpm by validation/space/newton_euler.py, in space and with
# dof='xi','eta','psi' in the plane: greatest abs(rho) over both turns, rms of the coordinates, greatest torque of 400 rows of the
# period. For the exact model with a flywheel these rows start at another time, so there is no number.
HELD = {
    ("space", "'outside'"): {
        "rest": (0.785660366347, (2.3786887982496e-05, 5.4150211095047e-05, 6.7454018076788e-05, 1.6485550178275e-04,
                                  1.9325017519185e-04, 6.8458244510375e-04), 2.3574758382e+00),
        "exact": (0.785660342363, (2.3790016323681e-05, 5.4149609438707e-05, 6.7453422651995e-05, 1.6486182367099e-04,
                                   1.9324579641914e-04, 6.8467399419629e-04), 2.3574786043e+00)},
    ("space", "'flywheel', flywheel_inertia=0.03"): {
        "rest": (0.785665113178, (2.3796566201165e-05, 5.4142468586010e-05, 6.8085555758374e-05, 1.6146878910837e-04,
                                  1.9582033149779e-04, 6.8444642356494e-04), 2.3573234400e+00),
        "exact": (0.785665135705, (2.3799702514140e-05, 5.4141864607755e-05, 6.8084957600305e-05, 1.6147471711935e-04,
                                   1.9581685927494e-04, 6.8453862202043e-04), None)},
    ("plane", "'outside'"): {
        "rest": (0.707603996400, (1.6424045034109e-05, 6.1261100143868e-05, 4.7360699398205e-04), 2.3561564944e+00),
        "exact": (0.707604048813, (1.6424052906829e-05, 6.1261085057799e-05, 4.7360673262571e-04), 2.3561568199e+00)},
    ("plane", "'flywheel', flywheel_inertia=0.03"): {
        "rest": (0.707603996400, (1.6424045034109e-05, 6.1261100143868e-05, 4.7360699398205e-04), 2.3561564944e+00),
        "exact": (0.707604048733, (1.6424056420338e-05, 6.1261082224098e-05, 4.7360674578261e-04), None)},
}


def held_tests():
    """A held speed with a fractional ratio satisfies d'Alembert's principle."""
    for (what, holder), models in HELD.items():
        text = re.sub(r"&case title = ('[^']*') /", "&response points=400, harmonics=60 /\n&case title = \\1, "
                      "tasks='stability','response','power' /", (VALIDATION / "twin_balance_shaft.nml").read_text())
        text = text.replace("ratio=-1", "ratio=-1,2").replace("&drive ", f"&drive held_by={holder}, ")
        if what == "plane":
            text = re.sub(r"dof='xi'.*", "dof='xi','eta','psi' /", re.sub(r", angle=0,0,-?30", "", text))
        for model, (rho, sizes, torque) in models.items():
            name = f"ratio -1,2, {what}, {holder.split(',')[0]}, {model}"
            with Folder(input=f"&model frame='{model}' /\n" + text) as folder:
                if Run(folder, "-q", "-o", "out", "-s", "drive.speed_rpm=625", "input.nml").done(name):
                    # the reference's integration has an error of 1e-10 in the multipliers; 60 harmonics of the motion are accurate to 1e-9
                    near(f"{name}: rho", greatest(folder / "out" / "multipliers.csv"), rho, 1e-10)
                    for dof, size in zip(DOF if what == "space" else ("xi", "eta", "psi"), sizes):
                        near(f"{name}: rms of {dof}", rms(folder / "out" / "harmonics.csv", dof), size, 1e-9 * max(sizes))
                    found = max(abs(float(row["torque_Nm"])) for row in rows(folder / "out" / "power.csv"))
                    if torque:
                        near(f"{name}: torque", found, torque, 1e-9 * torque)


def flywheel_tests():
    """The torque on a flywheel with ratio 0.5 agrees with the closed form.

    An unbalance m r on a shaft at half the speed, lifted on a frame almost at rest: the drive feels m g r/2 cos(W t/2);
    the flywheel turns J + (J_s + m r^2)/4.
    """
    r, m, inertia, own, rpm = 0.03, 2.0, 0.05, 0.08, 300.0
    text = (f"&case tasks='power' /\n&response points=256 /\n&drive speed_rpm={rpm}, held_by='flywheel', "
            f"flywheel_inertia={inertia} /\n&gravity /\n&frame mass=50, inertia=3, origin=0,0 /\n"
            "&foundation stiffness=1e13,0,0,0,1e13,0,0,0,1e13 /\n&mechanism name='s', ratio=0.5 /\n"
            "&joint mechanism='s', name='O', type='ground', position=0,0 /\n"
            "&joint mechanism='s', name='A', type='crank', pivot='O', radius=0.1 /\n"
            f"&link name='unbalance', from='O', to='A', mass={m}, inertia={own}, center={r},0 /\n")
    with Folder(input=text) as folder:
        run = Run(folder, "--verbose", "input.nml")
        if not run.done("ratio 0.5, flywheel"):
            return
        torque = 9.80665 * m * r / 2
        speed = torque / (inertia + (own + m * r**2) / 4) / (rpm * math.pi / 60)
        found = [max(abs(float(row[key])) for row in rows(folder / "input" / "power.csv"))
                 for key in ("torque_Nm", "speed_fluctuation_rad_s")]
        # the frame yields by 1e-9 of the lever
        near("ratio 0.5, flywheel: torque", found[0], torque, 1e-6 * torque)
        near("ratio 0.5, flywheel: fluctuation", found[1], speed, 1e-6 * speed)
        reported = re.search(r"speed with the flywheel: (\S+) to (\S+) rpm.* irregularity (\S+)", run.flat)
        check("ratio 0.5, flywheel: line", reported is not None, "the line", run.out)
        if reported:
            change = speed * 30 / math.pi
            for came, value in zip(reported.groups(), (rpm - change, rpm + change, 2 * change / rpm)):
                near("ratio 0.5, flywheel: reported", float(came), value, 1e-3 * value)


def word_tests():
    """With a period of two turns angles and speeds are the drive's."""
    whole = both(PLANE, 240.0, "", ALONE)
    with Folder(one=whole[0], other=whole[1]) as folder:
        reported = [re.search(r"SLIDERS at (\S+) rpm.*\n.*\n.*\n +C +(\S+) +(\S+) +(\S+) +(\S+) +(\S+)",
                          Run(folder, "--check", f"{which}.nml").out) for which in ("one", "other")]
        check("ratio 0.5: sliders", all(reported), "lines", reported)
        if all(reported):
            for x, y, factor in zip(reported[0].groups(), reported[1].groups(), (2, 1, 1, 1, 2, 1)):
                near("ratio 0.5: sliders", float(x), factor * float(y), 1e-4 * abs(factor * float(y)))
    short = [text.replace("lengths=0.37,0.16", "lengths=0.34,0.1") for text in whole]
    with Folder(one=short[0], other=short[1]) as folder:
        reported = [re.search(r"at a crank angle of (\S+) deg", Run(folder, f"{which}.nml").err) for which in ("one", "other")]
        check("ratio 0.5: impossible", all(reported), "an angle", reported)
        if all(reported):
            near("ratio 0.5: angle where it ends", float(reported[0][1]), 2 * float(reported[1][1]), 2e-3)
    ratios = "&case tasks='sweep' /\n&sweep parameter='mechanism(cam).ratio', from=0.5, to=1, count=3 /\n"
    with Folder(input=ratios + both(PLANE, 240.0, "", HALF)[0]) as folder:
        run = Run(folder, "--plot", "input.nml")
        if run.done("ratio in a sweep"):
            check("ratio in a sweep: note", "refers to one period; the ratio changes the period from point to point" in run.flat, "a note", run.out)
            check("ratio in a sweep: picture", "growth in the period of each point" in (folder / "input" / "sweep.gp").read_text(), "words", "")
    with Folder(input="&case tasks='stability','response','forces','power','sweep' /\n" + SPEEDS.format(200, 240, 3)
                + both(PLANE, 240.0, "", HALF)[0]) as folder:
        if not Run(folder, "-q", "--plot", "input.nml").done("ratio 0.5: pictures"):
            return
        for script, words in (("multipliers", "multipliers of 2 turns"), ("sweep", "growth in 2 turns"),
                              ("supports_history", "Forces on the ground over 2 turns"), ("power", "of the drive over 2 turns")):
            text = (folder / "input" / f"{script}.gp").read_text()
            check(f"ratio 0.5: {script}.gp", words in text, words, text[:600])


# A shaft that turns 30 times as fast and hardly shakes the frame: all its orders are multiples of 30.
QUICK = """&case tasks='stability' /
&drive speed_rpm=300 /
&joint name='O', type='ground', position=0,0 /
&joint name='A', type='crank', pivot='O', radius=0.05 /
&joint name='P', type='ground', position=0.1,0 /
&joint name='B', type='crank', pivot='P', radius=0.02, ratio=30 /
&link name='c', from='O', to='A', mass=0.5, inertia=0.001, center=0.001,0 /
&link name='d', from='P', to='B', mass=0.2, inertia=0.0001, center=0.02,0 /
&frame mass=18.0, inertia=0.78, origin=-0.20,0.20 /
&support position=-0.30,-0.20, stiffness=196133,196133, damping=10,10 /
&support position=0.30,-0.20, stiffness=196133,196133, damping=10,10 /
"""


def quick_tests():
    """A very fast shaft is sampled finely enough.

    With fewer than 60 phases the motion would seem to end at order 18, be much larger, and |rho| would be wrong by 2e-8.
    """
    with Folder(input=QUICK) as folder:
        found = {}
        for model in ("rest", "first_order", "exact"):
            run = Run(folder, "--set", f"model.frame={model}", "-o", model, "input.nml")
            if not run.done(f"a quick shaft, {model}"):
                return
            found[model] = float(re.search(r"\|rho\| = ([0-9.]+)", run.out)[1])
        for model in ("first_order", "exact"):
            check(f"a quick shaft, {model}", abs(found[model] - found["rest"]) < 2e-9, found["rest"], found[model])


RATIO_TESTS = [quick_tests, speed_tests, boundary_tests, study_tests, held_tests, flywheel_tests, word_tests]
