"""The task `sensitivity` as a user runs it: sensitivity.csv, the report, refused input."""

import csv
import math

from broken_inputs import SOUND
from harness import Folder, Run, check, equal, files, near

SENSITIVE = SOUND.replace("'stability', 'response'", "'sensitivity'")
QUANTITIES = "&sensitivity quantities='f','xi','psi_dot' /\n"
HEADER = ("quantity,unit,parameter,peak,peak_change_percent_per_percent,peak_change_error,rms,rms_change_percent_per_percent,"
          "rms_change_error,state")
PARAMETERS = ["drive.speed_rpm", "frame.mass", "frame.inertia"]
PARAMETERS += [f"link({name}).{key}" for name in ("crank", "coupler", "rocker") for key in ("mass", "inertia")]
PARAMETERS += ["support.stiffness"] + [f"support({i}).stiffness" for i in range(1, 5)] + ["foundation.damping"]


def rows(folder):
    """Header and rows of sensitivity.csv."""
    lines = [line for line in (folder / "sensitivity.csv").read_text().splitlines() if line[0] != "#"]
    return lines[0], list(csv.reader(lines[1:]))


def test_paper():
    """Sensitivities satisfy the laws of dimensions and add up over supports."""
    with Folder(input=SENSITIVE + QUANTITIES) as folder:
        run = Run(folder, "input.nml")
        if not run.done("sensitivity"):
            return
        equal("sensitivity: files", files(folder / "input"), ["sensitivity.csv"])
        header, table = rows(folder / "input")
        equal("sensitivity: header", header, HEADER)
        equal("sensitivity: rows", [(row[0], row[2]) for row in table],
              [(name, path) for name in ("f", "xi", "psi_dot") for path in PARAMETERS])
        equal("sensitivity: units", {(row[0], row[1]) for row in table}, {("f", "N"), ("xi", "m"), ("psi_dot", "rad/s")})
        for name, inertial, temporal in (("f", 1.0, 2.0), ("xi", 0.0, 0.0), ("psi_dot", 0.0, 1.0)):
            for column, what in ((4, "peak"), (7, "rms")):
                change = {row[2]: float(row[column]) for row in table if row[0] == name}
                bound = 4 * max(float(row[column + 1]) for row in table if row[0] == name) * math.sqrt(len(change))
                check(f"sensitivity of {name}, {what}: errors", bound < 1e-5, "little", bound)
                masses = sum(value for path, value in change.items() if path.endswith(("mass", "inertia")))
                # a force grows with masses, stiffness and damping by the same factor; a displacement stays
                near(f"sensitivity of {name}, {what}: forces", masses + change["support.stiffness"] + change["foundation.damping"],
                     inertial, bound)
                # and as (1/time)^2 if the unit of time changes: the speed as 1/time, stiffness and damping accordingly
                near(f"sensitivity of {name}, {what}: time",
                     change["drive.speed_rpm"] + 2 * change["support.stiffness"] + change["foundation.damping"], temporal, bound)
                near(f"sensitivity of {name}, {what}: supports", sum(change[f"support({i}).stiffness"] for i in range(1, 5)),
                     change["support.stiffness"], bound)
        report = run.out[run.out.index("SENSITIVITY"):]
        effects = [abs(float(line.split()[0])) for line in report.splitlines() if line.endswith(tuple(PARAMETERS))]
        equal("sensitivity: greatest effect first", effects[:len(PARAMETERS)], sorted(effects[:len(PARAMETERS)], reverse=True))

        before = (folder / "input" / "sensitivity.csv").read_bytes()
        for threads in ("1", "3"):
            Run(folder, "-q", "input.nml", environment={"OMP_NUM_THREADS": threads}).done("sensitivity by threads")
            equal(f"sensitivity: the same bytes by {threads} threads", (folder / "input" / "sensitivity.csv").read_bytes(), before)


def test_as_changed():
    """Sensitivities agree with machines changed by hand."""
    paths = {"support(2).stiffness(1)": 196133.0, "joint(A).radius": 0.07, "drive.speed_rpm": -240.0}
    line = "&sensitivity quantities='xi', parameters={} /\n".format(",".join(f"'{path}'" for path in paths))
    with Folder(input=SENSITIVE + line) as folder:
        backwards = ("-s", "drive.speed_rpm=-240")
        Run(folder, "-q", *backwards, "input.nml").done("sensitivity, clockwise")
        table = rows(folder / "input")[1]
        equal("sensitivity: the parameters of the input", [row[2] for row in table], list(paths))
        for row in table:
            peaks = []
            for part in (1.0001, 0.9999):
                run = Run(folder, "--one-line", *backwards, "-s", "case.tasks=response", "-s", "accuracy.tolerance=1e-12", "-s",
                          f"{row[2]}={paths[row[2]] * part!r}", "input.nml")
                names, values = (line.split(",") for line in run.out.splitlines()[:2])
                peaks.append(float(dict(zip(names, values))["xi_peak_m"]))
            change = math.log(peaks[0] / peaks[1]) / math.log(1.0001 / 0.9999)
            # error of the step of 1e-4: its square times a third derivative, of the order of (240 / 3 rpm off)^3
            near(f"sensitivity to {row[2]}", float(row[4]), change, 1e-3 * max(1.0, abs(change)))


def test_refused():
    """Invalid parameters of sensitivities are refused."""
    for name, keys, message in (
        ("no such path", "parameters='frame.weight'", "&sensitivity: parameters = 'frame.weight': "),
        ("no number", "parameters='joint(A).pivot'", "'joint(A).pivot' is not a numerical key of the machine"),
        ("an order", "parameters='accuracy.tolerance'", "'accuracy.tolerance' is not a numerical key of the machine"),
        ("zero", "parameters='support.damping'", "'support.damping' is zero or not given, so it cannot be changed by a percentage"),
        ("twice", "parameters='frame.mass','frame.mass'", "names 'frame.mass' twice"),
        ("no such quantity", "quantities='g'", "unknown quantity 'g'"),
    ):
        with Folder(input=SENSITIVE + f"&sensitivity {keys} /\n") as folder:
            run = Run(folder, "input.nml")
            equal(f"sensitivity refused, {name}: code", run.code, 2)
            check(f"sensitivity refused, {name}", run.err.startswith("input.nml:16: &sensitivity: ") and message in run.err
                  and run.err.count("\n") == 1, message, run.err)
            equal(f"sensitivity refused, {name}: no files", files(folder / "input"), [])


SENSITIVITY_TESTS = (test_paper, test_as_changed, test_refused)
