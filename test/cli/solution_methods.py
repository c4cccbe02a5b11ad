"""The methods of solution as a user sees them: reduction, factors, methods by name, separate parts, resonance, the comparison
of methods."""

import csv
import math
import re
from pathlib import Path

from broken_inputs import REST, SOUND
from harness import QUANTITIES, Folder, Run, Table, check, equal, files, near, tables

GOLDEN = Path(__file__).resolve().parent / "golden"
DATA = Path(__file__).resolve().parents[2] / "data"

# ln rho of the upper half plane and the real axis (modulus, argument) and x0, in quadruple precision: the rows
# 'speed: 0.01 rpm', 'speed: 1 rpm', 'stiffness: springs 1e15', 'damping: dampers times 20000' and
# 'damping: dampers times 5000' of validation/extremes/references.dat, and the method that the report states.
REFERENCES = {
    "drive.speed_rpm=0.01": (
        r"by reduction on \d+ angles",
        [(-77.519379844963640591, 0.40161015338120034), (-95.604132266545486101, 2.9217277279251417),
         (-148.75590309082193241, 1.8001623831988270)],
        [3.0542272927798483876e-13, 3.0577650056273955459e-15, -1.0211207949867980022e-12, 1.6685854920333602422e-16,
         1.9380489330284702374e-17, -6.5469378242272547439e-16]),
    "drive.speed_rpm=1": (
        r"by reduction on \d+ angles",
        [(-0.77519379868979362966, 1.1978207115797571), (-0.95604132240613794318, 1.4743505850304958),
         (-1.4875590309273790852, 2.2171162218180149)],
        [3.0542313950952512113e-09, 3.0577487141463443525e-11, -1.0211219992755572839e-08, 1.6685908205853865747e-10,
         1.9380404284869403188e-11, -6.5469548403508691560e-10]),
    "support.stiffness=1.96133e20": (
        r"by reduction on \d+ angles",
        [(-3.2299741602067183500e-3, 0.78354196089481806), (-3.9835055053666620188e-3, 2.3876647363819404),
         (-6.1981626345237473729e-3, 2.1888460584601393)],
        [1.7592349224483502934e-19, 1.7612726512239542803e-21, -5.8816557856152400984e-19, 2.3066525642564901218e-18,
         2.6791588514098110574e-19, -9.0504867800061818112e-18]),
    "foundation.damping=1e4,1e4,1e3": (
        r"by reduction on \d+ angles",
        [(-6.4349816917650764960, 0.0), (-24.113992384698872769, 0.0), (-40.432924981069546259, 0.0),
         (-102.78148641861116622, 0.0), (-105.07362689865040459, 0.0), (-257.62867962909002795, 0.0)],
        [4.3117490908749488304e-05, -1.9147593347091487067e-06, -1.2574616407761311080e-04, 3.1927500996459354824e-03,
         3.0108893489859617430e-04, -1.1846993677631300606e-02]),
    "foundation.damping=2.5e3,2.5e3,250": (
        r"by \w+ with \d+ steps in \d+ factors",
        [(-16.150028228023281615, 2.5874762246895579), (-20.796956303213827569, 0.034085885376222128),
         (-30.111226969248527601, 0.72312532368287418)],
        [1.3907515356809650669e-04, 1.0853900808943679954e-06, -4.5705035559932889899e-04, 4.2850786228358958819e-03,
         1.4487688233320944593e-04, -1.5493044298117088290e-02]),
}


def upper_half(table):
    """The multipliers on and above the real axis. Checks that each is followed by its conjugate."""
    chosen = []
    for k in range(len(table.rows)):
        if table["im"][k] < 0:
            pair = k > 0 and table["im"][k - 1] == -table["im"][k] and table["log_abs"][k - 1] == table["log_abs"][k]
            check(f"multiplier {k + 1}: its conjugate stands before it", pair, "a pair, +im first", table.rows[k])
        else:
            chosen.append(k)
    return chosen


def test_references():
    """Extreme machines are solved efficiently and agree with quadruple precision."""
    for setting, (way, logarithms, start) in REFERENCES.items():
        with Folder(input=SOUND + REST) as folder:
            run = Run(folder, "--verbose", "input.nml", "-s", setting)
            if not run.done(setting):
                continue
            # With steps over the whole period some of these would need hundreds of millions of evaluations.
            evaluations = [int(number) for number in re.findall(r"(\d+) evaluations[;,]", run.flat)]
            check(f"{setting}, work", len(evaluations) == 1 and evaluations[0] < 10000, "less than 10000 evaluations", evaluations)
            check(f"{setting}, verdict", "VERDICT  stable" in run.out, "stable", run.out)
            check(f"{setting}, way", re.search(way, run.flat), way, run.out)
            table = Table(folder / "input" / "multipliers.csv")
            chosen = upper_half(table)
            equal(f"{setting}, multipliers", len(chosen), len(logarithms))
            for k, (log_abs, arg) in zip(chosen, logarithms):
                bound = table["error"][k]
                # with springs 1e15 times as stiff a phase of 1e9 rad is accurate to 1e-5
                check(f"{setting}, multiplier {k + 1}, error", 0 < bound < 2e-5, "0 < error < 2e-5", bound)
                # the claimed bound; the modulus is far more accurate than the phase
                near(f"{setting}, multiplier {k + 1}, log_abs", table["log_abs"][k], log_abs, min(bound, 1e-10 * abs(log_abs)))
                near(f"{setting}, multiplier {k + 1}, arg", math.remainder(table["arg_rad"][k] - arg, 2 * math.pi), 0, bound)
            response = Table(folder / "input" / "response.csv")
            for part in (slice(0, 3), slice(3, 6)):
                greatest = max(map(abs, start[part]))
                for name, expected in zip(QUANTITIES[part], start[part]):
                    # the tolerance, with a digit for the velocities
                    near(f"{setting}, x0, {name}", response[name][0], expected, 1e-8 * greatest)


def test_methods():
    """Every method keeps its error bounds."""
    golden = Table(GOLDEN / "240" / "multipliers.csv")
    for method in ("explicit8", "magnus4", "magnus6", "gauss2", "gauss8"):
        with Folder(input=SOUND + REST) as folder:
            run = Run(folder, "--verbose", "input.nml", "-s", f"accuracy.method={method}")
            if not run.done(method):
                continue
            check(f"{method}, report", re.search(rf"\(tolerance 1e-9\), by {method} with \d+ steps,", run.flat), method, run.out)
            table = Table(folder / "input" / "multipliers.csv")
            for k, bound in enumerate(table["error"]):
                check(f"{method}, multiplier {k + 1}, error", 0 < bound < 1e-8, "0 < error < 1e-8", bound)
                # 1e-11 is the error of the golden numbers
                for name in ("re", "im"):
                    near(f"{method}, multiplier {k + 1}, {name}", table[name][k], golden[name][k], bound + 1e-11)


def test_reduced_by_name():
    """The method reduced is refused where it does not apply."""
    with Folder() as folder:
        options = ("-s", "accuracy.method=reduced")
        Run(folder, "-q", "input.nml", *options).refused(
            "reduced at 240 rpm", 4, "method 'reduced' cannot be used: the free vibrations are too slow compared with the rotation of the crank")
        equal("reduced at 240 rpm, files", files(folder), ["input.nml"])
        Run(folder, "-q", "input.nml", *options, "-s", "drive.speed_rpm=1", "-o", "named").done("reduced at 1 rpm")
        Run(folder, "-q", "input.nml", "-s", "drive.speed_rpm=1", "-o", "auto").done("auto at 1 rpm")
        named, auto = tables(folder / "named"), tables(folder / "auto")
        equal("reduced at 1 rpm equals auto", {k: t.rows for k, t in named.items()}, {k: t.rows for k, t in auto.items()})


def test_parts():
    """Uncoupled degrees of freedom are solved separately.

    Two oscillators with multipliers exp(lambda T). The second is damped so strongly that it is reduced, while the
    first is integrated.
    """
    mass, period, stiffness = 18.0 + 1.35, 0.25, 4 * 196133.0
    light, heavy = 5.0, 5e5
    with Folder() as folder:
        run = Run(folder, "--verbose", "input.nml", "-s", "frame.dof='xi','eta'", "-s", f"foundation.damping={light},{heavy},0")
        if not run.done("xi and eta"):
            return
        check("xi and eta, way", re.search(r"by gauss\d+ with \d+ steps and reduction on \d+ angles", run.flat), "both", run.out)
        check("xi and eta, parts", "2 decoupled subsystems were solved separately" in run.flat, "2 parts", run.out)
        table = Table(folder / "input" / "multipliers.csv")
        root = math.sqrt((heavy / (2 * mass)) ** 2 - stiffness / mass)
        fast = -(heavy / (2 * mass) + root)
        expected = sorted([-light / (2 * mass) * period] * 2 + [stiffness / mass / fast * period, fast * period], reverse=True)
        equal("xi and eta, multipliers", len(table.rows), 4)
        for k, log_abs in enumerate(expected):
            # relative rounding of an exponent of -6459, and the bound
            near(f"xi and eta, log_abs {k + 1}", table["log_abs"][k], log_abs, table["error"][k] + 1e-14 * abs(log_abs))
            check(f"xi and eta, error {k + 1}", table["error"][k] < 1e-9, "< 1e-9", table["error"][k])
        run = Run(folder, "--verbose", "input.nml", "-s", "frame.dof='xi','psi'")
        check("xi and psi act on each other", "solved separately" not in run.flat, "no parts", run.out)


def test_resonance():
    """An exact resonance is an error; a near one is reported."""
    stiffness = (18.0 + 1.35) * (5 * 2 * math.pi * 4) ** 2 / 4
    settings = ("-s", "frame.dof='xi'", "-s", f"support.stiffness={stiffness!r}")
    sentence = (r"the natural frequency (20|19\.99\d*) Hz is (5|4\.999\d*) times the crank speed \(order 5\); "
                r"multiplier \d is \S+ away from 1")
    with Folder(input=SOUND + REST) as folder:
        run = Run(folder, "-q", "input.nml", *settings, "-s", "foundation.damping=0,0,0")
        run.refused("resonance", 4, re.compile(rf"the periodic vibration cannot be computed: .*\(resonance\).*; {sentence}"))
        equal("resonance, files", files(folder / "input"), ["multipliers.csv"])
        # the exact frame has no vibration to linearise about; the message uses the vibration about rest
        run = Run(folder, "-q", "input.nml", *settings, "-s", "foundation.damping=0,0,0", "-s", "model.frame=exact", "-o", "exact")
        run.refused("resonance, exact", 4, re.compile(rf"no periodic vibration of the nonlinear equations was found; .*; the equations linearised about rest have no periodic vibration either; {sentence}"))
        equal("resonance, exact, files", files(folder / "exact"), [])
        run = Run(folder, "input.nml", *settings, "-s", "foundation.damping=50,0,0")
        if run.done("near resonance"):
            check("near resonance, report", re.search(rf"near resonance: {sentence}\b", run.flat), sentence, run.out)
        # 50 times the damping: no digit is lost
        run = Run(folder, "input.nml", *settings, "-s", "foundation.damping=2500,0,0")
        if run.done("damped well"):
            check("damped well, report", "near resonance" not in run.out, "no resonance", run.out)


def test_trade():
    """The task trade includes the method reduced where it applies."""
    with Folder() as folder:
        for speed, expected in (("1", 1), ("240", 0)):
            run = Run(folder, "input.nml", "-s", "case.tasks=trade", "-s", f"drive.speed_rpm={speed}", "-s", "model.frame=rest",
                      "-o", speed)
            if not run.done(f"trade at {speed} rpm"):
                continue
            lines = [line for line in (folder / speed / "trade.csv").read_text().splitlines() if line[0] != "#"]
            names = lines[0].split(",")
            rows = [dict(zip(names, line.split(","))) for line in lines[1:]]
            reduced = [row for row in rows if row["method"] == "reduced"]
            equal(f"trade at {speed} rpm, reduced", len(reduced), expected)
            for row in reduced:
                # it claims 1e-10 of Phi(T); the converged solution that it is compared with claims less than 1e-9
                check("trade, reduced, errors", all(float(row[f"error_{name}"]) < 1e-9 for name in ("phi", "rho", "x0")),
                      "< 1e-9", row)
                check("trade, reduced, angles", row["order"] == "0" and 0 < int(row["steps"]) < 200, "order 0, < 200", row)
                check("trade, the report recommends it", re.search(r" 1e-9 +reduced ", run.out), "reduced for 1e-9", run.out)
            equal(f"trade at {speed} rpm, integrated", {"rk4", "explicit8", "magnus4", "magnus6", "gauss8"}
                  - {row["method"] for row in rows}, set())


# All modes are overdamped or nearly so.
OVERDAMPED = """\
&case title='Overdamped', tasks='response' /
&drive speed_rpm=2.10915 /
&joint name='O', type='ground', position=0.0,0.0 /
&joint name='A', type='crank', pivot='O', radius=0.07055, phase=9.87942 /
&joint name='P', type='ground', position=0.10584,-0.10661 /
&joint name='C', type='RPR', ends='A','P', lengths=0.23335, branch=-1 /
&link name='crank', from='O', to='A', mass=0.67509, inertia=0.01479, center=0.14243,0.11942 /
&link name='block', from='A', to='P', mass=0.36614, inertia=0.00449, center=0.06275,0.00574 /
&link name='lever', from='P', to='C', mass=0.25289, inertia=0.00457, center=-0.03364,0.07169 /
&frame mass=0.16405, inertia=0.02427, origin=0.06076,-0.06469, dof='xi','eta','psi' /
&support position=0.07480,-0.14831, stiffness=0.07234,0.17422, damping=1.18313,1.65491, angle=39.77949 /
&support position=0.10108,-0.14018, stiffness=0.29343,0.06631, damping=1.08523,0.34030, angle=0.0 /
&support position=-0.14905,-0.32779, stiffness=0.14940,0.10266, damping=0.15705,0.74867, angle=34.47581 /
&support position=0.43732,0.51867, stiffness=0.30237,0.11787, damping=1.47043,1.52239, angle=-0.0 /
&foundation stiffness=0.04390,-0.04519,-0.00223,-0.04519,0.06292,0.00035,-0.00223,0.00035,0.00035, damping=0.53982,0.38689,0.02591 /
"""


def test_overdamped():
    """Error bounds of an overdamped machine hold and are small."""
    with Folder(input=OVERDAMPED) as folder:
        peaks = {}
        for method in ("auto", "gauss10"):
            run = Run(folder, "input.nml", "-o", method, "-s", f"accuracy.method='{method}'")
            if not run.done(f"overdamped, {method}"):
                return
            lines = run.out.split("PERIODIC VIBRATION")[1].splitlines()[3:6]
            peaks[method] = [[float(word) for word in re.findall(r"[-+.\de]*\d[-+.\de]*", line)[:2]] for line in lines]
        for auto, gauss in zip(peaks["auto"], peaks["gauss10"]):
            # the tolerance is 1e-9; the condition of the start is 7
            check("overdamped, claimed error", auto[1] < 1e-6 * auto[0], "1e-6 of the peak", auto)
            near("overdamped, peak", auto[0], gauss[0], 1e-4 * gauss[0] + auto[1])


# Near a dead point a local error arises in mid-turn, and strong damping removes it before the turn ends.
MID_TURN = """\
&case title='Local errors in mid-turn', tasks='response' /
&drive speed_rpm=9264.774065173902 /
&joint name='A0', type='ground', position=0.0,0.0 /
&joint name='A', type='crank', pivot='A0', radius=0.6672421006418059, phase=60.18584513557212 /
&joint name='J0', type='RPP', ends='A', slot_angle=43.17496011821451,
  guide_point=0.8561199323426971,-1.3999786904765725, guide_angle=-17.552972062742327 /
&joint name='J1', type='RPP', ends='J0', slot_angle=90.0, guide_point=1.4675224521820607,-1.1308530145396163,
  guide_angle=-75.29789678157528 /
&joint name='Q2', type='rigid', ends='A0','A', offset=0.8526811778993434,0.42565237078409784 /
&joint name='G2', type='ground', position=-2.078511273526963,1.4418076872919654 /
&joint name='J2', type='RRR', ends='Q2','G2', lengths=2.374477223188262,3.950747386087779, branch=1 /
&link name='l0', from='A0', mass=0.0021784752271873354, inertia=0.001461926438448936, to='A',
  center=0.39803050541395624,0.5323521369500472 /
&link name='l1', from='J0', mass=0.0008173705566112474, inertia=2.833836656850779e-05 /
&link name='l2', from='J1', mass=0.0020861916391901767, inertia=7.212454300174185e-05 /
&link name='l3', from='Q2', mass=0.0023987393695196245, inertia=0.003535540784757042, to='J2',
  center=0.3224888323017097,0.0 /
&link name='l4', from='G2', mass=0.000680147024107798, inertia=0.0008228764799773836, to='J2',
  center=1.3522059062261158,0.0 /
&frame mass=0.013299096676104679, inertia=0.01858969747258322, origin=0.3587766129766365,0.8494146606074289 /
&support position=-3.299338832453058,3.2567392314596377, stiffness=191901.14352385074,1246793.4072967274,
  damping=0.0002724147224277745,0.00027462438820976534 /
&support position=-1.8048124115026025,0.6528056621309871, stiffness=419477.8782234779,498194.5240135626,
  damping=4.97249277078601,13.224161020646292 /
&support position=2.7763707854349398,-2.4537275748507055, stiffness=382278.95713569556,391809.314333715,
  damping=105.74380728136556,114.16337668382178 /
"""


def test_mid_turn():
    """Error bounds cover errors that arise in mid-turn."""
    with Folder(input=MID_TURN + REST) as folder:
        rows = {}
        for name, accuracy in (("rough", ["tolerance=1e-8", "method='gauss5'"]), ("sharp", ["tolerance=1e-13", "method='gauss10'"])):
            settings = [word for key in accuracy for word in ("-s", f"accuracy.{key}")]
            run = Run(folder, "input.nml", "-o", name, *settings)
            if not run.done(f"mid-turn, {name}"):
                return
            rows[name] = Table(folder / name / "response.csv")
            lines = run.out.split("PERIODIC VIBRATION")[1].splitlines()[3:6]
            # errors of xi, eta and psi, printed in mm and mrad with one digit
            rows[name + " error"] = [float(re.split(r"  +", line.strip())[2]) / 1000 for line in lines]
        for column, error in zip(QUANTITIES, rows["rough error"]):
            miss = max(abs(a - b) for a, b in zip(rows["rough"][column], rows["sharp"][column]))
            check(f"mid-turn, {column}", 0 < miss <= error, f"at most {error}", miss)
            check(f"mid-turn, no more than that, {column}", error <= 10 * miss, f"at most 10 times {miss}", error)


# A frame with little inertia between strong dampers: its rotation decays 1e4 times within a degree of the crank.
COMPRESSORS = (("frame.inertia=1e-3", "support.damping=6e4"), ("frame.inertia=1e-2", "support.damping=6e4"),
               ("frame.inertia=1.6e-4", "support.damping=6e4", "frame.mass=1620"))


def test_overdamped_probes():
    """Error bounds of overdamped probes are finite and small."""
    for settings in COMPRESSORS:
        with Folder() as folder:
            changes = [word for setting in settings for word in ("-s", setting)]
            run = Run(folder, DATA / "compressor.nml", "-o", "out", "-s", "case.tasks='response'", "-s",
                      "model.frame='rest'", *changes)
            if not run.done(f"overdamped compressor, {settings}"):
                return
            check("overdamped compressor, report", "NaN" not in run.out, "no NaN", settings)
            lines = (folder / "out/probes.csv").read_text().splitlines()
            for row in csv.DictReader(line for line in lines if not line.startswith("#")):
                for key, value in row.items():
                    if "_peak_error_" not in key:
                        continue
                    peak = float(row[key.replace("_peak_error_", "_peak_")])
                    # the tolerance is 1e-9; accelerations are less accurate by the fastest decay, 1e4 per turn
                    check("overdamped compressor, claimed error", 0 < float(value) <= 1e-2 * peak, f"1e-2 of {peak}",
                          f"{key} = {value} with {settings}")


def test_too_few_steps():
    """With far too few steps the results are reported as lost."""
    with Folder() as folder:
        run = Run(folder, DATA / "khang_four_bar.nml", "--verbose", "-o", "out", "-s", "case.tasks='stability'", "-s",
                  "accuracy.method='explicit8'", "-s", "accuracy.steps=2")
        if not run.done("too few steps"):
            return
        check("too few steps, verdict", "VERDICT  undecided: too few steps" in run.out,
              "undecided, nothing is known", run.out)
        check("too few steps, evidence", "Phi(T) has no reliable digit" in run.out, "Phi(T) is lost", run.out)
        lines = (folder / "out/multipliers.csv").read_text().splitlines()
        rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
        check("too few steps, lost", [row["lost"] for row in rows] == ["1"] * 6, "six times 1", rows)
        check("too few steps, error", all(float(row["error"]) == 1e308 for row in rows), "1e308", rows)
        response = Run(folder, DATA / "khang_four_bar.nml", "-s", "accuracy.method='explicit8'", "-s", "accuracy.steps=2")
        check("too few steps, vibration", response.code == 4 and "steps" in response.err, "exit code 4, for the steps",
              response.err)


SOLUTION_METHOD_TESTS = (test_too_few_steps, test_mid_turn, test_overdamped, test_overdamped_probes, test_references, test_methods, test_reduced_by_name, test_parts, test_resonance, test_trade)
