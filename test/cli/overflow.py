"""Results beyond what double precision holds: told in words or refused, never NaN or Infinity without a word."""

import re
from pathlib import Path

from harness import Folder, Run, check, equal, files

DATA = Path(__file__).resolve().parents[2] / "data"


def test_shaking():
    for name, setting in (("flying_press", "drive.speed_rpm=1e200"), ("khang_four_bar", "link(rocker).center=1e160,0")):
        with Folder() as folder:
            run = Run(folder, "--check", "-s", setting, DATA / f"{name}.nml")
            run.done(f"shaking forces, {setting}")
            check(f"shaking forces, {setting}, report", "NaN" not in run.out and "at rest: they lie beyond" in run.out,
                  "words", run.out[-900:])


def test_probe():
    with Folder() as folder:
        run = Run(folder, "-s", "probe.position(1)=-9e306", "-o", "far", DATA / "compressor.nml")
        run.refused("a probe beyond all numbers", 4, re.compile(r"forces, motion of probes or torque overflow: .*"))
        left = files(folder / "far")
        equal("a probe beyond all numbers, files", left, ["harmonics.csv", "multipliers.csv", "response.csv"])
        text = "".join((folder / "far" / name).read_text() for name in left)
        check("a probe beyond all numbers, tables", not re.search("NaN|Infinity", text), "numbers", "others")
        # Its acceleration alone overflows, and nobody asks for the torque.
        run = Run(folder, "-s", "probe.position(1)=-9e305", "-s", "case.tasks='response'", "-o", "fast", DATA / "compressor.nml")
        run.refused("a probe faster than all numbers", 4, re.compile(r"forces, motion of probes or torque overflow: .*"))
        # Squares of its velocity overflow, not the velocity.
        run = Run(folder, "-s", "probe.position(1)=-9e241", "-o", "near", DATA / "compressor.nml")
        if run.done("a probe beyond all squares"):
            text = "".join((folder / "near" / name).read_text() for name in files(folder / "near") if name.endswith(".csv"))
            check("a probe beyond all squares, tables", "Infinity" not in text + run.out, "numbers", "others")


def test_factors():
    """Factors of Phi(T) that overflow: no multipliers, so no verdict of none."""
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
        run.refused("factors that overflow", 4, "the free vibration leaves the range of the numbers within one period")
        check("factors that overflow, report", "VERDICT" not in run.out and "NaN" not in run.out, "no verdict", run.out[-900:])
        equal("factors that overflow, files", files(folder / "out"), [])


def test_places():
    """Places are taken as far as lengths are."""
    for key, told in (("guide_point=9.99e307,0", ""), ("guide_point=0,-1e101", ""),
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
                                                             f"input.nml:4: &joint 'J3': {told}coordinates must lie between -1e100 m and 1e100 m")


def test_implausible_motion():
    """Speeds and accelerations beyond all numbers: the note says so."""
    for speed, told in (("1e170", "'B' moves with up to 7.6e259 m/s"), ("1e250", "'B' moves with more than 1.8e308 m/s")):
        with Folder() as folder:
            run = Run(folder, "--check", "-s", f"drive.speed_rpm={speed}", "-s", "joint(A).radius=7e90", "-s",
                      "joint(B0).position(1)=4e91", "-s", "joint(B).lengths=3.7e91,1.6e91", "input.nml")
            run.done(f"a joint at {speed} rpm")
            check(f"a joint at {speed} rpm", told in run.out and "Inf" not in run.out, told, run.out)


def test_multiplier():
    """A multiplier of e^9e15, told by its logarithm."""
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
        row = next(line for line in run.out.splitlines() if line.startswith("1  "))
        check("a multiplier that overflows", re.match(r"1 +- +- e\^9\.\d+e15 ", row) and "Inf" not in run.out, "- - e^9...e15", row)


def test_moduli():
    """The range of a sweep and the verdict about the vibration, where moduli overflow; frequencies that do."""
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
        check("a range of moduli", "to beyond 1.8e308, greatest" in run.out and "Inf" not in run.out, "in words", run.out)


def test_balanced():
    """A balanced crank: its forces are rounding, which no number of steps makes more exact."""
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
        run = Run(folder, "input.nml")
        if not run.done("a balanced crank"):
            return
        steps = int(re.search(r"with (\d+) steps", run.out)[1])
        check("a balanced crank, steps", steps <= 10000, "10000 at most", steps)
        force = max(float(number) for number in re.findall(r"force on ground, [xy] +(\S+)", run.out))
        # one of the two links alone exerts 0.3 kg 0.1 m (2 pi 5 Hz)^2 = 30 N
        check("a balanced crank, forces", force < 1e-13 * 30, "rounding of 30 N", force)


OVERFLOW_TESTS = [
    test_shaking, test_probe, test_balanced, test_multiplier, test_moduli, test_factors, test_places, test_implausible_motion]
