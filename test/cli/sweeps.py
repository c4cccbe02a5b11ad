"""Sweeps: points against single runs, invalid input, parts, threads, and everything that can interrupt a run."""

import ast
import csv
import json
import os
import random
import re
import resource
import shutil
import signal
import struct
import subprocess
import time
from pathlib import Path

from broken_inputs import REST, SOUND
from harness import Folder, Run, Table, check, equal, files, near

GOLDEN = Path(__file__).resolve().parent / "golden" / "sweep"
FIRST, SECOND = "drive.speed_rpm", "support.stiffness"
COLUMNS = ["rho_max", "log_rho_max", "rho_error", "verdict", "xi_peak_m", "eta_peak_m", "psi_peak_rad"]
SWEEP = SOUND.replace("'stability', 'response'", "'sweep'")


def axis(parameter, first, last, count, more=""):
    return f"&sweep parameter='{parameter}', from={first}, to={last}, count={count}{more} /\n"


TWO = axis(FIRST, 100, 500, 3) + axis(SECOND, 50000, 200000, 3, ", spacing='log'")
# 16 tiles, tenths of a second in all: time enough to be interrupted
LONG = REST + axis(FIRST, 200, 500, 25, ", engine='direct', columns='rho_max','verdict'") + axis(SECOND, 50000, 200000, 40)
EXPANDED = LONG.replace("'direct'", "'expansion'").replace("from=200, to=500", "from=480, to=500")


class Points:
    """A sweep.csv: its text columns too."""

    def __init__(self, text):
        self.preamble = [line for line in text.splitlines() if line.startswith("#")]
        rows = list(csv.reader(line for line in text.splitlines() if not line.startswith("#")))
        # numbers may be preceded by blanks, words may not
        self.header = rows[0]
        self.rows = [[cell if name == "verdict" else cell.strip() for name, cell in zip(self.header, row)] for row in rows[1:]]

    def column(self, name):
        i = self.header.index(name)
        return [row[i] if name == "verdict" else float(row[i]) for row in self.rows]


def points(folder):
    path = folder / "sweep.csv"
    return Points(path.read_text()) if path.exists() else Points("none\n")


def same(name, came, expected, tolerance):
    """Compares the numbers of two lists relative to the largest; NaN only where NaN is expected."""
    greatest = max((abs(value) for value in expected if value == value), default=0.0)
    wrong = [i for i, (one, two) in enumerate(zip(came, expected))
             if not (one != one and two != two or abs(one - two) <= tolerance * greatest)]
    check(name, not wrong and len(came) == len(expected), f"equal to {tolerance:g}", [(i, came[i]) for i in wrong[:3]])


# ---- results of a sweep ----------------------------------------------------------------------------------------------


def test_golden():
    """Results of a sweep agree with the stored ones."""
    with Folder(input=SWEEP + TWO + REST) as folder:
        run = Run(folder, "input.nml")
        run.done("sweep")
        equal("sweep, files", files(folder / "input"), ["sweep.csv"])
        check("sweep, report", "SWEEP  9 points" in run.out and "stable   9 points" in run.out,
              "points, verdicts", run.out)
        check("sweep, nothing else is computed", "VERDICT" not in run.out, "no single verdict", run.out)
        came, right = points(folder / "input"), points(GOLDEN)
        equal("sweep, header", came.header, [FIRST, SECOND, *COLUMNS])
        equal("sweep, preamble", came.preamble, right.preamble)
        equal("sweep, parameters", [row[:2] for row in came.rows], [row[:2] for row in right.rows])
        equal("sweep, verdicts", came.column("verdict"), right.column("verdict"))
        for name in COLUMNS:
            if name not in ("verdict", "rho_error"):
                # the golden numbers were found with a tolerance of 1e-13, these with 1e-9; a peak loses two digits
                same(f"sweep, {name}", came.column(name), right.column(name), 1e-7 if "peak" in name else 1e-8)


def write_sweep_golden():
    with Folder(input=SWEEP + TWO + REST) as folder:
        run = Run(folder, "input.nml", "-s", "accuracy.tolerance=1e-13")
        assert run.code == 0, run.err
        GOLDEN.mkdir(parents=True, exist_ok=True)
        text = (folder / "input" / "sweep.csv").read_text().replace("# set: accuracy.tolerance=1e-13\n", "")
        (GOLDEN / "sweep.csv").write_text(text)


def test_as_single_runs():
    """Every point of a sweep agrees with a single run."""
    with Folder(input=SWEEP + TWO + "&units stiffness='N/cm' /\n", single=SOUND) as folder:
        Run(folder, "-q", "input.nml", "-s", "sweep(2).from=500", "-s", "sweep(2).to=2000").done("sweep in other units")
        table = points(folder / "input")
        for row in table.rows:
            speed, stiffness = map(float, row[:2])
            Run(folder, "-q", "single.nml", "-s", f"{FIRST}={row[0]}", "-s", f"{SECOND}={100 * stiffness!r}").done("single")
            rho = Table(folder / "single" / "multipliers.csv")["abs"][0]
            # both to 1e-9; the expansion is checked to the same
            near(f"sweep as a single run, {speed}, {stiffness}", float(row[2]), rho, 1e-8)


def test_shapes():
    """Sweeps of any shape have the right rows and columns."""
    for rows, columns in ((1, 1), (1, 5), (5, 1), (2, 3)):
        text = axis(FIRST, 200, 200 if rows == 1 else 300, rows) + axis(SECOND, 1e5, 1e5 if columns == 1 else 2e5, columns)
        with Folder(input=SWEEP + text) as folder:
            what = f"grid {rows} x {columns}"
            Run(folder, "-q", "input.nml", "-s", "sweep.columns=rho_max").done(what)
            table = points(folder / "input")
            equal(f"{what}, header", table.header, [FIRST, SECOND, "rho_max"])
            speeds, stiffnesses = table.column(FIRST), table.column(SECOND)
            equal(f"{what}, rows", len(table.rows), rows * columns)
            equal(f"{what}, first parameter slow", speeds, sorted(speeds))
            equal(f"{what}, second parameter fast", stiffnesses, sorted(stiffnesses[:columns]) * rows)
    with Folder(input=SWEEP + "&sweep parameter='frame.mass', from=18, count=1 /\n") as folder:
        Run(folder, "-q", "input.nml").done("one value needs no to")
        equal("one value, rows", len(points(folder / "input").rows), 1)
    with Folder(input=SWEEP + axis("foundation.stiffness(1,1)", 0, 10, 3)) as folder:
        Run(folder, "-q", "input.nml").done("a path with a comma")
        equal("a path with a comma, header", points(folder / "input").header[:2], ["foundation.stiffness(1,1)", "rho_max"])


def test_impossible():
    """A sweep continues past machines that cannot be assembled."""
    # the coupler must reach from the crank's circle to the rocker's: 0.33 - 0.16 to 0.07 + 0.40 - 0.16 and so on
    with Folder(input=SWEEP + axis("joint(B).lengths(1)", 0.1, 0.5, 17)) as folder:
        Run(folder, "-q", "input.nml").done("through a dead point")
        table = points(folder / "input")
        turns = [0.47 - 0.16 < length < 0.33 + 0.16 for length in table.column("joint(B).lengths(1)")]
        equal("through a dead point", [word != "impossible" for word in table.column("verdict")], turns)
        check("impossible, no numbers", all(row[1:4] + row[5:] == ["NaN"] * 6 for row, turn in zip(table.rows, turns) if not turn),
              "NaN", table.rows)
        run = Run(folder, "-q", "input.nml", "--fail-if-unstable")
        equal("impossible is not stable", run.code, 10)
        # the machine of the input itself need not turn
        run = Run(folder, "input.nml", "-s", "joint(B).lengths(1)=0.1")
        run.done("the input itself cannot turn")
        equal("the input itself cannot turn, points", points(folder / "input").rows, table.rows)
        run = Run(folder, "-q", "input.nml", "-s", "joint(B).lengths(1)=0.1", "-s", "case.tasks='sweep','stability'")
        equal("the input itself cannot turn, but is asked for", run.code, 3)
    # no point can turn
    with Folder(input=SWEEP + TWO) as folder:
        Run(folder, "-q", "input.nml", "-s", "joint(B).lengths(1)=0.1").done("no point can turn")
        equal("no point can turn", set(points(folder / "input").column("verdict")), {"impossible"})


def test_nearly_singular():
    """A sweep down to zero inertia ends with verdicts."""
    text = axis("frame.inertia", 1e-14, 1, 15, ", spacing='log'")
    with Folder(input=SWEEP.replace("inertia=0.0060", "inertia=0").replace("inertia=0.0035", "inertia=0")
                .replace("inertia=0.0070", "inertia=0") + text) as folder:
        run = Run(folder, "-q", "input.nml", "-s", "frame.mass=1e-9")
        run.done("M nearly singular")
        words = set(points(folder / "input").column("verdict"))
        check("M nearly singular, verdicts", words <= {"stable", "undecided", "unstable", "failed"}, "verdicts", words)


def test_other_tasks():
    """The group &sweep takes effect only with its task."""
    with Folder(input=SOUND + TWO) as folder:
        Run(folder, "-q", "input.nml").done("&sweep without the task")
        equal("&sweep without the task, files", files(folder / "input"), ["harmonics.csv", "multipliers.csv", "response.csv"])
        run = Run(folder, "input.nml", "-s", "case.tasks='sweep','stability'", "-o", "both")
        run.done("sweep and stability")
        equal("sweep and stability, files", files(folder / "both"), ["multipliers.csv", "sweep.csv"])
        check("sweep and stability, report", "VERDICT" in run.out and "SWEEP" in run.out, "both", run.out)
        run = Run(folder, "input.nml", "-s", "case.tasks='sweep'", "--check")
        run.done("--check of a sweep")
        check("--check of a sweep", "9 points in 1 tile" in run.out, "9 points in 1 tile", run.out)
        run = Run(folder, "-q", "input.nml", "-s", "case.tasks='sweep'", "--fail-if-unstable", "-o", "f")
        equal("all stable", run.code, 0)


# ---- bad inputs ------------------------------------------------------------------------------------------------------

LINE = SWEEP.count("\n") + 1
REFUSED = [
    ("unknown key", axis("drive.speed", 1, 2, 2), "parameter = 'drive.speed': unknown key 'speed': allowed are speed_rpm, speed_hz, held_by, flywheel_inertia"),
    ("unknown group", axis("frme.mass", 1, 2, 2), "parameter = 'frme.mass': unknown group &frme: did you mean &frame?"),
    ("unknown link", axis("link(couplr).mass", 1, 2, 2),
     "parameter = 'link(couplr).mass': unknown link 'couplr'; did you mean 'coupler'?"),
    ("no path", axis("speed", 1, 2, 2),
     "parameter = 'speed': the path must be GROUP.KEY, GROUP(NAME).KEY or GROUP.KEY(INDEX), such as drive.speed_rpm"),
    ("a text", axis("frame.dof", 1, 2, 2), "parameter = 'frame.dof': has a text as its value; only numbers can be varied"),
    ("a whole number", axis("joint(B).branch", -1, 1, 3), "parameter = 'joint(B).branch': has a whole number as its value; only real numbers can be varied"),
    ("several values", axis("frame.origin", 1, 2, 2), "parameter = 'frame.origin': has 2 values; give the path of one of them, for example frame.origin(1)"),
    ("an order", axis("accuracy.tolerance", 1e-9, 1e-3, 2),
     "parameter = 'accuracy.tolerance': &accuracy does not describe the machine; only numbers of the machine can be varied"),
    ("a sweep of a sweep", axis("sweep.from", 1, 2, 2),
     "parameter = 'sweep.from': &sweep does not describe the machine; only numbers of the machine can be varied"),
    ("count 0", axis(FIRST, 1, 2, 0), "count = 0: must be at least 1"),
    ("count negative", axis(FIRST, 1, 2, -3), "count = -3: must be at least 1"),
    ("empty range", axis(FIRST, 1, 1, 2), "to = 1: 'from' and 'to' must differ if there are several values"),
    ("one value, two ends", axis(FIRST, 1, 2, 1), "count = 1: 'from' and 'to' must be equal if there is only one value"),
    ("logarithmic through zero", axis(FIRST, -1, 2, 3, ", spacing='log'"),
     "to = 2: 'from' and 'to' of a logarithmic range must be nonzero and have the same sign"),
    ("too wide for a logarithm", axis("support.angle", 1e-200, 1e200, 3, ", spacing='log'"),
     "to = 1e+200: the range is too wide for double precision"),
    ("unknown spacing", axis(FIRST, 1, 2, 3, ", spacing='lin'"), "spacing = 'lin': unknown; choose from 'linear', 'log'"),
    ("unknown engine", axis(FIRST, 1, 2, 3, ", engine='drect'"), "engine = 'drect': unknown; did you mean 'direct'?"),
    ("unknown column", axis(FIRST, 1, 2, 3, ", columns='verdict','rhomax'"),
     "columns(2) = 'rhomax': unknown; did you mean 'rho_max'?"),
    ("negative mass", axis("frame.mass", -1, 20, 3), "frame.mass = -1: must be positive"),
    ("negative stiffness at the end", axis(SECOND, 10, -10, 3), "support.stiffness = -10: must not be negative"),
    ("speed zero in between", axis(FIRST, -100, 100, 3), "drive.speed_rpm = 0: must not be zero"),
    ("negative length", axis("joint(B).lengths(1)", 0.3, -0.1, 3), "joint(B).lengths(1) = -0.1: must be positive"),
    ("unsymmetric stiffness", axis("foundation.stiffness(1,2)", 0, 5, 3),
     "foundation.stiffness(1,2) = 2.5: must be symmetric, but c12 is 2.5 and c21 is 0"),
    ("from is missing", f"&sweep parameter='{FIRST}', to=2, count=3 /\n", "from: must be given"),
    ("to is missing", f"&sweep parameter='{FIRST}', from=2, count=3 /\n", "to: must be given"),
    ("count is missing", f"&sweep parameter='{FIRST}', from=2, to=3 /\n", "count: must be given"),
    ("parameter is missing", "&sweep from=2, to=3, count=2 /\n", "parameter: must be given"),
]
REFUSED_SECOND = [
    ("too many points", axis(FIRST, 1, 2, 2000000000) + axis(SECOND, 1, 2, 51),
     "&sweep 2: count = 51: gives 102000000000 points in total; at most 100000000000 can be computed"),
    ("the same path twice", axis(FIRST, 1, 2, 2) * 2, "&sweep 2: parameter = 'drive.speed_rpm': is already varied in &sweep 1"),
    ("all and one of them", axis(SECOND, 1, 2, 2) + axis("support(2).stiffness(1)", 1, 2, 2),
     "&sweep 2: parameter = 'support(2).stiffness(1)': is already varied in &sweep 1"),
    ("two engines", axis(FIRST, 1, 2, 3, ", engine='auto'") + axis(SECOND, 1, 2, 3, ", engine='direct'"),
     "&sweep 2: engine = 'direct': differs from 'engine' in &sweep 1; give the same values in both groups"),
    ("two sets of columns", axis(FIRST, 1, 2, 3, ", columns='rho_max'") + axis(SECOND, 1, 2, 3, ", columns='verdict'"),
     "&sweep 2: columns = 'verdict': differs from 'columns' in &sweep 1; give the same values in both groups"),
]


def test_refused():
    """Invalid sweeps are refused and nothing is written."""
    for what, text, message in REFUSED:
        with Folder(input=SWEEP + text) as folder:
            Run(folder, "input.nml", "-q").refused(f"sweep, {what}", 2, f"input.nml:{LINE}: &sweep: {message}")
            equal(f"sweep, {what}: nothing is written", files(folder), ["input.nml"])
    for what, text, message in REFUSED_SECOND:
        with Folder(input=SWEEP + text) as folder:
            Run(folder, "input.nml", "-q").refused(f"sweep, {what}", 2, f"input.nml:{LINE + 1}: {message}")
    with Folder(input=SWEEP + TWO + axis("frame.mass", 1, 2, 2)) as folder:
        Run(folder, "input.nml").refused("three sweeps", 2, f"input.nml:{LINE + 2}: &sweep 3: at most two groups &sweep are "
                                         "allowed, one for each parameter")
    with Folder(input=SWEEP) as folder:
        Run(folder, "input.nml").refused("no &sweep", 2, "input.nml:1: &case: tasks = 'sweep': needs a group &sweep with "
                                         "parameter, from, to and count")
    with Folder(input=SWEEP + TWO) as folder:
        for what, options, code, message in (
                ("--set", ["-s", "sweep(1).from=-1", "-s", "sweep(1).parameter=frame.mass"], 2,
                 f"input.nml:{LINE}: &sweep 1: frame.mass = -1: must be positive"),
                ("--set of a count", ["-s", "sweep(1).count=0"], 2, "--set sweep(1).count=0: must be at least 1"),
                ("part 0", ["--part", "0/3"], 1, "--part 0/3: must be i/n with i from 1 to n, such as 3/8 for the third of eight parts"),
                ("part 4 of 3", ["--part=4/3"], 1, "--part 4/3: must be i/n with i from 1 to n, such as 3/8 for the third of eight parts"),
                ("part and merge", ["--part", "1/3", "--merge"], 1, "options '--part' and '--merge' exclude each other"),
                ("part without a value", ["--part"], 1, "option '--part' needs a value"),
                ("merge without the task", ["--merge", "-s", "case.tasks=response"], 1, "--part and --merge need the task 'sweep'"),
                ("verdict is no column", ["--fail-if-unstable", "-s", "sweep.columns=rho_max"], 1,
                 "--fail-if-unstable needs the column 'verdict' of the sweep"),
                ("one line of nothing", ["--one-line", "-s", "case.tasks=trade"], 1,
                 "--one-line needs one of the tasks 'stability', 'modes', 'response', 'forces', 'power' or 'sweep'")):
            Run(folder, "-q", "input.nml", *options).refused(f"sweep, {what}", code, message)
            equal(f"sweep, {what}: nothing is written", files(folder), ["input.nml"])


# ---- threads and parts -----------------------------------------------------------------------------------------------


def undisturbed(folder):
    run = Run(folder, "-q", "input.nml", "-o", "undisturbed")
    run.done("undisturbed sweep")
    return (folder / "undisturbed" / "sweep.csv").read_bytes() if run.code == 0 else b""


def test_threads():
    """Any number of threads writes the same bytes."""
    for text in (LONG, EXPANDED):
        with Folder(input=SWEEP + text) as folder:
            right = undisturbed(folder)
            for threads in "1234":
                Run(folder, "-q", "input.nml", "-o", threads, environment={"OMP_NUM_THREADS": threads}).done(f"{threads} threads")
                equal(f"{threads} threads, same bytes", (folder / threads / "sweep.csv").read_bytes() == right, True)


def test_parts():
    """Separately computed parts merge to the same bytes."""
    with Folder(input=SWEEP + LONG) as folder:
        right = undisturbed(folder)
        for n in (1, 3, 20):
            output = folder / str(n)
            for i in range(1, n + 1):
                run = Run(folder, "input.nml", "-o", str(n), "--part", f"{i}/{n}", "-s", "case.tasks='sweep','stability'")
                run.done(f"part {i}/{n}")
                check(f"part {i}/{n}, says so", f"Part {i} of {n}" in run.out and "VERDICT" not in run.out, "the part", run.out)
                equal(f"part {i}/{n}, files", files(output), ["sweep.blocks"])
                if i == 1 < n:
                    run = Run(folder, "-q", "input.nml", "-o", str(n), "--merge", "-s", "case.tasks='sweep','stability'")
                    run.refused("merge of too few", 4, re.compile(rf"{n}/sweep\.blocks: \d+ of 16 tiles are missing: [\d, .]+"))
            Run(folder, "-q", "input.nml", "-o", str(n), "--merge", "-s", "case.tasks='sweep','stability'").done(f"{n} parts")
            text = (output / "sweep.csv").read_bytes().replace(b"# set: case.tasks='sweep','stability'\n", b"")
            equal(f"{n} parts, same bytes", text == right, True)
            equal(f"{n} parts, files", files(output), ["sweep.csv"])
        # two at the same time
        runs = [subprocess.Popen([Run.program, "-q", "input.nml", "-o", "both", "--part", f"{i}/2"], cwd=folder) for i in (1, 2)]
        equal("two parts at once", [run.wait() for run in runs], [0, 0])
        Run(folder, "-q", "input.nml", "-o", "both").done("the rest without --merge")
        equal("two parts at once, same bytes", (folder / "both" / "sweep.csv").read_bytes() == right, True)


def test_concurrent_runs():
    """Two runs in one folder at once do not disturb each other."""
    gone = "both/sweep.blocks: no longer exists: another run has finished this sweep, or the folder was removed\n"
    other = "both/sweep.blocks: contains an unfinished sweep of another input; remove this folder " \
        "to start again, or choose another with --output\n"
    with Folder(input=SWEEP + LONG, other=(SWEEP + LONG).replace("mass=18.0", "mass=18.5")) as folder:
        right = undisturbed(folder)
        Run(folder, "-q", "other.nml", "-o", "o").done("the other input")
        tables = {"input.nml": right, "other.nml": (folder / "o" / "sweep.csv").read_bytes()}
        for second in ("input.nml", "other.nml"):
            for trial in range(5):
                shutil.rmtree(folder / "both", ignore_errors=True)
                runs = [subprocess.Popen([Run.program, "-q", name, "-o", "both"], cwd=folder, stderr=subprocess.PIPE)
                        for name in ("input.nml", second)]
                ends = [(run.communicate()[1].decode(), run.returncode) for run in runs]
                # one run may also begin after the other has ended; then it succeeds as well
                name = "input.nml" if ends[0][1] == 0 else second
                equal(f"together with {second}, one goes through", any(end == ("", 0) for end in ends), True)
                check(f"together with {second}, the other reports it", all(end in (("", 0), (gone, 4), (other, 1)) for end in ends),
                      "one line", ends)
                came = (folder / "both" / "sweep.csv").read_bytes()
                good = came in tables.values() if ends[0][1] == ends[1][1] else came == tables[name]
                equal(f"together with {second}, same bytes", good, True)
                equal(f"together with {second}, files", files(folder / "both"), ["sweep.csv"])


# ---- interruptions ---------------------------------------------------------------------------------------------------


# bytes of a mark: head, tile, checksum, summary, checksum
MARK = 8 * (3 + 2 + 17 + 1)


def marks_of(output):
    """The marks of finished tiles, by number."""
    try:
        data = (output / "sweep.blocks" / "marks").read_bytes()
    except FileNotFoundError:
        # removed between two looks: the run is done
        return {}
    found = {i // MARK + 1: data[i:i + MARK] for i in range(0, len(data), MARK)}
    return {tile: mark for tile, mark in found.items() if any(mark)}


def test_killed():
    """A killed sweep resumes and writes the same bytes."""
    chance = random.Random(6)
    with Folder(input=SWEEP + LONG) as folder:
        right = undisturbed(folder)
        for trial in range(5):
            output = folder / f"killed{trial}"
            kept = 0
            for _ in range(200):
                run = subprocess.Popen([Run.program, "-q", "input.nml", "-o", output.name], cwd=folder, stderr=subprocess.PIPE)
                # Shortly after its start, or when it has some more marks, however busy the computer is.
                wanted = kept + chance.randrange(4)
                while run.poll() is None and len(marks_of(output)) < wanted:
                    time.sleep(0.001)
                try:
                    run.wait(chance.uniform(0, 0.02))
                except subprocess.TimeoutExpired:
                    run.send_signal(signal.SIGKILL)
                message = run.communicate()[1]
                if run.returncode == 0:
                    break
                equal(f"killed, trial {trial}", (run.returncode, message), (-signal.SIGKILL, b""))
                check("killed, no half sweep.csv", not (output / "sweep.csv").exists()
                      or (output / "sweep.csv").read_bytes() == right, "none, or all of it", "another")
                blocks = marks_of(output)
                # They go once the table is whole.
                done = (output / "sweep.csv").exists()
                check(f"killed, trial {trial}, blocks stay", len(blocks) >= kept or done or not blocks, f">= {kept}", len(blocks))
                kept = len(blocks)
            equal(f"killed, trial {trial}, same bytes", (output / "sweep.csv").read_bytes() == right, True)
            equal(f"killed, trial {trial}, files", files(output), ["sweep.csv"])


def first_part(folder, output, part="1/2"):
    Run(folder, "-q", "input.nml", "-o", output, "--part", part).done("one part")
    return folder / output / "sweep.blocks"


def test_damaged():
    """Damaged intermediate rows and marks are computed again."""
    with Folder(input=SWEEP + LONG) as folder:
        right = undisturbed(folder)
        head = right.index(b"\n", right.index(b"\ndrive.speed_rpm,") + 1) + 1
        width = (len(right) - head) // 1000

        def bit(place):
            return lambda data: data[:place] + bytes([data[place] ^ 1]) + data[place + 1:]

        # the first part has the odd tiles; the last of them, 15, is second to last in the last band of tiles
        for what, file, change, damaged in (
                ("rows cut off", "rows", lambda data: data[:head + 965 * width], 2),
                ("rows cut off within one", "rows", lambda data: data[:-1], 1),
                ("rows empty", "rows", lambda data: b"", 8),
                ("a bit of a row", "rows", bit(head + 5), 1),
                ("the last bit of a tile's first rows", "rows", bit(head + 10 * width - 1), 1),
                ("a row of another point", "rows", lambda data: data[:head] + data[head + width:head + 2 * width]
                 + data[head + width:], 1),
                ("zeros", "rows", lambda data: bytes(len(data)), 8),
                ("a bit of a mark", "marks", bit(100), 1),
                ("a bit of a mark's head", "marks", bit(8), 1),
                ("marks cut off within one", "marks", lambda data: data[:-8], 0),
                ("marks empty", "marks", lambda data: b"", 0),
                ("marks of other tiles", "marks", lambda data: data[2 * MARK:3 * MARK] + data[MARK:2 * MARK] + data[:MARK]
                 + data[3 * MARK:], 2),
                ("a text", "marks", lambda data: b"gestell " * (len(data) // 8), 15)):
            output = "damaged " + what
            victim = first_part(folder, output) / file
            victim.write_bytes(change(victim.read_bytes()))
            run = Run(folder, "-q", "input.nml", "-o", output)
            note = f"note: {output}/sweep.blocks: {damaged} damaged tile{'s' * (damaged > 1)}: computed again\n" * (damaged > 0)
            equal(f"damaged, {what}", (run.code, run.err), (0, note))
            equal(f"damaged, {what}: same bytes", (folder / output / "sweep.csv").read_bytes() == right, True)


def test_unwritten_rows():
    """An unfinished table contains no wrong rows."""
    with Folder(input=SWEEP + LONG) as folder:
        right = undisturbed(folder)
        data = (first_part(folder, "half") / "rows").read_bytes()
        head = right.index(b"\n", right.index(b"\ndrive.speed_rpm,") + 1) + 1
        width = (len(right) - head) // 1000
        rows = [data[i:i + width] for i in range(head, len(data), width)]
        final = [right[i:i + width] for i in range(head, len(right), width)]
        equal("rows of one width", {(row[-1:], row.count(b"\n")) for row in final}, {(b"\n", 1)})
        equal("half a table: rows so far", sum(map(any, rows)), 500)
        equal("half a table: only correct bytes", all(row in (bytes(width), right) for row, right in zip(rows, final)), True)
        equal("half a table: no heading yet", any(data[:head]), False)


def npy(path):
    """Shape and rows of a file of NumPy, by its description (numpy.lib.format, version 1.0) alone."""
    data = path.read_bytes()
    magic, length = struct.unpack("<8sH", data[:10])
    assert magic == b"\x93NUMPY\x01\x00" and (10 + length) % 64 == 0 and data[9 + length:10 + length] == b"\n", data[:128]
    head = ast.literal_eval(data[10:10 + length].decode("ascii"))
    assert set(head) == {"descr", "fortran_order", "shape"} and head["fortran_order"] is False, head
    points, columns = head["shape"]
    numbers = struct.unpack(f"{head['descr'][0]}{points * columns}d", data[10 + length:])
    return head["shape"], [numbers[i:i + columns] for i in range(0, len(numbers), columns)]


VERDICTS = ["stable", "unstable", "undecided", "impossible", "failed", "undamped"]


def test_npy():
    """NumPy files contain the same numbers as sweep.csv."""
    grids = {"a grid": TWO, "a line through a dead point": axis("joint(B).lengths(1)", 0.1, 0.5, 17), "several tiles": LONG,
             "quantities": TWO.replace("spacing='log'", "spacing='log', columns='log_rho_max','fx','xi_peak_m'")}
    for what, grid in grids.items():
        with Folder(input=SWEEP + grid + (REST if grid != LONG else "")) as folder:
            Run(folder, "-q", "input.nml", "-o", "csv").done(f"npy, {what}: csv")
            Run(folder, "-q", "input.nml", "-s", "sweep.format=npy", "-o", "npy").done(f"npy, {what}")
            equal(f"npy, {what}: files", files(folder / "npy"), ["sweep.npy", "sweep_columns.csv"])
            table = points(folder / "csv")
            shape, rows = npy(folder / "npy" / "sweep.npy")
            expected = [tuple(float(VERDICTS.index(cell)) if name == "verdict" else float(cell)
                              for name, cell in zip(table.header, row)) for row in table.rows]
            equal(f"npy, {what}: shape", shape, (len(table.rows), len(table.header)))
            # NaN is no number, and equals itself as bytes
            pack = [struct.pack(f"{shape[1]}d", *(abs(x) if x != x else x for x in row)) for row in rows]
            equal(f"npy, {what}: the numbers of sweep.csv", pack == [struct.pack(f"{shape[1]}d", *row) for row in expected], True)
            names = [row[1] for row in csv.reader(line for line in (folder / "npy" / "sweep_columns.csv").read_text().splitlines()
                                                  if not line.startswith("#"))]
            equal(f"npy, {what}: names", names, ["name", *table.header])
            for part in ("1/2", "2/2"):
                Run(folder, "-q", "input.nml", "-s", "sweep.format=npy", "-o", "parts", "--part", part).done(f"npy, {what}: one part")
            Run(folder, "-q", "input.nml", "-s", "sweep.format=npy", "-o", "parts", "--merge").done(f"npy, {what}: merged")
            equal(f"npy, {what}: same bytes", (folder / "parts" / "sweep.npy").read_bytes(),
                  (folder / "npy" / "sweep.npy").read_bytes())
            both = [json.loads(Run(folder, "-q", "--json", "input.nml", "-o", form, "-s", f"sweep.format={form}").out)["tables"]
                    for form in ("csv", "npy")]
            equal(f"npy, {what}: the same JSON", both[0]["sweep"] == both[1]["sweep"], True)
            numbers = [[None if x == "NaN" else x if x in VERDICTS else float(x) for x in row] for row in table.rows]
            equal(f"npy, {what}: JSON of the rows", both[0]["sweep"]["rows"] == numbers, True)
    with Folder(input=SWEEP + TWO) as folder:
        run = Run(folder, "input.nml", "-s", "sweep(1).format=npy", "-s", "sweep(2).format=csv")
        run.refused("two formats", 2, re.compile(r".*format.*differs from 'format' in &sweep.*"))


def test_foreign():
    """Intermediate results of another input or version are refused unchanged."""
    other = SWEEP + LONG
    with Folder(input=other, changed=other.replace("mass=18.0", "mass=18.5"),
                same="! mine\n" + other.replace("mass=18.0, ", "\n mass=1.80d1 ! kg\n")) as folder:
        right = undisturbed(folder)
        hint = "; remove this folder to start again, or choose another with --output"
        blocks = first_part(folder, "out")
        before = {path.name: path.read_bytes() for path in blocks.iterdir()}
        for what, options in (("changed", ["changed.nml"]), ("--set", ["input.nml", "-s", "frame.mass=18.5"]),
                              ("another grid", ["input.nml", "-s", "sweep(1).count=41"])):
            run = Run(folder, "-q", *options, "-o", "out")
            run.refused(f"foreign blocks, {what}", 1, "out/sweep.blocks: contains an unfinished sweep of another input" + hint)
            after = {path.name: path.read_bytes() for path in blocks.iterdir()}
            equal(f"foreign blocks, {what}: nothing changed", (files(folder / "out"), after == before), (["sweep.blocks"], True))
        origin = blocks / "origin"
        text = origin.read_text()
        origin.write_text(text.replace(text.splitlines()[0], "0.0.9"))
        run = Run(folder, "-q", "input.nml", "-o", "out")
        check("foreign blocks, version", run.code == 1 and "by version 0.0.9 of gestell (this is version " in run.err and hint in run.err,
              "the version", run.err)
        origin.write_text(text)
        Run(folder, "-q", "same.nml", "-o", "out").done("a sweep with another layout resumes")
        # the head is that of the run that began
        equal("another layout, same bytes", (folder / "out" / "sweep.csv").read_bytes() == right, True)


def limited(size):
    """A limit of `size` bytes per file, like a full disk."""
    def limit():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
    return limit


def test_full_disk():
    """A full disk ends with exit code 4 and keeps finished tiles."""
    with Folder(input=SWEEP + LONG) as folder:
        right = undisturbed(folder)
        # too little space for the rows of any tile, then for the last ones
        for what, size in (("any rows", 512), ("the last rows", len(right) - 1)):
            run = Run(folder, "-q", "input.nml", "-o", what, preexec_fn=limited(size))
            run.refused(f"disk full, {what}", 4, re.compile(rf"{what}/sweep.*: cannot be written: .+"))
            check(f"disk full, {what}: no table", "sweep.csv" not in files(folder / what), "none", files(folder / what))
            kept = len(marks_of(folder / what))
            check(f"disk full, {what}: marks stay", kept == 0 if size == 512 else 0 < kept < 16, "none, or some", kept)
            Run(folder, "-q", "input.nml", "-o", what).done(f"disk full, {what}: with more room")
            equal(f"disk full, {what}: same bytes", (folder / what / "sweep.csv").read_bytes() == right, True)
            equal(f"disk full, {what}: files", files(folder / what), ["sweep.csv"])
        if os.geteuid() == 0 and shutil.which("mount"):
            small_disk(folder, right)
        else:
            print("skipped: a small disk of its own, which only root can mount")


def small_disk(folder, right):
    """A file system that is full after some blocks."""
    disk = folder / "disk"
    disk.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=40k", "none", disk], stderr=subprocess.DEVNULL).returncode:
        print("skipped: a small disk of its own, which cannot be mounted here")
        return
    try:
        run = Run(folder, "-q", "input.nml", "-o", "disk/out")
        run.refused("small disk", 4, re.compile(r"disk/out/sweep.*: cannot be written.*"))
        kept = marks_of(disk / "out")
        check("small disk, some tiles", 0 < len(kept) < 16, "some", len(kept))
        subprocess.run(["mount", "-o", "remount,size=4m", disk], check=True)
        Run(folder, "-q", "input.nml", "-o", "disk/out").done("small disk, with more room")
        equal("small disk, same bytes", (disk / "out" / "sweep.csv").read_bytes() == right, True)
    finally:
        subprocess.run(["umount", disk], check=False)


# ---- for shell scripts -----------------------------------------------------------------------------------------------


def test_one_line():
    """--one-line prints the same numbers as the tables."""
    with Folder(input=SOUND, sweep=SWEEP + TWO) as folder:
        for tasks, columns in (("stability", COLUMNS[:4]), ("response", [*COLUMNS[4:], "verdict"]), ("stability,response", COLUMNS)):
            run = Run(folder, "--one-line", "input.nml", "-s", f"case.tasks={tasks}", "-s", f"{FIRST}=300", "-s",
                      "frame.origin=-0.2,0.2")
            run.done(f"--one-line, {tasks}")
            table = Points(run.out)
            equal(f"--one-line, {tasks}, header", table.header, ["case.tasks", FIRST, "frame.origin", *columns])
            equal(f"--one-line, {tasks}, line", [row[:3] for row in table.rows], [[tasks, "300", "-0.2,0.2"]])
            equal(f"--one-line, {tasks}: no files", files(folder), ["input.nml", "sweep.nml"])
        single = Points(run.out)
        run = Run(folder, "--one-line", "-q", "sweep.nml")
        run.done("--one-line, sweep")
        lines = Points(run.out)
        Run(folder, "-q", "sweep.nml").done("sweep to a file")
        table = points(folder / "sweep")
        equal("--one-line, sweep: as sweep.csv", (lines.header, lines.rows), (table.header, table.rows))
        middle = [row for row in table.rows if float(row[0]) == 300 and abs(float(row[1]) - 1e5) < 1]
        equal("the middle point is listed", len(middle), 1)
        run = Run(folder, "--one-line", "input.nml", "-s", f"{FIRST}={middle[0][0]}", "-s", f"{SECOND}={middle[0][1]}")
        came = Points(run.out)
        for name in COLUMNS[:1] + COLUMNS[4:]:
            right = float(middle[0][table.header.index(name)])
            near(f"--one-line, as the sweep: {name}", came.column(name)[0], right, 1e-7 * abs(right))
        equal("--one-line, another machine", single.rows[0][3:] != came.rows[0][2:], True)
        run = Run(folder, "--one-line", "input.nml", "-s", "foundation.damping=0,0,0", "--fail-if-unstable")
        equal("--one-line --fail-if-unstable", (run.code, Points(run.out).column("verdict")), (10, ["undamped"]))


def test_unwritable_lines():
    """Lines that cannot be written do not count as done."""
    with Folder(input=SOUND, sweep=SWEEP + TWO) as folder:
        for name in ("input.nml", "sweep.nml"):
            if os.path.exists("/dev/full"):
                with open("/dev/full", "w", encoding="ascii") as full:
                    run = Run(folder, "--one-line", name, stdout=full)
                run.refused(f"--one-line {name}, full disk", 4, "standard output cannot be written: No space left on device")
        # 5.6e12 bytes: more than any machine gives
        run = Run(folder, "--one-line", "sweep.nml", "-s", "sweep.count=316000", preexec_fn=limited_memory)
        run.refused("--one-line, memory", 4, "there is not enough memory to hold all points of the sweep at once; omit --one-line")


def limited_memory():
    resource.setrlimit(resource.RLIMIT_AS, (2**36, 2**36))


NEARLY_ISOSCELES = """&case title='slider crank', tasks='stability' /
&drive speed_rpm=60 /
&joint name='O', type='ground', position=0,0 /
&joint name='A', type='crank', pivot='O', radius=0.1 /
&joint name='B', type='RRP', ends='A', lengths=0.10000001, guide_point=0,0, guide_angle=0, branch=1 /
&link name='crank', from='O', to='A', mass=1, inertia=0.001 /
&link name='rod', from='A', to='B', mass=1, inertia=0.001, center=0.05,0 /
&link name='slider', from='B', mass=1, inertia=0 /
&frame mass=50, inertia=2, origin=0,0 /
&support position=-0.2,-0.2, stiffness=1e5,1e5, damping=100,100 /
&support position=0.2,-0.2, stiffness=1e5,1e5, damping=100,100 /
&model frame='rest' /
&accuracy tolerance=0.01 /
"""


def shown_on_terminal(folder, *words):
    """What the program writes to standard error where that is a terminal, and for how many seconds it runs; None: there is no terminal."""
    try:
        leader, follower = os.openpty()
    except OSError:
        print("skipped: what a terminal shows, for there is none")
        return None
    begin = time.monotonic()
    run = subprocess.Popen([Run.program, *words], cwd=folder, stderr=follower)
    os.close(follower)
    shown = b""
    while True:
        try:
            piece = os.read(leader, 4096)
        except OSError:
            break
        if not piece:
            break
        shown += piece
    run.wait()
    os.close(leader)
    return shown, time.monotonic() - begin


def test_progress():
    """A progress bar is shown on terminals only."""
    with Folder(input=SWEEP + LONG.replace("count=25", "count=200") + "&accuracy tolerance=1e-14 /\n") as folder:
        seen = shown_on_terminal(folder, "-q", "input.nml")
        if seen is None:
            return
        shown, seconds = seen
        bars = shown.count(b"points/s")
        check("progress, bars", 1 <= bars <= 10 * seconds + 1, f"1 to {10 * seconds + 1:.0f}", bars)
        check("progress, the line disappears", shown.split(b"\r")[-2].strip() == b"", "blanks", shown[-100:])


def test_slow_machine():
    """The program explains why a machine takes long.

    A slider-crank whose rod l is longer than its crank r by d passes a dead point at the distance sqrt(2 d / r) of the crank angle:
    4.5e-4 here, of which a turn has 14050.
    """
    with Folder(input=NEARLY_ISOSCELES) as folder:
        seen = shown_on_terminal(folder, "-q", "input.nml")
        if seen is None:
            return
        words = seen[0].split(b"\r")
        steps = [int(word.split()[6]) for word in words if word.startswith(b"near a dead point: at least ")]
        check("a slow machine, why", len(steps) == 1 and 14050 <= steps[0] <= 15500, "steps from 14050 to 15500", seen[0][:200])
        check("a slow machine, the line disappears", words[-2].strip() == b"", "blanks", seen[0][-100:])


SWEEP_TESTS = (test_golden, test_as_single_runs, test_shapes, test_impossible, test_nearly_singular, test_other_tasks,
               test_refused, test_threads, test_parts, test_concurrent_runs, test_killed, test_damaged, test_unwritten_rows, test_npy, test_foreign,
               test_full_disk, test_one_line, test_unwritable_lines, test_progress, test_slow_machine)
