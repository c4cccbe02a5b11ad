"""Every vibration comes with the verdict of the machine, and a large one with a remark on the linear equations.

The sieve rocks on torsion springs; at 229 1/min, near twice its natural frequency of 114 1/min, parametric resonance makes the
rocking grow, at 120 and 300 1/min it does not (Mathieu's first tongue).
"""

import csv
import itertools
import json
import re
import shutil

from harness import SVG_ONLY, Folder, Run, check, equal, files

SIEVE = """&case title = 'Sieve', tasks = 'response', 'forces', 'power' /
&drive speed_rpm = 229.0 /
&joint name='O', type='ground', position=0.0,0.0 /
&joint name='A', type='crank', pivot='O', radius=0.12 /
&link name='eccentric', from='O', to='A', mass=9.0, inertia=0.02, center=0.12,0.0 /
&frame mass=40.0, inertia=2.0, origin=0.5,0.0, dof='psi' /
&foundation stiffness=0.0,0.0,0.0, 0.0,0.0,0.0, 0.0,0.0,630.0, damping=0.0,0.0,1.5 /
&probe name='lip', position=0.4,0.1, limit_mm_s=2000.0, band_hz=1.0,1000.0 /
"""
SPEEDS = "&sweep parameter='drive.speed_rpm', from=120, to=300, count=19 /\n&resonance quantities='psi' /\n"
ABOUT_REST = ["-s", "model.frame='rest'"]
LEFT = "UNSTABLE: the machine leaves this vibration"
TASKS = [("response",), ("forces",), ("power",), ("response", "forces"), ("response", "power"), ("sensitivity",)]


def tasks(*names):
    return ["-s", "case.tasks=" + ",".join(f"'{name}'" for name in names)]


def table(path):
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    return list(csv.DictReader(lines))


def head(path):
    """The # lines of a file."""
    return [line for line in path.read_text().splitlines() if line.startswith("#")]


def test_vibrations():
    """An unstable verdict comes first and again before the vibration."""
    for names in TASKS:
        what = "verdict, tasks " + ", ".join(names)
        with Folder(input=SIEVE) as folder:
            run = Run(folder, *tasks(*names), "input.nml")
            run.done(what)
            sections = re.findall(r"^(PERIODIC|FORCES|VIBRATION AT|DRIVE|SENSITIVITY)[^\n]*\n([^\n]*)", run.out, re.M)
            equal(f"{what}: comes first", run.out.find("VERDICT  unstable") in range(1, run.out.find(sections[0][0])), True)
            equal(f"{what}: sections", [line for _, line in sections], ["  " + LEFT] * len(sections))
            for name in files(folder / "input"):
                if name.endswith(".csv"):
                    equal(f"{what}, {name}: head", head(folder / "input" / name)[-1],
                          "# verdict: unstable: the machine leaves this vibration")
            check(f"{what}: no file that was not asked for", not (folder / "input/multipliers.csv").exists(), "none", "one")
            Run(folder, "-q", "--fail-if-unstable", *tasks(*names), "input.nml").done(f"{what}: exit code", 10)
            run = Run(folder, "--fail-if-unstable", *tasks(*names), "-s", "drive.speed_rpm=300", "input.nml")
            run.done(f"{what}, stable")
            check(f"{what}, stable: no alarm", "UNSTABLE" not in run.out and "VERDICT  stable" in run.out, "stable", run.out)


def test_limits():
    """A limit met by an unstable machine is marked as meaningless."""
    with Folder(input=SIEVE) as folder:
        run = Run(folder, *tasks("response"), "input.nml")
        check("limit of an unstable machine", re.search(r"% of the limit [^:]* " + LEFT, run.flat), LEFT, run.out)


def test_one_line():
    """--one-line ends with the verdict."""
    with Folder(input=SIEVE) as folder:
        for names, header in ((("response", "forces"), "xi_peak_m,eta_peak_m,psi_peak_rad,f_peak_N,"
                               "probe(lip).v_band_mm_s,verdict"), (("power",), "torque_peak_Nm,verdict")):
            for speed, word in ((229, "unstable"), (300, "stable")):
                run = Run(folder, "--one-line", *tasks(*names), "-s", f"drive.speed_rpm={speed}", "input.nml")
                lines = list(csv.reader(run.out.splitlines()))
                equal(f"--one-line, {names}: columns", ",".join(lines[0][2:]), header)
                equal(f"--one-line, {names} at {speed}: verdict", lines[1][-1], word)


def test_over_speeds():
    """Studies over the speed report unstable speeds."""
    with Folder(input=SIEVE + SPEEDS) as folder:
        run = Run(folder, *tasks("resonance", "campbell"), "input.nml")
        run.done("speeds")
        out = folder / "input"
        reported = re.search(r"RESONANCE CURVE .*\n  UNSTABLE at (\d+) of (\d+) speeds, (\S+) to (\S+) rpm: disturbances", run.out)
        unstable = [float(row["speed_rpm"]) for row in table(out / "resonance.csv") if row["state"] == "unstable"]
        equal("speeds: unstable", bool(reported and unstable), True)
        if reported and unstable:
            equal("speeds: how many", (int(reported[1]), int(reported[2])), (len(unstable), len(table(out / "resonance.csv"))))
            check("speeds: from, to", abs(float(reported[3]) - unstable[0]) < 1e-3 and abs(float(reported[4]) - unstable[-1]) < 1e-3,
                  (unstable[0], unstable[-1]), reported[0])
        for name in ("resonance.csv", "peaks.csv"):
            check(f"{name}: head", head(out / name)[-1].startswith("# verdict: unstable at "), "the verdict",
                  head(out / name))
        narrow = Run(folder, *tasks("critical"), "-s", "sweep(1).from=225", "-s", "sweep(1).to=235", "-o", "narrow", "input.nml")
        check("critical speeds without a crossing: report", re.search(
            r"CRITICAL SPEEDS.*\n  UNSTABLE at 19 of 19 speeds, 225 to 235 rpm: a free vibration grows\n +no natural frequency crosses", narrow.out), "it", narrow.out)
        check("critical speeds without a crossing: head", head(folder / "narrow/critical.csv")[-1].startswith("# verdict: unstable at "),
              "the verdict", head(folder / "narrow/critical.csv"))
        for name in ("critical", "campbell"):
            Run(folder, "-q", *tasks(name), "-o", name, "input.nml").done(f"{name}: about rest")
            check(f"{name}: model", "# model: rest" in head(folder / f"{name}/{name}.csv"), "rest", head(folder / f"{name}/{name}.csv"))
        check("modes: report", re.search(r"CAMPBELL DIAGRAM .*\n  UNSTABLE at .* a free vibration grows\n", run.out), "it", run.out)
        for name in ("resonance", "critical", "campbell"):
            Run(folder, "-q", "--fail-if-unstable", *tasks(name), "input.nml").done(f"{name}: exit code", 10)
            Run(folder, "-q", "--fail-if-unstable", *tasks(name), "-s", "sweep(1).from=260", "input.nml").done(f"{name}, stable")


def test_sweep():
    """Peaks swept alone include the verdict and the same numbers."""
    for engine in ("direct", "expansion"):
        with Folder(input=SIEVE + SPEEDS) as folder:
            settings = [*tasks("sweep"), "-s", f"sweep.engine={engine}"]
            run = Run(folder, *settings, "-s", "sweep.columns=psi_peak_rad", "input.nml")
            run.done(f"peaks alone, {engine}")
            header = [line for line in (folder / "input/sweep.csv").read_text().splitlines() if line[0] != "#"][0]
            equal(f"peaks alone, {engine}: columns", header, "drive.speed_rpm,psi_peak_rad,verdict")
            alone = table(folder / "input/sweep.csv")
            check(f"peaks alone, {engine}: report", re.search(r"^  unstable +\d+ points", run.out, re.M), "unstable points", run.out)
            Run(folder, "-q", *settings, "-o", "all", "input.nml").done(f"all columns, {engine}")
            every = table(folder / "all/sweep.csv")
            equal(f"peaks alone, {engine}: verdicts", [row["verdict"] for row in alone], [row["verdict"] for row in every])
            equal(f"peaks alone, {engine}: peaks", [float(row["psi_peak_rad"]) for row in alone],
                  [float(row["psi_peak_rad"]) for row in every])
            equal(f"peaks alone, {engine}: both verdicts", {row["verdict"] for row in alone} >= {"stable", "unstable"}, True)
            Run(folder, "-q", "--fail-if-unstable", *settings, "-s", "sweep.columns=psi_peak_rad", "-o", "new",
                "input.nml").done(f"peaks alone, {engine}: exit code", 10)


def test_combinations():
    """Last line, exit code and JSON agree for all combinations of tasks.

    The machine is unstable at 229 1/min only, so the verdict follows from the speeds that the tasks consider.
    """
    single, ranges = ("stability", "response", "power"), ("resonance", "campbell", "sweep")
    every = single + ranges
    with Folder(input=SIEVE + SPEEDS.replace("count=19", "count=7")) as folder:
        for names in (pick for n in range(1, len(every) + 1) for pick in itertools.combinations(every, n)):
            for speed, range_from in ((229, 120), (300, 120), (229, 270), (300, 270)):
                machine = "unstable" if speed == 229 else "stable"
                over_range = "unstable" if range_from == 120 else "stable"
                seen = {machine} if set(names) & set(single) else set()
                seen |= {over_range} if set(names) & set(ranges) else set()
                wanted = "unstable" if "unstable" in seen else "stable"
                what = f"combination {', '.join(names)} at {speed} from {range_from}"
                run = Run(folder, "--json", "--fail-if-unstable", *tasks(*names), "-s", f"drive.speed_rpm={speed}", "-s",
                          f"sweep(1).from={range_from}", "input.nml")
                equal(f"{what}: code", run.code, 10 if wanted == "unstable" else 0)
                found = json.loads((folder / "input/results.json").read_text())
                equal(f"{what}: JSON", found["verdict"], wanted)
                last = run.out.splitlines()[-1]
                word = re.match(r"VERDICT  (\w+)", last)
                if word:
                    equal(f"{what}: last line", word[1].lower(), wanted)
                    equal(f"{what}: last line, the machine", bool(re.search(r"; (the machine of the input is|at the speed of the input) "
                                                                            "stable", last)), len(seen) == 2 and machine == "stable")
                else:
                    equal(f"{what}: last line", (names, "unstable" in last), (("sweep",), wanted == "unstable"))


def test_small():
    """Rotations beyond small angles are pointed out everywhere.

    psi is 0.17 rad; the limit is 0.1 rad.
    """
    for names in TASKS:
        with Folder(input=SIEVE) as folder:
            run = Run(folder, *tasks(*names), *ABOUT_REST, "input.nml")
            check(f"small, {names}", re.search(r"BEYOND SMALL MOTIONS: psi reaches 0\.168 rad\n.*psi up to 0\.1 rad", run.out),
                  "psi and its limit", run.out)
            # a tenth of the eccentric shakes a tenth
            run = Run(folder, *tasks(*names), *ABOUT_REST, "-s", "link.mass=0.9", "input.nml")
            check(f"small, {names}: a light eccentric", "BEYOND" not in run.out, "nothing", run.out)
            run = Run(folder, *tasks(*names), "input.nml")
            check(f"small, {names}: the exact frame may go far", run.code == 0 and "BEYOND" not in run.out, "nothing", run.out)
    with Folder(input=SIEVE + SPEEDS) as folder:
        run = Run(folder, *tasks("resonance", "critical", "sweep"), "input.nml")
        run.done("small, speeds of the exact frame")
        check("small, speeds of the exact frame", "BEYOND" not in run.out and "not small" not in run.out, "nothing", run.out)
        run = Run(folder, *tasks("resonance", "sweep"), *ABOUT_REST, "input.nml")
        # in both sections, and in the last line
        equal("small, resonance and sweep", len(re.findall("BEYOND SMALL MOTIONS", run.out)), 3)
        for row in table(folder / "input/resonance.csv"):
            equal(f"small_motion at {row['speed_rpm']}", row["small_motion"], "10"[float(row["psi_peak_rad"]) > 0.1])


def test_great():
    """Very large rotations of the exact model are pointed out.

    Springs and dampers are linear in the exact model too: beyond half a radian the report questions this.
    """
    with Folder(input=SIEVE) as folder:
        for speed, great in (("117", True), ("229", False)):
            run = Run(folder, *tasks("response"), "-s", f"drive.speed_rpm={speed}", "input.nml")
            run.done(f"great, {speed} rpm")
            psi = float(re.search(r"^  psi +([0-9.]+) .* mrad", run.out, re.M)[1]) / 1000
            check(f"great, {speed} rpm: psi = {psi} rad", (psi > 0.5) == great, great, psi)
            check(f"great, {speed} rpm", ("LARGE MOTIONS: psi reaches 3.42 rad\n" in run.out) == great, great, run.out)


def test_page():
    """Page and pictures show the verdict in their headlines."""
    if not shutil.which("gnuplot"):
        print("skip  the verdict on a page: there is no gnuplot")
        return
    with Folder(input=SIEVE) as folder:
        Run(folder, "-q", "--report", *tasks("response"), *ABOUT_REST, "input.nml", environment=SVG_ONLY).done("page")
        page = (folder / "input/report.html").read_text(encoding="utf-8")
        top = page.partition('<section id="summary">')[2].partition("</section>")[0]
        check("page: verdict", '<p class="verdict unstable"><strong>unstable</strong>' in top, "in the headline", top[-900:])
        check("page: a limit is no comfort", f'<li class="unstable">{LEFT}; lip: ' in top, LEFT, top[-900:])
        check("page: small motions", '<li class="undecided">BEYOND SMALL MOTIONS' in top, "it", top[-900:])
        for name in ("response", "harmonics", "probes"):
            check(f"{name}.gp: title", '"UNSTABLE: ' in (folder / "input" / f"{name}.gp").read_text(), "UNSTABLE", "none")
    with Folder(input=SIEVE + SPEEDS) as folder:
        Run(folder, "-q", "--report", *tasks("resonance"), "input.nml", environment=SVG_ONLY).done("page of a curve")
        page = (folder / "input/report.html").read_text(encoding="utf-8")
        top = page.partition('<section id="summary">')[2].partition("</section>")[0]
        check("page of a curve", '<p class="verdict unstable">UNSTABLE at ' in top, "in the summary", top[-600:])
        check("resonance.gp: title", '"UNSTABLE IN PART: ' in (folder / "input/resonance.gp").read_text(), "UNSTABLE", "none")


# The frame is lighter than its mechanism and stands on soft mounts. Rounding limits its vibration to eight digits.
SWINGING = """&case tasks='stability' /
&drive speed_rpm=-1523, held_by='outside' /
&joint name='j1', type='ground', position=0,0 /
&joint name='j2', type='crank', pivot='j1', radius=0.02765, phase=57.94 /
&joint name='j3', type='ground', position=0.1278,0 /
&joint name='j4', type='RRR', ends='j2','j3', lengths=0.09762,0.06686, branch=1 /
&joint name='j5', type='PRP', guide='j3','j4', guide_point=-0.009455,-0.01926, guide_angle=0, guide2_point=0.1278,0.05601,
       guide2_angle=-15.54 /
&link name='l1', from='j1', to='j2', mass=0.4455, inertia=1.138e-5, center=6.091e-4,0 /
&link name='l2', from='j2', to='j4', mass=1.055, inertia=4.753e-4, center=0.06003,0 /
&link name='l3', from='j3', to='j4', mass=0.9162, inertia=2.671e-4, center=0.02432,0 /
&link name='l4', from='j5', mass=1.228, inertia=7.361e-5, center=-0.005464,0 /
&frame mass=2.294, inertia=4.783e-3, origin=0.02461,0.01646 /
&support position=-0.05904,-0.028, stiffness=2933,1788, damping=0.2372,0.08432 /
&support position=-0.03564,-0.005451, stiffness=3640,1811, damping=0.439,0.2133, angle=-51.86 /
&support position=0.03242,-0.02709, stiffness=1683,934.8, damping=0.2035,0.1179, angle=-64.53 /
&support position=0.06497,-0.0238, stiffness=4010,2389, damping=0.4725,0.1713 /
&gravity /
"""


def test_rounding():
    """No smaller tolerance is suggested if rounding leaves the verdict undecided."""
    with Folder(input=SWINGING) as folder:
        for tolerance in ("1e-9", "1e-12"):
            run = Run(folder, "-s", f"accuracy.tolerance={tolerance}", "input.nml")
            check(f"open by rounding, {tolerance}", "VERDICT  undecided" in run.out and "a smaller tolerance would not help" in run.flat
                  and "too coarse" not in run.flat, "no advice", run.out[-1500:])


VERDICT_TESTS = (test_rounding, test_vibrations, test_combinations, test_limits, test_one_line, test_over_speeds, test_sweep, test_small, test_great, test_page)
