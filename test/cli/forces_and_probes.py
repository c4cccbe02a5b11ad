"""Forces on the ground, probes and the drive, as a user runs them: files, report, refused input."""

import csv
import math
from pathlib import Path

from broken_inputs import REST, SOUND
from harness import Folder, Run, Table, check, equal, files, near, series

GOLDEN = Path(__file__).resolve().parent / "golden" / "findings"
TASKS = "case.tasks='response','forces','power'"
MACHINE = SOUND.replace("damping=0.5,0.5,0.05", "stiffness(3,3)=900.0, damping=40.0,60.0,2.0") + """\
&response points=24, harmonics=6 /
&probe name='bearing', position=-0.2,0.2, limit_mm_s=9.0 /
&probe name='a, "b"', position=0.3,-0.2, band_hz=4.0,8.0 /
"""
FILES = [f"{what}{part}.csv" for what in ("probes", "supports") for part in ("", "_harmonics", "_history")] + ["power.csv"]
PLACES = ["1", "2", "3", "4", "foundation", "total"]
FORCES = [f"{part}_{place}_{unit}" for place in PLACES for part, unit in (("fx", "N"), ("fy", "N"), ("f", "N"), ("m", "Nm"))
          if part != "m" or not place.isdigit()]
PARTS = [(name, unit) for names, unit in (("x y d", "m"), ("vx vy v", "m_s"), ("ax ay a", "m_s2")) for name in names.split()]


def table(path):
    """Header and rows, without quotes."""
    lines = [line for line in path.read_text().splitlines() if line[0] != "#"]
    header, *rows = csv.reader(lines)
    return header, [dict(zip(header, row)) for row in rows]


def column(rows, name):
    return [float(row[name]) for row in rows]


def run_golden(folder):
    return Run(folder, "-s", TASKS, "-o", "new", "input.nml")


def write_findings_golden():
    with Folder(input=MACHINE + REST) as folder:
        run = run_golden(folder)
        assert run.code == 0, run.err
        GOLDEN.mkdir(parents=True, exist_ok=True)
        for name in FILES:
            (GOLDEN / name).write_bytes((folder / "new" / name).read_bytes())


def test_golden():
    """Results on forces, probes and drive agree with the stored ones."""
    with Folder(input=MACHINE + REST) as folder:
        if not run_golden(folder).done("findings"):
            return
        equal("findings: files", [name for name in files(folder / "new") if name.endswith(".csv")],
              sorted([*FILES, "response.csv", "harmonics.csv"]))
        for name in FILES:
            (header, came), (right_header, right) = table(folder / "new" / name), table(GOLDEN / name)
            equal(f"{name}: header", header, right_header)
            for word in ("support", "name", "verdict", "order", *(w for w in header if w.endswith("strongest_order"))):
                if word in header:
                    equal(f"{name}: {word}", [row[word] for row in came], [row[word] for row in right])
            for word in header:
                if word in ("support", "name", "verdict") or "error" in word or word.endswith("phase_rad"):
                    continue
                numbers = [0 if x != x else x for x in column(right, word)]
                # Phi(T) is accurate to 1e-9 at worst, condition 10; the angle of a peak to the root of that.
                rate = 1e-3 if word.endswith("peak_crank_deg") else 1e-8
                # A component that hardly moves is compared on the scale of the other one.
                scale = [abs(x) for other in (word, word.replace("x_", "y_")) if other in header for x in column(right, other)]
                series(f"{name}: {word}", [0 if x != x else x for x in column(came, word)], numbers,
                       rate * max(x for x in scale if x == x) if any(x == x for x in scale) else 0)


def test_forces():
    """Forces of the supports add up to the total and to response.csv."""
    with Folder(input=MACHINE) as folder:
        Run(folder, "-q", "-s", "case.tasks='response','forces'", "input.nml").done("forces")
        out = folder / "input"
        header, rows = table(out / "supports.csv")
        equal("supports.csv: places", [row["support"] for row in rows], PLACES)
        equal("supports.csv: positions", [(float(row["x_m"]), float(row["y_m"])) for row in rows],
              [(-0.3, -0.2), (-0.1, -0.2), (0.1, -0.2), (0.3, -0.2), (0.0, 0.0), (0.0, 0.0)])
        history, response = Table(out / "supports_history.csv"), Table(out / "response.csv")
        equal("supports_history.csv: header", history.header, ",".join(["crank_deg", "t_s", *FORCES]))
        equal("supports_history.csv: times", history["t_s"] == response["t_s"], True)
        for axis in "xy":
            total = [sum(parts) for parts in zip(*(history[f"f{axis}_{place}_N"] for place in PLACES[:-1]))]
            series(f"forces along {axis} add up", history[f"f{axis}_total_N"], total, 1e-10)
            series(f"forces along {axis} are the response's", history[f"f{axis}_total_N"], response[f"f{axis}_N"], 1e-10)
        series("the moment is the response's", history["m_total_Nm"], response["m_Nm"], 1e-10)
        for row in rows:
            f = history[f"f_{row['support']}_N"]
            check(f"place {row['support']}: peak above all rows", float(row["f_peak_N"]) >= max(f) * (1 - 1e-12), "it",
                  (row["f_peak_N"], max(f)))
            x, y = history[f"fx_{row['support']}_N"], history[f"fy_{row['support']}_N"]
            series(f"place {row['support']}: size", f, [math.hypot(*pair) for pair in zip(x, y)], 1e-10)
        equal("forces: no more files", files(out) and "probes.csv" in files(out), True)
        harmonics = Table(out / "supports_harmonics.csv")
        right = ["order", "frequency_Hz"] + [f"{name}_{part}" for name in FORCES if not name.startswith("f_")
                                             for part in ("amplitude", "phase_rad")]
        equal("supports_harmonics.csv: header", harmonics.header, ",".join(right))
        equal("supports_harmonics.csv: rows", len(harmonics.rows), 7)


def test_guides():
    """A guide's force acts only across the free directions."""
    with Folder(input=MACHINE) as folder:
        run = Run(folder, "-s", "case.tasks='forces'", "-s", "frame.dof='xi','psi'", "input.nml")
        if not run.done("forces with a guide"):
            return
        equal("guide: files", [name for name in files(folder / "input") if name.endswith(".csv")],
              ["supports.csv", "supports_harmonics.csv", "supports_history.csv"])
        _, rows = table(folder / "input" / "supports.csv")
        equal("guide: places", [row["support"] for row in rows], [*PLACES[:-1], "guide", "total"])
        guide = rows[-2]
        equal("guide: no force along free directions", float(guide["fx_peak_N"]), 0.0)
        check("guide: force across free directions", float(guide["fy_peak_N"]) > 1, "more than 1 N", guide["fy_peak_N"])
        check("guide: report", "\n  guide  " in run.out and "FORCES ON THE GROUND" in run.out
              and "PERIODIC VIBRATION" not in run.out, "forces alone", run.out)
        Run(folder, "-q", "-s", "case.tasks='response','forces'", "-s", "frame.dof='xi','psi'", "-o", "both", "input.nml")
        (_, motion), (_, forces) = (table(folder / "both" / name) for name in ("response.csv", "supports_history.csv"))
        arms = [x * f for x, f in zip(column(motion, "xi_m"), column(forces, "fy_guide_N"))]
        # its force acts where F has moved; roundings of the product
        series("guide: moment about F at rest", column(forces, "m_guide_Nm"), arms, 1e-14 * max(map(abs, arms)))


def test_probes():
    """Probes are written with their bands, limits and verdicts."""
    with Folder(input=MACHINE) as folder:
        run = Run(folder, "-s", "case.tasks='response'", "input.nml")
        if not run.done("probes"):
            return
        out = folder / "input"
        header, rows = table(out / "probes.csv")
        equal("probes.csv: names", [row["name"] for row in rows], ["bearing", 'a, "b"'])
        measures = [f"{name}_{what}_{unit}" for name, unit in PARTS for what in ("peak", "peak_error", "rms")]
        equal("probes.csv: header", header, ["name", "x_m", "y_m", *measures, "vx_rms_band_mm_s", "vy_rms_band_mm_s",
                                             "v_rms_band_mm_s", "v_rms_band_error_mm_s", "band_from_Hz", "band_to_Hz",
                                             "limit_mm_s", "verdict"])
        equal("probes.csv: limits", (rows[0]["limit_mm_s"], rows[1]["limit_mm_s"], rows[1]["verdict"]),
              ("9.0000000000000000E+000", "NaN", ""))
        band = float(rows[0]["v_rms_band_mm_s"])
        # From the harmonics by hand: 10 to 1000 Hz at 4 Hz are orders 3 to 250, of which 6 are listed; 4 to 8 Hz 1 and 2.
        header, orders = table(out / "probes_harmonics.csv")
        equal("probes_harmonics.csv: header", header[2:6], ["x_bearing_m_amplitude", "x_bearing_m_phase_rad",
                                                            "y_bearing_m_amplitude", "y_bearing_m_phase_rad"])
        check("probes_harmonics.csv: a name with quotes", 'ay_a, "b"_m_s2_phase_rad' in header, "quoted", header)
        for axis in "xy":
            for name, low, high in (("bearing", 3, 6), ('a, "b"', 1, 2)):
                row = rows[name != "bearing"]
                rms = 1000 * math.sqrt(sum(x * x / 2 for x in column(orders, f"v{axis}_{name}_m_s_amplitude")[low:high + 1]))
                if name == "bearing":
                    check(f"band of {name} along {axis}", rms <= float(row[f"v{axis}_rms_band_mm_s"]) * (1 + 1e-12), rms, row)
                else:
                    near(f"band of {name} along {axis}", float(row[f"v{axis}_rms_band_mm_s"]), rms, 1e-12 * rms)
        header, history = table(out / "probes_history.csv")
        equal("probes_history.csv: header", header[:11], ["crank_deg", "t_s"] + [f"{n}_bearing_{u}" for n, u in PARTS])
        equal("probes_history.csv: rows", len(history), 25)
        for limit, word, number in ((2 * band, "within", "50 % of the limit"), (band / 2, "above", "2 times the limit"),
                                    (band, "undecided", "UNDECIDED")):
            run = Run(folder, "-s", "case.tasks='response'", "-s", f"probe(bearing).limit_mm_s={limit!r}", "input.nml")
            equal(f"verdict {word}: exit code", (run.code, run.err), (0, ""))
            equal(f"verdict {word}", table(out / "probes.csv")[1][0]["verdict"], word)
            check(f"verdict {word}: report", number in run.out and "VIBRATION AT PROBES" in run.out, number, run.out)
        run = Run(folder, "-s", "case.tasks='stability'", "-o", "none", "input.nml")
        equal("probes need the task response", "probes.csv" in files(folder / "none") or "PROBES" in run.out, False)


def test_units():
    """Units apply to probes as to all other lengths."""
    machine = SOUND + "&probe name='p', position=0.25,-0.1 /\n"
    other = machine
    for key in ("position", "radius", "lengths", "center", "origin"):
        head, *rest = other.split(key + "=")
        other = head + "".join(key + "=" + scaled(part) for part in rest)
    with Folder(input=machine, other=other + "&units length='mm' /\n") as folder:
        for name in ("input", "other"):
            Run(folder, "-q", "-s", TASKS, f"{name}.nml").done(f"units, {name}")
        for name in ("probes.csv", "supports.csv"):
            (_, right), (_, came) = table(folder / "input" / name), table(folder / "other" / name)
            for k in ("x_m", "y_m", *(word for word in right[0] if word.endswith("_rms_m") or word.endswith("rms_N"))):
                series(f"units: {name} {k}", column(came, k), column(right, k), 1e-9 * max(map(abs, column(right, k))) + 1e-18)


def scaled(part):
    """The list of numbers at the beginning of `part`, times 1000."""
    words = part.split(" ")
    numbers = words[0].rstrip(",").split(",")
    ends = "," if words[0].endswith(",") else ""
    count = len(numbers)
    if ends and len(words) > 1 and words[1][:1] in "-.0123456789":
        return f"{1000 * float(numbers[0])}, {1000 * float(words[1].rstrip(','))} " + " ".join(words[2:])
    assert count in (1, 2)
    return ",".join(str(1000 * float(number)) for number in numbers) + ends + " " + " ".join(words[1:])


def test_power():
    """The drive's mean power equals the losses of the dampers."""
    with Folder(input=MACHINE) as folder:
        run = Run(folder, "-s", "case.tasks='power'", "-s", "response.points=360", "input.nml")
        if not run.done("power"):
            return
        equal("power: files", [name for name in files(folder / "input") if name.endswith(".csv")], ["power.csv"])
        power = Table(folder / "input" / "power.csv")
        equal("power.csv: header", power.header, "crank_deg,t_s,torque_Nm,rigid_torque_Nm,drive_W,dampers_W,energy_J")
        speed = 240.0 * 2 * math.pi / 60
        greatest = max(map(abs, power["drive_W"]))
        series("power is torque times speed", power["drive_W"], [speed * x for x in power["torque_Nm"]], 1e-13 * greatest)
        # The trapezoidal rule over the turn, exact for orders below 360.
        drive, dampers = (sum(power[name][:-1]) / 360 for name in ("drive_W", "dampers_W"))
        near("power: drive and dampers balance", drive, dampers, 1e-11 * greatest)
        near("power: none on a rigid frame", sum(power["rigid_torque_Nm"][:-1]) / 360, 0, 1e-13 * greatest)
        step = power["t_s"][1]
        e = power["energy_J"]
        # Central differences over 1 deg, orders up to 40: (40 * 0.0175)^2 / 6 of the highest, which are small.
        slope = [(e[i + 1] - e[i - 1]) / (2 * step) for i in range(1, 360)]
        series("power: the balance", slope, [power["drive_W"][i] - power["dampers_W"][i] for i in range(1, 360)], 1e-2 * greatest)
        check("power: report", "DRIVE" in run.out and "on a frame at rest" in run.out, "it", run.out)
        clockwise = Run(folder, "-s", "case.tasks='power'", "-s", "response.points=360", "-s",
                        "drive.speed_rpm=-240", "-o", "back", "input.nml")
        clockwise.done("power, clockwise")
        back = Table(folder / "back" / "power.csv")
        equal("power, clockwise: angles", (back["crank_deg"][0], back["crank_deg"][-1]), (0.0, -360.0))
        # On a rigid frame the torque at an angle does not depend on the sense.
        series("power, clockwise: rigid", back["rigid_torque_Nm"][::-1], power["rigid_torque_Nm"], 1e-11 * greatest)


FUNCTIONS = """\
&case tasks='power' /
&drive speed_rpm = 240.0 /
&mass_functions mass=1.0, inertia=0.01, a1=0.0,0.02,0.0, a2=0.0,0.0,0.02, a3=0.01, moment=0.01 /
&frame mass=18.0, inertia=0.78, origin=0.0,0.0 /
&foundation stiffness=1.0e5,0.0,0.0,0.0,1.0e5,0.0,0.0,0.0,1.0e4, damping=10.0,10.0,1.0 /
"""


def test_refused():
    """Tasks that need the kinetic energy or periodic masses are refused without."""
    with Folder(input=FUNCTIONS, sound=SOUND) as folder:
        Run(folder, "input.nml").refused(
            "power without energy", 2, "input.nml:3: &mass_functions: the task 'power' needs the key 'energy', the harmonics of "
            "sum [m (x'^2 + y'^2) + J phi'^2]")
        Run(folder, "-q", "-s", "mass_functions.energy=0.01", "input.nml").done("power with energy")
        Run(folder, "-s", TASKS, "-s", "model.coefficients=averaged", "sound.nml").refused(
            "power of the averaged model", 2, "--set model.coefficients=averaged: must be 'periodic' for the task 'power': "
            "with averaged masses, the powers of drive and dampers do not balance")
        Run(folder, "-q", "-s", "case.tasks='response','forces'", "-s", "model.coefficients=averaged", "sound.nml").done(
            "forces of the averaged model")


FORCE_AND_PROBE_TESTS = [test_golden, test_forces, test_guides, test_probes, test_units, test_power, test_refused]
