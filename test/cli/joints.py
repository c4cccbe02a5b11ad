"""Forces at the joints, as a user runs them: oracles, tables, quantities in other tasks, refused input."""

import csv
import math
from pathlib import Path

from harness import Folder, Run, check, equal, near, series
from plots import drawn

DATA = Path(__file__).resolve().parents[2] / "data"
COMPRESSOR = (DATA / "compressor.nml").read_text()
RIGID = "joints.on='rigid'"
# At 0 and 180 deg the pin of the crank is the joint of the yoke.
SCOTCH_YOKE = """\
&drive speed_rpm=600 /
&joint name='O', type='ground', position=0,0 /
&joint name='A', type='crank', pivot='O', radius=0.06 /
&joint name='Y', type='RPP', ends='A', guide_point=0,0, guide_angle=0, slot_angle=90 /
&link name='crank', from='O', to='A', mass=1.6, inertia=0.004 /
&link name='block', from='A', mass=0.3, inertia=2e-4 /
&link name='yoke', from='Y', mass=2.4, inertia=0.012 /
&frame mass=38, inertia=1.1, origin=0,0 /
&support position=-0.25,-0.22, stiffness=1.4e5,5e4, damping=30,30 /
&support position=0.27,-0.2, stiffness=1.5e5,6e4, damping=30,30 /
"""


def rows_of(path):
    """Rows of a table as dictionaries; empty if there is no table."""
    if not path.exists():
        return []
    return list(csv.DictReader(line for line in path.read_text().splitlines() if line[0] != "#"))


def solve(folder, *settings, tasks="'joints'"):
    """Solves the machine with the task `joints`; returns the rows of joints.csv by joint, body and pair."""
    run = Run(folder, "-s", f"case.tasks={tasks}", *(word for one in settings for word in ("-s", one)), "-o", "new", "input.nml")
    if not run.done("joints: run"):
        return {}
    rows = rows_of(folder / "new" / "joints.csv")
    check("joints: rows of joints.csv", rows, "rows", "none")
    return {(row["joint"], row["on"], row["pair"]): row for row in rows}


def test_rigid():
    """The joint forces of the compressor on rigid ground agree with Newton and Euler's equations."""
    # Newton and Euler, a code of its own; the torque agrees with `rigid_torque` of the task `power` in all digits.
    with Folder(input=COMPRESSOR) as folder:
        rows = solve(folder, RIGID)
        if not rows:
            return
        crank, guide = rows["O", "crank", "pin"], rows["B", "piston", "guide"]
        near("O: peak", float(crank["f_peak_N"]), 1929.5402164, 1e-7)
        near("O: crank angle", float(crank["f_peak_crank_deg"]), 90, 0.01)
        near("O: rms", float(crank["f_rms_N"]), 1383.69084084, 1e-8)
        near("N: peak", float(guide["f_peak_N"]), 148.696793413, 1e-9)
        # N and, without weights, |T| are symmetric about 90 deg
        near("N: crank angle", abs(float(guide["f_peak_crank_deg"]) - 90), 90 - 46.6195383, 0.05)
        near("T: peak", float(crank["m_peak_Nm"]), 26.810821582, 1e-9)
        near("T: crank angle", abs(float(crank["m_peak_crank_deg"]) - 90), 127.078264 - 90, 0.05)
        history = rows_of(folder / "new" / "joints_history.csv")
        near("T at 0 deg", float(history[0]["m_O:crank_Nm"]), 10.34361683076, 1e-10)
        check("bounds", all(0 < float(row["f_peak_error_N"]) < 1e-8 for row in rows.values()), "small", rows)


def test_mounts():
    """The joint forces of the compressor on its mounts agree with Newton and Euler's equations, body by body."""
    # The forces on the frame, which the oracle does not use, satisfy the frame's own law to 5e-13 N. The exact frame of the oracle
    # is solved to 1e-10 of its motion.
    with Folder(input=COMPRESSOR) as folder:
        rows = solve(folder, "accuracy.tolerance=1e-12")
        if not rows:
            return
        crank, guide = rows["O", "crank", "pin"], rows["B", "piston", "guide"]
        near("O: peak", float(crank["f_peak_N"]), 1771.721129, 1e-6)
        near("O: crank angle", float(crank["f_peak_crank_deg"]), 90.166434, 0.01)
        near("O: rms", float(crank["f_rms_N"]), 1276.6119652, 1e-6)
        near("N: peak", float(guide["f_peak_N"]), 130.2669608, 1e-6)
        near("N: crank angle", float(guide["f_peak_crank_deg"]), 132.059694, 0.05)
        history = rows_of(folder / "new" / "joints_history.csv")
        at = next(row for row in history if abs(float(row["crank_deg"]) - 45) < 1e-9)
        near("T at 45 deg", float(at["m_O:crank_Nm"]), -23.96250607, 1e-7)


def test_gas():
    """With the gas of a compressor the peak at the main bearing tends to that of the exact cycle as its harmonics grow."""
    # Oracle: at the kink where the discharge valve opens; the torque agrees with the closed form of the indicated work. A Fourier
    # series of h harmonics rounds the kink off by a part that falls as 1/h.
    gas = ("&load name='gas', on='piston', joint='B', type='polytropic', direction=180, bore=0.07, clearance=0.06, suction=1,\n"
           "  discharge=8, ambient=1, exponent=1.3, harmonics={} /\n")
    peaks = []
    for harmonics in (250, 500):
        with Folder(input=COMPRESSOR + gas.format(harmonics)) as folder:
            rows = solve(folder, RIGID)
            if not rows:
                return
            peaks.append(float(rows["O", "crank", "pin"]["f_peak_N"]))
            sources = rows_of(folder / "new" / "joints_sources.csv")
            check("causes", "gas" in {row["cause"] for row in sources}, "gas", sources[:4])
    near("peak", 2 * peaks[1] - peaks[0], 1655.103861, 0.2)


def test_yoke():
    """The block of a Scotch yoke, whose pin crosses the guide, carries its own mass; the axis of the block is that of the slot."""
    radius, block, yoke, omega = 0.06, 0.3, 2.4, 20 * math.pi
    with Folder(input=SCOTCH_YOKE) as folder:
        rows = solve(folder, RIGID)
        if not rows:
            return
        history = rows_of(folder / "new" / "joints_history.csv")
        for what, column, law in (
                ("crank on block, x", "fx_A:block", lambda turned: -(block + yoke) * math.cos(turned)),
                ("crank on block, y", "fy_A:block", lambda turned: -block * math.sin(turned)),
                ("along the slot", "axial_A:block", lambda turned: -block * math.sin(turned)),
                ("block on yoke, x", "fx_A:slot", lambda turned: -yoke * math.cos(turned)),
                ("block on yoke, across the slot", "transverse_A:slot", lambda turned: yoke * math.cos(turned)),
                ("block on crank, y", "fy_A:crank", lambda turned: block * math.sin(turned))):
            for row in history:
                right = radius * omega**2 * law(math.radians(float(row["crank_deg"])))
                # a force that is zero all the time has rounding errors of the others
                near(f"yoke: {what} at {row['crank_deg']}", float(row[f"{column}_N"]), right, 1e-12 * 640)
        equal("yoke: pairs", sorted(rows), [("A", "block", "pin"), ("A", "crank", "pin"), ("A", "yoke", "slot"), ("O", "crank", "pin"),
                                            ("Y", "yoke", "guide")])


def test_tables():
    """The tables of joint forces agree with each other, and the parts of a force add up to its peak."""
    with Folder(input=COMPRESSOR) as folder:
        rows = solve(folder, "joints.axes='link'", tasks="'joints','power'")
        if not rows:
            return
        history = rows_of(folder / "new" / "joints_history.csv")
        power = rows_of(folder / "new" / "power.csv")
        numbers = {name: [float(row[name]) for row in history] for name in history[0]}
        torque = [float(row["torque_Nm"]) for row in power]
        # both bound to 1e-9 of the motion
        series("torque", numbers["m_O:crank_Nm"], torque, 1e-7 * max(map(abs, torque)))
        for (joint, body, pair), row in rows.items():
            name = f"{joint}:{body if pair == 'pin' else pair}"
            sides = [[x * x + y * y for x, y in zip(numbers[f"{one}_{name}_N"], numbers[f"{two}_{name}_N"])]
                     for one, two in (("fx", "fy"), ("axial", "transverse"))]
            series(f"{name}: axes", sides[0], sides[1], 1e-9 * max(sides[0]))
            # 360 samples of a period, of orders up to about 20
            near(f"{name}: peak", max(numbers[f"f_{name}_N"]), float(row["f_peak_N"]), 1e-2 * float(row["f_peak_N"]))
        sources = rows_of(folder / "new" / "joints_sources.csv")
        for joint, body, pair in rows:
            parts = [float(row["at_peak_N"]) for row in sources if (row["joint"], row["on"], row["pair"]) == (joint, body, pair)]
            # at the nearest of the samples
            near(f"{joint}, {body}: parts", sum(parts), float(rows[joint, body, pair]["f_peak_N"]),
                 1e-2 * float(rows[joint, body, pair]["f_peak_N"]))


def test_quantities():
    """A joint force has the same value as quantity, in a sweep, and as a level that a boundary search finds."""
    text = COMPRESSOR + ("&response quantities='joint(O).f','joint(B:guide).n' /\n"
                         "&sweep parameter='drive.speed_rpm', from=1000, to=1450, count=2, columns='joint(O).f' /\n")
    with Folder(input=text) as folder:
        rows = solve(folder, tasks="'joints','response','sweep'")
        if not rows:
            return
        found = {row["quantity"]: float(row["value"]) for row in rows_of(folder / "new" / "quantities.csv")}
        near("response", found["joint(O).f"], float(rows["O", "crank", "pin"]["f_peak_N"]), 1e-6)
        near("normal force", found["joint(B:guide).n"], float(rows["B", "piston", "guide"]["f_peak_N"]), 1e-6)
        swept = rows_of(folder / "new" / "sweep.csv")
        near("sweep", float(swept[-1]["joint(O).f_peak_N"]), found["joint(O).f"], 1e-5)


def test_studies():
    """Level boundaries, sensitivity and design take joint forces, and their results agree with single machines."""
    text = COMPRESSOR + ("&sensitivity quantities='joint(O).f' /\n&boundary quantity='joint(O).f', level=1800 /\n"
                         "&sweep parameter='drive.speed_rpm', from=1300, to=1500, count=3 /\n")
    goal = ("&design parameter='link(crank).center(1)', from=-0.03, to=0.03, starts=1 /\n"
            "&objective quantity='joint(O).f', measure='rms' /\n")

    def bearing(column, setting):
        return float(solve(folder, setting)["O", "crank", "pin"][column])

    with Folder(input=text) as folder:
        run = Run(folder, "-q", "-s", "case.tasks='boundary','sensitivity'", "-o", "studies", "input.nml")
        if not run.done("studies"):
            return
        border = rows_of(folder / "studies" / "boundary.csv")[0]
        # the boundary is found to 1e-10 of the range of speeds
        near("level", bearing("f_peak_N", f"drive.speed_rpm={border['drive.speed_rpm']}"), 1800, 1e-4)
        row = next(row for row in rows_of(folder / "studies" / "sensitivity.csv") if row["parameter"] == "frame.mass")
        change = bearing("f_peak_N", "frame.mass=45.045") - bearing("f_peak_N", "frame.mass=44.955")
        # for 0.2 % of the mass; the quotient errs by terms of third order
        near("sensitivity", float(row["peak_change_percent_per_percent"]), change / float(row["peak"]) / 0.002, 1e-5)
    with Folder(input=COMPRESSOR + goal) as folder:
        run = Run(folder, "-q", "-s", "case.tasks='design'", "-o", "studies", "input.nml")
        if not run.done("design"):
            return
        found = rows_of(folder / "studies" / "design.csv")[0]
        goals = rows_of(folder / "studies" / "design_goals.csv")[0]
        # the optimum is flat; both solve the same machine to 1e-9
        near("design", bearing("f_rms_N", f"link(crank).center={found['after']},0"), float(goals["after"]), 1e-4)
        check("better", float(goals["after"]) < 0.4 * float(goals["before"]), "a third of the force", goals)


def test_data_files():
    """On every machine in data/ the moment at the crank's pivot is the driving torque of the task power."""
    for path in sorted(DATA.glob("*.nml")):
        with Folder(input=path.read_text()) as folder:
            rows = solve(folder, tasks="'joints','power'")
            history, power = (rows_of(folder / "new" / f"{name}.csv") for name in ("joints_history", "power"))
            check(f"{path.name}: tables", rows and history and power, "rows", (len(rows), len(history), len(power)))
            # geared shafts share the torque by their ratios
            shafts = [name for name in (history or [{}])[0] if name.startswith("m_") and not name.endswith(("guide_Nm", "slot_Nm"))]
            if len(shafts) != 1:
                continue
            torque = [float(row["torque_Nm"]) for row in power]
            # data/khang_four_bar.nml is solved about rest, where the torque has an error of third order in the motion
            series(f"{path.name}: torque", [float(row[shafts[0]]) for row in history], torque, 1e-8 * max(map(abs, torque)))


def test_pictures():
    """Every table of joint forces has a picture."""
    with Folder(input=COMPRESSOR) as folder:
        solve(folder)
        texts = drawn("joints", folder / "new")
        if texts:
            check("load diagram", "O: frame on crank" in texts.get("joints", ""), "its title", texts.get("joints"))


def test_refused():
    """Unknown joints and forces that are not determined are refused in one line."""
    with Folder(input=COMPRESSOR + "&joints names='C' /\n") as folder:
        run = Run(folder, "-s", "case.tasks='joints'", "input.nml")
        equal("unknown joint", (run.code, run.out), (2, ""))
        check("unknown joint: message", "&joints: names = 'C': there is no joint 'C' at which forces act" in run.err, "names it", run.err)
    with Folder(input=COMPRESSOR.replace("from='A', to='B'", "from='O', to='B'")) as folder:
        run = Run(folder, "-s", "case.tasks='joints'", "input.nml")
        equal("no body", run.code, 2)
        check("no body: message", "no body carries both joints 'O' and 'B' of link 'rod'" in run.err, "names them", run.err)


JOINT_TESTS = [test_rigid, test_mounts, test_gas, test_yoke, test_tables, test_quantities, test_studies, test_data_files,
               test_pictures, test_refused]
