"""The averaged model and the comparison of models, as a user runs them."""

import math
import re
from pathlib import Path

from broken_inputs import SOUND
from harness import (HEADERS, MODES, MULTIPLIERS, QUANTITIES, Folder, Run, Table, body, check, equal, files, near, series,
                     tables)

GOLDEN = Path(__file__).resolve().parent / "golden" / "averaged"
AVERAGED = SOUND + "&model coefficients='averaged' /\n"
SETTINGS = ("case.tasks='stability','modes','response'", "response.points=24")


def run_golden(folder):
    return Run(folder, "--verbose", *(word for each in SETTINGS for word in ("-s", each)), "-o", "new", "input.nml")


def write_averaged_golden():
    with Folder(input=AVERAGED) as folder:
        run = run_golden(folder)
        assert run.code == 0, run.err
        GOLDEN.mkdir(parents=True, exist_ok=True)
        for name in HEADERS:
            (GOLDEN / name).write_bytes((folder / "new" / name).read_bytes())


def test_golden():
    """Results of the averaged model agree with the stored ones."""
    with Folder(input=AVERAGED) as folder:
        run = run_golden(folder)
        if not run.done("averaged"):
            return
        check("averaged, the report says so", "averaged model solved in closed form" in run.flat and "model      averaged" in run.out,
              "the model in head and evidence", run.out)
        check("averaged, report does not mention integration", "Phi" not in run.out, "no Phi(T)", run.out)
        came, right = tables(folder / "new"), tables(GOLDEN)
        equal("averaged, files", sorted(came), sorted(right))
        for name in MULTIPLIERS[1:-1]:
            # rounding and no more: bounds of 1e-11 relative to 1, exponents over a period of 0.25 s
            series(f"averaged, multipliers.csv, {name}", came["multipliers.csv"][name], right["multipliers.csv"][name], 4e-11)
        for name in MODES[1:]:
            series(f"averaged, modes.csv, {name}", came["modes.csv"][name], right["modes.csv"][name], 1e-11)
        for file, ending in (("response.csv", ""), ("harmonics.csv", "_amplitude")):
            for name in QUANTITIES:
                greatest = max(map(abs, right[file][name + ending]))
                series(f"averaged, {file}, {name}", came[file][name + ending], right[file][name + ending], 1e-10 * greatest)


def test_chosen():
    """The averaged model can be chosen in the file and by --set."""
    with Folder(input=AVERAGED, plain=SOUND) as folder:
        Run(folder, "-q", "input.nml", "-o", "file").done("averaged in the file")
        Run(folder, "-q", "plain.nml", "-o", "set", "-s", "model.coefficients=averaged").done("averaged by --set")
        Run(folder, "-q", "plain.nml", "-o", "default").done("periodic by default")
        Run(folder, "-q", "input.nml", "-o", "periodic", "-s", "model.coefficients=periodic").done("periodic by --set")
        equal("averaged, in the file as by --set", body(folder / "file") == body(folder / "set"), True)
        equal("periodic, by default as by --set", body(folder / "default") == body(folder / "periodic"), True)
        equal("averaged is another model", body(folder / "file") != body(folder / "default"), True)


def test_by_hand():
    """Averaged multipliers of one degree of freedom agree with the closed form.

    They are exp(lambda T) with lambda from m lambda^2 + b lambda + c = 0.
    """
    mass, period, stiffness, damping = 18.0 + 1.35, 0.25, 4 * 196133.0, 0.5
    with Folder(input=AVERAGED) as folder:
        Run(folder, "-q", "input.nml", "-s", "frame.dof='xi'").done("averaged, xi alone")
        table = Table(folder / "input" / "multipliers.csv")
        for k, sign in ((0, 1), (1, -1)):
            near(f"averaged, xi alone, log_abs {k + 1}", table["log_abs"][k], -damping / (2 * mass) * period, 1e-14)
            turn = math.sqrt(stiffness / mass - (damping / (2 * mass)) ** 2) * period
            # the pair in this order: the first lies above the real axis as an eigenvalue lambda
            near(f"averaged, xi alone, arg {k + 1}", math.remainder(table["arg_rad"][k] - sign * turn, 2 * math.pi), 0, 1e-12)


def test_resonance():
    """An undamped averaged machine at resonance ends with exit code 4.

    The error names the harmonic; the verdict is still reported.
    """
    stiffness = (18.0 + 1.35) * (5 * 2 * math.pi * 4) ** 2 / 4
    settings = ["-s", "frame.dof='xi'", "-s", f"support.stiffness={stiffness!r}", "-s", "foundation.damping=0,0,0"]
    with Folder(input=AVERAGED) as folder:
        run = Run(folder, "-q", "input.nml", *settings)
        run.refused("averaged, resonance", 4, re.compile(r".*harmonic 5 of the period \(resonance\).*"))
        equal("averaged, resonance, files", files(folder / "input"), ["multipliers.csv"])
        run = Run(folder, "-q", "input.nml", "-s", "support.stiffness=0.0", "-o", "free")
        run.refused("averaged, frame without supports", 4, re.compile(r".*in one or more directions no spring carries the mean load \(harmonic 0\)"))


def test_extremes():
    """The averaged model never prints NaN, however extreme the numbers."""
    for settings in (["drive.speed_rpm=0.01"], ["drive.speed_rpm=1e-300"], ["drive.speed_rpm=1e30"], ["drive.speed_rpm=1e300"],
                     ["frame.mass=1e300"], ["frame.mass=1e-300"], ["support.stiffness=1e300"], ["support.damping=1e300"],
                     ["support.damping=1e6"], ["link.mass=0", "link.inertia=0"], ["link(coupler).mass=1e300"],
                     ["joint(B).lengths(1)=0.3101"], ["foundation.damping=0,0,0"], ["response.points=1"]):
        what = "averaged, " + " ".join(settings)
        with Folder(input=AVERAGED) as folder:
            run = Run(folder, "input.nml", *(word for setting in settings for word in ("-s", setting)))
            check(what, run.code in (0, 4) and run.err.count("\n") == (run.code != 0), "0, or 4 and one line",
                  (run.code, run.err))
            numbers = [value for table in body(folder / "input").values() for row in table for value in row]
            # rho itself may overflow
            check(f"{what}, files", not any(map(math.isnan, numbers)), "numbers", "others")
            check(f"{what}, report", not re.search(r"NaN|\*\*", run.out), "finite numbers", run.out)


def test_trade():
    """The task trade compares the averaged model with the periodic one."""
    with Folder() as folder:
        run = Run(folder, "input.nml", "-s", "case.tasks='trade'")
        if run.code != 0:
            run.done("trade")
            return
        rows = (folder / "input" / "trade.csv").read_text().splitlines()
        last = rows[-1].split(",")
        equal("trade, last row", last[:3], ["averaged", "0", "0"])
        equal("trade, one row of the averaged model", sum(row.startswith("averaged,") for row in rows), 1)
        check("trade, samples", int(last[3]) > 0, "> 0", last[3])
        # errors of the averaged model at this speed: Phi(T) 1.5 %, a multiplier 1.1 %, x0 0.25 %
        for name, value, expected in zip(("phi", "rho", "x0"), last[4:7], (1.5377e-2, 1.1172e-2, 2.4890e-3)):
            near(f"trade, averaged, error_{name}", float(value), expected, 1e-4 * expected)
        check("trade, report", "PERIODIC OR AVERAGED" in run.out and "use it for a first estimate" in run.flat,
              "the comparison in words", run.out)


AVERAGED_TESTS = (test_golden, test_chosen, test_by_hand, test_resonance, test_extremes, test_trade)
