"""Whole runs of every task against stored records that a developer has reviewed: reports, tables, pictures' scripts, the page.

A record does not prove that a number is right; other tests do. It protects what no other test checks: words, columns, units, remarks,
which curve a picture draws, and that bounds are still there and of the same size. After an intended change,
`run.py PROGRAM records --write-golden` replaces the records; review the differences.
"""

import csv
import io
import json
import math
import re
from pathlib import Path

from broken_inputs import REST, SOUND
from broken_mechanisms import FUNCTIONS
from critical import NEEDLE
from design import PLACES, ROTOR
from harness import Folder, Run, check, equal
from several_mechanisms import CYLINDER, own
from units import machine

HERE = Path(__file__).resolve().parent
RECORDS = HERE / "golden" / "records"
DATA = HERE.parents[1] / "data"
SHORT = "&response points=12, harmonics=3 /\n"
ROCKING = (DATA / "rocking_sieve.nml").read_text()
SPEEDS = "&sweep parameter='drive.speed_rpm', from={}, to={}, count={} /\n"
DAMPED = SOUND.replace("0.5,0.5,0.05", "10.0,10.0,1.0") + REST
EXACT = SOUND.replace("0.5,0.5,0.05", "10.0,10.0,1.0")
INERTIAS = "&sweep parameter='frame.inertia', from=2, to=3, count=3 /\n"
YOKE = (HERE.parents[1] / "validation" / "exudyn" / "scotch_yoke.nml").read_text()
# In place of the tasks: the run with --check, which reports the mechanism.
CHECK = "--check"
PROBE = "&probe name='p', position=0.1,0.15, band_hz=2,40, limit_mm_s=20 /\n"


def data(name, more=SHORT):
    return (DATA / f"{name}.nml").read_text() + more


# A small part of the chart, solved by expansions.
EXPANDED = data("khang_chart", "").replace("from=100.0, to=500.0, count=1000", "from=150, to=160, count=9, engine='expansion'").replace(
    "from=49033.25, to=392266.0, count=1000", "from=150000, to=155000, count=8").replace("1e-9", "1e-6").replace(
    "='rho_max'", "='rho_max','verdict','xi_peak_m'")
ENGINE_FRAME = """\
&case title='copies' /
&drive speed_rpm=600, held_by='flywheel', flywheel_inertia=0.4 /
&frame mass=60, inertia=1.5, origin=0,0.1, dof='xi','eta','psi' /
&foundation stiffness=4e5,0,0,0,3e5,0,0,0,2e4, damping=1800,1500,90 /
&gravity /
"""
DESIGN = """\
&design parameter='support.stiffness', from=1e5, to=4e5, starts=2 /
&design parameter='foundation.damping(3)', from=0.5, to=20 /
&objective quantity='probe(p).v', measure='band' /
&constraint quantity='f', measure='peak', at_most=400 /
&constraint quantity='support(1).fy', at_most=100 /
&constraint quantity='separation', at_least=2 /
"""

# Name, input, tasks.
RUNS = {
    "machine": (data("compressor"), "stability modes response forces power drawing balance separation sensitivity"),
    "space": (data("engine_in_space"), "stability modes response forces power separation"),
    "averaged": (SOUND + "&model coefficients='averaged' /\n" + SHORT, "stability modes response forces"),
    "cam": (data("cam_press", SHORT + "&gravity /\n"), "stability response separation drawing"),
    "rotor": (ROTOR + "&gravity /\n" + SHORT, "stability modes response"),
    "shaper": (data("shaper"), "stability response"),
    "space_drawing": (data("engine_in_space"), "drawing"),
    "powertrain": (data("powertrain"), "stability separation"),
    "trade": (DAMPED, "trade"),
    "trade_in_space": (data("engine_in_space"), "trade"),
    "speeds": (NEEDLE + REST + SPEEDS.format(2000, 4000, 9), "campbell critical resonance"),
    "sweep": (DAMPED + SPEEDS.format(200, 300, 4), "sweep"),
    "chart": (ROCKING + SPEEDS.format(120, 300, 4) + "&sweep parameter='frame.inertia', from=2, to=3, count=3 /\n", "sweep"),
    "logarithmic": (DAMPED + SPEEDS.format(200, 300, 3) + "&sweep parameter='foundation.damping(1)', from=300, to=0.2, count=4, "
                    "spacing='log' /\n", "sweep"),
    "borders": (ROCKING + SPEEDS.format(120, 300, 7), "boundary"),
    "level": (DAMPED + SPEEDS.format(240, 300, 3) + "&boundary quantity='f', measure='rms', level=60 /\n", "boundary"),
    "branches": (YOKE + SPEEDS.format(643, 650, 2), "boundary"),
    "several": (YOKE.replace("speed_rpm=", "speed_rpm=648.9 ! ") + "&model vibrations='all' /\n" + SHORT, "stability response"),
    "level_mass": (DAMPED + "&sweep parameter='frame.mass', from=30, to=60, count=3 /\n"
                   "&boundary quantity='f', measure='rms', level=50 /\n", "boundary"),
    "map": (ROCKING + REST + SPEEDS.format(200, 250, 3) + INERTIAS, "boundary"),
    "map_exact": (ROCKING + SPEEDS.format(200, 250, 3) + INERTIAS, "boundary"),
    "level_map": (DAMPED + SPEEDS.format(250, 330, 3) + "&sweep parameter='frame.mass', from=40, to=50, count=3 /\n"
                  "&boundary quantity='f', measure='rms', level=60 /\n", "boundary"),
    "first_order": (EXACT + "&model frame='first_order' /\n" + SHORT, "stability response"),
    "stiff": (EXACT + "&support position=0.1,0.3, stiffness=1e9,2e5, damping=100,10 /\n" + PROBE + SHORT,
              "stability modes response forces"),
    "steps": (DAMPED + "&accuracy method='gauss4', steps=60 /\n" + SHORT, "stability response"),
    "explicit": (DAMPED + "&accuracy method='rk4', tolerance=1e-6 /\n" + SHORT, "stability response"),
    "commutators": (DAMPED + "&accuracy method='magnus6' /\n" + SHORT, "stability response"),
    "copies": (ENGINE_FRAME + "&mechanism name='one', phase=90 /\n" + own(CYLINDER, "one")
               + "&repeat of='one', name='two', phase=180, angle=90 /\n&repeat of='one', name='balancer', ratio=-2, origin=0.1,0 /\n"
               + PROBE + SHORT, "stability response forces power balance"),
    "space_speeds": (data("engine_in_space", "&accuracy tolerance=1e-6 /\n" + SPEEDS.format(900, 1300, 3)),
                     "campbell critical sweep"),
    "design_exact": (EXACT + PROBE + "&accuracy tolerance=1e-5 /\n" + DESIGN, "design"),
    "design_speeds": (ROTOR + PLACES.replace("0.08", "0.04") + SPEEDS.format(550, 650, 3) + "&objective quantity='fx', "
                      "measure='peak' /\n&objective quantity='torque', measure='peak', weight=0.1 /\n"
                      "&constraint quantity='xi', measure='peak', at_most=2.0e-3 /\n", "design"),
    # the counterweight's mass counts as much as the force: the limit is active at one end of the range of speeds
    "design_range_limit": (ROTOR + PLACES.replace("0.08 /", "0.08, starts=2 /", 1) + "&design parameter='link(cw).mass', from=0.2, to=1 /\n"
                           + SPEEDS.format(550, 650, 3) + "&objective quantity='added_mass' /\n"
                           "&constraint quantity='xi', measure='peak', at_most=3.0e-3 /\n", "design"),
    "design": (ROTOR + PLACES.replace("0.08", "0.03") + "&objective quantity='fx' /\n&constraint quantity='xi', at_most=1.0e-3 /\n",
               "design"),
    # above its resonance a damper raises the force on the ground and lowers the vibration
    "design_curve": (ROTOR + PLACES.replace("0.08", "0.02") + "&design parameter='foundation.damping(1)', from=40, to=1000, starts=2 /\n"
                     "&objective quantity='fx', trade_off=4 /\n&objective quantity='xi', measure='peak' /\n", "design"),
    "design_conflict": (ROTOR + PLACES.replace("0.08", "0.03").replace("to=0.03 /", "to=0.03, starts=1 /", 1)
                        + "&objective quantity='fx' /\n&constraint quantity='fx', at_most=1 /\n", "design"),
    "joints": (data("compressor"), "joints matrices"),
    "joints_in_space": (data("engine_in_space"), "joints"),
    "units": (machine(True, results=", results='input'"), "response forces power joints drawing"),
    "resonances": (NEEDLE + REST + SPEEDS.format(400, 900, 3), "campbell critical separation"),
    "measured": (FUNCTIONS + SHORT, "stability modes response forces separation"),
    "expansion": (EXPANDED, "sweep"),
    "averaged_equations": (SOUND + "&model coefficients='averaged' /\n" + SHORT, "matrices joints"),
    # the machine of the input cannot be assembled, those of the sweep can
    "impossible": (DAMPED.replace("lengths=0.37", "lengths=0.10") + "&sweep parameter='joint(B).lengths(1)', from=0.36, to=0.38, count=3, "
                   "columns='verdict','xi_peak_m','xi' /\n", "sweep"),
    "large_motions": (ROCKING + REST + SPEEDS.format(220, 240, 3), "sweep"),
    "undamped": (ROTOR.replace("damping=40.0,", "damping=0,") + SPEEDS.format(420, 520, 3) + SHORT,
                 "stability modes campbell critical separation resonance"),
    "unstable": (ROCKING + SHORT, "stability modes response forces"),
    **{f"check_{name}": (data(name, ""), CHECK) for name in ("compressor", "engine_in_space", "cam_press", "powertrain", "shaper",
                                                             "watt_six_bar", "v_twin", "suspended_compressor")},
}
# A number, but not the digit of a name.
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w(])")


def recorded(what, folder):
    """Lines of the record: the report, each table's heading, columns, middle and last row, each script from its heading on."""
    tasks = RUNS[what][1]
    options = [CHECK] if tasks == CHECK else ["--json", "-o", "out", "-s", "case.tasks=" + ",".join(f"'{task}'" for task in tasks.split())]
    run = Run(folder, "--verbose", *options, "input.nml")
    equal(f"record {what}", (run.code, run.err), (0, ""))
    if run.code:
        return []
    # Measured times differ from run to run, and so do the rows.
    timed = tasks == "trade"
    report = ["== report", *(untimed(run.out) if timed else run.out.splitlines())]
    lines = []
    results = {} if tasks == CHECK else json.loads((folder / "out" / "results.json").read_text())["tables"]
    for name, table in results.items():
        head = [line for line in (folder / "out" / f"{name}.csv").read_text().splitlines() if line[:1] == "#" and "version" not in line]
        lines += [f"== {name}.csv, {table['heading']}", *head]
        columns = table["columns"]
        lines += ["keys " + json.dumps([column["key"] for column in columns], ensure_ascii=False),
                  "errors " + json.dumps([column["error"] for column in columns if column["error"]], ensure_ascii=False)]
        lines += dict.fromkeys(f"unit {column['unit']}, meaning {column['meaning']}" for column in columns)
        rows = table["rows"]
        listed = sorted({len(rows) // 2, len(rows) - 1}) if rows else []
        compare_files(f"record {what}, {name}.csv", folder / "out" / f"{name}.csv", [column["key"] for column in columns], rows, listed)
        lines += ["row " + json.dumps(rows[i], ensure_ascii=False) for i in listed if not timed]
        script = (folder / "out" / f"{name}.gp")
        if script.exists():
            # the lines of a scene are pixels; test/cli/animation.py checks them
            text = re.sub(r"(?s)(\$scene << END\n).*?\nEND\n", r"\1END\n", script.read_text())
            lines += [f"== {name}.gp", *text.partition("heading = ")[2].splitlines()]
    if timed:
        lines = [NUMBER.sub("#", line) for line in lines]
    return [" ".join(line.split()) for line in report + lines]


def untimed(report):
    """The lines of the task `trade` that compare models, without times and without differences of |rho|, which may be as small as
    their errors."""
    lines = report.partition("PERIODIC OR AVERAGED")[2].splitlines()
    return [re.sub(r"(stable .*) \S+$", r"\1", line) for line in lines if "time" not in line and "|rho| " not in line]


def compare_files(what, file, keys, rows, listed):
    """Checks that a table's CSV file has the keys, the number of rows and the listed rows of results.json."""
    text = "\n".join(line for line in file.read_text().split("\n") if line[:1] != "#")
    head, *body = csv.reader(io.StringIO(text))
    equal(f"{what}: keys and number of rows", (head, len(body)), (keys, len(rows)))
    for i in listed[:len(body)]:
        cells = [cell if isinstance(value, str) else None if cell == "NaN" else float(cell) for cell, value in zip(body[i], rows[i])]
        equal(f"{what}: row {i}", cells, rows[i])


def write_records():
    RECORDS.mkdir(parents=True, exist_ok=True)
    for what in RUNS:
        with Folder(input=RUNS[what][0]) as folder:
            (RECORDS / f"{what}.txt").write_text("\n".join(rounded(line) for line in recorded(what, folder)) + "\n")


def rounded(line):
    """A row rounded to five digits, as in the record."""
    if not line.startswith("row ["):
        return line
    return re.sub(r"(?<![\d.])[-+]?\d+\.\d{9,}(?:[eE][-+]?\d+)?", lambda m: f"{float(m[0]):.5g}", line)


def alike(came, right):
    """True if numbers of a report agree to three digits; defects and bounds as small as rounding errors within a factor of 3."""
    came, right = abs(float(came)), abs(float(right))
    if max(came, right) < 1e-6:
        return max(came, right) < 1e-13 or max(came, right) <= 3.5 * min(came, right)
    return abs(came - right) <= 2e-3 * max(came, right)


def record_test(what):
    """A test that compares one run with its record."""
    def test():
        compare(what)
    test.__doc__ = f"The run '{what}' agrees with its stored record."
    test.__name__ = f"test_{what}"
    return test


def compare(what):
    """Compares a run with its stored record, line by line."""
    with Folder(input=RUNS[what][0]) as folder:
        came = recorded(what, folder)
    right = (RECORDS / f"{what}.txt").read_text().splitlines()
    if not came:
        return
    equal(f"record {what}: lines", len(came), len(right))
    place, keys, errors = "", [], []
    for one, two in zip(came, right):
        if two.startswith("== "):
            place, keys, errors = two[3:], [], []
        if two.startswith("keys ["):
            keys = json.loads(two[5:])
        if two.startswith("errors ["):
            errors = json.loads(two[7:])
        if two.startswith("row [") and one.startswith("row ["):
            compare_rows(f"record {what}, {place}", json.loads(one[4:]), json.loads(two[4:]), keys, errors)
            continue
        good = NUMBER.sub("#", one) == NUMBER.sub("#", two) and all(map(alike, NUMBER.findall(one), NUMBER.findall(two)))
        check(f"record {what}, {place}", good, two, one)


def compare_rows(what, came, right, keys, errors):
    """Compares a row with the recorded one: bounds within a factor of 3; bounded values and all others within a thousandth of
    the row's largest number in that unit. Phases of negligible amplitudes are skipped."""
    equal(f"{what}: width", len(came), len(right))
    for i, (key, one, two) in enumerate(zip(keys, came, right)):
        if "phase" in key or not isinstance(two, (int, float)) or isinstance(one, str):
            if "phase" not in key:
                equal(f"{what}: {key}", one, two)
        elif key in errors:
            check(f"{what}: {key}", alike(one, two) if max(abs(one), abs(two)) < 1e-6 else two / 3 <= one <= 3 * two, two, one)
        else:
            scale = max(abs(other) for other in right if isinstance(other, (int, float)))
            check(f"{what}: {key}", abs(one - two) <= 1e-3 * abs(two) + 1e-12 * scale, two, one)


RECORD_TESTS = tuple(map(record_test, RUNS))
