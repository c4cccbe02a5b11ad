"""Who holds the speed: report and files, the flywheel's speed fluctuation, refused input."""

import re
from pathlib import Path

from broken_inputs import SOUND
from harness import Folder, Run, Table, check, equal, near

DATA = Path(__file__).resolve().parent.parent.parent / "data"
COMPRESSOR = (DATA / "compressor.nml").read_text()
HOLDERS = {"motor": "motor      on the frame", "flywheel": "flywheel   constant absolute speed",
           "outside": "motor      beside the machine"}


def amplitude(folder, order, name="psi_rad"):
    return Table(folder / "harmonics.csv")[f"{name}_amplitude"][order]


def test_holders():
    """The compressor's second-order rotation depends on who holds the speed.

    Exudyn, which holds the speed in space by a constraint, agrees to 1e-9.
    """
    for holder, second in (("motor", 0.003799), ("flywheel", 0.149134), ("outside", 0.149134)):
        with Folder(machine=COMPRESSOR) as folder:
            run = Run(folder, "-s", f"drive.held_by='{holder}'", "machine.nml")
            if not run.done(f"held by {holder}"):
                return
            check(f"held by {holder}, report", HOLDERS[holder] in run.out, HOLDERS[holder], run.out[:900])
            head = [line for line in (folder / "machine" / "response.csv").read_text().splitlines() if line[0] == "#"]
            equal(f"held by {holder}, files", [line for line in head if "held by" in line],
                  [] if holder == "motor" else [f"# speed held by: {holder}"])
            near(f"held by {holder}, psi's order 2 (mrad)", 1e3 * amplitude(folder / "machine", 2), second, 1e-6)


def test_default():
    """Naming the default holder of the speed changes no byte."""
    with Folder(input=SOUND) as folder:
        for name, words in (("a", ()), ("b", ("-s", "drive.held_by='motor'"))):
            Run(folder, "-q", "-o", name, *words, "input.nml").done(f"default, {name}")
        both = [[line for line in (folder / name / "response.csv").read_text().splitlines() if line[0] != "#"] for name in "ab"]
        equal("held by the motor, default", both[0] == both[1], True)


def test_fluctuation():
    """A heavier flywheel turns more evenly.

    Also its units, a sweep over its inertia, the note and the column.
    """
    words = ("-s", "drive.held_by='flywheel'", "-s", "case.tasks='power'")
    with Folder(machine=COMPRESSOR, small=COMPRESSOR + "&units inertia='kg cm^2' /\n",
                sweep=COMPRESSOR + "&sweep parameter='drive.flywheel_inertia', from=0.1, to=0.3, count=2 /\n") as folder:
        reported = []
        for inertia in ("0.3", "0.03"):
            run = Run(folder, *words, "-s", f"drive.flywheel_inertia={inertia}", "machine.nml")
            if not run.done(f"flywheel of {inertia}"):
                return
            reported.append(float(re.search(r"coefficient of irregularity (\S+)", run.flat)[1]))
            equal(f"flywheel of {inertia}, note", "the speed fluctuates by more than 1 %" in run.flat, reported[-1] > 0.01)
            speed = Table(folder / "machine" / "power.csv")["speed_fluctuation_rad_s"]
            near(f"flywheel of {inertia}, column", (max(speed) - min(speed)) / (1450 * 3.14159265 / 30) / reported[-1], 1, 1e-3)
        # the mechanism's own inertia is some per cent of the small one
        near("flywheels of 0.3 and 0.03", reported[1] / reported[0], 10, 1.5)
        run = Run(folder, *words, "-s", "frame.inertia=1.6e4", "-s", "link(crank).inertia=20", "-s", "link(rod).inertia=30",
                  "-s", "drive.flywheel_inertia=3e3", "small.nml")
        if run.done("inertia in kg cm^2"):
            equal("inertia in kg cm^2", float(re.search(r"coefficient of irregularity (\S+)", run.flat)[1]), reported[0])
        run = Run(folder, "-q", "-s", "drive.held_by='flywheel'", "-s", "drive.flywheel_inertia=0.2", "-s", "case.tasks='sweep'",
                  "-s", "model.frame='rest'", "sweep.nml")
        if run.done("sweep over the flywheel's inertia"):
            lines = [line for line in (folder / "sweep" / "sweep.csv").read_text().splitlines() if line[0] != "#"]
            rows = [line.split(",")[1:] for line in lines[1:]]
            equal("sweep over the flywheel's inertia, points", len(rows), 2)
            equal("sweep over the flywheel's inertia: it does not shake", rows[:1], rows[1:])


def test_check():
    """The shaking moment of --check depends on who holds the speed.

    It does not contain the torque's fluctuation.
    """
    with Folder(machine=COMPRESSOR) as folder:
        tables = []
        for holder in ("motor", "outside"):
            run = Run(folder, "--check", "-s", f"drive.held_by='{holder}'", "machine.nml")
            if not run.done(f"--check, held by {holder}"):
                return
            tables.append([line.split() for line in run.out.partition("SHAKING")[2].splitlines()[2:10]])
        equal("--check, forces are the same", [row[:5] for row in tables[0]], [row[:5] for row in tables[1]])
        check("--check, moments are not", tables[0][1][5] != tables[1][1][5], "different", (tables[0][1], tables[1][1]))


def test_refused():
    """Holders of the speed that lack data are refused."""
    drive = "&drive speed_rpm = 240.0"
    cases = (
        ("nobody holds it", "held_by='nobody'", "held_by = 'nobody'"),
        ("an inertia without flywheel", "flywheel_inertia=0.3", "flywheel_inertia = 0.3: is only allowed with held_by='flywheel'"),
        ("no inertia", "held_by='flywheel', flywheel_inertia=0.0", "flywheel_inertia = 0.0: must be positive"))
    for what, keys, message in cases:
        with Folder(input=SOUND.replace(drive, f"{drive}, {keys}")) as folder:
            run = Run(folder, "input.nml")
            equal(f"held by, {what}: code", run.code, 2)
            check(f"held by, {what}: message", run.err.startswith("input.nml:2: &drive: " + message) and run.err.count("\n") == 1,
                  message, run.err)
            equal(f"held by, {what}: no files", [path.name for path in folder.iterdir()], ["input.nml"])
    functions = "\n".join(line for line in SOUND.splitlines() if not line.startswith(("&joint", "&link")))
    functions += "\n&mass_functions mass=1.0, inertia=0.0, a1=0.0,0.1,0.0, a2=0.0,0.0,0.1, a3=0.02, moment=0.01 /\n"
    with Folder(input=functions) as folder:
        run = Run(folder, "-s", "drive.held_by='outside'", "input.nml")
        run.refused("held by, mass functions without energy", 2,
                    "input.nml:2: &drive: held_by = 'outside' requires the kinetic energy of the mechanism: add the key energy to &mass_functions")


HELD_SPEED_TESTS = [test_holders, test_default, test_fluctuation, test_check, test_refused]
