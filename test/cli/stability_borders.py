"""The task `boundary` as a user runs it: boundary.csv, the report, the nearest stable machine, refused input."""

import math
import re
from pathlib import Path

from harness import Folder, Run, check, equal, files, near

DATA = Path(__file__).resolve().parents[2] / "data"
SIEVE = (DATA / "rocking_sieve.nml").read_text().replace("'stability'", "'boundary'")
SPEED = "&sweep parameter='drive.speed_rpm', from=120.0, to=300.0, count=10 /\n"
DAMPING = "&sweep parameter='foundation.damping(3)', from=0.2, to=10.0, count=8 /\n"
# Found by plain bisection with single solutions (like test/test_boundary_machines.f90).
BORDERS = (217.756724550, 245.981254672)


def rows(folder):
    """Header and rows of boundary.csv as words."""
    lines = [line for line in (folder / "boundary.csv").read_text().splitlines() if line[0] != "#"]
    return lines[0], [line.split(",") for line in lines[1:]]


def test_one_parameter():
    """Stability borders over one parameter are found and reported."""
    with Folder(input=SIEVE + SPEED) as folder:
        run = Run(folder, "input.nml")
        if not run.done("borders over the speed"):
            return
        equal("borders: files", files(folder / "input"), ["boundary.csv"])
        header, table = rows(folder / "input")
        equal("borders: header", header, "curve,drive.speed_rpm,arg_rad,kind,drive.speed_rpm_error,below,above,vibration")
        equal("borders: words", [(row[0], row[3], row[5], row[6]) for row in table],
              [("1", "period_doubling", "stable", "unstable"), ("2", "period_doubling", "unstable", "stable")])
        for row, border in zip(table, BORDERS):
            near("borders: value", float(row[1]), border, 1e-8)
            near("borders: argument", float(row[2]), math.pi, 1e-15)
            for side, word in ((-1, row[5]), (1, row[6])):
                value = float(row[1]) + 10 * side * float(row[4])
                single = Run(folder, "-s", "case.tasks=stability", "-s", f"drive.speed_rpm={value!r}", "-s",
                             "accuracy.tolerance=1e-12", "input.nml")
                check(f"borders: verdict at {value}", f"VERDICT  {word}" in single.out, word, single.out[-900:-600])
        check("borders: report", re.search(r"^ +217\.7567\S* +\S+ +stable +unstable ", run.out, re.M), "both", run.out)
        check("borders: nearest", "drive.speed_rpm = 217.7567" in run.out and "(11.24" in run.out and " less)" in run.out, "it", run.out)

        again = Run(folder, "-s", "drive.speed_rpm=150", "input.nml")
        check("borders: no advice for a stable machine", again.code == 0 and "nearest" not in again.out, "", again.out)
        narrow = Run(folder, "-s", "sweep(1).from=225", "-s", "sweep(1).to=235", "input.nml")
        check("borders: none", "no boundary in the range" in narrow.out and "none in the range" in narrow.out, "",
              narrow.out)
        equal("borders: none, file", rows(folder / "input")[1], [])


def test_two_parameters():
    """Stability borders over two parameters do not depend on threads."""
    with Folder(input=SIEVE + SPEED + DAMPING) as folder:
        run = Run(folder, "input.nml")
        if not run.done("borders over speed and damping"):
            return
        header, table = rows(folder / "input")
        equal("curves: header", header, "curve,drive.speed_rpm,foundation.damping(3),arg_rad,kind,"
              "drive.speed_rpm_error,foundation.damping(3)_error")
        equal("curves: one, of one kind", {(row[0], row[4]) for row in table}, {("1", "period_doubling")})
        # From edge to edge at the smallest damping, with the unstable side on the left: from the right over the tip to the left.
        first, last = ([float(word) for word in row[1:3]] for row in (table[0], table[-1]))
        near("curves: first vertex on the edge", first[1], 0.2, 1e-12)
        near("curves: last vertex on the edge", last[1], 0.2, 1e-12)
        check("curves: unstable side on the left", first[0] > 229 > last[0], "229 between", (first, last))
        # At the damping of the input the curve passes through the critical values: the deviation is 1e-3 of 180 rpm.
        for border in BORDERS:
            places = []
            for a, b in zip(table, table[1:]):
                (x, y), (v, w) = ((float(row[1]), float(row[2])) for row in (a, b))
                if (y - 1.5) * (w - 1.5) <= 0 and y != w:
                    places.append(x + (v - x) * (1.5 - y) / (w - y))
            near("curves: through the critical value", min(places, key=lambda x: abs(x - border)), border, 0.3)
        check("curves: report", "1 curve, " in run.out and "period doubling" in run.out, "it", run.out)
        bytes_of = (folder / "input" / "boundary.csv").read_bytes()
        Run(folder, "-q", "input.nml", environment={"OMP_NUM_THREADS": "1"}).done("curves: on one thread")
        equal("curves: the same bytes on one thread", (folder / "input" / "boundary.csv").read_bytes() == bytes_of, True)
        Run(folder, "-q", "input.nml", environment={"OMP_NUM_THREADS": "3"}).done("curves: on three threads")
        equal("curves: the same bytes on three threads", (folder / "input" / "boundary.csv").read_bytes() == bytes_of, True)


# An inline twin, throws at 180 degrees, both pistons on one line: it repeats after half a turn, so that twice a frequency meets twice the
# crank's speed in a tongue at +1.
TWIN = """\
&case tasks='boundary' /
&drive speed_rpm=344.0 /
&joint name='O', type='ground', position=0.0,0.0 /
&joint name='A1', type='crank', pivot='O', radius=0.05 /
&joint name='A2', type='rigid', ends='O','A1', offset=-0.05,0.0 /
&joint name='B1', type='RRP', ends='A1', lengths=0.13, guide_point=0.0,0.0, guide_angle=90.0, branch=1 /
&joint name='B2', type='RRP', ends='A2', lengths=0.13, guide_point=0.0,0.0, guide_angle=90.0, branch=1 /
&link name='crank', from='O', to='A1', mass=2.5, inertia=0.004 /
&link name='rod 1', from='A1', to='B1', mass=0.5, inertia=0.0016, center=0.05,0.0 /
&link name='rod 2', from='A2', to='B2', mass=0.5, inertia=0.0016, center=0.05,0.0 /
&link name='piston 1', from='B1', mass=1.6, inertia=0.0008 /
&link name='piston 2', from='B2', mass=1.6, inertia=0.0008 /
&frame mass=20.0, inertia=0.55, origin=0.04,0.06 /
&support position=-0.21,-0.22, stiffness=3.0e4,7.0e4, damping=1.0,2.0 /
&support position=0.23,-0.24, stiffness=2.5e4,8.0e4, damping=1.0,2.5 /
&model frame='exact' /
"""
# By an independent program in quadruple precision, with all its digits.
TWIN_BORDERS = (342.3752, 345.2946, 1244.8146, 1251.0103)


def test_half_period():
    """Borders of a tongue are found wherever the middle of the range lies.

    The nearest stable machine lies at the border.
    """
    with Folder() as folder:
        for first, last in ((340.5, 347.5), (343.0, 347.5), (340.5, 345.0), (1238.0, 1258.0)):
            what = f"twin from {first} to {last}"
            (folder / "input.nml").write_text(
                TWIN + f"&sweep parameter='drive.speed_rpm', from={first}, to={last}, count=20 /\n")
            run = Run(folder, "input.nml")
            if not run.done(what):
                return
            table = rows(folder / "input")[1]
            inside = [border for border in TWIN_BORDERS if first < border < last]
            equal(f"{what}: kinds", [row[3] for row in table], ["divergence"] * len(inside))
            for row, border in zip(table, inside):
                near(f"{what}: {border}", float(row[1]), border, 1e-4)
                check(f"{what}: sides of {border}", {row[5], row[6]} == {"stable", "unstable"}, "both", row)
            if first < 344 < last and 345.2946 < last:
                way = re.search(r"drive.speed_rpm = (\S+) \+- (\S+) \(\S+ more\), stable", run.flat)
                check(f"{what}: nearest", way and abs(float(way[1]) - 345.2945613) <= min(float(way[2]), 1e-3), 345.2945613, run.flat[-300:])


def test_undamped():
    """An undamped machine is unstable only between pairs of borders."""
    with Folder(input=SIEVE + SPEED) as folder:
        run = Run(folder, "-s", "foundation.damping(3)=0", "-s", "sweep.from=40", "input.nml")
        if not run.done("borders without damping"):
            return
        # Twice the natural frequency over 1, 3, 5, ... lies in the range, ever narrower. Over 2, 4, ... there is none: with the
        # moment u = J psi' the sieve is (1 + e cos phi) u'' + c u = 0, Ince's equation, whose tongues of even order have closed
        # (W. Magnus, S. Winkler, Hill's Equation, 1966, theorem 7.1: Q(mu) = 2 e mu^2 is zero at 0).
        table = rows(folder / "input")[1]
        equal("borders without damping: odd orders alone", {row[3] for row in table}, {"period_doubling"})
        check("borders without damping: unstable in pairs", len(table) % 2 == 0 and len(table) >= 6
              and [row[5].replace("undamped", "undecided") for row in table] == ["undecided", "unstable"] * (len(table) // 2),
              "pairs", table)


def test_refused():
    """The task boundary refuses invalid ranges and tolerances."""
    with Folder(input=SIEVE, one=SIEVE + SPEED, point=SIEVE + SPEED.replace("to=300.0, count=10", "count=1")) as folder:
        Run(folder, "input.nml").refused(
            "borders: no parameter", 2, "input.nml:4: &case: tasks = 'boundary': needs a group &sweep with parameter, from, to and count")
        Run(folder, "point.nml").refused(
            "borders: empty range", 2, "point.nml:11: &sweep: count = 1: must be at least 2 for the task 'boundary'")
        Run(folder, "-s", "boundary.tolerance=0.2", "one.nml").refused(
            "borders: a coarse tolerance", 2, "--set boundary.tolerance=0.2: must lie between 1e-13 and 0.1")
        done = Run(folder, "--check", "one.nml")
        check("borders: --check", done.code == 0 and "10 search points" in done.out and not (folder / "one").exists(), "it",
              done.out)


def test_within_range():
    """The border search never leaves the range, however coarse the tolerance.

    Below its range the mass would be negative.
    """
    light = """\
&case tasks='boundary' /
&drive speed_rpm=384.907 /
&mass_functions mass=0.64961, inertia=1.9567E-4, a1=1.0696E-2,7.19E-4,-6.11E-4, a2=1.06956E-2,-9.12E-4,8.8E-4,
  a3=1.95667E-3,2.808E-5,-1.238E-4, moment=1.95667E-3, energy=1.95667E-3 /
&frame mass=6.4961, inertia=0.05283, origin=-0.0483533,0.0504472 /
&foundation stiffness=139535,0,0,0,139535,0,0,0,3782.6, damping=74.78,74.78,2.02718 /
&sweep parameter='frame.mass', from=74.78, to=74780.0, count=5 /
&boundary tolerance=0.0434 /
"""
    with Folder(input=light) as folder:
        Run(folder, "input.nml").done("borders: a coarse tolerance over a positive mass")
    # The machine's own damping is slightly above the start of the range: smaller damping, negative here, is not examined.
    sieve = (DATA / "sieve_borders.nml").read_text().replace("count=40", "count=4").replace("count=30", "count=4")
    sieve, ranges = re.subn(r"('foundation.damping\(3\)', from=0.05, to=)\S+", r"\g<1>2.2534e14", sieve)
    equal("borders: the sieve's range", ranges, 1)
    with Folder(input=sieve) as folder:
        Run(folder, "input.nml").done("borders: a machine close to where a range begins")


STABILITY_BORDER_TESTS = (test_one_parameter, test_two_parameters, test_half_period, test_undamped, test_within_range, test_refused)
