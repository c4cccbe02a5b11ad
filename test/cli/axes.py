"""Supports whose axes turn with the frame, and the instability tongue that theory.md computes by formula."""

import math
from pathlib import Path

from broken_inputs import SOUND
from harness import Folder, Run, Table, check, equal, near

VALIDATION = Path(__file__).resolve().parent.parent.parent / "validation"
GRAVITY = "&gravity acceleration=98.0665, direction=-70.0 /\n"


def greatest(folder, what, *words, file="input.nml", column="abs"):
    """The greatest multiplier."""
    run = Run(folder, "-q", "-s", "case.tasks='stability'", *words, "-o", "out", file)
    return Table(folder / "out" / "multipliers.csv")[column][0] if run.done(what) else math.nan


def test_axes():
    """Turning support axes agree with Exudyn, with and without weights."""
    with Folder(heavy=(VALIDATION / "exudyn" / "turning_mounts.nml").read_text() + GRAVITY) as folder:
        # Its differences of the map: some 1e-7.
        for what, words, exudyn in (("weights", (), 0.917863129), ("none", ("-s", "gravity.acceleration=0"), 0.922365120)):
            near(f"axes, Exudyn, {what}", greatest(folder, f"axes, {what}", *words, file="heavy.nml"), exudyn, 4e-7)
            space = greatest(folder, f"in space, {what}", *words, "-s", "support.axes=space", file="heavy.nml")
            check(f"axes in space, {what}", abs(space - exudyn) > 1e-4, "another number", space)


def test_keys():
    """The key axes applies to one support or to all.

    Supports that are alike along both axes act alike unless there are weights. Unknown words are refused.
    """
    fast = ("-s", "drive.speed_rpm=2426")
    with Folder(input=SOUND, weighed=SOUND + "&gravity acceleration=300.0 /\n",
                other=SOUND.replace("position=0.10,-0.20, ", "position=0.10,-0.20, axes='both', ")) as folder:
        space, turned = (greatest(folder, "alike along both axes", *fast, *words) for words in ((), ("-s", "support.axes='frame'")))
        near("alike along both axes", turned, space, 1e-9)
        one = greatest(folder, "one of them", *fast, "-s", "support(2).damping=100,0", "-s", "support(2).axes='frame'")
        none = greatest(folder, "none of them", *fast, "-s", "support(2).damping=100,0")
        check("axes of one support have an effect", abs(one - none) > 1e-5, "another number", (one, none))
        space, turned = (abs(greatest(folder, "weights about rest", *words, "-s", "model.frame=rest", "-s", "frame.dof='eta','psi'",
                                      file="weighed.nml", column="arg_rad")) for words in ((), ("-s", "support.axes='frame'")))
        check("weights about rest have an effect", abs(turned - space) > 1e-4, "another phase", (turned, space))
        Run(folder, "other.nml").refused("axes, unknown word", 2, "other.nml:13: &support 3: axes = 'both': unknown; choose from 'space', 'frame'")
        equal("axes, no files", sorted(path.name for path in folder.iterdir()), ["input.nml", "other.nml", "out", "weighed.nml"])


def test_by_hand():
    """The width of an instability tongue agrees with the formula of theory.md.

    The relative width is a k |h| / (2 c); the rest is even in the unbalance. About rest there is no tongue.
    """
    mass, inertia, arm, k, c = 20.0, 0.45, 0.3, 3.6e5, 405.0
    speed = 2 * math.sqrt(c / inertia)
    with Folder() as folder:
        for model in ("exact", "first_order", "rest"):
            missed = []
            for centre in (0.01, 0.005):
                words = ("-s", f"model.frame={model}", "-s", f"link(rotor).center={centre},0", "-s",
                         f"frame.inertia={inertia - 0.05 - 2.0 * centre ** 2!r}")
                run = Run(folder, "-q", *words, "-o", "out", VALIDATION / "rotor_on_support.nml")
                if not run.done(f"closed form, {model}"):
                    return
                rows = [line.split(",") for line in (folder / "out" / "boundary.csv").read_text().splitlines() if line[0] != "#"][1:]
                if model == "rest":
                    equal("closed form, rest", rows, [])
                    continue
                equal(f"closed form, {model}, kinds", [row[3] for row in rows], ["period_doubling"] * 2)
                h = 2.0 * centre * speed ** 2 / (k - mass * speed ** 2)
                width = (float(rows[1][1]) - float(rows[0][1])) * math.pi / 30 / speed
                missed.append(width / (arm * k * h / (2 * c)) - 1)
            if missed:
                near(f"closed form, {model}", missed[1], 0, 1e-3)
                # terms of the fourth order
                near(f"closed form, {model}, falls with the square", missed[0] / missed[1], 4, 0.05)


AXES_TESTS = [test_axes, test_keys, test_by_hand]
