"""Quantities by name, as columns of sweeps and on one line, against a rotor's closed form and the task resonance."""

import cmath
import csv
import math
import re

from broken_inputs import REST, SOUND
from harness import Folder, Run, check, equal, files, near
from sweeps import FIRST, LINE, SECOND, SWEEP, Points, axis, points

# An unbalanced rotor on a frame that moves along xi alone: M xi'' + b xi' + c xi = u w^2 cos w t.
MASS, STIFFNESS, DAMPING, UNBALANCE, BAND = 20.0, 80000.0, 200.0, 0.1, 8.0
ROTOR = f"""&case tasks='sweep' /
&model frame='rest' /
&drive speed_rpm=600 /
&joint name='A0', type='ground', position=0,0 /
&joint name='A', type='crank', pivot='A0', radius=0.1 /
&link name='crank', from='A0', to='A', mass=2, inertia=0.01, center=0.05,0 /
&frame mass=18, inertia=1, origin=0,0, dof='xi' /
&support position=0,0, stiffness={STIFFNESS},0, damping={DAMPING},0 /
&probe name='foot', position=0.3,-0.2, band_hz={BAND},1000 /
"""
NAMES = ("fx", "xi", "probe(foot).vx", "probe(foot).v", "guide.fy", "f")


def rotor(rpm, stiffness=STIFFNESS):
    """Peak of each quantity, and of its band (mm/s), in closed form."""
    w = rpm * 2 * math.pi / 60
    load = UNBALANCE * w * w
    xi = load / abs(stiffness - MASS * w * w + 1j * DAMPING * w)
    phase = cmath.phase(1 / (stiffness - MASS * w * w + 1j * DAMPING * w))
    fx = abs(stiffness + 1j * DAMPING * w) * xi
    # the guide takes u w^2 sin w t along y; the tip of the sum runs on an ellipse
    lag = phase + cmath.phase(stiffness + 1j * DAMPING * w)
    square = (fx**2 + load**2) / 2 + abs(fx**2 * cmath.exp(2j * lag) - load**2) / 2
    band = 1000 * w * xi / math.sqrt(2) if w / (2 * math.pi) >= BAND else 0.0
    peaks = {"fx": fx, "xi": xi, "probe(foot).vx": w * xi, "probe(foot).v": w * xi, "guide.fy": load, "f": math.sqrt(square)}
    rms = {name: peak / math.sqrt(2) for name, peak in peaks.items()} | {"f": math.hypot(fx, load) / math.sqrt(2)}
    return peaks, rms, band


UNITS = {"fx": "N", "xi": "m", "probe(foot).vx": "m_s", "probe(foot).v": "m_s", "guide.fy": "N", "f": "N"}


def columns_of(names, measures):
    columns = []
    for name in names:
        for measure in measures:
            if measure == "band" and ").v" not in name:
                continue
            unit = "mm_s" if measure == "band" else UNITS[name]
            columns += [f"{name}_{measure}_{unit}", f"{name}_{measure}_error_{unit}"]
    return columns


def as_rotor(what, table, i, rpm, measures, stiffness=STIFFNESS):
    """Compares row `i` with the closed form within its own errors, which must be small."""
    peaks, rms, band = rotor(rpm, stiffness)
    for name in NAMES:
        for measure, right in (("peak", peaks[name]), ("rms", rms[name]), ("band", band)):
            unit = "mm_s" if measure == "band" else UNITS[name]
            if measure not in measures or measure == "band" and ").v" not in name:
                continue
            came = table.column(f"{name}_{measure}_{unit}")[i]
            error = table.column(f"{name}_{measure}_error_{unit}")[i]
            # the bound, plus rounding of the closed form
            near(f"{what}, {name} {measure} at {rpm}", came, right, error + 1e-12 * abs(right))
            check(f"{what}, error of {name} {measure} at {rpm}", 0 <= error < 1e-6 * max(peaks[name], 1e-3 * band), "small", error)


def test_closed_form():
    """Swept quantities of a rotor agree with the closed form."""
    ordered = ",".join(f"'{name}'" for name in NAMES)
    for measures in (["peak"], ["peak", "rms", "band"], ["band"]):
        words = ",".join(f"'{measure}'" for measure in measures)
        groups = axis(FIRST, 300, 900, 13, f", columns={ordered}, measures={words}")
        with Folder(input=ROTOR + groups) as folder:
            Run(folder, "-q", "input.nml").done("rotor, sweep")
            table = points(folder / "input")
            equal("rotor, header", table.header, [FIRST, "verdict", *columns_of(NAMES, measures)])
            for i, rpm in enumerate(table.column(FIRST)):
                as_rotor("rotor", table, i, rpm, measures)
    # over two parameters, in parts and by one process; the number of threads does not matter
    groups = axis(FIRST, 300, 900, 5) + axis(SECOND, 4e4, 9e4, 4, f", columns='rho_max',{ordered}")
    groups = groups.replace("'support.stiffness'", "'support.stiffness(1)'")
    with Folder(input=ROTOR + groups) as folder:
        Run(folder, "-q", "input.nml", "-s", "sweep(2).measures=rms").done("rotor, grid")
        table = points(folder / "input")
        for i, (rpm, stiffness) in enumerate(zip(table.column(FIRST), table.column("support.stiffness(1)"))):
            as_rotor("rotor, grid", table, i, rpm, ["rms"], stiffness)
        for part in ("2/2", "1/2"):
            Run(folder, "-q", "input.nml", "-s", "sweep(2).measures=rms", "-o", "parts", "--part", part).done("rotor, part")
        Run(folder, "-q", "input.nml", "-s", "sweep(2).measures=rms", "-o", "parts", "--merge",
            environment={"OMP_NUM_THREADS": "1"}).done("rotor, merged")
        equal("rotor, parts", (folder / "parts" / "sweep.csv").read_bytes() == (folder / "input" / "sweep.csv").read_bytes(), True)


def test_as_resonance():
    """Swept quantities agree with the task resonance.

    The other columns are those of a sweep without quantities.
    """
    desk = "&probe name='desk, left', position=0.3,0.25 /\n"
    names = "'f','support(2).fx','probe(desk, left).ay'"
    text = SWEEP + desk + f"&resonance quantities={names} /\n"
    with Folder(input=text + axis(FIRST, 340, 400, 4, f", columns='rho_max','psi_peak_rad',{names}, measures='peak','rms'"),
                plain=SWEEP + axis(FIRST, 340, 400, 4, ", columns='rho_max','psi_peak_rad', engine='direct'")) as folder:
        Run(folder, "-q", "input.nml").done("quantities and other columns")
        Run(folder, "-q", "plain.nml").done("the other columns")
        Run(folder, "-q", "input.nml", "-s", "case.tasks=resonance", "-o", "curve").done("the task resonance")
        table, plain = points(folder / "input"), points(folder / "plain")
        equal("with other columns, header", table.header[:4], [FIRST, "rho_max", "psi_peak_rad", "verdict"])
        equal("with other columns, the same", [row[:2] + row[3:4] for row in table.rows],
              [row[:2] + row[3:4] for row in plain.rows])
        rows = list(csv.reader(line for line in (folder / "curve" / "resonance.csv").open() if not line.startswith("#")))
        curve = {float(row[0]): dict(zip(rows[0], row)) for row in rows[1:]}
        for row in table.rows:
            right = curve[float(row[0])]
            for name, came in list(zip(table.header, row))[4:]:
                if "_rms_error" not in name:
                    equal(f"as resonance.csv, {name} at {row[0]}", came, right[name])


def test_no_vibration():
    """Quantities are NaN where there is no vibration.

    In an undamped resonance, and where the mechanism does not turn.
    """
    with Folder(input=ROTOR.replace(f"damping={DAMPING}", "damping=0")
                + axis(FIRST, 300, 900, 3, ", columns='fx','probe(foot).vx'")) as folder:
        # the natural frequency, to the last typed digit
        resonant = repr(math.sqrt(STIFFNESS / MASS) * 60 / (2 * math.pi))
        Run(folder, "-q", "input.nml", "-s", f"sweep.from={resonant}", "-s", "sweep.to=900", "-s", "sweep.count=2").done("resonance")
        table = points(folder / "input")
        equal("in resonance", table.rows[0][2:], ["NaN"] * 4)
        check("near resonance", "NaN" not in table.rows[1], "numbers", table.rows[1])
    with Folder(input=SWEEP + axis("joint(B).lengths(1)", 0.1, 0.5, 5, ", columns='f','guide.m','support(4).fx'")) as folder:
        Run(folder, "-q", "input.nml", "-s", "joint(B).lengths(1)=0.1").done("quantities of machines that do not turn")
        table = points(folder / "input")
        equal("impossible, numbers", [row[2] == "NaN" for row in table.rows],
              [word == "impossible" for word in table.column("verdict")])
        check("impossible, some points", "stable" in table.column("verdict"), "some turn", table.rows)


REFUSED = [
    ("no quantity", ", columns='verdict','fz'", re.compile(r"columns\(2\) = 'fz': unknown quantity 'fz': use xi, .*, m, f, "
     r"support\(1\)\.fx .*; other columns are rho_max, .*, psi_peak_rad")),
    ("no such support", ", columns='support(5).f'", re.compile(r"columns\(1\) = 'support\(5\)\.f': .*to 4\).*")),
    ("nearly a column", ", columns='xi_pek_m'", "columns(1) = 'xi_pek_m': unknown; did you mean 'xi_peak_m'?"),
    ("twice", ", columns='f','rho_max','f'", "columns(3) = 'f': column 'f' is named twice"),
    ("unknown measure", ", columns='f', measures='men'", "measures(1) = 'men': unknown; choose from 'peak', 'rms', 'band'"),
    ("no band", ", columns='f','xi_dot', measures='band'",
     "measures = 'band': 'band' is available only for velocities of probes: probe(NAME).v, .vx, .vy, in space .vz"),
    ("measures of nothing", ", columns='verdict', measures='rms'", "measures = 'rms': applies to quantities, but no quantity is requested"),
]


def test_refused():
    """Invalid quantities and measures are refused."""
    for what, words, message in REFUSED:
        with Folder(input=SWEEP + axis(FIRST, 100, 200, 3, words)) as folder:
            before = f"input.nml:{LINE}: &sweep: "
            if isinstance(message, str):
                message = re.escape(message)
            else:
                message = message.pattern
            Run(folder, "-q", "input.nml").refused(f"quantities, {what}", 2, re.compile(re.escape(before) + message))
            equal(f"quantities, {what}: nothing is written", files(folder), ["input.nml"])
    groups = axis(FIRST, 1, 2, 3, ", columns='f', measures='peak'") + axis(SECOND, 1, 2, 3, ", measures='rms'")
    with Folder(input=SWEEP + groups) as folder:
        Run(folder, "input.nml").refused("two sets of measures", 2, f"input.nml:{LINE + 1}: &sweep 2: measures = 'rms': differs "
                                         "from 'measures' in &sweep 1; give the same values in both groups")
    with Folder(input=SOUND) as folder:
        for setting, message in (("response.quantities=fz", "unknown quantity 'fz': use xi, "),):
            text = SOUND + "&response quantities='f' /\n"
            (folder / "input.nml").write_text(text)
            run = Run(folder, "-q", "input.nml", "-s", setting)
            check("response, no quantity", run.code == 2 and run.err.startswith(f"--set {setting}: {message}"), message, run.err)
        Run(folder, "-q", "input.nml", "-s", "response.quantities=f,f").refused(
            "response, twice", 2, "--set response.quantities=f,f: names 'f' twice")


def test_of_one_machine():
    """Quantities of a single machine agree in table, report and line."""
    names = ",".join(f"'{name}'" for name in NAMES)
    words = f"&response quantities={names}, measures='peak','rms','band' /\n"
    with Folder(input=ROTOR.replace("'sweep'", "'response'") + words) as folder:
        run = Run(folder, "input.nml")
        run.done("quantities of one machine")
        rows = [line.split(",") for line in (folder / "input" / "quantities.csv").read_text().splitlines() if line[0] != "#"]
        equal("quantities.csv, header", rows[0], ["quantity", "measure", "unit", "value", "error"])
        peaks, rms, band = rotor(600)
        equal("quantities.csv, rows", len(rows) - 1, 2 * len(NAMES) + 2)
        for name, measure, unit, value, error in rows[1:]:
            right = {"peak": peaks.get(name), "rms": rms.get(name), "band": band}[measure]
            near(f"quantities.csv, {name} {measure}", float(value), right, float(error) + 1e-12 * right)
            equal(f"quantities.csv, unit of {name} {measure}", unit.replace("/", "_"), "mm_s" if measure == "band" else UNITS[name])
        check("quantities, report", "QUANTITIES" in run.out and re.search(r"\n  probe\(foot\)\.vx +band +1391 +\S+ ", run.out),
              "a section", run.out)
        line = Run(folder, "--one-line", "-s", f"{FIRST}=600", "-s", "case.tasks=response,forces", "input.nml")
        line.done("quantities on one line")
        came = Points(line.out)
        equal("one line, no name twice", len(set(came.header)), len(came.header))
        for name, right in peaks.items():
            near(f"one line, {name}", came.column(f"{name}_peak_{UNITS[name]}")[0], right, 1e-9 * right)
        near("one line, band", came.column("probe(foot).v_band_mm_s")[0], band, 1e-9 * band)
        equal("one line, verdict last", came.header[-1], "verdict")
        # where there is no vibration there is no number
        none = Run(folder, "--one-line", "-s", "support.damping=0,0", "-s",
                   f"drive.speed_rpm={math.sqrt(STIFFNESS / MASS) * 60 / (2 * math.pi)!r}", "-s", "case.tasks=stability,response",
                   "input.nml")
        equal("one line, resonance", (none.code, Points(none.out).rows[0][Points(none.out).header.index("fx_peak_N")]), (4, "NaN"))


def test_settings_of_a_sweep():
    """--one-line of a sweep lists the settings before its points."""
    with Folder(input=SWEEP + REST + axis(FIRST, 200, 300, 3, ", columns='verdict','f'")) as folder:
        plain = Points(Run(folder, "--one-line", "input.nml").out)
        run = Run(folder, "--one-line", "-s", "frame.mass=18", "-s", "frame.origin=-0.2,0.2", "input.nml")
        run.done("one line of a sweep, with settings")
        table = Points(run.out)
        equal("settings, header", table.header, ["frame.mass", "frame.origin", *plain.header])
        equal("settings, rows", table.rows, [["18", "-0.2,0.2", *row] for row in plain.rows])
        equal("settings, numbers", len(plain.rows), 3)


QUANTITY_TESTS = [test_closed_form, test_as_resonance, test_no_vibration, test_refused, test_of_one_machine,
                  test_settings_of_a_sweep]
