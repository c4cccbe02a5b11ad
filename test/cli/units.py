"""Units of the input and of the results: machines in US units, results in the units of the input, limits, pictures, messages."""

import math
import re
from pathlib import Path

from harness import SVG_ONLY, Folder, Run, check, equal, near

# NIST Special Publication 811 (2008), Appendix B: exact.
INCH, POUND, GRAVITY = 0.0254, 0.45359237, 9.80665
LBF = POUND * GRAVITY
FOOT, SLUG, PSI = 12 * INCH, LBF / (12 * INCH), LBF / INCH ** 2

# A machine with every kind of quantity. {name:number} is a number in the unit that UNITS gives to the name; "us" stays as typed.
MACHINE = """&case title='Both worlds', tasks={tasks} /
&drive {speed}, held_by='flywheel', flywheel_inertia={inertia:40} /
&joint name='O', type='ground', position={length:1},0 /
&joint name='A', type='crank', pivot='O', radius={length:2} /
&joint name='B', type='RRP', ends='A', lengths={length:8}, guide_point={length:1},0, guide_angle=90, branch=1 /
&link name='crank', from='O', to='A', mass={mass:9}, inertia={inertia:20}, center={length:-0.2},{length:0.1} /
&link name='rod', from='A', to='B', mass={mass:1.2}, inertia={inertia:10}, center={length:2.5},0 /
&link name='piston', from='B', mass={mass:1.1}, inertia={inertia:1.5} /
&load name='gas', on='piston', joint='B', type='polytropic', direction=180, bore={length:2.5}, clearance=0.06,
      suction={pressure:14}, discharge={pressure:90}, ambient={pressure:14.5} /
&load name='pressure', on='piston', joint='B', axes='guide', force={table:5},{table:2},{table:1}, area={area:3} /
&load name='push', on='frame', point={length:3},{length:-2}, force=0,{force:4},0, direction=30, moment=0,{moment:6},{moment:2} /
&frame mass={mass:110}, inertia={inertia:6000}, origin={length:-1},{length:2} /
&gravity acceleration={acceleration:386}, direction=-80 /
&support position={length:-8},{length:-10}, stiffness={stiffness:340},{stiffness:680}, damping={damping:4},{damping:6} /
&support position={length:8},{length:-10}, stiffness={stiffness:340},{stiffness:680}, damping={damping:4},{damping:6} /
&foundation stiffness={stiffness:30},0,{force:12}, 0,{stiffness:50},0, {force:12},0,{moment:4000},
            damping={damping:0.5},{damping:0.4},{rotary_damping:9} /
&probe name='bearing 5 mm', position={length:1},{length:3}, {limit} /
"""
SI = dict(length=INCH, mass=POUND, inertia=POUND * INCH ** 2, stiffness=LBF / INCH, force=LBF, moment=LBF * INCH,
          damping=LBF * 1 / INCH, rotary_damping=LBF * INCH, pressure=PSI / 1e5, table=PSI, area=INCH ** 2, acceleration=INCH)
US = ("&units length='in', mass='lb', inertia='lb in^2', stiffness='lbf/in', force='lbf', moment='lbf in', damping='lbf s/in', "
      "rotary_damping='lbf in s', pressure='psi', area='in^2', acceleration='in/s^2'{0} /\n")
# (unit of results, suffix of its columns, unit in US units, suffix, factor)
COLUMNS = {"m": ("in", INCH), "m_s": ("in_s", INCH), "m_s2": ("in_s2", INCH), "mm_s": ("in_s", 1000 * INCH), "N": ("lbf", LBF),
           "Nm": ("lbfin", LBF * INCH), "kg": ("lb", POUND), "kg_m": ("lbin", POUND * INCH)}
LISTED = {"m": ("in", INCH), "m/s": ("in/s", INCH), "mm/s": ("in/s", 1000 * INCH), "N": ("lbf", LBF), "Nm": ("lbf in", LBF * INCH),
          "kg": ("lb", POUND)}
UNITS_OF_TEXT = re.compile(r"(?<![\w.])-?\d[\d.e+-]* (?:mm|m|N|N m|kg|kg m\^2|kg mm|mm/s|m/s|m/s\^2)(?![\w^/])")


def machine(us, tasks="'stability','response','forces','power','joints'", results=""):
    """The input in US units or, with hand-made conversions, in SI units."""
    def number(found):
        value = float(found[2])
        return found[2] if us else repr(value * SI[found[1]])

    text = MACHINE.replace("{tasks}", tasks)
    text = text.replace("{speed}", "speed_hz=24" if us else "speed_rpm=1440")
    text = text.replace("{limit}", "limit_in_s=4" if us else "limit_mm_s=101.6")
    return (US.format(results) if us else "") + re.sub(r"\{(\w+):([-0-9.]+)\}", number, text)


def tables(folder):
    """All CSV files of a folder: for each the keys and the rows of words."""
    found = {}
    for path in sorted(folder.glob("*.csv")):
        lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
        found[path.name] = (lines[0].split(","), [line.split(",") for line in lines[1:]])
    return found


def number(word):
    try:
        return float(word)
    except ValueError:
        return None


def test_machine_in_us_units():
    """A machine described in US units has the results of the machine described in SI units."""
    with Folder(us=machine(True), si=machine(False)) as folder:
        if not (Run(folder, "us.nml").done("us") and Run(folder, "si.nml").done("si")):
            return
        us, si = tables(folder / "us"), tables(folder / "si")
        equal("tables", sorted(us), sorted(si))
        for name, (keys, rows) in us.items():
            equal(f"{name}: columns", keys, si[name][0])
            for k, key in enumerate(keys):
                ours, theirs = ([number(row[k]) for row in some] for some in (rows, si[name][1]))
                if None in ours + theirs or "error" in key or "phase" in key:
                    continue
                # products of rounded factors, which the solution amplifies less than a thousand times; zeros are rounding errors
                allowed = 1e-12 * max([1e-3] + [abs(x) for x in theirs if x == x and abs(x) < math.inf])
                worst = max([abs(a - b) for a, b in zip(ours, theirs) if a == a and abs(a) < math.inf] or [0])
                check(f"{name}: {key}", worst <= allowed, f"<= {allowed}", worst)


def test_other_units():
    """ft, slug, lbf/ft, lbf ft, slug ft^2 and the units with lbf s^2 give the same machine as in, lb and lbf."""
    one = """&units {units} /
&drive speed_rpm=600 /
&joint name='O', type='ground', position=0,0 /
&joint name='A', type='crank', pivot='O', radius={length:2} /
&link name='rotor', from='O', to='A', mass={mass:20}, inertia={inertia:30}, center={length:0.5},0 /
&frame mass={mass:100}, inertia={inertia:5000}, origin=0,{length:2} /
&support position={length:-8},{length:-10}, stiffness={stiffness:340},{stiffness:680}, damping={damping:4},{damping:6} /
&support position={length:8},{length:-10}, stiffness={stiffness:340},{stiffness:680}, damping={damping:4},{damping:6} /
&foundation stiffness={stiffness:30},0,{force:2}, 0,0,0, {force:2},0,{moment:40}, damping=0,0,{rotary_damping:9} /
"""
    worlds = {
        "in": ("length='in', mass='lb', inertia='lb in^2', stiffness='lbf/in', force='lbf', moment='lbf in', damping='lbf s/in', "
               "rotary_damping='lbf in s'", {}),
        "ft": ("length='ft', mass='slug', inertia='slug ft^2', stiffness='lbf/ft', force='kip', moment='lbf ft', "
               "damping='lbf s/ft', rotary_damping='lbf ft s'",
               dict(length=1 / 12, mass=POUND / SLUG, inertia=POUND * INCH ** 2 / (SLUG * FOOT ** 2), stiffness=12, force=1e-3,
                    moment=1 / 12, damping=12, rotary_damping=1 / 12)),
        "slinch": ("length='in', mass='lbf s^2/in', inertia='lbf in s^2', stiffness='lbf/in', force='lbf', moment='lbf in', "
                   "damping='lbf s/in', rotary_damping='lbf in s'",
                   dict(mass=POUND * INCH / LBF, inertia=POUND * INCH / LBF)),
        "lb ft": ("length='in', mass='lb', inertia='lb ft^2', stiffness='lbf/in', force='lbf', moment='lbf in', "
                  "damping='lbf s/in', rotary_damping='lbf in s'", dict(inertia=1 / 144))}
    with Folder() as folder:
        lines = {}
        for name, (units, factors) in worlds.items():
            text = re.sub(r"\{(\w+):([-0-9.]+)\}", lambda found: repr(float(found[2]) * factors.get(found[1], 1)),
                          one.replace("{units}", units))
            (folder / "one.nml").write_text(text)
            run = Run(folder, "--one-line", "one.nml")
            run.done(f"{name} runs")
            lines[name] = [number(word) for word in run.out.splitlines()[-1].split(",")]
        for name, values in lines.items():
            for a, b in zip(values, lines["in"]):
                if a is not None and a > 1e-9:
                    near(f"{name}: {b}", a, b, 1e-11 * abs(b))


def test_tables_of_loads():
    """A CSV file of a load may be in psi, lbf or lbf ft."""
    rows = [(15 * i, 30 + 20 * math.cos(math.radians(15 * i))) for i in range(24)]
    text = re.sub(r"force=[^=]*, area", "table='gas.csv', area", machine(False), count=1)
    for unit, factor in (("pressure_psi", PSI / 1e5), ("pressure (kp/cm^2)", 0.980665)):
        with Folder(machine=text) as folder:
            (folder / "gas.csv").write_text(f"crank_deg,{unit}\n" + "".join(f"{a},{b!r}\n" for a, b in rows))
            if not Run(folder, "-o", "own", "machine.nml").done(unit):
                return
            (folder / "gas.csv").write_text("crank_deg,pressure_bar\n" + "".join(f"{a},{b * factor!r}\n" for a, b in rows))
            Run(folder, "-o", "bar", "machine.nml").done("bar")
            own, bar = (tables(folder / name)["power.csv"][1] for name in ("own", "bar"))
            most = max(abs(float(row[2])) for row in bar)
            near(f"torque with {unit}", max(abs(float(a[2]) - float(b[2])) for a, b in zip(own, bar)), 0, 1e-11 * most)


ALL = ("'stability','modes','response','forces','power','joints','drawing','balance','sensitivity','separation','campbell',"
       "'critical','resonance','design','sweep','matrices'")
STUDIES = """&response quantities='f','xi','probe(bearing 5 mm).v','m', measures='peak','rms' /
&sweep parameter='drive.speed_rpm', from=300, to=1440, count=39 /
&resonance quantities='f','xi','m' /
&sensitivity quantities='f','xi' /
&design parameter='link(crank).center(1)', from=-1, to=0, starts=1 /
&objective quantity='f' /
&constraint quantity='xi', measure='peak', at_most={limit} /
"""


def test_tables_in_requested_units():
    """Tables in lbf and in are the tables in N and m divided by the factors, with the new unit in the keys."""
    text = re.sub(r"&load(.|\n)*?/\n", "", machine(True, ALL))
    with Folder() as folder:
        for name, results, limit in (("si", "SI", 0.3 * INCH), ("own", "input", 0.3)):
            (folder / "machine.nml").write_text(text + STUDIES.replace("{limit}", repr(limit)))
            if not Run(folder, "--set", f"units.results={results}", "-o", name, "machine.nml").done(name):
                return
        si, own = tables(folder / "si"), tables(folder / "own")
        equal("tables", sorted(own), sorted(si))
        converted = set()
        for name, (keys, rows) in si.items():
            always_si = name in ("matrices.csv", "mechanism.csv")
            by_row = keys.index("unit") if "unit" in keys and name != "design.csv" else None
            for k, key in enumerate(keys):
                old = max((old for old in COLUMNS if re.search(rf"_{old}(_amplitude|_phase_rad)?$", key)), key=len, default=None)
                if always_si or name == "sweep.csv" and k == 0:
                    old = None
                new, factor = COLUMNS[old] if old else ("", 1.0)
                expected = re.sub(rf"_{old}(_amplitude|_phase_rad)?$", rf"_{new}\1", key) if old else key
                if key.endswith("_phase_rad"):
                    factor = 1.0
                equal(f"{name}: key of {key}", own[name][0][k], expected)
                converted |= {name} if old else set()
                worst = 0.0
                for ours, theirs in zip(own[name][1], rows):
                    scale = factor
                    if by_row is not None and (k == by_row or key in ROW_COLUMNS):
                        unit, scale = LISTED.get(theirs[by_row], (theirs[by_row], 1.0))
                        if k == by_row:
                            equal(f"{name}: unit", ours[k], unit)
                    a, b = number(ours[k]), number(theirs[k])
                    if a is None or b is None or a != a or abs(a) == math.inf:
                        check(f"{name}: {key}", ours[k] == theirs[k] or k == by_row, theirs[k], ours[k])
                    else:
                        worst = max(worst, abs(a - b / scale) / max(abs(b / scale), 1e-300))
                # two roundings; a design is searched in the unit of its objective, so that its last digits differ
                allowed = 1e-6 if name.startswith("design") else 1e-15
                if "error" in key and name.startswith("design"):
                    continue
                check(f"{name}: {key}", worst <= allowed, f"<= {allowed}", worst)
        check("converted tables", len(converted) > 15, "more than 15", sorted(converted))


ROW_COLUMNS = ("value", "error", "peak", "rms", "other_side", "before", "before_error", "after", "after_error", "limit")


def test_report_in_requested_units():
    """The report and the page contain no lengths, masses and forces in SI units, and the numbers of the tables."""
    text, in_si = (re.sub(r"&load(.|\n)*?/\n", "", machine(True, ALL, results)) + STUDIES.replace("{limit}", "0.3")
                   for results in (", results='input'", ""))
    with Folder(machine=text, in_si=in_si) as folder:
        run = Run(folder, "--report", "--json", "machine.nml", environment=SVG_ONLY)
        if not run.done("report"):
            return
        left = set(UNITS_OF_TEXT.findall(run.out)) - {"5 mm"}
        check("SI units in the report", not left, "none", left)
        check("names stay", "bearing 5 mm (1,3)" in run.out, "bearing 5 mm (1,3)", run.out)
        keys, rows = tables(folder / "machine")["supports.csv"]
        total = dict(zip(keys, rows[-1]))
        for key in ("fx_peak_lbf", "fy_peak_lbf", "f_peak_lbf"):
            line = next(line for line in run.out.splitlines() if line.startswith("  total "))
            value = float(total[key])
            check(f"{key} in the report", any(abs(float(word) - value) < 2e-4 * value for word in line.split()[1:4]), value, line)
        # A bound is not rounded down when the number of the report in SI units, one digit, is converted.
        of_total = r"^  total +\S+ +\S+ +\S+ +(\S+)"
        errors = [re.search(of_total, out, re.M) for out in (run.out, Run(folder, "in_si.nml").out)]
        check("error bound", all(errors) and float(errors[0][1]) * 4.4482216152605 >= float(errors[1][1]), errors[1], errors[0])
        page = (folder / "machine" / "report.html").read_text()
        check("unit in the page", "(lbf)" in page and "lbf in</td>" in page and "in/s rms" in page, "lbf", "")
        check("no N in the page's tables", "fx peak (N)" not in page, "no N", "N")
        json = (folder / "machine" / "results.json").read_text()
        check("unit in JSON", '"key": "fx_peak_lbf"' in json and '"unit": "lbf in"' in json, "lbf", "")


def test_pictures_in_requested_units():
    """Scripts of pictures label axes with the requested units and refer to existing columns."""
    text, in_si = (re.sub(r"&load(.|\n)*?/\n", "", machine(True, ALL, results)) + STUDIES.replace("{limit}", "0.3")
                   for results in (", results='input'", ""))
    with Folder(machine=text, in_si=in_si) as folder:
        run = Run(folder, "machine.nml")
        if not run.done("pictures"):
            return
        keys = {key for key, _ in tables(folder / "machine").values() for key in key}
        for script in sorted((folder / "machine").glob("*.gp")):
            words = script.read_text()
            named = set(re.findall(r"column\('(\w+)'\)", words)) - {"x", "y", "speed", "frequency_Hz", "speed_rpm"}
            check(f"{script.name}: columns", named <= keys, "existing", named - keys)
            if script.stem not in ("mechanism", "modes", "modes_motion", "mechanism_motion", "power"):
                found = re.findall(r"\((?:mm|m|µm|N|kN|N m|kN m|mm/s|m/s|m/s²)\)", words)
                check(f"{script.name}: units", not found, "none in SI", found)


def test_limits_in_requested_units():
    """Limits and levels are in the unit in which the results state the quantity."""
    text = re.sub(r"&load(.|\n)*?/\n", "", machine(True, "'design'")) + STUDIES
    with Folder() as folder:
        found = {}
        for results, limit in (("SI", 0.3 * INCH), ("input", 0.3), ("mm", 0.3 * INCH * 1000)):
            (folder / "machine.nml").write_text(text.replace("{limit}", repr(limit)))
            run = Run(folder, "--set", f"units.results={results}", "machine.nml")
            run.done(f"design with {results}")
            keys, rows = tables(folder / "machine")["design.csv"]
            found[results] = float(rows[0][keys.index("after")])
        near("design with a limit in in", found["input"], found["SI"], 1e-5 * abs(found["SI"]))
        near("design with a limit in mm", found["mm"], found["SI"], 1e-5 * abs(found["SI"]))
        text = re.sub(r"&load(.|\n)*?/\n", "", machine(True, "'boundary'"))
        text += "&sweep parameter='drive.speed_rpm', from=300, to=1440, count=39 /\n&boundary quantity='f', level={level} /\n"
        for results, level in (("SI", 20 * LBF), ("lbf", 20)):
            (folder / "machine.nml").write_text(text.replace("{level}", repr(level)))
            run = Run(folder, "--set", f"units.results={results}", "machine.nml")
            run.done(f"level with {results}")
            keys, rows = tables(folder / "machine")["boundary.csv"]
            found[results] = [float(row[1]) for row in rows]
        check("crossings of the level", len(found["lbf"]) > 0, "some", found)
        for a, b in zip(found["lbf"], found["SI"]):
            near("crossing of a level in lbf", a, b, 1e-7 * b)


def test_speed_in_hz():
    """`speed_hz` replaces `speed_rpm`, and `limit_in_s` replaces `limit_mm_s`; both names together are refused."""
    with Folder(machine=machine(True, "'response'")) as folder:
        run = Run(folder, "machine.nml")
        check("24 Hz", "1440 rpm" in run.out and "the limit of 101.6 mm/s" in run.out, "1440 rpm", run.out)
        Run(folder, "--set", "drive.speed_hz=25", "machine.nml").refused(
            "--set", 2, "--set drive.speed_hz=25: use drive.speed_rpm instead of speed_hz")
        text = (folder / "machine.nml").read_text()
        (folder / "both.nml").write_text(text.replace("speed_hz=24", "speed_hz=24, speed_rpm=3"))
        run = Run(folder, "both.nml")
        check("both", run.code == 2 and "speed_rpm" in run.err and len(run.err.splitlines()) == 1, "speed_rpm", run.err)


UNITS_TESTS = [test_machine_in_us_units, test_other_units, test_tables_of_loads, test_tables_in_requested_units,
               test_report_in_requested_units, test_pictures_in_requested_units, test_limits_in_requested_units, test_speed_in_hz]
