"""Results that overflow double precision are reported in words or refused, never as an unexplained NaN or Infinity."""

import csv
import re
from pathlib import Path

from harness import Folder, Run, check, equal, files
from scaling import MACHINES, scaled

DATA = Path(__file__).resolve().parents[2] / "data"


def test_shaking():
    """Overflowing shaking forces are reported in words."""
    for name, setting in (("flying_press", "drive.speed_rpm=1e200"), ("khang_four_bar", "link(rocker).center=1e160,0")):
        with Folder() as folder:
            run = Run(folder, "--check", "-s", setting, DATA / f"{name}.nml")
            run.done(f"shaking forces, {setting}")
            check(f"shaking forces, {setting}, report", "NaN" not in run.out and "at rest: they overflow" in run.out,
                  "words", run.out[-900:])


def test_probe():
    """Overflowing motion of a probe is reported in words."""
    with Folder() as folder:
        run = Run(folder, "-s", "probe.position(1)=-9e306", "-o", "far", DATA / "compressor.nml")
        run.refused("a probe beyond all numbers", 4, re.compile(r"the motion of a probe overflows double precision"))
        left = files(folder / "far")
        equal("a probe beyond all numbers, files", left, ["harmonics.csv", "multipliers.csv", "power.csv", "response.csv", "supports.csv",
                                                         "supports_harmonics.csv", "supports_history.csv"])
        text = "".join((folder / "far" / name).read_text() for name in left)
        check("a probe beyond all numbers, tables", not re.search("NaN|Infinity", text), "numbers", "others")
        # The exit code is that of the verdict; the failure is reported in a line.
        run = Run(folder, "-q", "--fail-if-unstable", "-s", "support.damping=0,0", "-s", "probe.position(1)=-9e306", "-o", "both",
                  DATA / "compressor.nml")
        run.refused("not stable, and a probe beyond all numbers", 10, re.compile(r"note: the motion of a probe overflows double precision"))
        # Only its acceleration overflows, and the torque is not requested.
        run = Run(folder, "-s", "probe.position(1)=-9e305", "-s", "case.tasks='response'", "-o", "fast", DATA / "compressor.nml")
        run.refused("a probe faster than all numbers", 4, re.compile(r"the motion of a probe overflows double precision"))
        # Squares of its velocity overflow, not the velocity.
        run = Run(folder, "-s", "probe.position(1)=-9e241", "-o", "near", DATA / "compressor.nml")
        if run.done("a probe beyond all squares"):
            text = "".join((folder / "near" / name).read_text() for name in files(folder / "near") if name.endswith(".csv"))
            check("a probe beyond all squares, tables", "Infinity" not in text + run.out, "numbers", "others")


def test_factors():
    """Overflowing factors yield neither multipliers nor a verdict."""
    machine = """\
&model frame='rest' /
&accuracy tolerance=0.851758E-7, method='magnus6' /
&drive speed_rpm=-0.816201E+10 /
&joint name='J1', type='ground', position=0,0 /
&joint name='J2', type='crank', pivot='J1', radius=12925.2 /
&joint name='J3', type='ground', position=41804.1,11919.6 /
&link name='L1', from='J3', mass=0.808032E-10, inertia=0.100040, center=10529,4118.5 /
&frame mass=0.142858E-8, inertia=12.67069, origin=-2339.76,-45443.0 /
&support position=-79940.8,-157460, stiffness=1.15244E10,1.44449E11, damping=0.065353,2.33448, angle=-25.9 /
"""
    with Folder(input=machine) as folder:
        run = Run(folder, "-o", "out", "input.nml")
        run.refused("factors that overflow", 4, "a free vibration overflows double precision within one period")
        check("factors that overflow, report", "VERDICT" not in run.out and "NaN" not in run.out, "no verdict", run.out[-900:])
        equal("factors that overflow, files", files(folder / "out"), [])


def test_places():
    """Positions beyond 1e100 m are refused as lengths are."""
    for key, message in (("guide_point=9.99e307,0", ""), ("guide_point=0,-1e101", ""),
                      ("guide='J1','J2', guide_point=0,1e242", "a guide: ")):
        machine = """\
&drive speed_rpm=268.79 /
&joint name='J1', type='ground', position=0,0 /
&joint name='J2', type='crank', pivot='J1', radius=0.04 /
&joint name='J3', type='RPP', ends='J2', """ + key + """, guide_angle=-51.7, slot_angle=62.3 /
&link name='L2', from='J2', to='J3', mass=1, inertia=5e-4 /
&frame mass=13, inertia=0.55, origin=0,0 /
"""
        with Folder(input=machine) as folder:
            Run(folder, "--check", "input.nml").refused(key, 2, 
                                                             f"input.nml:4: &joint 'J3': {message}coordinates must lie between -1e100 m and 1e100 m")


def test_implausible_motion():
    """Overflowing speeds and accelerations are warned of."""
    for speed, message in (("1e170", "'B' moves at up to 7.6e259 m/s"), ("1e250", "'B' moves at more than 1.8e308 m/s")):
        with Folder() as folder:
            run = Run(folder, "--check", "-s", f"drive.speed_rpm={speed}", "-s", "joint(A).radius=7e90", "-s",
                      "joint(B0).position(1)=4e91", "-s", "joint(B).lengths=3.7e91,1.6e91", "input.nml")
            run.done(f"a joint at {speed} rpm")
            check(f"a joint at {speed} rpm", message in run.out and "Inf" not in run.out, message, run.out)


def test_masses():
    """Machines whose forces have squares beyond all numbers have finite tables.

    Forces, springs, dampers and inertias grow or fall by 2^520 with the masses; the motion remains. NaN stands only where it stands
    for the ordinary machine: for phases of zero and for limits that are not set.
    """
    text, tasks = MACHINES["compressor"]
    expected = None
    for power in (0, 520, -520):
        with Folder(input=scaled(text, (power, 0, 0))) as folder:
            settings = "-s", "case.tasks=" + ",".join(f"'{task}'" for task in (tasks + " joints").split())
            run = Run(folder, "-q", "-o", "out", *settings, "input.nml")
            run.done(f"masses by 2^{power}")
            came = {name: len(re.findall("NaN|Infinity", (folder / "out" / name).read_text())) for name in files(folder / "out")
                    if name.endswith(".csv") and not name.startswith("balance")}
            expected = expected or came
            equal(f"masses by 2^{power}: undefined numbers", came, expected)


def test_multiplier():
    """A multiplier that overflows is reported by its logarithm.

    It is about e^9e15 and marked as lost.
    """
    machine = """\
&model coefficients='averaged' /
&drive speed_rpm=-6.3290E-030 /
&joint name='J1', type='ground', position=0.0,0.0 /
&joint name='J2', type='crank', pivot='J1', radius=3.86E20, phase=246.7 /
&link name='L1', from='J1', mass=0.428874E-31, inertia=6.3E10 /
&frame mass=0.37691E-29, inertia=5.7573E246, origin=-0.206952E22,-0.355025E21 /
&support position=0.248163E21,6.4298E20, stiffness=1.0822E-26,1.4933E-26, damping=5.6261E-32,1.3811E-30, angle=-129.893 /
"""
    with Folder(input=machine) as folder:
        run = Run(folder, "input.nml")
        row = next(line for line in run.out[run.out.index("MULTIPLIERS"):].splitlines() if line.startswith("  1  "))
        check("a multiplier that overflows", re.match(r"  1 +e\^\d\.\d+e15 +lost ", row) and "Inf" not in run.out,
              "e^...e15 lost", row)


def test_moduli():
    """Overflowing moduli and frequencies are reported in words."""
    with Folder() as folder:
        run = Run(folder, "-s", "support(1).stiffness(1)=3.2008e14", "-s", "support.position(1)=1", "-s", "model.frame='rest'",
                  DATA / "compressor.nml")
        check("multipliers about the vibration", "NaN" not in run.out and "Inf" not in run.out, "no such words", run.out[-2500:])
        run = Run(folder, "--check", "-s", "support(1).position(1)=1e158", DATA / "compressor.nml")
        check("natural frequencies", "NaN" not in run.out and "Inf" not in run.out, "none", run.out)
    machine = """\
&sweep parameter='support(1).stiffness(1)', from=2.1689410726781755E-001, to=0.238584, count=5 /
&case tasks='sweep' /
&response points=6, harmonics=4 /
&model coefficients='averaged' /
&drive speed_rpm=-2.6715E+003 /
&joint name='J1', type='ground', position=0.0000E+000,0.0000E+000 /
&joint name='J2', type='crank', pivot='J1', radius=8.6649E-002 /
&joint name='J3', type='ground', position=0.227835,8.1012E-002 /
&joint name='J4', type='RPR', ends='J2','J3', lengths=0.748785E-1, branch=1 /
&link name='L1', from='J2', mass=0.435388, inertia=1.9954E-004, center=0.320520E-1,2.2755464370901046E-002 /
&link name='L2', from='J2', mass=1.0094E+000, inertia=1.0695816226446165E-004, center=1.9758E-001,5.0457E-016 /
&frame mass=1.3350356952261631E+000, inertia=0.169571, origin=3.0513822958922276E-001,9.5101508843708119E-002 /
&support position=-2.2763E-001,0.630812E-2, stiffness=2.5762E+006,0.119075E+7, damping=0.441772,1.9469261103121795E+000 /
&support position=0.216053,2.0909442150990873E-002, stiffness=3.5156E+093,97575.1 /
&support position=-0.428487,-0.485349, stiffness=5.2063727219576258E+006,3.7883971391592792E+005 /
&support position=-0.170799,3.7649322484724845E-001, stiffness=4.2790854410323431E+005,272711., damping=2.7726099203523857E-001,0.791321 /
&probe name='P1', position=6.5068232180345265E-001,-0.650682, limit_mm_s=6.2409E+028, band_hz=1.0000000000000000E+000,2.5486455424752535E+001 /
&probe name='P2', position=6.5068232180345265E-001,-0.650682, limit_mm_s=1.3485717937289107E-002 /
"""
    with Folder(input=machine) as folder:
        run = Run(folder, "input.nml")
        check("a range of moduli", "to beyond 1.8e308, maximum" in run.out and "Inf" not in run.out, "in words", run.out)


def test_balanced():
    """Rounding errors of a balanced crank are not refined further."""
    machine = """\
&case tasks='stability','response','forces' /
&drive speed_rpm=300 /
&joint name='O', type='ground', position=0,0 /
&joint name='A', type='crank', pivot='O', radius=0.1, phase=17 /
&link name='disc', from='O', to='A', mass=0.3, inertia=0.01, center=0.1,0.01 /
&link name='balance', from='O', to='A', mass=0.1, inertia=0.01, center=-0.3,-0.03 /
&frame mass=10, inertia=0.3, origin=0.1,0.05 /
&support position=-0.3,-0.2, stiffness=2e4,2e4, damping=20,20 /
&support position=0.3,-0.2, stiffness=2e4,2e4, damping=20,20 /
"""
    with Folder(input=machine) as folder:
        run = Run(folder, "--verbose", "input.nml")
        if not run.done("a balanced crank"):
            return
        steps = int(re.search(r"with (\d+) steps", run.flat)[1])
        check("a balanced crank, steps", steps <= 10000, "10000 at most", steps)
        force = max(float(number) for number in re.findall(r"force on ground, [xy] +(\S+)", run.out))
        # one of the two links alone exerts 0.3 kg 0.1 m (2 pi 5 Hz)^2 = 30 N
        check("a balanced crank, forces", force < 1e-13 * 30, "rounding of 30 N", force)


# No damping, and the frame is not held in one direction: gauss3 cannot compute its multipliers.
UNDAMPED = """\
&case tasks='modes', title='A title' /
&accuracy tolerance=0.299412E-4, method='gauss3', /
&model vibrations='all' /
&drive speed_rpm=3.8806E+002, held_by='motor' /
&joint name='J1', type='ground', position=0.00000,0.0000E+000 /
&joint name='J2', type='crank', pivot='J1', radius=0.270342E-1, phase=-136.835 /
&joint name='J3', type='rigid', ends='J2','J1', offset=-0.210067E-1,0.810433E-1 /
&joint name='J4', type='ground', position=6.9811E-002,2.7399928843642864E-002 /
&joint name='J5', type='rigid', ends='J2','J4', offset=-4.7773E-002,-0.452481E-2 /
&joint name='J6', type='ground', position=7.2334460905763731E-002,0.197535E-1 /
&joint name='J7', type='rigid', ends='J2','J6', offset=0.175829E-1,3.7541E-002 /
&link name='L1', from='J4', to='J2', mass=0.905813, inertia=0.288867E-2, center=4.0279142284537599E-002,1.8681E-002 /
&link name='L2', from='J1', to='J6', mass=1.9549690771965245E-001, inertia=1.6311543557207006E-004, center=1.4110E-002,0.249288E-2 /
&frame mass=12.2250, inertia=0.388022, origin=-0.154074,-0.537234E-1 /
&support position=-0.333004E-1,0.288304, stiffness=1.2054879587439164E+006,34387.4 /
"""

# Links of 154 kg on a frame of 0.5 mm: a free motion grows by e^467 in a turn.
GROWING = """\
&case tasks='modes','power','stability','stability' /
&model frame='first_order' /
&gravity acceleration=9.8000E+000, direction=-8.0000E+001 /
&drive speed_rpm=23.2503 /
&joint name='J1', type='ground', position=0.00000,0.0000000000000000E+000 /
&joint name='J2', type='crank', pivot='J1', radius=0.708492E-4, phase=-141.192 /
&joint name='J3', type='ground', position=0.254858E-3,-0.176849E-4 /
&joint name='J4', type='RRP', ends='J2', lengths=0.246147E-3, guide='J1','J2', branch=1 /
&link name='L1', from='J1', to='J3', mass=3.8182E+000, inertia=6.3922E-008 /
&link name='L2', from='J1', to='J4', mass=1.3983935430243551E+002, inertia=0.436330E-7, center=0.104831E-3,0.223171E-4 /
&link name='L3', from='J3', to='J4', mass=1.0295E+001, inertia=1.2030E-008 /
&frame mass=218.538, inertia=0.301552E-4, origin=-0.211323E-3,2.0146835032828768E-004 /
&support position=0.483675E-3,-0.375946E-3, stiffness=15799.1,3.4186E+004, damping=4.5561995573936002E+001,1995.30 /
&support position=4.9137770331513398E-004,0.323144E-3, stiffness=1.4739E+004,5.4758783308132461E+003, axes='space' /
&support position=6.8785E-005,2.1385096155038233E-004, stiffness=376536.,49728.8 /
&support position=5.6546E-004,0.501836E-3, stiffness=45961.6,2.0534E+005, damping=965.679,33.3539, axes='frame' /
"""

# An inertia so large that springs do not matter: its velocities are 1e-224 of their unit.
HEAVY = """\
&case tasks='stability','modes' /
&model frame='rest' /
&drive speed_rpm=1.0989E+017 /
&joint name='J1', type='ground', position=0.0000000000000000E+000,0.00000 /
&joint name='J2', type='crank', pivot='J1', radius=5.1097E-007 /
&link name='L1', from='J1', mass=0.866279E-28, inertia=1.8282E-042, center=0.121620E-5,-2.1096635822637089E-007 /
&frame mass=5.2063569970068355E-028, inertia=5.3480E+304, origin=-0.211591E-6,-0.111160E-5 /
&support position=-0.354745E-5,-0.277793E-5, stiffness=6.9471E+005,32886.2, damping=1.3485E-013,0.907146E-12, axes='space' /
"""

AVERAGED = """\
&case tasks='stability','drawing','forces','stability' /
&model coefficients='averaged' /
&drive speed_rpm=1913.79 /
&joint name='J1', type='ground', position=0.00000,0.00000 /
&joint name='J2', type='crank', pivot='J1', radius=1.07519, phase=-5.4932E+001 /
&joint name='J3', type='ground', position=3.4630931944555980E+000,-1.5809444874802929E+000 /
&joint name='J4', type='rigid', ends='J2','J3', offset=-5.7165E-001,-4.42720 /
&joint name='J5', type='ground', position=3.5862344690141690E+000,-1.9982E-001 /
&joint name='J6', type='RPR', ends='J4','J5', lengths=2.81270, branch=-1 /
&link name='L1', from='J4', to='J5', mass=0.979802E-2, inertia=0.249814E-1, center=5.4830E-001,-0.280039 /
&link name='L2', from='J1', to='J5', mass=7.4157334799523184E-004, inertia=0.340381E-2 /
&link name='L3', from='J1', to='J2', mass=0.565771E-3, inertia=0.328225E-1, center=5.3766E-001,-2.8154E-001 /
&link name='L4', from='J1', mass=1.7735E-002, inertia=0.327836E-2 /
&link name='L5', from='J4', to='J3', mass=0.208923E-2, inertia=0.337132E-2, center=8.7538403922658525E-001,0.360328 /
&frame mass=2.0397291818731990E-002, inertia=1.43785, origin=1.69618,-4.62303 /
&support position=-1.63945,8.4717E+000, stiffness=35.4553,808.831 /
&support position=13.4720,-8.43286, stiffness=1.1242381987172262E+003,37.2826 /
&units length='cm', mass='g', stiffness='N/m', angle='rad' /
"""


def test_faint_balance():
    """The picture of the balance copes with forces of 1e-308 N."""
    machine = """\
&case tasks='balance' /
&drive speed_rpm=147.66 /
&joint name='O', type='ground', position=0,0 /
&joint name='A', type='crank', pivot='O', radius=0.00688, ratio=0.5 /
&link name='dust', from='A', mass=2.3e-308, inertia=1.4e-13, center=0.0035,-0.0001 /
&frame mass=5.3, inertia=0.005, origin=0.018,0.017, dof='psi' /
&support position=-0.055,0.055, stiffness=8.4e4,5.8e-29 /
"""
    with Folder(input=machine) as folder:
        if Run(folder, "-q", "input.nml").done("forces of 1e-308 N"):
            script = (folder / "input" / "balance.gp").read_text()
            check("forces of 1e-308 N, picture", not re.search("NaN *\\*|Infinity", script), "numbers", script)


HEAVY_LINK = """\
&case tasks='separation' /
&drive speed_rpm=460.023, held_by='outside' /
&joint name='O', type='ground', position=0,0 /
&joint name='A', type='crank', pivot='O', radius=0.026614 /
&link name='weight', from='O', mass=MASS, inertia=9.39513e-4 /
&frame mass=9.67877, inertia=0.349122, origin=-0.0881318,-0.0650376, dof='xi','eta','psi' /
&support position=-0.34417,-0.0071263565611080623, stiffness=25504.9,0.654068 /
"""


def test_heavy_link():
    """With an overwhelming link the energy shares are valid or NaN.

    If the frame's inertia is lost in rounding, each share of a mode lies between 0 and 1, or all of them are NaN.
    """
    for mass, dofs in (("1.2905e29", "'xi','eta','psi'"), ("3.2e160", "'xi','eta'")):
        with Folder(input=HEAVY_LINK.replace("MASS", mass)) as folder:
            if not Run(folder, "-q", "-s", f"frame.dof={dofs}", "input.nml").done(f"a link of {mass} kg"):
                continue
            with open(folder / "input" / "separation.csv") as lines:
                rows = list(csv.DictReader(line for line in lines if line[0] != "#"))
            for row in rows:
                energies = [row[f"energy_{name}"] for name in ("xi", "eta", "psi")]
                check(f"a link of {mass} kg, share", row["share"] == "NaN" or 0 <= float(row["share"]) <= 1, "a part", row["share"])
                check(f"a link of {mass} kg, energies", (row["share"] == "NaN") == all(word == "NaN" for word in energies)
                      and energies.count("NaN") in (0, 3), "all or none", [row["share"], *energies])


def test_heavy_frame():
    """The sag of a frame of 1e308 kg is finite."""
    with Folder() as folder:
        run = Run(folder, "--check", "-s", "frame.mass=9.99e307", DATA / "cam_press.nml")
        run.done("a frame of 1e308 kg")
        check("a frame of 1e308 kg", " Inf" not in run.out and "the machine would sink by" in run.flat, "a number", run.flat)


def test_all_vibrations():
    """If one vibration cannot be computed, none is listed."""
    with Folder(input=UNDAMPED) as folder:
        run = Run(folder, "input.nml")
        run.refused("vibrations that cannot be computed", 4, re.compile(r"the periodic vibration cannot be computed: .*"))
        check("vibrations that cannot be computed, report", "VERDICT" in run.out and "VIBRATIONS at" not in run.out, "no list", run.out[-900:])


def test_growing():
    """A free motion that grows by e^467 is solved correctly."""
    with Folder(input=GROWING) as folder:
        for model in ("first_order", "exact"):
            run = Run(folder, "-s", f"model.frame={model}", "input.nml")
            run.done(f"a free motion that grows by e^467, {model}")
            check(f"a free motion that grows by e^467, {model}", re.search(r"largest multiplier +.rho. = 9\.[0-9]+e202 ", run.out),
                  "9.4e202 or 9.6e202", run.out[:1500])


def test_vectors():
    """Eigenvectors with an inertia of 5e304 contain no NaN."""
    with Folder(input=HEAVY) as folder:
        if Run(folder, "-o", "out", "input.nml").done("vectors of an inertia of 5e304"):
            check("vectors of an inertia of 5e304", "NaN" not in (folder / "out" / "modes.csv").read_text(), "numbers", "NaN")


def test_averaged():
    """Averaged masses of 1e308 kg end with an error."""
    with Folder(input=AVERAGED) as folder:
        run = Run(folder, "--verbose", "-s", "link.mass=9.99e307", "input.nml")
        check("averaged masses of 1e308 kg", run.code == 4 and "the state transition matrix has no reliable digit," in run.flat, "lost", run.out)


FAST = """&case tasks='critical' /
&drive speed_rpm=850386. /
&sweep parameter='drive.speed_rpm', from=1.8559E+029, to=1.0204633743012142E+006, count=2 /
&joint name='J1', type='ground', position=0,0 /
&joint name='J2', type='crank', pivot='J1', radius=2.2426E-12, phase=-4.48378 /
&joint name='J4', type='follower', cam='J1','J2', lift=3.148E-12,0.209867E-12,-0.104933E-12, guide_point=0,-0.604109E-12,
       guide_angle=-94.41, lift_phase=5.74947 /
&link name='L1', from='J4', mass=9.02E-17, inertia=4.89E-40 /
&frame mass=6.87E-16, inertia=0.204E-36, origin=0.131933E-10,-0.103785E-10 /
&support position=-3.1220E-11,0.563205E-11, stiffness=0.283974E-2,0.333032E-11 /
"""


def test_decades_of_speed():
    """Speeds over 23 decades are searched without reaching zero.

    From 1e6 to 2e29 1/min rounding must not produce a speed of zero.
    """
    with Folder(input=FAST) as folder:
        run = Run(folder, "input.nml")
        check("speeds over 23 decades", "must not be zero" not in run.err and "CRITICAL SPEEDS" in run.out, "a section", run.err)


OVERFLOW_TESTS = [
    test_decades_of_speed, test_faint_balance, test_heavy_link, test_heavy_frame, test_all_vibrations, test_growing, test_vectors, test_averaged,
    test_shaking, test_probe, test_balanced, test_multiplier, test_moduli, test_factors, test_places, test_implausible_motion,
    test_masses]
