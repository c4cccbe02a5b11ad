"""The task `resonance` as a user runs it: resonance.csv, peaks.csv, the report, refused input."""

import csv
import json
import math

from broken_inputs import REST, SOUND
from harness import Folder, Run, check, equal, files, near

CURVE = SOUND.replace("'stability', 'response'", "'resonance'").replace("0.5,0.5,0.05", "10.0,10.0,1.0")
SPEEDS = "&sweep parameter='drive.speed_rpm', from=500.0, to=700.0, count=5 /\n"
ORDERED = "&probe name='desk, left', position=0.3,0.2 /\n&resonance quantities='psi','probe(desk, left).ay', orders=2 /\n"


def rows(folder, name):
    """Header and rows as words."""
    lines = [line for line in (folder / name).read_text().splitlines() if line[0] != "#"]
    header, *table = csv.reader(lines)
    return header, table


def test_curve():
    """Resonance curve and peaks are written, whatever the number of threads."""
    with Folder(input=CURVE + SPEEDS + ORDERED + REST, single=SOUND.replace("0.5,0.5,0.05", "10.0,10.0,1.0") + REST) as folder:
        run = Run(folder, "input.nml")
        if not run.done("resonance"):
            return
        equal("resonance: files", files(folder / "input"), ["peaks.csv", "resonance.csv"])
        header, table = rows(folder / "input", "resonance.csv")
        columns = ["peak", "peak_error", "rms", "order_1", "order_2"]
        equal("resonance: header", header, ["speed_rpm", "state", "refined"] + [f"psi_{c}_rad" for c in columns]
              + [f"probe(desk, left).ay_{c}_m_s2" for c in columns] + ["small_motion"])
        speeds = [float(row[0]) for row in table]
        equal("resonance: ascending", speeds, sorted(set(speeds)))
        grid = [row for row in table if row[2] == "0"]
        equal("resonance: the grid", [float(row[0]) for row in grid], [500.0, 550.0, 600.0, 650.0, 700.0])
        check("resonance: all ok", {row[1] for row in table} == {"ok"}, "ok", {row[1] for row in table})
        for row in grid:
            single = Run(folder, "--one-line", "-s", "case.tasks=response", "-s", f"drive.speed_rpm={row[0]}", "single.nml")
            names, values = (line.split(",") for line in single.out.splitlines()[:2])
            # the same solution to 1e-9, a peak loses two digits
            expected = float(dict(zip(names, values))["psi_peak_rad"])
            near(f"resonance: psi at {row[0]}", float(row[3]), expected, 1e-7 * expected)
        for row in table:
            # Parseval: the mean square is half the sum of the squares of all amplitudes, two of them here, and that of the mean
            check("resonance: rms", float(row[5]) >= math.hypot(float(row[6]), float(row[7])) / math.sqrt(2) * (1 - 1e-12), "", row)
            check("resonance: peak", float(row[3]) >= float(row[5]) and 0 < float(row[4]) < 1e-6 * float(row[3]), "", row)

        header, peaks = rows(folder / "input", "peaks.csv")
        equal("peaks: header", ",".join(header), "quantity,unit,speed_rpm,value,width_rpm,damping_ratio,strongest_order,state,"
              "small_motion,other_side")
        psi = [row for row in peaks if row[0] == "psi"]
        # 127.36 rad/s, the lowest natural frequency of the averaged frame, swings twice in a turn at 608.1 rpm
        top = min(psi, key=lambda row: abs(float(row[2]) - 608.1))
        near("peaks: second order", float(top[2]), 127.36 * 60 / (2 * math.pi) / 2, 1.0)
        equal("peaks: second order", (top[1], top[6], top[7]), ("rad", "2", "ok"))
        equal("peaks: is the greatest of the curve", top[3], max((row[3] for row in table), key=float))
        # about D = b w / (2 c) with the rotary stiffness and damping: 3 parts in a thousand
        check("peaks: damping", 0.001 < float(top[5]) < 0.004, "0.0026", top[5])
        near("peaks: width", float(top[4]), 2 * float(top[2]) * float(top[5]), 1e-12)
        check("resonance: report", "RESONANCE CURVE  500 to 700 rpm, 5 grid speeds" in run.out and "607.8" in run.out
              and "minimum" in run.out and "halve within" not in run.out, "range, maximum, least", run.out)

        before = {name: (folder / "input" / name).read_bytes() for name in ("resonance.csv", "peaks.csv")}
        for threads in ("1", "3"):
            Run(folder, "-q", "input.nml", environment={"OMP_NUM_THREADS": threads}).done("resonance by threads")
            equal(f"resonance: the same bytes by {threads} threads",
                  {name: (folder / "input" / name).read_bytes() for name in before}, before)


def test_directions():
    """Clockwise rotation and descending speeds yield the same resonances."""
    with Folder(input=CURVE + SPEEDS) as folder:
        for first, last in ((-500.0, -700.0), (700.0, 500.0)):
            Run(folder, "-q", "-s", f"sweep.from={first}", "-s", f"sweep.to={last}", "input.nml").done("directions")
            table = rows(folder / "input", "resonance.csv")[1]
            speeds = [float(row[0]) for row in table]
            equal("directions: ends", (speeds[0], speeds[-1]), (first, last))
            equal("directions: descending", speeds, sorted(set(speeds), reverse=True))
            peaks = [row for row in rows(folder / "input", "peaks.csv")[1] if row[0] == "psi" and row[6] == "2"]
            near("directions: second order", min(abs(abs(float(row[2])) - 608.1) for row in peaks), 0.0, 1.0)


def test_states():
    """Unstable speeds of a resonance curve are marked with their ends."""
    with Folder(input=CURVE + "&sweep parameter='drive.speed_rpm', from=1210, to=1222, count=4 /\n" + REST) as folder:
        run = Run(folder, "-s", "foundation.damping(1)=0.5", "-s", "foundation.damping(2)=0.5", "-s",
                  "foundation.damping(3)=0.05", "input.nml")
        run.done("states")
        table = rows(folder / "input", "resonance.csv")[1]
        equal("states: a tongue", {row[1] for row in table} - {"undecided"}, {"ok", "unstable"})
        peaks = rows(folder / "input", "peaks.csv")[1]
        equal("states: its ends", {(row[0], row[3], row[7]) for row in peaks if row[7] == "unbounded"},
              {(name, "Infinity", "unbounded") for name in ("xi", "eta", "psi", "f")})
        check("states: report", "  UNSTABLE at " in run.out and "unbounded at 2 speeds" in run.out, "", run.out)


# A crank-rocker on two mounts of unlike stiffness with weak damping. At 486.93 rpm its vibration meets another one, and both cease to
# exist: the machine jumps to a third.
FOLD = """\
&case tasks='resonance' /
&drive speed_rpm=1000.0 /
&joint name='A0', type='ground', position=0.0,0.0 /
&joint name='B0', type='ground', position=0.26,0.05 /
&joint name='A', type='crank', pivot='A0', radius=0.06, phase=15.0 /
&joint name='B', type='RRR', ends='A','B0', lengths=0.22,0.17, branch=1 /
&link name='crank', from='A0', to='A', mass=0.8, inertia=0.0011, center=0.018,0.0 /
&link name='coupler', from='A', to='B', mass=1.1, inertia=0.0062, center=0.10,0.02 /
&link name='rocker', from='B0', to='B', mass=1.3, inertia=0.0055, center=0.09,-0.01 /
&frame mass=24.0, inertia=0.85, origin=-0.09,0.12 /
&support position=-0.30,-0.22, stiffness=5.0e4,9.0e4, damping=2.0,3.0 /
&support position=0.34,-0.20, stiffness=4.0e4,1.1e5, damping=1.5,4.0 /
&model frame='exact' /
&accuracy tolerance=1e-12 /
&resonance quantities='psi','f' /
&sweep parameter='drive.speed_rpm', from=486.9314, to=486.94, count=2 /
"""
# The maximum of psi (rad) at multiples of 5 degrees by an independent program, at both ends of the range.
FOLD_PSI = (0.688158, 0.865882)


def test_fold():
    """A jump of the exact model at a fold is listed with both values."""
    with Folder(input=FOLD) as folder:
        run = Run(folder, "input.nml")
        if not run.done("fold"):
            return
        header, table = rows(folder / "input", "resonance.csv")
        psi = [float(row[header.index("psi_peak_rad")]) for row in table]
        speeds = [float(row[0]) for row in table]
        for value, sampled in zip((psi[0], psi[-1]), FOLD_PSI):
            # between samples of 5 degrees a motion of order 2 rises by 1 - cos(2 * 2.5 deg) at most
            check(f"fold: psi of {sampled} at samples", 0 <= value / sampled - 1 < 4e-3, sampled, value)
        header, peaks = rows(folder / "input", "peaks.csv")
        equal("fold: rows", [(row[0], row[7]) for row in peaks], [("psi", "jump"), ("f", "jump")])
        # beyond the jump the vibration is another one, without a point at half the power of this one
        equal("fold: no width", [row[header.index("width_rpm")] for row in peaks], ["NaN", "NaN"])
        check("fold: finite", all(math.isfinite(float(row[3])) for row in peaks), "finite", peaks)
        at, value, other = (float(peaks[0][header.index(name)]) for name in ("speed_rpm", "value", "other_side"))
        equal("fold: the greatest of the curve", value, max(psi))
        # next to each other, 4e-10 of the speed apart
        low = psi[speeds.index(at) - 1]
        equal("fold: both sides", other, low)
        near("fold: how near", at - speeds[speeds.index(at) - 1], 0.0, 4e-10 * at)
        check("fold: both sides lie between the ends", FOLD_PSI[0] < other < 0.7 and value > FOLD_PSI[1], FOLD_PSI, (other, value))
        check("fold: report", "0 maxima, 1 jump" in run.out and "jump at a turning point, beyond it 0.69" in run.flat
              and "unbounded" not in run.out, "a jump", run.out)


def test_nothing_judged():
    """A frame that nothing holds is stable at no speed."""
    text = ("&case tasks='resonance' /\n&model frame='rest' /\n&drive speed_rpm=229 /\n&joint name='O', type='ground', position=0,0 /\n"
            "&joint name='A', type='crank', pivot='O', radius=0.12 /\n"
            "&link name='eccentric', from='O', to='A', mass=9, inertia=0.02, center=0.12,0 /\n"
            "&frame mass=40, inertia=2, origin=0.5,0, dof='xi' /\n&sweep parameter='drive.speed_rpm', from=180, to=260, count=4 /\n")
    with Folder(input=text) as folder:
        run = Run(folder, "--json", "input.nml")
        head = (folder / "input" / "resonance.csv").read_text()
        equal("no verdict", (json.loads((folder / "input" / "results.json").read_text())["verdict"], "# verdict" in head,
                                 "stable" in run.out.splitlines()[-1]), (None, False, False))


def test_refused():
    """Invalid speed ranges for the task resonance are refused."""
    for name, line, message in (
        ("two sweeps", SPEEDS + SPEEDS.replace("drive.speed_rpm", "frame.mass"), "input.nml:17: &sweep 2: the tasks "
         "resonance, critical and campbell vary only the speed: remove this group"),
        ("no sweep", "", "input.nml:1: &case: tasks = 'resonance': needs a group &sweep with parameter, from, to and count"),
        ("another parameter", SPEEDS.replace("drive.speed_rpm", "frame.mass"),
         "input.nml:16: &sweep: parameter = 'frame.mass': must "
         "be 'drive.speed_rpm' for the tasks resonance, critical and campbell"),
        ("through standstill", SPEEDS.replace("500.0", "-500.0").replace("count=5", "count=4"),
         "input.nml:16: &sweep: to = 700.0: the range must not include standstill: 'from' and 'to' must have the same sign"),
        ("one speed", SPEEDS.replace("to=700.0, count=5", "count=1"), "input.nml:16: &sweep: count = 1: must be at least 2 for the "
         "tasks resonance, critical and campbell"),
        ("no such quantity", SPEEDS + "&resonance quantities='zeta' /\n",
         "input.nml:17: &resonance: quantities = 'zeta': unknown "
         "quantity 'zeta': use xi, eta, psi (also with _dot, _ddot), fx, fy, m, f, support(1).fx (.fy, .f; up to 4), "
         "foundation.fx, guide.fx, total.fx (.fy, .f, .m), joint(NAME).f (.fx, .fy, .m)"),
        ("a quantity twice", SPEEDS + "&resonance quantities='xi','xi' /\n",
         "input.nml:17: &resonance: quantities = 'xi', 'xi': names "
         "'xi' twice"),
        ("no orders", SPEEDS + "&resonance orders=0 /\n", None),
        ("too many orders", SPEEDS + "&resonance orders=51 /\n", "input.nml:17: &resonance: orders = 51: must be at most 50"),
    ):
        with Folder(input=CURVE + line) as folder:
            run = Run(folder, "input.nml")
            equal(f"resonance refused, {name}: code", run.code, 2)
            if message:
                equal(f"resonance refused, {name}", run.err, message + "\n")
            equal(f"resonance refused, {name}: no files", files(folder / "input"), [])


RESONANCE_TESTS = (test_curve, test_nothing_judged, test_directions, test_states, test_fold, test_refused)
