"""Critical speeds: each peak of the force is assigned to the order that causes it."""

import csv
import math

from harness import Folder, Run, check, equal

# A slider-crank on soft feet: near 500 1/min order 2 excites mode 2, and order 3 crosses mode 3 without a visible effect.
NEEDLE = """&case title = 'Needle drive', tasks = 'critical' /
&drive speed_rpm = 3000 /
&joint name='O', type='ground', position=0,0 /
&joint name='A', type='crank', pivot='O', radius=0.015 /
&joint name='B', type='RRP', ends='A', lengths=0.045, guide_point=0,0, guide_angle=-90, branch=1 /
&link name='crank', from='O', to='A', mass=0.08, inertia=0.00001, center=0.003,0 /
&link name='counterweight', from='O', to='A', mass=0.055, inertia=0.00001, center=-0.018,0 /
&link name='rod', from='A', to='B', mass=0.025, inertia=0.00001, center=0.018,0 /
&link name='needle bar', from='B', mass=0.06, inertia=0 /
&frame mass=22, inertia=0.453, origin=0.02,0.168 /
&support position=-0.22,-0.102, stiffness=60e3,120e3, damping=80,120 /
&support position=0.22,-0.102, stiffness=60e3,120e3, damping=80,120 /
"""


def rows(start):
    """critical.csv by mode and order, for a range that begins at `start`."""
    with Folder(input=NEEDLE + f"&sweep parameter='drive.speed_rpm', from={start}, to=5000, count=91 /\n") as folder:
        Run(folder, "-q", "input.nml").done(f"critical from {start}")
        lines = (folder / "input/critical.csv").read_text().splitlines()
        return {(row["mode"], row["order"]): row for row in csv.DictReader(line for line in lines if line[0] != "#")}


def test_critical():
    """Critical speeds and forces do not depend on the start of the range.

    A peak of the force is assigned to the order that causes it.
    """
    high, low = rows(500), rows(470)
    silent = high.get(("3", "3"))
    check("the order without force is listed", silent is not None, "mode 3, order 3", sorted(high))
    check("the order without force has NaN as force", silent is None or math.isnan(float(silent["force_N"])), "NaN", silent)
    loud = low.get(("2", "2"))
    check("the exciting order has a force", loud is not None and 10 < float(loud["force_N"]) < 13, "about 11 N", loud)
    for key in sorted(set(high) & set(low)):
        for column in ("outcome", "mode", "order"):
            equal(f"critical {key}: {column}", high[key][column], low[key][column])
        # The peaks are found to 1e-3 half widths, from different samples.
        for column, part in (("force_N", 1e-5), ("amplitude_m", 1e-5), ("force_speed_rpm", 1e-3)):
            a, b = float(high[key][column]), float(low[key][column])
            same = math.isnan(a) and math.isnan(b) or abs(a - b) <= part * abs(b)
            check(f"critical {key}: {column} does not depend on the range", same, b, a)


CRITICAL_TESTS = (test_critical,)
