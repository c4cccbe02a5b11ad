"""Loads: forces and moments between links, frame and ground over the crank angle, against closed forms, a nonlinear integration and
the balance of power; faulty tables."""

import cmath
import math
import re

from harness import Folder, Run, Table, check, equal, near
from held_speed import COMPRESSOR

HOLDERS = ("motor", "flywheel", "outside")
GAS = ("&load name='gas', on='piston', joint='B', type='polytropic', direction=180, bore=0.07, clearance=0.06, "
       "suction=1, discharge=8 /\n")
# A massless slider-crank that fires every second turn, on a frame that only rolls.
ROLLING = ("&case tasks='response','power' /\n&drive speed_rpm=1500, held_by='outside' /\n&joint name='O', type='ground', "
           "position=0,0 /\n&joint name='A', type='crank', pivot='O', radius=0.05 /\n&joint name='B', type='RRP', ends='A', "
           "lengths=0.2, guide_point=0,0, guide_angle=90, branch=1 /\n&link name='rod', from='A', to='B', mass=0, inertia=0 "
           "/\n&link name='piston', from='B', mass=0, inertia=0 /\n&frame mass=1, inertia=2, origin=0,0, dof='psi' /\n&foundation "
           "stiffness(3,3)=3000, damping(3)=12 /\n"
           "&response harmonics=20, points=720 /\n")
FIRING = "&load name='gas', on='piston', joint='B', axes='guide', direction=180, bore=0.07, cycle=2, {} /\n"
# Loads of every kind on the compressor.
LOADS = ("&load name='within', on='rod', against='crank', point=0.05,0.02, axes='link', direction=30, force=40,30,10,0,20, "
         "moment=3,1,2 /\n&load name='frame', on='piston', joint='B', axes='guide', force=-200,150,80 /\n&load "
         "name='ground', on='rod', "
         "against='ground', point=0.1,0.03, axes='ground', direction=200, force=20,30,15,5,5, moment=1,0,2 /\n&load "
         "name='follows', on='rod', against='ground', point=0.1,0.03, axes='link', direction=50, force=20,30,15,5,5, cycle=2 /\n")
SHAKER = "&load name='shaker', on='frame', point=0.2,0.1, direction=20, force=10,30,15, moment=2,4,3, order=3,2 /\n"


def pressure(degrees):
    """Pressure of the four-stroke cycle (Pa) at a crank angle."""
    return 4e6 * math.exp(20 * (math.cos(math.radians((degrees - 100) / 2)) - 1))


def gas_csv(rows=720):
    """The four-stroke cycle as a table in bar."""
    step = 720 / rows
    return "crank_deg,pressure_bar\n" + "".join(f"{step * k!r},{pressure(step * k) / 1e5!r}\n" for k in range(rows + 1))


def piston_torque(degrees):
    """Torque of the gas on the crank of the four-stroke machine (N m)."""
    a, r, length = math.radians(degrees), 0.05, 0.2
    root = math.sqrt(length**2 - (r * math.cos(a))**2)
    return -pressure(degrees) * math.pi / 4 * 0.07**2 * (r * math.cos(a) + r**2 * math.cos(a) * math.sin(a) / root)


def harmonic(folder, order, name="psi_rad"):
    """Complex amplitude of an order in harmonics.csv."""
    table = Table(folder / "harmonics.csv")
    row = table["order"].index(order)
    return cmath.rect(table[f"{name}_amplitude"][row], table[f"{name}_phase_rad"][row])


def mean_of(folder, name):
    """Mean over the period of a column of power.csv, whose last row repeats the first."""
    column = Table(folder / "power.csv")[name][:-1]
    return sum(column) / len(column)


def rolled(torque, order, mean=0.0):
    """Amplitude of psi under a torque at this order, without the load's dependence on psi."""
    n, w = 4000, 1500 * math.pi / 30 * order
    c = sum(torque(720 * k / n) * cmath.exp(-4j * math.pi * order * k / n) for k in range(n)) / n * (2 if order else 1) - mean
    return c / (3000 - 2 * w**2 + 12j * w)


def integrated(start, turns):
    """psi of the four-stroke machine after some cycles: the gas acts at the crank angle W t - psi. Runge-Kutta of order 4."""
    speed, steps = 1500 * math.pi / 30, 2000
    step = 4 * math.pi / speed / steps

    def slope(t, x):
        return x[1], (-piston_torque(math.degrees(speed * t - x[0])) - 3000 * x[0] - 12 * x[1]) / 2

    x, history = start, []
    for k in range(turns * steps):
        t = k * step
        if k >= (turns - 1) * steps:
            history.append(x[0])
        a = slope(t, x)
        b = slope(t + step / 2, [y + step / 2 * d for y, d in zip(x, a)])
        c = slope(t + step / 2, [y + step / 2 * d for y, d in zip(x, b)])
        d = slope(t + step, [y + step * e for y, e in zip(x, c)])
        x = [y + step / 6 * (p + 2 * q + 2 * r + s) for y, p, q, r, s in zip(x, a, b, c, d)]
    return history


def test_four_stroke():
    """A four-stroke's gas force drives the crank and rolls the frame at half orders.

    Torque and work from p dV; psi by closed forms but for the load's dependence on psi, and by integration in time.
    """
    half, one = 3.0941819798e-3 * cmath.exp(-74.118527j * math.pi / 180), 7.7633942217e-4 * cmath.exp(-146.177041j * math.pi / 180)
    near("oracle of order 0.5", abs(rolled(lambda a: -piston_torque(a), 0.5) / half - 1), 0, 1e-8)
    values = ",".join(repr(pressure(k)) for k in range(0, 720, 4))
    courses = {"table": "table='gas.csv'", "steps": f"force_table={values}", "linear": "table='gas.csv', interpolation='linear'",
               "halved": "table='gas.csv', interpolation='fourier', scale=0.5"}
    for name, course in courses.items():
        text = ROLLING + FIRING.format(course)
        with Folder(input=text) as folder:
            (folder / "gas.csv").write_text(gas_csv())
            if not Run(folder, "-q", "input.nml").done(f"four-stroke, {name}"):
                return
            factor, rough = (0.5 if name == "halved" else 1), (1e-3 if name == "linear" else 1e-8)
            out = folder / "input"
            near(f"four-stroke, {name}: mean torque", mean_of(out, "rigid_torque_Nm"), -12.8151590822 * factor, 13 * rough)
            near(f"four-stroke, {name}: work per cycle", mean_of(out, "load_power_W") * 0.08, 161.040038508 * factor, 161 * rough)
            if name == "halved":
                continue
            for order, closed in ((0.5, half), (1, one)):
                near(f"four-stroke, {name}: order {order}", abs(harmonic(out, order) / closed - 1), 0, 2e-3)
            if name == "table":
                history = integrated([0.0, 0.0], 110)
                n = len(history)
                for order in (0.5, 1, 1.5):
                    c = 2 / n * sum(x * cmath.exp(-4j * math.pi * order * k / n) for k, x in enumerate(history))
                    near(f"four-stroke in time: order {order}", abs(harmonic(out, order) / c - 1), 0, 1e-7)


def test_ram_force():
    """A harmonic force against the ground moves the frame as the closed form says."""
    w = 600 * math.pi / 30
    closed = 100 / (2e5 - 50 * w**2 + 240j * w)
    near("oracle", abs(closed), 6.534455999481e-3, 1e-15)
    text = (ROLLING.replace("1500, held_by='outside'", "600").replace("mass=1", "mass=50").replace("'psi'", "'xi'")
            .replace("stiffness(3,3)=3000, damping(3)=12", "stiffness(1,1)=2e5, damping(1)=240"))
    for on in ("on='piston', against='ground', joint='B'", "on='frame', point=0.3,0.4"):
        for axes in ("ground", "frame"):
            with Folder(input=text + f"&load name='ram', {on}, axes='{axes}', force=0,100,0 /\n") as folder:
                if Run(folder, "-q", "input.nml").done(f"ram force, {on}, {axes}"):
                    near(f"ram force, {on}, {axes}", abs(harmonic(folder / "input", 1, "xi_m") / closed - 1), 0, 1e-10)


def test_gas_cycle():
    """A compressor's polytropic cycle takes the work of its closed form, and the flywheel's speed keeps the energy."""
    rigid = COMPRESSOR.replace("damping=60.0,120.0", "").replace("stiffness=6.0e4,1.2e5", "stiffness=1e13,1e13")
    with Folder(input=rigid + GAS, fly=rigid + GAS) as folder:
        if Run(folder, "-q", "-s", "case.tasks='power'", "input.nml").done("gas cycle"):
            near("gas cycle: mean torque", mean_of(folder / "input", "rigid_torque_Nm"), 12.47119717787, 1e-8)
            near("gas cycle: power", mean_of(folder / "input", "drive_W"), 1893.672036, 1e-5)
            near("gas cycle: power of the load", mean_of(folder / "input", "load_power_W"), -1893.672036, 1e-5)
        run = Run(folder, "-s", "case.tasks='power'", "-s", "drive.held_by='flywheel'", "-s", "drive.flywheel_inertia=0.2",
                  "fly.nml")
        if run.done("gas cycle, flywheel"):
            speed = Table(folder / "fly" / "power.csv")["speed_fluctuation_rad_s"]
            found = (max(speed) - min(speed)) / (1450 * math.pi / 30)
            near("gas cycle: speed fluctuation", found, 0.0122366057, 2e-6)
            near("gas cycle: reported", float(re.search(r"irregularity (\S+)", run.flat)[1]), 0.0122366057, 1e-5)


def test_motor():
    """A motor on the frame that holds the speed keeps loads within the machine from moving the frame."""
    with Folder(bare=COMPRESSOR, loaded=COMPRESSOR + GAS) as folder:
        for name in ("bare", "loaded"):
            run = Run(folder, "-s", "response.points=90", f"{name}.nml")
            run.done(f"motor, {name}")
        line = "gas: within the machine; changes the driving torque, does not move the frame"
        check("motor: report", line in run.flat, line, run.out)
        one, other = (Table(folder / name / "response.csv")["psi_rad"] for name in ("bare", "loaded"))
        near("motor: psi", max(abs(x - y) for x, y in zip(one, other)), 0, 1e-12 * max(one))
        near("motor: rigid torque without gas at 0 deg", Table(folder / "bare" / "power.csv")["rigid_torque_Nm"][0],
             10.34361683076, 1e-9)


def test_power():
    """Drive and loads deliver what the dampers absorb, whoever holds the speed, in the plane and in space."""
    mounts = "".join(f"&support position={x},-0.25,{z}, stiffness=6e4,1.2e5,5e4, damping=60,120,70 /\n" for x in (-0.2, 0.2)
                     for z in (-0.1, 0.15))
    space = re.sub(r"&support.*\n", "", COMPRESSOR) + mounts
    space = space.replace("inertia=1.6", "inertia=1.2,1.4,1.6, dof='xi','eta','psi','zeta','rot_xi','rot_eta'")
    tilted = SHAKER.replace("direction=20", "direction=1,2,3").replace("0.2,0.1", "0.2,0.1,0.05")
    for where, text, loads in (("plane", COMPRESSOR, LOADS + SHAKER), ("space", space, LOADS + tilted)):
        for holder in HOLDERS:
            with Folder(m=text + loads) as folder:
                run = Run(folder, "-q", "-s", f"drive.held_by='{holder}'", "-s", "case.tasks='power'", "-s", "response.points=720",
                          "m.nml")
                if not run.done(f"{where}, {holder}"):
                    return
                drive, loads_mean, dampers = (mean_of(folder / "m", key) for key in ("drive_W", "load_power_W", "dampers_W"))
                near(f"{where}, {holder}: power", drive + loads_mean - dampers, 0, 1e-7 * abs(loads_mean))
                check(f"{where}, {holder}: the dampers absorb", dampers > 0, "> 0", dampers)


def test_plane_in_space():
    """A machine that moves in its plane moves alike as a frame in space."""
    text = COMPRESSOR + LOADS + SHAKER
    space = text.replace("mass=45.0", "dof='xi','eta','psi','zeta', mass=45.0").replace("6.0e4,1.2e5", "6.0e4,1.2e5,5e4")
    for holder in HOLDERS:
        for model in ("exact", "rest"):
            with Folder(plane=text, space=space) as folder:
                for name in ("plane", "space"):
                    Run(folder, "-q", "-s", f"drive.held_by='{holder}'", "-s", f"model.frame='{model}'", "-s", "response.points=90",
                        f"{name}.nml").done(f"{holder}, {model}, {name}")
                for table, key in (("response", "psi_rad"), ("response", "xi_m"), ("power", "torque_Nm"),
                                   ("power", "load_power_W")):
                    one, other = (Table(folder / name / f"{table}.csv")[key] for name in ("plane", "space"))
                    worst = max(abs(x - y) for x, y in zip(one, other)) / max(map(abs, one))
                    # the torque about rest follows the exact kinematics only in space
                    near(f"{holder}, {model}: {key}", worst, 0, 1e-7 if model == "exact" or table == "response" else 1e-2)
                one, other = (Table(folder / name / "multipliers.csv")["abs"] for name in ("plane", "space"))
                near(f"{holder}, {model}: largest multiplier", min(abs(max(one) - x) for x in other), 0, 1e-8)


def test_copies():
    """Copies of a mechanism carry its loads; `firing` sets in which turn of the cycle a copy fires."""
    linkage = re.sub(r"(&joint|&link) ", r"\1 mechanism='a', ", re.search(r"&joint(.|\n)*?(?=&frame)", ROLLING)[0])
    head = ROLLING.replace(re.search(r"&joint(.|\n)*?(?=&frame)", ROLLING)[0], "&mechanism name='a' /\n" + linkage)
    one = head + FIRING.format("table='gas.csv'")
    with Folder(one=one, two=one + "&repeat name='b', of='a', firing=360 /\n", same=one + "&repeat name='b', of='a' /\n",
                bad=one + "&repeat name='b', of='a', firing=180 /\n",
                vee=one + "&repeat name='b', of='a', angle=90, phase=-90, firing=450 /\n") as folder:
        (folder / "gas.csv").write_text(gas_csv())
        size = {}
        for name in ("one", "two", "same", "vee"):
            if not Run(folder, "-q", "-s", "model.frame='rest'", f"{name}.nml").done(f"copies, {name}"):
                return
            torque = Table(folder / name / "power.csv")["rigid_torque_Nm"][:-1]
            size[name] = [sum(t * cmath.exp(-4j * math.pi * k / 2 * i / len(torque)) for i, t in enumerate(torque)) / len(torque)
                          for k in (1, 2)]
        near("copies: half an order cancels", abs(size["two"][0] / size["one"][0]), 0, 1e-9)
        near("copies: order 1 doubles", abs(size["two"][1] / size["one"][1] - 2), 0, 1e-9)
        near("copies: both at once", abs(size["same"][0] / size["one"][0] - 2), 0, 1e-9)
        near("copies: 450 deg later", abs(size["vee"][0] / size["one"][0] - 1 - cmath.exp(-1j * math.radians(225))), 0, 1e-9)
        Run(folder, "bad.nml").refused("copies: firing", 2, re.compile(
            r"bad.nml:\d+: &repeat 'b': firing = 180: does not agree with 'phase': the crank of the copy lags behind "
            r"that of the original by 0 deg"))


def test_tables():
    """Faulty tables are refused with file and row."""
    good = gas_csv(72).splitlines()
    faulty = [("descending", good[:5] + [good[3]] + good[5:], "gas.csv:6: the angle must be greater than that of the row before"),
              ("not a number", good[:9] + ["80,nan"] + good[10:], "gas.csv:10: column 2 must be finite"),
              ("one column", good[:9] + ["80"] + good[10:], "gas.csv:10: must contain two numbers separated by a comma"),
              ("unit", ["crank_deg,pressure_atm"] + good[1:], "gas.csv:1: the unit of the second column is unknown: use a "
               "unit of forces, moments or pressures as in &units, such as pressure_bar"),
              ("angle", ["crank,pressure_bar"] + good[1:], "gas.csv:1: the first column must be an angle in deg or rad, such as "
               "angle_deg"),
              ("jump", good[:-1] + ["720,25"], "gas.csv:74: the course jumps at the ends: 25 in the last row, 1.6e-12 in the first "
               "(line 2)"),
              ("part", good[:50], "gas.csv:50: the angles span only 480 deg of the cycle of 720 deg"),
              ("long", good + ["730,0"], "gas.csv:75: the angles span 730 deg, more than the cycle of 720 deg"),
              ("empty", good[:2], "gas.csv: a table of a load needs a row of names and at least 4 rows of numbers")]
    with Folder(input=ROLLING + FIRING.format("table='gas.csv'"),
                many=ROLLING + FIRING.format("table='gas.csv', harmonics=40")) as folder:
        Run(folder, "input.nml").refused("no table", 2, "gas.csv: there is no such file")
        for name, lines, message in faulty:
            (folder / "gas.csv").write_text("\n".join(lines) + "\n")
            Run(folder, "input.nml").refused(f"table, {name}", 2, re.compile(re.escape(message).replace(r"1\.6e\-12", ".*")))
        (folder / "gas.csv").write_text("\n".join(good) + "\n")
        Run(folder, "many.nml").refused("table, orders", 2, re.compile(
            r"many.nml:\d+: &load 'gas': harmonics = 40: the table has 72 rows per cycle, which determine at most 35 orders"))
        (folder / "gas.csv").write_text("\n".join(good[:1] + [f"{80 * k},{1 + k % 3}" for k in range(9)]) + "\n")
        for orders, code in ((4, 0), (5, 2)):
            equal(f"{orders} orders of 9 rows", Run(folder, "-q", "-s", f"load(gas).harmonics={orders}", "many.nml").code, code)


def test_keys():
    """Loads whose keys contradict each other are refused."""
    for load, message in (("on='pistn', joint='B', force=1", "on = 'pistn': there is no link 'pistn'; did you mean 'piston'?"),
                          ("on='piston', against='piston', joint='B', force=1",
                           "against = 'piston': must differ from the body in 'on'"),
                          ("on='piston', joint='B'", "give 'force', 'moment', 'force_table', 'table' or type='polytropic'"),
                          ("on='piston', force=1", "give either 'joint' or 'point', at which the force acts"),
                          ("on='piston', joint='B', force=1,2",
                           "force = 1, 2: must have an odd number of values: the mean, then one "
                           "cosine and one sine coefficient for each order"),
                          ("on='piston', joint='B', axes='ground', force=1", "axes = 'ground': 'ground' requires against='ground'"),
                          ("on='rod', joint='A', axes='guide', force=1",
                           "axes = 'guide': 'guide' requires a 'joint' that slides on a guide"),
                          ("on='frame', joint='B', force=1", "joint = 'B': a force on the frame needs 'point' instead"),
                          ("on='piston', joint='B', type='polytropic'", "type='polytropic' needs the key 'bore'"),
                          ("on='piston', joint='B', force=1, order=2", "order = 2: is allowed only with on='frame'")):
        with Folder(input=ROLLING + f"&load name='f', {load} /\n") as folder:
            Run(folder, "input.nml").refused(load, 2, re.compile(r"input.nml:\d+: &load 'f': " + re.escape(message)))


LOAD_TESTS = [test_four_stroke, test_ram_force, test_gas_cycle, test_motor, test_power, test_plane_in_space, test_copies,
              test_tables, test_keys]
