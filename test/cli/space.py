"""The frame in space: machines against an independent reference, a planar machine in a tilted plane, a block on mounts,
refused input."""

import cmath
import csv
import math
import re
import shutil
from pathlib import Path

from harness import Folder, Run, check, equal, near

ROOT = Path(__file__).resolve().parents[2]
DATA, VALIDATION = ROOT / "data", ROOT / "validation" / "space"
DOF = ("xi", "eta", "zeta", "rot_xi", "rot_eta", "psi")
ALL = "dof=" + ",".join(f"'{name}'" for name in DOF)

# Of validation/space/newton_euler.py, whose loads of inertia are summed link by link, integrated to 1e-13: speed (1/min), greatest
# abs(rho), and the rms of the six coordinates (m, rad), about rest and exact.
REFERENCE = {
    "suspended_compressor": (284, {
        "rest": (0.978150001097, (6.6922942523791e-05, 1.2881319311078e-05, 9.4091409687664e-06, 2.9337442894003e-04,
                                  3.2871296366183e-04, 2.0915034171570e-04)),
        "exact": (0.978149996698, (6.6923465574294e-05, 1.2885502067922e-05, 9.4086330944383e-06, 2.9338614014450e-04,
                                   3.2903794863158e-04, 2.0915435659122e-04))}),
    "v_twin": (740, {
        "rest": (0.943367074795, (4.3838725249194e-05, 1.9270702774291e-05, 1.6414154554404e-05, 6.7272045654421e-05,
                                  9.9059435956897e-05, 1.9124372822317e-04)),
        "exact": (0.943366628830, (4.3836494163255e-05, 1.9265087266204e-05, 1.6413027416738e-05, 6.7261917398344e-05,
                                   9.9068841589378e-05, 1.9124559517535e-04))}),
    "watt_beside": (209, {
        "rest": (0.848848519886, (1.7302925751517e-02, 4.6862827859381e-04, 6.5480946104881e-04, 1.2721283625092e-03,
                                  3.2791883093107e-03, 1.6968155335522e-02)),
        "exact": (0.847767803099, (1.7299776178788e-02, 4.5259069346122e-04, 6.4892528293753e-04, 1.2626474517025e-03,
                                   3.3348179300654e-03, 1.6969164542043e-02))}),
    "weighing": (420, {
        "rest": (0.863695492937, (2.4723928396194e-03, 2.2214251340081e-03, 4.9577611775699e-03, 5.0514366368957e-03,
                                  6.9983710484329e-04, 4.6897310537504e-03)),
        "exact": (0.863799521464, (2.4730104179031e-03, 2.2187604118501e-03, 4.9601284192076e-03, 5.0318816716235e-03,
                                   6.7851021982958e-04, 4.6900481625566e-03))}),
    "twin_balance_shaft": (625, {
        "rest": (0.886374862868, (1.0475821697834e-06, 5.5774591160081e-05, 3.9145798169801e-06, 3.5527443581493e-05,
                                  1.4597006718715e-05, 2.9855588169734e-05)),
        "exact": (0.886374841744, (1.0475833999791e-06, 5.5774590740192e-05, 3.9145202988651e-06, 3.5527444038832e-05,
                                   1.4597077614008e-05, 2.9855620779367e-05))}),
}
# The same, exact, for validation/space/weighing.nml: maximum over 400 rows of the forces on the ground (N).
WEIGHING_FORCES = {"1": 191.3662621696942, "2": 271.43213258391603, "total": 413.1929093651879}
# The same from validation/space/holders.py for watt_beside at 209 1/min by who holds the speed, and the greatest torque at 64 phases.
# None: with a flywheel these phases start at another time.
HELD = {
    "'outside'": {
        "rest": (0.848852220676, (1.8290447725508e-02, 4.7213289703193e-04, 6.7306457775479e-04, 1.4217822693255e-03,
                                  3.6617814626817e-03, 1.7902098619203e-02), 5.1853719835e+01),
        "exact": (0.847663925706, (1.8248148455852e-02, 4.4534645799400e-04, 6.7171743634235e-04, 1.4058542114913e-03,
                                   3.7205586028492e-03, 1.7863095532487e-02), 5.1482024113e+01)},
    "'flywheel', flywheel_inertia=0.3": {
        "rest": (0.848851874020, (1.8286623804119e-02, 4.6168126028395e-04, 6.7077096205537e-04, 1.3480832328549e-03,
                                  3.7567417663251e-03, 1.7897358399061e-02), 5.1827000855e+01),
        "exact": (0.847702723373, (1.8241902034515e-02, 4.3804008028971e-04, 6.6961479075409e-04, 1.3364267543394e-03,
                                   3.8162602628504e-03, 1.7855034507100e-02), None)},
}
# data/engine_in_space.nml describes validation/space/inline_four.nml in another way; its crank is at 90 deg where the other one is at 0.
ENGINE = (336, 0.716992557639, (7.8441568718468e-06, 6.8979299597789e-06, 1.8997896654406e-06, 5.0284783159456e-05,
                                5.0841084388053e-05, 2.6008034566268e-04))


def rows(path):
    """The rows of a table."""
    return list(csv.DictReader(line for line in path.read_text().splitlines() if line[0] != "#"))


def rms(path, name):
    """Rms of a coordinate, from its harmonics."""
    unit = "m" if name in DOF[:3] else "rad"
    sizes = [float(row[f"{name}_{unit}_amplitude"]) for row in rows(path)]
    return math.sqrt(sizes[0]**2 + sum(size**2 for size in sizes[1:]) / 2)


def greatest(path):
    """The greatest abs(rho)."""
    return max(float(row["abs"]) for row in rows(path))


def against_reference(folder, what, rho, sizes):
    """Compares with the reference, whose integration leaves errors of 1e-10 in the multipliers; 60 harmonics of the motion
    are accurate to 1e-9."""
    near(f"space, {what}: rho", greatest(folder / "out" / "multipliers.csv"), rho, 1e-10)
    for name, size in zip(DOF, sizes):
        near(f"space, {what}: rms of {name}", rms(folder / "out" / "harmonics.csv", name), size, 1e-9 * max(sizes))


def reference_tests():
    """Machines in space agree with an independent reference.

    The machines of validation/space, about rest and exact.
    """
    for machine, (speed, models) in REFERENCE.items():
        text = re.sub(r"&case title = ('[^']*') /", "&response points=64, harmonics=60 /\n"
                      "&case title = \\1, tasks='stability','response' /", (VALIDATION / f"{machine}.nml").read_text())
        for model, (rho, sizes) in models.items():
            with Folder(input=f"&model frame='{model}' /\n" + text) as folder:
                if Run(folder, "-q", "-o", "out", "--set", f"drive.speed_rpm={speed}", "input.nml").done(f"{machine}, {model}"):
                    against_reference(folder, f"{machine}, {model}", rho, sizes)
    text = re.sub(r"&case title = ('[^']*') /", "&response points=64, harmonics=60 /\n"
                  "&case title = \\1, tasks='stability','response','power' /", (VALIDATION / "watt_beside.nml").read_text())
    for holder, models in HELD.items():
        for model, (rho, sizes, torque) in models.items():
            what = f"watt_beside, {model}, {holder.split(',')[0]}"
            with Folder(input=f"&model frame='{model}' /\n" + text.replace("&drive ", f"&drive held_by={holder}, ")) as folder:
                if not Run(folder, "-q", "-o", "out", "--set", "drive.speed_rpm=209", "input.nml").done(what):
                    continue
                against_reference(folder, what, rho, sizes)
                found = max(abs(float(row["torque_Nm"])) for row in rows(folder / "out" / "power.csv"))
                if torque:
                    near(f"space, {what}: torque", found, torque, 1e-9 * torque)
    # the reference's crank is held by a motor on the block
    text = (DATA / "engine_in_space.nml").read_text().replace("held_by = 'flywheel', flywheel_inertia = 0.12", "held_by = 'motor'")
    equal("engine in space: the motor", text.count("'motor'"), 1)
    with Folder(engine_in_space=text) as folder:
        speed, rho, sizes = ENGINE
        if Run(folder, "-q", "-o", "out", "--set", f"drive.speed_rpm={speed}", "--set", "response.harmonics=60",
               "engine_in_space.nml").done("engine in space"):
            against_reference(folder, "engine in space", rho, sizes)


def times(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(len(b))) for j in range(len(b[0]))] for i in range(len(a))]


def turned(axis, angle):
    """The matrix of a rotation about an axis of space (deg)."""
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix = [[float(row == column) for column in range(3)] for row in range(3)]
    matrix[i][i] = matrix[j][j] = c
    matrix[i][j], matrix[j][i] = -s, s
    return matrix


def words(numbers):
    return ",".join(repr(float(number)) for number in numbers)


FOUR_BAR = """\
&joint {0}name='A0', type='ground', position=0,0 /
&joint {0}name='B0', type='ground', position=0.40,0 /
&joint {0}name='A', type='crank', pivot='A0', radius=0.07 /
&joint {0}name='B', type='RRR', ends='A','B0', lengths=0.37,0.16, branch=1 /
&link {0}name='crank', from='A0', to='A', mass=0.5, inertia=0.0035, center=0.03,0 /
&link {0}name='coupler', from='A', to='B', mass=0.6, inertia=0.007, center=0.18,0.01 /
&link {0}name='rocker', from='B0', to='B', mass=0.25, inertia=0.006, center=0.08,0 /
"""
SUPPORTS = ((-0.3, 0.2, 4.0e4, 6.0e4, 40, 60, 20), (0.35, 0.1, 5.0e4, 3.0e4, 30, 50, 0))
TASKS = "&case tasks='stability','response','power' /\n&response points=64, harmonics=40 /\n&model frame='{}' /\n" \
    "&drive speed_rpm=420, held_by={} /\n"
HOLDERS = ("'motor'", "'outside'", "'flywheel', flywheel_inertia=0.7")


def tilted_tests():
    """A planar machine in a tilted plane moves as in the plane.

    Without weights, and with weights, turning axes and a foundation.
    """
    tilt("tilted", False)
    tilt("tilted, weighing", True)


def block_of(matrix):
    """A matrix used for both displacements and rotations."""
    none = [0.0] * 3
    return [[*row, *none] for row in matrix] + [[*none, *row] for row in matrix]


def tilted_machine(weighs=False):
    """A planar machine, the same in a tilted plane in space, and the plane's axes; with weights also with turning axes and a
    foundation."""
    q = times(turned(2, 30), times(turned(1, -25), turned(0, 50)))
    tensor = times(times(q, [[0.5, 0, 0], [0, 0.6, 0], [0, 0, 0.78]]), [list(column) for column in zip(*q)])
    j = [tensor[0][0], tensor[1][1], tensor[2][2], tensor[0][1], tensor[0][2], tensor[1][2]]

    def placed(x, y, z=0.0):
        return words(q[i][0] * x + q[i][1] * y + q[i][2] * z for i in range(3))

    space, plane = FOUR_BAR.format("mechanism='m', "), FOUR_BAR.format("")
    space += f"&mechanism name='m', axis={words(row[2] for row in q)}, x_axis={words(row[0] for row in q)} /\n" \
        f"&frame mass=18, inertia={words(j)}, origin={placed(0.1, -0.25)}, {ALL} /\n"
    plane += "&frame mass=18, inertia=0.78, origin=0.1,-0.25 /\n"
    turning = ""
    if weighs:
        # one of two supports turns; elements of the foundation in the plane, of stiffness about it and across it too
        turning = ", axes='frame'"
        ground = [[1000.0, 100.0, 0, 0, 0, 50.0], [100.0, 2000.0, 0, 0, 0, 30.0], [0, 0, 500.0, 0, 0, 0], [0, 0, 0, 40.0, 0, 0],
                  [0, 0, 0, 0, 60.0, 0], [50.0, 30.0, 0, 0, 0, 90.0]]
        whole = block_of(q)
        tilted_ground = times(times(whole, ground), [list(column) for column in zip(*whole)])
        tilted_ground = [[(tilted_ground[i][k] + tilted_ground[k][i]) / 2 for k in range(6)] for i in range(6)]
        plane += "&foundation stiffness=1000,100,50,100,2000,30,50,30,90, damping=3,3,2 /\n&gravity direction=-70 /\n"
        order = (0, 1, 5, 2, 3, 4)
        space += f"&foundation stiffness={words(tilted_ground[i][k] for i in order for k in order)}, damping=3,3,2,3,2,2 /\n" \
            f"&gravity direction={placed(math.cos(math.radians(70)), -math.sin(math.radians(70)))} /\n"
    for x, y, kx, ky, bx, by, angle in SUPPORTS:
        plane += f"&support position={x},{y}, stiffness={kx},{ky}, damping={bx},{by}, angle={angle}{turning} /\n"
        # first its own angle, then yaw, pitch and roll of both together
        axes = times(q, turned(2, angle))
        angles = (math.degrees(math.atan2(axes[1][0], axes[0][0])), math.degrees(math.asin(-axes[2][0])),
                  math.degrees(math.atan2(axes[2][1], axes[2][2])))
        # two halves on both sides of the plane, which also hold the frame out of the plane
        for z in (-0.2, 0.2):
            space += f"&support position={placed(x, y, z)}, stiffness={kx / 2},{ky / 2},2e4, damping={bx / 2},{by / 2},25, " \
                f"angle={words(angles)}{turning} /\n"
        turning = ""
    return plane, space, q


def tilt(case, weighs):
    """Compares a planar machine with its tilted version. In its plane it moves the same way, and not out of it; its
    multipliers are among those in space. Torque and power of the drive are the same, whoever holds the speed."""
    plane, space, q = tilted_machine(weighs)
    for model, holder in [(model, holder) for model in ("rest", "exact", "first_order") for holder in HOLDERS]:
        with Folder(plane=TASKS.format(model, holder) + plane, space=TASKS.format(model, holder) + space) as folder:
            what = f"{case}, {model}, {holder.split(',')[0]}"
            for name in ("plane", "space"):
                if not Run(folder, "-q", "--set", "accuracy.tolerance=1e-12", f"{name}.nml").done(f"{what}, {name}"):
                    return
            drives = [rows(folder / name / "power.csv") for name in ("plane", "space")]
            # about rest the plane's kinematics are of first order, those in space exact: psi^2, here 1e-4, of the torque
            for key in ("torque_Nm", "rigid_torque_Nm", "drive_W", "dampers_W", "energy_J", "speed_fluctuation_rad_per_s"):
                # in the plane the dampers are linear, in space they act at their displaced position: this changes their power by a part of psi
                if key not in drives[0][0] or (model == "rest" and key == "dampers_W"):
                    continue
                # potentials are known up to a constant
                start = [float(table[0][key]) if key == "energy_J" else 0.0 for table in drives]
                top = max(abs(float(row[key])) for row in drives[0])
                miss = max(abs(float(one[key]) - start[0] - float(other[key]) + start[1]) for one, other in zip(*drives))
                near(f"{what}: {key}", miss, 0.0, (1e-3 if model == "rest" else 1e-11) * top)
            flat, tilted = rows(folder / "plane" / "response.csv"), rows(folder / "space" / "response.csv")
            size = max(abs(float(row["psi_rad"])) for row in flat)
            reach = max(math.hypot(float(row["xi_m"]), float(row["eta_m"])) for row in flat)
            worst = [0.0, 0.0, 0.0]
            for one, other in zip(flat, tilted):
                for i, (along, about) in enumerate(zip(DOF[:3], DOF[3:])):
                    u = q[i][0] * float(one["xi_m"]) + q[i][1] * float(one["eta_m"])
                    f = q[i][0] * float(one["fx_N"]) + q[i][1] * float(one["fy_N"])
                    worst[0] = max(worst[0], abs(float(other[f"{along}_m"]) - u) / reach)
                    worst[1] = max(worst[1], abs(float(other[f"{about}_rad"]) - q[i][2] * float(one["psi_rad"])) / size)
                    worst[2] = max(worst[2], abs(float(other[("fx_N", "fy_N", "fz_N")[i]]) - f))
            force = max(math.hypot(float(row["fx_N"]), float(row["fy_N"])) for row in flat)
            # both solved to 1e-12
            for part, miss in (("displacements", worst[0]), ("turns", worst[1]), ("forces", worst[2] / force)):
                near(f"{what}: {part}", miss, 0.0, 1e-11)
            multipliers = [[complex(float(row["re"]), float(row["im"])) for row in rows(folder / name / "multipliers.csv")]
                           for name in ("plane", "space")]
            equal(f"{what}: multipliers", [len(found) for found in multipliers], [6, 12])
            for rho in multipliers[0]:
                near(f"{what}: rho", min(abs(rho - other) for other in multipliers[1]), 0.0, 1e-10)


def power_tests():
    """Drive power equals energy growth plus damper power at every phase.

    The derivative is that of the series through 128 points, whose terms end at 1e-10.
    """
    for machine, speed in (("watt_beside", 209), ("v_twin", 740)):
        text = re.sub(r"&case title = ('[^']*') /", "&response points=128 /\n&case title = \\1, tasks='power' /",
                      (VALIDATION / f"{machine}.nml").read_text())
        for holder in HOLDERS:
            what = f"power, {machine}, {holder.split(',')[0]}"
            with Folder(input=text.replace("&drive ", f"&drive held_by={holder}, ")) as folder:
                if not Run(folder, "-q", "-o", "out", "--set", f"drive.speed_rpm={speed}", "input.nml").done(what):
                    continue
                table = rows(folder / "out" / "power.csv")[:-1]
                energy, drive, dampers = ([float(row[key]) for row in table] for key in ("energy_J", "drive_W", "dampers_W"))
                size, n = max(abs(watts) for watts in drive), len(table)
                turning = [cmath.exp(2j * math.pi * k / n) for k in range(n)]
                terms = [sum(value * turning[-order * k % n] for k, value in enumerate(energy)) / n for order in range(n // 2)]
                for k in range(0, n, 8):
                    rate = 2 * sum((1j * order * term * turning[order * k % n]).real for order, term in enumerate(terms))
                    near(f"{what}: balance", (rate * speed * math.pi / 30 - drive[k] + dampers[k]) / size, 0.0, 1e-8)
                near(f"{what}: means", (sum(drive) - sum(dampers)) / n / size, 0.0, 1e-10)


def block_tests():
    """The six frequencies of a block on mounts agree with closed forms.

    Four equal mounts at a height below F, and a rotor that turns about zeta. With weights, the moment m g h reduces the stiffness
    of rot_xi and psi for mounts below F and increases it for springs above.
    """
    for what, height, weight in (("block", -0.15, 0.0), ("weighing block", -0.15, 9.80665), ("hanging block", 0.25, 9.80665)):
        block(what, height, weight)


def block(what, height, weight):
    mass, j, a, b, k = 40.0, (1.2, 0.9, 1.5), 0.3, 0.2, (3.0e4, 8.0e4, 5.0e4)
    text = "&case tasks='stability' /\n&model frame='rest' /\n&drive speed_rpm=60 /\n&joint name='O', type='ground', position=0,0 /\n" \
        "&joint name='A', type='crank', pivot='O', radius=0.1 /\n&link name='rotor', from='O', to='A', mass=1e-9, inertia=0 /\n" \
        f"&frame mass={mass}, inertia={words(j)}, origin=0,0, {ALL} /\n&gravity acceleration={weight}, direction=0,-1,0 /\n"
    for x in (a, -a):
        for z in (b, -b):
            text += f"&support position={x},{height},{z}, stiffness={words(k)} /\n"
    kx, ky, kz = (4 * value for value in k)
    # eta, and the turn about it, are alone; xi goes with psi, zeta with rot_xi: each two of m s + k and the coupling k h
    squares = [ky / mass, (kx * b**2 + kz * a**2) / j[1]]
    for spring, inertia, arm in ((kx, j[2], a), (kz, j[0], b)):
        turn = ky * arm**2 + spring * height**2 + mass * weight * height
        middle = (spring / mass + turn / inertia) / 2
        root = math.sqrt(middle**2 - (spring * turn - (spring * height)**2) / (mass * inertia))
        squares += [middle - root, middle + root]
    expected = sorted(math.sqrt(square) / (2 * math.pi) for square in squares)
    with Folder(input=text) as folder:
        run = Run(folder, "--verbose", "input.nml")
        found = [float(line.split()[1]) for line in run.out.partition("at rpm")[2].splitlines()[1:7]]
        for i, (one, other) in enumerate(zip(found, expected)):
            near(f"{what}, frequency {i + 1}", one, other, 1e-5 * other)


def range_tests():
    """Studies over a parameter keep each mechanism in its own plane."""
    source = re.sub(r"tasks = .*/", "tasks = '{}' /", (DATA / "suspended_compressor.nml").read_text(), count=1)
    sweep = "&sweep parameter='support(1).stiffness(2)', from=2000, to=2400, count=2, columns='rho_max' /\n"
    with Folder(sweep=source.format("sweep") + sweep, single=source.format("stability','separation")) as folder:
        if Run(folder, "-q", "sweep.nml").done("space, a range") and Run(folder, "-q", "single.nml").done("space, single machine"):
            for row in rows(folder / "sweep" / "sweep.csv"):
                setting = f"support(1).stiffness(2)={row['support(1).stiffness(2)']}"
                Run(folder, "-q", "--set", setting, "-s", "case.tasks=stability", "-o", "one", "single.nml").done("space, single point")
                # both to the tolerance, 1e-9
                near("space, a range: rho", float(row["rho_max"]), greatest(folder / "one" / "multipliers.csv"), 2e-9)
            modes = {float(row["frequency_Hz"]) for row in rows(folder / "single" / "separation.csv")}
            turns = [abs(float(row["exponent_im_rad_per_s"])) / (2 * math.pi) for row in rows(folder / "single" / "multipliers.csv")]
            for frequency in modes:
                # separation is about the vibration at rest, 1e-5 of these frequencies from that of the exact one
                near("space, modes over a speed", min(abs(frequency - turn) for turn in turns), 0.0, 1e-3)


def task_tests():
    """All tasks work for a frame in space.

    Probes, quantities, resonance, sweep, Campbell diagram, critical speeds.
    """
    with Folder() as folder:
        shutil.copy(DATA / "suspended_compressor.nml", folder)
        run = Run(folder, "suspended_compressor.nml")
        run.done("suspended compressor")
        check("suspended compressor: energy", "rot_eta" in run.out, "rot_eta", run.out)
        probe = rows(folder / "suspended_compressor" / "probes.csv")[0]
        response = rows(folder / "suspended_compressor" / "response.csv")
        # y + rot_zeta x ... to first order: turns of 1e-3 leave 1e-6
        high = max(abs(float(row["zeta_m"]) + 0.06 * float(row["rot_xi_rad"]) - 0.07 * float(row["rot_eta_rad"])) for row in response)
        near("suspended compressor: probe's z", float(probe["z_peak_m"]), high, 1e-3 * high)
        parts = [float(probe[f"v{axis}_rms_band_mm_s"]) for axis in "xyz"]
        band = float(probe["v_rms_band_mm_s"])
        check("suspended compressor: band", max(parts) <= band <= math.hypot(*parts), f"{max(parts)} to {math.hypot(*parts)}", band)
        for task, text in (("sweep", "&sweep parameter='drive.speed_rpm', from=2000, to=3000, count=5, "
                            "columns='rho_max','zeta','probe(discharge tube).v','fz' /\n"),
                           ("resonance", "&sweep parameter='drive.speed_rpm', from=200, to=240, count=5 /\n"
                            "&resonance quantities='zeta','rot_xi' /\n"),
                           ("campbell", "&sweep parameter='drive.speed_rpm', from=200, to=400, count=21 /\n"),
                           ("critical", "&sweep parameter='drive.speed_rpm', from=200, to=400, count=21 /\n")):
            source = re.sub(r"tasks = .*/", f"tasks = '{task}' /", (DATA / "suspended_compressor.nml").read_text(), count=1)
            (folder / "task.nml").write_text(source + text)
            Run(folder, "-q", "-o", task, "task.nml").done(f"space, {task}")
        for row in rows(folder / "sweep" / "sweep.csv")[-1:]:
            check("space, sweep: a point", 0.997 < float(row["rho_max"]) < 1, "0.997 to 1", row["rho_max"])
        # 2900 1/min is not a point of the sweep, so it is an additional point
        run = Run(folder, "--one-line", "--set", "drive.speed_rpm=3000", "suspended_compressor.nml")
        check("space, one line", "zeta_peak" in run.out, "zeta_peak", run.out)


def force_tests():
    """Forces of supports in space add up and carry the weights."""
    text = (VALIDATION / "weighing.nml").read_text().replace("&case ", "&response points=400 /\n&case tasks='response','forces', ")
    with Folder(input=text) as folder:
        run = Run(folder, "-o", "out", "input.nml")
        if not run.done("weighing, forces"):
            return
        history, response = rows(folder / "out" / "supports_history.csv"), rows(folder / "out" / "response.csv")
        table = {row["support"]: row for row in rows(folder / "out" / "supports.csv")}
        equal("weighing, places", list(table), ["1", "2", "foundation", "total"])
        greatest_force = max(float(row["f_total_N"]) for row in history)
        for axis in "xyz":
            parts = [sum(float(row[f"f{axis}_{place}_N"]) for place in ("1", "2", "foundation")) for row in history]
            # sums of rows to rounding
            miss = max(abs(one - float(row[f"f{axis}_total_N"])) for one, row in zip(parts, history))
            near(f"weighing, sum of forces along {axis}", miss, 0, 1e-12 * greatest_force)
            miss = max(abs(float(row[f"f{axis}_total_N"]) - float(other[f"f{axis}_N"])) for row, other in zip(history, response))
            near(f"weighing, the response's force along {axis}", miss, 0, 1e-12 * greatest_force)
            # after a turn the momentum is the same: 400 rows integrate a smooth periodic function to its error, 1e-9
            near(f"weighing, mean force along {axis}", sum(parts[:-1]) / 400, 0, 1e-8 * greatest_force)
            static = [float(table[place][f"static_f{axis}_N"]) for place in table]
            near(f"weighing, static forces along {axis}", sum(static[:3]), static[3], 1e-11 * 200)
        down = [value / math.sqrt(14) for value in (2, -3, 1)]
        weight = (18 + 0.5 + 0.6 + 0.25) * 9.81
        for axis, part in zip("xyz", down):
            near(f"weighing, weight along {axis}", float(table["total"][f"static_f{axis}_N"]), weight * part, 1e-11 * weight)
        # of validation/space/newton_euler.py, at 400 rows: greatest force of each support and of all, in the report's steps of a turn
        for place, size in WEIGHING_FORCES.items():
            found = max(float(row[f"f_{place}_N"]) for row in history)
            near(f"weighing, force at {place}", found, size, 1e-8 * size)
        for place in ("1", "2"):
            lowest = min(sum(part * (float(table[place][f"static_f{axis}_N"]) + float(row[f"f{axis}_{place}_N"]))
                             for axis, part in zip("xyz", down)) for row in history)
            # a parabola between 400 rows
            near(f"weighing, least compression of {place}", float(table[place]["least_compression_N"]), lowest, 1e-3 * greatest_force)
            near_zero = float(table[place]["least_compression_N"]) < 0
            equal(f"weighing, {place} lifts off", bool(re.search(rf"support {place} .*LIFTS OFF", run.out)), near_zero)
        check("weighing, gravity in the report", "9.81 m/s^2 along (0.5345,-0.8018,0.2673)" in run.out, "along", run.out[:900])
    with Folder(input=BLOCK.format(**GOOD).replace("'stability'", "'forces'").replace("0.1,0,0.1", "0,0,0") + "&gravity /\n") as folder:
        run = Run(folder, "--check", "input.nml")
        check("space, static loads of --check", "STATIC LOADS" in run.out and "fz" in run.out, "STATIC LOADS", run.out)


BLOCK = """\
&case tasks='stability' /
&model frame='rest' /
&drive speed_rpm=60 /
&joint name='O', type='ground', position=0,0 /
&joint name='A', type='crank', pivot='O', radius=0.1 /
&link name='rotor', from='O', to='A', mass=1, inertia={link} /
&frame mass=10, inertia={frame}, origin=0,0, dof={dof} /
&support position=0.1,0,{z}, stiffness={stiffness}, damping=1,1,1, angle={angle} /
"""
GOOD = {"link": "0.01", "frame": "0.5,0.5,0.6", "dof": "'xi','eta','zeta','rot_xi','rot_eta','psi'", "z": "0.1",
        "stiffness": "1e4,1e4,1e4", "angle": "0"}
REFUSED = (
    ("one moment of inertia", {"frame": "0.5"}, "", "must have 3 or 6 values, because the frame can rotate about xi or eta"),
    ("two moments", {"frame": "0.5,0.6"}, "", "must have 1, 3 or 6 values, but has 2"),
    ("no body's", {"frame": "0.1,0.1,0.6"}, "", "greater than the sum"),
    ("negative", {"frame": "0.5,-0.5,0.6"}, "", "must be positive"),
    ("two of a link", {"link": "0.1,0.2"}, "", "must have 1 or 3 values, but has 2"),
    ("a degree of freedom twice", {"dof": "'zeta','zeta'"}, "", "twice"),
    ("tilted in the plane", {"dof": "'xi','eta','psi'", "angle": "0,10,0"}, "", "describes a tilt out of the plane"),
    ("tilted plane in the plane", {"dof": "'xi','eta','psi'"}, "&mechanism name='m', axis=1,0,0 /\n", "describes a tilt out of the plane"),
    ("no axis", {}, "&mechanism name='m', axis=0,0,0 /\n", "must not be the zero vector"),
    ("x-axis on the plane", {}, "&mechanism name='m', axis=1,0,0, x_axis=2,0,0 /\n", "must not be normal to the mechanism's plane"),
    ("gravity of two values", {}, "&gravity direction=0,-1 /\n", "must be one angle or a vector of 3 values, but has 2 values"),
    ("gravity without direction", {}, "&gravity direction=0,0,0 /\n", "must not be the zero vector"),
    ("gravity's vector in the plane", {"dof": "'xi','eta','psi'"}, "&gravity direction=0,-1,0 /\n", "must be one angle, because the frame moves in a plane"),
    ("foundation in the plane", {"dof": "'xi','eta','psi'"}, "&foundation stiffness(4,4)=1e3 /\n",
     "&foundation: stiffness(4,4) = 1e3: is allowed only for a frame in space"),
    ("foundation's damping in the plane", {"dof": "'xi','eta','psi'"}, "&foundation damping(5)=1e3 /\n",
     "&foundation: damping(5) = 1e3: is allowed only for a frame in space"),
    ("foundation not symmetric", {}, "&foundation stiffness(2,6)=1e3 /\n",
     "stiffness(2,6) = 1e3: must be symmetric, but c26 is 1000 and c62 is 0"),
    ("foundation that pushes", {}, "&foundation stiffness(4,6)=1e3, stiffness(6,4)=1e3, stiffness(4,4)=1e3, stiffness(6,6)=999 /\n",
     "must be positive semidefinite"),
    ("foundation of too few", {}, "&foundation stiffness=10*0 /\n", "takes 9 or 36 values, has 10"),
    ("four values", {"z": "0.1,3"}, "", "takes at most 3 values"),
)


SHAFT = """\
&case tasks='stability', 'response' /
&drive speed_rpm=1200, held_by={held_by} /
&model frame={frame} /
{mechanism}
&joint name='S', type='ground', position=0.02,0.01 /
&joint name='P', type='crank', pivot='S', radius=0.02 /
&link name='shaft', from='S', to='P', mass=3.0, inertia=4.0e-3, center={center},0.0 /
&frame mass=42.0, inertia={inertia}, origin=0.0,0.0, dof={dof} /
&support position= 0.20,-0.12{z}, stiffness=60e3,110e3, damping=60,90, angle=30 /
&support position=-0.18,-0.12{z}, stiffness=60e3,110e3, damping=60,90, axes='frame' /
{more}"""
SHAFTS = {
    "plane": {"mechanism": "", "inertia": "0.95", "dof": "'xi','eta','psi'", "z": "", "more": ""},
    "space": {"mechanism": "&mechanism name='m', origin=0,0,0.03 /", "inertia": "1.1,0.85,0.95,0.03,0.02,-0.04", "dof": ALL[4:],
              "z": ",0.16", "more": "&support position=0.15,-0.1,-0.2, stiffness=60e3,90e3,50e3, damping=60,90,60 /\n"},
}
SHAFTS["weighing"] = SHAFTS["space"] | {"more": SHAFTS["space"]["more"] + "&gravity direction=0.3,-1,0.2 /\n"}
# Compared with a load of this size, rounding is small: m e W^2 compared with rounding of J W^2 and m g.
LEAST_UNBALANCE = 1e-13


def balanced_tests():
    """Without unbalance the exact model agrees with the model about rest."""
    for where, data in SHAFTS.items():
        for held_by in ("'motor'", "'outside'", "'flywheel'"):
            found = {}
            for frame in ("'rest'", "'exact'"):
                for center in (0, 1e-16, 1e-13, 1e-11, 1e-9, 1e-8, 1e-7):
                    with Folder(input=SHAFT.format(held_by=held_by, frame=frame, center=center, **data)) as folder:
                        run = Run(folder, "-q", "--one-line", "input.nml")
                        if not run.done(f"space, {where} held by {held_by}, {frame}, unbalance {center}"):
                            continue
                        row = next(csv.DictReader(run.out.splitlines()))
                        equal(f"space, {where}, unbalance {center}: verdict", row["verdict"], "stable")
                        found[frame, center] = [float(row[name]) for name in row if "_peak_" in name]
            for (frame, center), peaks in found.items():
                if center >= LEAST_UNBALANCE and frame == "'exact'":
                    worst = max(abs(one / other - 1) for one, other in zip(peaks, found["'rest'", center]))
                    near(f"space, {where} held by {held_by}: exact and rest, unbalance {center}", worst, 0, 1e-4)


def refused_tests():
    """Invalid machines in space are refused with the line of the file."""
    with Folder(input=BLOCK.format(**GOOD)) as folder:
        Run(folder, "-q", "input.nml").done("space, block")
    for what, changes, more, message in REFUSED:
        with Folder(input=BLOCK.format(**{**GOOD, **changes}) + more) as folder:
            run = Run(folder, "input.nml")
            equal(f"space, {what}: code", run.code, 2)
            check(f"space, {what}: line", message in run.err and "input.nml:" in run.err, message, run.err)
    with Folder(input=BLOCK.format(**GOOD).replace("rpm=60", "rpm=60, held_by='outside'") + "&mechanism name='m', ratio=2 /\n") as folder:
        run = Run(folder, "input.nml")
        equal("space, no shaft of the drive: code", run.code, 2)
        message = "input.nml:3: &drive: held_by = 'outside': other than 'motor' requires a mechanism with ratio=1 if the frame moves in space: the crankshaft of this mechanism is the drive's shaft"
        equal("space, no shaft of the drive: line", run.err, message + "\n")
    loose = GOOD | {"stiffness": "1e4,1e4,0", "dof": "'xi','eta','zeta'"}
    with Folder(input=BLOCK.format(**loose) + "&gravity direction=0,-1,1 /\n") as folder:
        Run(folder, "input.nml").refused("space, nothing carries the weight", 3, "input.nml:9: &gravity: no spring carries the weight "
                                         "along zeta: add a spring in this direction, or lock this degree of freedom")


SPACE_TESTS = [reference_tests, range_tests, tilted_tests, power_tests, block_tests, force_tests, task_tests, balanced_tests,
               refused_tests]
