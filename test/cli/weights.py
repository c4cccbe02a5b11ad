"""Weights: static loads, feet that lift off, the torque that lifts the links, refused input."""

import math
import re
from pathlib import Path

from broken_inputs import SOUND
from harness import Folder, Run, Table, check, equal, near, series

DATA = Path(__file__).resolve().parent.parent.parent / "data"
GRAVITY = "&gravity /\n"
G = 9.80665
COLUMNS = ["static_fx_N", "static_fy_N", "least_compression_N", "least_compression_error_N"]


def data(name):
    return (DATA / f"{name}.nml").read_text()


def places(folder):
    """The rows of supports.csv by place."""
    rows = [line.split(",") for line in (folder / "supports.csv").read_text().splitlines() if line[0] != "#"]
    return rows[0], {row[0]: dict(zip(rows[0], row)) for row in rows[1:]}


def peak(out, label):
    """The number that follows a label at the beginning of a line."""
    found = re.search(rf"^ *{re.escape(label)} +(-?[0-9.]+)", out, re.M)
    return float(found[1]) if found else math.nan


def test_lifts_off():
    """Feet that lift off are reported with their least compression."""
    for name, foot, least, weight in (("compressor", "1", -4.57, 48.1), ("watt_six_bar", "1", -10.1, 65.2)):
        with Folder(machine=data(name) + "\n" + GRAVITY) as folder:
            run = Run(folder, "-s", "case.tasks='forces'", "-s", "response.points=3600", "machine.nml")
            if not run.done(f"{name}, forces with weights"):
                return
            header, rows = places(folder / "machine")
            equal(f"{name}, columns", header[-4:], COLUMNS)
            printed = float(rows[foot]["least_compression_N"])
            near(f"{name}, least compression", printed, least, 0.05 if least > -5 else 0.5)
            history = Table(folder / "machine" / "supports_history.csv")
            static = {place: float(row["static_fy_N"]) for place, row in rows.items()}
            for place, row in rows.items():
                lowest = min(-static[place] - f for f in history[f"fy_{place}_N"])
                # a parabola between 3600 rows
                near(f"{name}, least compression of {place}", float(row["least_compression_N"]), lowest, 1e-3)
            near(f"{name}, the weight", static["total"], -weight * G, 1e-9 * weight)
            near(f"{name}, the supports carry it", sum(f for place, f in static.items() if place != "total"), static["total"],
                 1e-9 * weight)
            words = re.findall(r"support (\d).*LIFTS OFF$", run.out, re.M)
            equal(f"{name}, report", words, [p for p, r in rows.items() if p.isdigit() and float(r["least_compression_N"]) < 0])


def test_no_gravity():
    """Without gravity nothing about weights is reported or changed."""
    with Folder(input=SOUND) as folder:
        words = ("-s", "case.tasks='response','forces','power'")
        run, zero = (Run(folder, *words, *more, "input.nml") for more in (("-o", "a"), ("-o", "b", "-s", "gravity.acceleration=0")))
        if not (run.done("without weights") and zero.done("gravity zero")):
            return
        equal("without weights, columns", [word for word in places(folder / "a")[0] if word in COLUMNS], [])
        equal("without weights, report", "LIFTS OFF" in run.out or "static N" in run.out or "STATIC" in run.out, False)
        for name in ("supports.csv", "response.csv", "power.csv"):
            both = [[line for line in (folder / other / name).read_text().splitlines() if line[0] != "#"] for other in "ab"]
            equal(f"gravity zero, {name}", both[0] == both[1], True)


def test_numbers():
    """Effects of weights on motion and torque agree with known values.

    psi of the shaper, torque of the flying press. Over a turn lifting takes no power.
    """
    for name, label, factor, tolerance in (("shaper", "psi", 1.092, 2e-3), ("flying_press", "on the vibrating frame", -1.993, 2e-3)):
        with Folder(plain=data(name), weighed=data(name) + "\n" + GRAVITY) as folder:
            runs = [Run(folder, "-s", "case.tasks='response','power'", f"{other}.nml") for other in ("plain", "weighed")]
            for run in runs:
                if not run.done(f"{name}, with and without weights"):
                    return
            near(f"{name}, {label}", peak(runs[1].out, label) / peak(runs[0].out, label), factor, tolerance)
            power = Table(folder / "weighed" / "power.csv")
            rigid = power["rigid_torque_Nm"][:-1]
            near(f"{name}, mean rigid torque", sum(rigid) / len(rigid), 0, 1e-9 * max(map(abs, rigid)))
            drive, dampers = power["drive_W"][:-1], power["dampers_W"][:-1]
            near(f"{name}, balance", sum(drive), sum(dampers), 1e-7 * len(drive) * max(map(abs, drive)))


def test_units_and_paths():
    """The direction of gravity follows units, --set and sweeps."""
    sweep = "&sweep parameter='gravity.direction', from=-90.0, to=0.0, count=3 /\n"
    sensitive = "&sensitivity parameters='gravity.acceleration', quantities='psi' /\n"
    heavy = SOUND + "&gravity acceleration=300.0 /\n"
    with Folder(degrees=heavy + sweep + sensitive, radians=heavy + "&units angle='rad' /\n") as folder:
        peaks = []
        for name, words in (("degrees", ("-s", "gravity.direction=-45")), ("radians", ("-s", f"gravity.direction={-math.pi / 4!r}"))):
            one = Run(folder, "-s", "case.tasks='response'", *words, f"{name}.nml")
            one.done(f"direction in {name}")
            check(f"direction in {name}, report", re.search(r"gravity +300 m/s\^2 at -45 deg", one.out), "-45 deg", one.out[:900])
            peaks.append(Table(folder / name / "response.csv")["psi_rad"])
        series("direction in deg and rad", peaks[1], peaks[0], 1e-9 * max(map(abs, peaks[0])))
        Run(folder, "-q", "-s", "case.tasks='sweep'", "-o", "sweep", "degrees.nml").done("sweep over the direction")
        Run(folder, "-q", "-s", "case.tasks='sensitivity'", "-o", "sensitive", "degrees.nml").done("sensitivity to gravity")
        lines = [line.split(",") for line in (folder / "sweep" / "sweep.csv").read_text().splitlines() if line[0] != "#"]
        middle = float(lines[2][lines[0].index("psi_peak_rad")])
        # the maximum over 361 rows of the history
        near("sweep, its middle is -45 deg", middle / max(map(abs, peaks[0])), 1, 1e-3)
        low, high = float(lines[1][lines[0].index("psi_peak_rad")]), float(lines[3][lines[0].index("psi_peak_rad")])
        check("sweep, the direction has an effect", abs(low / high - 1) > 0.01, "different peaks", (low, high))


def test_check():
    """--check reports the static loads of the supports."""
    with Folder(input=SOUND + GRAVITY) as folder:
        run = Run(folder, "--check", "input.nml")
        if not run.done("--check with weights"):
            return
        table = run.out.partition("STATIC LOADS")[2]
        loads = [float(found) for found in re.findall(r"^  \d at .* (-?[0-9.]+)$", table, re.M)]
        equal("--check, supports", len(loads), 4)
        # five digits are printed
        near("--check, all of it", sum(loads), -(18 + 0.5 + 0.6 + 0.25) * G, 5e-3)


def test_refused():
    """Invalid gravity and weights that nothing carries are refused."""
    cases = (
        ("negative acceleration", "&gravity acceleration=-1.0 /\n", 2,
         "input.nml:16: &gravity: acceleration = -1.0: must not be negative"),
        ("misspelt key", "&gravity accelleration=1.0 /\n", 2,
         "input.nml:16: &gravity: unknown key 'accelleration': did you mean 'acceleration'?"),
        ("group twice", GRAVITY + GRAVITY, 2, "input.nml:17: &gravity: may occur only once (first in line 16)"))
    for what, line, code, message in cases:
        with Folder(input=SOUND + line) as folder:
            Run(folder, "input.nml").refused(f"weights, {what}", code, message)
    loose = "\n".join(line for line in SOUND.splitlines() if not line.startswith("&support"))
    for what, stiffness, direction, word in (("weight", "1.0e5,0.0", -90, "the weight along eta"),
                                             ("weight across", "0.0,1.0e5", 180, "the weight along xi")):
        hung = f"&support position=0.0,-0.2, stiffness={stiffness} /\n&gravity direction={direction}.0 /\n"
        with Folder(input=loose + "\n" + hung + "&foundation stiffness(3,3)=1.0e4 /\n" * ("&foundation" not in loose)) as folder:
            Run(folder, "-s", "foundation.stiffness(3,3)=1.0e4", "input.nml").refused(
                f"weights, nothing carries the {what}", 3,
                f"input.nml:13: &gravity: no spring carries {word}: add a spring in this direction, or lock this degree of freedom")
            equal(f"weights, nothing carries the {what}: no files", [path.name for path in folder.iterdir()], ["input.nml"])


def test_sweep():
    """Points of a sweep that cannot carry the weights are impossible."""
    sweep = SOUND.replace("'stability', 'response'", "'sweep'") + GRAVITY \
        + "&sweep parameter='support.stiffness', from=0, to=2e5, count=2 /\n"
    with Folder(input=sweep) as folder:
        if Run(folder, "-q", "input.nml").done("weights, a sweep from no stiffness"):
            rows = [line.split(",") for line in (folder / "input" / "sweep.csv").read_text().splitlines() if line[0] in "02"]
            equal("weights, a sweep from no stiffness, verdicts", [row[4] for row in rows], ["impossible", "stable"])


WEIGHT_TESTS = [test_sweep, test_lifts_off, test_no_gravity, test_numbers, test_units_and_paths, test_check, test_refused]
