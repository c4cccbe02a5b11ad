"""All joints, guides, units, mass functions and mountings, against numbers computed here."""

import cmath
import math
import re

from broken_mechanisms import FUNCTIONS, MACHINE
from harness import QUANTITIES, Folder, Run, body, check, equal, files, near, series, tables

FINE = ["-s", "accuracy.tolerance=1e-12"]


def compute(what, text, *options):
    """The result files of a valid input."""
    with Folder(input=text) as folder:
        if Run(folder, "-q", "input.nml", *options).done(what):
            return tables(folder / "input")
    return {}


def check_report(what, text, *options):
    """The report of --check on an input; checks that it writes nothing."""
    with Folder(input=text) as folder:
        run = Run(folder, "--check", "input.nml", *options)
        run.done(f"{what}, --check")
        equal(f"{what}, --check writes nothing", files(folder), ["input.nml"])
        return run.out


def check_words(what, report, *words):
    """Checks that the report contains these words, wherever its lines are broken and however its columns are spaced."""
    for word in words:
        check(f"{what}: '{word}'", " ".join(word.split()) in " ".join(report.split()), word, report)


def shaking(report):
    """The table of shaking forces: rows of fx, fy, moment for the orders from 1, without their phases."""
    rows = re.findall(r"^ +(\d)" + 3 * r" +(\S+) +[-\d.]+" + "$", report.partition("SHAKING")[2], re.MULTILINE)
    return [[float(word) for word in row[1:]] for row in rows]


def shakes(what, report, column, expected):
    """Compares the amplitudes of a column to the 5 printed digits."""
    came = [row[column] for row in shaking(report)]
    equal(f"{what}, rows of shaking forces", len(came), 8)
    for order, (one, other) in enumerate(zip(came, expected), 1):
        near(f"{what}, shaking force of order {order}", one, other, 6e-5 * other)


def agree(what, one, other, tolerance):
    """Compares multipliers and vibration of two runs, relative to the largest value of each column."""
    equal(f"{what}, files", sorted(one), sorted(other))
    for name in ("re", "im"):
        series(f"{what}, multipliers, {name}", one["multipliers.csv"][name], other["multipliers.csv"][name], tolerance)
    for name in QUANTITIES:
        greatest = max(map(abs, other["response.csv"][name]))
        series(f"{what}, {name}", one["response.csv"][name], other["response.csv"][name], tolerance * greatest)


# ---- closed forms ----------------------------------------------------------------------------------------------------


def binomial_half(n):
    return math.prod((0.5 - k) / (k + 1) for k in range(n))


def piston_series(ratio, orders):
    """A_k of the piston's acceleration r Omega^2 (cos + A2 cos 2 + A4 cos 4 + ...), by the binomial series of
    sqrt(1 - ratio^2 sin^2), ratio = r/l, and the harmonics of the powers of the sine."""
    factors = [0.0, 1.0] + [0.0] * (orders - 1)
    for k in range(1, orders // 2 + 1):
        root = sum(binomial_half(n) * (-ratio ** 2) ** n * 2 / 4 ** n * (-1) ** k * math.comb(2 * n, n - k)
                   for n in range(k, 60))
        factors[2 * k] = (2 * k) ** 2 * root / ratio
    return factors


# Only the moving mass at the slider or yoke counts, and the frame is guided: one equation with constant coefficients.
MASS, STIFFNESS, DAMPING, RADIUS, SPEED = 0.8, 3.0e5, 200.0, 0.05, 1500.0
GUIDED = f"""\
&drive speed_rpm={SPEED} /
&joint name='O', type='ground', position=0.0,0.0 /
&joint name='A', type='crank', pivot='O', radius={RADIUS} /
@
&link name='mass', from='B', mass={MASS}, inertia=0.0 /
&frame mass=20.0, inertia=1.0, origin=0.1,0.2, dof='eta' /
&support position=0.3,0.0, stiffness=0.0,{STIFFNESS}, damping=0.0,{DAMPING} /
"""
SLIDER = "&joint name='B', type='RRP', ends='A', lengths=0.20, guide_point=0.0,0.0, guide_angle=90.0, branch=1 /"
YOKE = "&joint name='B', type='RPP', ends='A', guide_point=0.0,0.1, guide_angle=90.0, slot_angle=@ /"


def guided(what, joint, throw):
    """A guided frame under the inertia force MASS RADIUS Omega^2 throw[k] of each order k."""
    text, omega, total = GUIDED.replace("@", joint), SPEED * math.pi / 30, 20.0 + MASS
    forces = [MASS * RADIUS * omega ** 2 * abs(a) for a in throw]
    report = check_report(what, text)
    shakes(what, report, 1, forces[1:])
    equal(f"{what}, no force across", [row[0] for row in shaking(report)], [0.0] * 8)
    found = compute(what, text, *FINE)
    if not found:
        return report
    root = cmath.sqrt(DAMPING ** 2 - 4 * total * STIFFNESS)
    rho = cmath.exp((-DAMPING + root) / (2 * total) * 60 / SPEED)
    multipliers = found["multipliers.csv"]
    equal(f"{what}, number of multipliers", len(multipliers.rows), 2)
    # both relative to 1, with the tolerance of 1e-12
    near(f"{what}, multiplier", complex(multipliers["re"][0], abs(multipliers["im"][0])),
         complex(rho.real, abs(rho.imag)), 1e-11)
    amplitudes = found["harmonics.csv"]
    greatest = {"eta_m_amplitude": 0.0, "fy_N_amplitude": 0.0}
    expected = {name: [0.0] for name in greatest}
    for k in range(1, 9):
        rate = k * omega
        motion = forces[k] / abs(STIFFNESS - total * rate ** 2 + 1j * DAMPING * rate)
        expected["eta_m_amplitude"].append(motion)
        expected["fy_N_amplitude"].append(abs(STIFFNESS + 1j * DAMPING * rate) * motion)
    for name, values in expected.items():
        series(f"{what}, {name}", amplitudes[name][1:9], values[1:], 1e-11 * max(values))
    for name in ("xi_m", "psi_rad", "fx_N"):
        equal(f"{what}, {name} rests", max(map(abs, found["response.csv"][name])), 0.0)
    return report


def test_slider_crank():
    """Forces and motion of a slider-crank agree with the piston's series."""
    factors = piston_series(0.25, 8)
    for k, known in ((2, 0.2540250423), (4, -0.0040981112), (6, 7.4379e-5)):
        near(f"the series itself, A{k}", factors[k], known, 6e-10)
    report = guided("slider-crank", SLIDER, factors)
    # stroke 2 r, between l - r and l + r; sin of the rod's swing r/l, its complement is the transmission angle
    swing = math.degrees(math.asin(0.25))
    check_words("slider-crank", report, "0.15 to 0.25             0.1\n", "mobility 1 (4 links including the frame, 4 pairs)\n",
          f"smallest transmission angle {90 - swing:.1f} deg at joint 'B'",
          "nearest dead point: reached if a link length at joint 'B' changes by 0.15 m", "translates")
    # the acceleration is largest at the outer dead centre, r Omega^2 (1 + r/l); half a turn each way
    row = re.search(r"^  B +0\.1 +\S+ +(\S+) +180 +1$", report, re.MULTILINE)
    check("slider-crank, sliders", row, "stroke 0.1, 180 deg, ratio 1", report)
    if row:
        near("slider-crank, acceleration", float(row[1]), RADIUS * (SPEED * math.pi / 30) ** 2 * 1.25, 6e-5 * float(row[1]))
    # the slider's m r, half with the crank and half against it; its peak is 1 + r/l of the first order
    first = MASS * RADIUS * (SPEED * math.pi / 30) ** 2
    unbalance = re.search(r"with the crank +(\S+) kg mm at 0\.0 deg\n +rotating against the crank +(\S+) kg mm at 180\.0 deg\n", report)
    check("slider-crank, unbalance", unbalance, "in kg mm", report)
    if unbalance:
        for way in (1, 2):
            near(f"slider-crank, unbalance {way}", float(unbalance[way]), 500 * MASS * RADIUS, 6e-5 * 500 * MASS * RADIUS)
    peak = re.search(r"resultant force: peak (\S+) N", report)
    near("slider-crank, peak", float(peak[1]), 1.25 * first, 6e-5 * 1.25 * first)
    check("--check, no line wider than 80 columns below SLIDERS",
          max(map(len, report.partition("SLIDERS")[2].splitlines())) <= 80, 80, report)
    rod = "&link name='rod', from='A', to='B', mass=0.0, inertia=0.0 /"
    check_words("slider-crank with a rod", check_report("slider-crank with a rod", GUIDED.replace("@", SLIDER + "\n" + rod)),
          f"swings through {2 * swing:.2f} deg")


def test_scotch_yoke():
    """Forces and motion of a Scotch yoke agree with its single order."""
    report = guided("Scotch yoke", YOKE.replace("@", "90.0"), [0.0, 1.0] + [0.0] * 7)
    check_words("Scotch yoke", report, "-0.05 to 0.05            0.1\n")
    # the slot at an angle moves the yoke by r cos(phi - angle) / sin(angle)
    sine = math.sin(math.radians(60))
    report = guided("oblique yoke", YOKE.replace("@", "60.0"), [0.0, 1 / sine] + [0.0] * 7)
    check_words("oblique yoke", report, "smallest transmission angle 60 deg at joint 'B'", f"{2 * RADIUS / sine:.6g}\n")


# ---- a linkage and its own mass functions ----------------------------------------------------------------------------

R, L, E = 0.06, 0.21, 0.03
OFFSET_CRANK = f"""\
&drive speed_rpm = 700.0 /
&joint name='O', type='ground', position=0.0,0.0 /
&joint name='A', type='crank', pivot='O', radius={R} /
&joint name='B', type='RRP', ends='A', lengths={L}, guide_point=0.0,{E}, guide_angle=0.0, branch=1 /
&link name='crank', from='O', to='A', mass=1.1, inertia=0.003, center=0.02,0.01 /
&link name='rod', from='A', to='B', mass=0.7, inertia=0.004, center=0.08,-0.015 /
&link name='piston', from='B', mass=0.9, inertia=0.001, center=0.03,0.02 /
"""
MOUNTED = """\
&frame mass=24.0, inertia=0.9, origin=-0.10,0.15 /
&support position=-0.30,-0.20, stiffness=8.0e4,2.0e5, damping=80.0,150.0 /
&support position=0.30,-0.20, stiffness=8.0e4,2.0e5, damping=80.0,150.0 /
"""


def offset_crank(phi):
    """a1, a2, a3 and the moment function of OFFSET_CRANK in closed form."""
    c, s = math.cos(phi), math.sin(phi)
    sine = (E - R * s) / L
    cosine = math.sqrt(1 - sine ** 2)
    turn = -R * c / (L * cosine)
    # mass, inertia, centre of mass, its derivative, and that of the link's angle
    links = (
        (1.1, 0.003, 0.02 * c - 0.01 * s, 0.02 * s + 0.01 * c, -0.02 * s - 0.01 * c, 0.02 * c - 0.01 * s, 1.0),
        (0.7, 0.004, R * c + 0.08 * cosine + 0.015 * sine, R * s + 0.08 * sine - 0.015 * cosine,
         -R * s + (-0.08 * sine + 0.015 * cosine) * turn, R * c + (0.08 * cosine + 0.015 * sine) * turn, turn),
        (0.9, 0.001, R * c + L * cosine + 0.03, E + 0.02, -R * s - L * sine * turn, 0.0, 0.0))
    return [sum(m * x for m, j, x, y, u, v, w in links), sum(m * y for m, j, x, y, u, v, w in links),
            sum(m * (x * x + y * y) for m, j, x, y, u, v, w in links),
            sum(m * (x * v - y * u) + j * w for m, j, x, y, u, v, w in links)]


def transformed(samples, orders):
    """Mean, then the factors of cosine and sine of each order."""
    n = len(samples)
    values = [sum(samples) / n]
    for k in range(1, orders + 1):
        values += [2 / n * sum(f * turn(2 * math.pi * (k * i % n) / n) for i, f in enumerate(samples))
                   for turn in (math.cos, math.sin)]
    return values


def by_functions(sampled, orders):
    functions = [transformed(column, orders) for column in zip(*sampled)]
    keys = ", ".join(f"{name}=" + ",".join(map(repr, values))
                     for name, values in zip(("a1", "a2", "a3", "moment"), functions))
    return f"&mass_functions mass=2.7, inertia=0.008, {keys} /\n", functions


def test_mass_functions():
    """Mass functions yield the results of the mechanism they describe."""
    n, orders = 192, 32  # the harmonics fall by 0.13 and more from order to order: beyond 32 there is nothing
    group, (a1, a2, a3, moment) = by_functions([offset_crank(2 * math.pi * i / n) for i in range(n)], orders)
    text = "&drive speed_rpm = 700.0 /\n" + group + MOUNTED
    linkage = compute("offset slider-crank", OFFSET_CRANK + MOUNTED, *FINE)
    functions = compute("its mass functions", text, *FINE)
    if linkage and functions:
        agree("a linkage and its mass functions", functions, linkage, 1e-9)
    for speed, name in ((-700.0, "clockwise"), (2300.0, "faster")):
        options = [*FINE, "-s", f"drive.speed_rpm={speed}"]
        linkage = compute(f"offset slider-crank, {name}", OFFSET_CRANK + MOUNTED, *options)
        functions = compute(f"its mass functions, {name}", text, *options)
        if linkage and functions:
            agree(f"a linkage and its mass functions, {name}", functions, linkage, 1e-9)

    report, omega = check_report("mass functions", text), 700 * math.pi / 30
    check_words("mass functions", report, "2.7 kg in total, given by mass functions")
    check("mass functions have no joints", "MECHANISM\n" not in report, "no MECHANISM", report)
    for what, source in (("mass functions", report), ("linkage", check_report("linkage", OFFSET_CRANK + MOUNTED))):
        for column, values in enumerate((a1, a2)):
            shakes(f"{what}, axis {column + 1}", source, column,
                   [(k * omega) ** 2 * math.hypot(*values[2 * k - 1:2 * k + 1]) for k in range(1, 9)])
        shakes(f"{what}, moment", source, 2,
               [k * omega ** 2 * math.hypot(*moment[2 * k - 1:2 * k + 1]) for k in range(1, 9)])
    # the means of a1, a2, a3 and of the moment function cause no force or moment, but they act as masses
    more = compute("another a3", text.replace(f"a3={a3[0]!r}", f"a3={a3[0] + 0.1!r}"), *FINE)
    if more:
        differ = more["multipliers.csv"]["re"] != functions["multipliers.csv"]["re"]
        check("the mean of a3 has an effect", differ, "other multipliers", "the same")
    short = FUNCTIONS.replace("a1=0.1,0.05,0.0, a2=0.0,0.0,0.05, a3=0.02, moment=0.0,0.0,0.001", "")
    found = compute("mass functions, all left out", short)
    if found:
        equal("mass functions left out do not shake", max(map(abs, found["response.csv"]["eta_m"])), 0.0)


# ---- units -----------------------------------------------------------------------------------------------------------

SI = """\
&case title='units', tasks='stability','modes','response' /
@&drive speed_rpm = 600.0 /
&joint name='O', type='ground', position=0.0,0.0 /
&joint name='P', type='ground', position=0.0,-0.35 /
&joint name='A', type='crank', pivot='O', radius=0.055 /
&joint name='B', type='RRP', ends='A', lengths=0.213, guide_point=0.017,0.0, guide_angle=90.0, branch=1 /
&joint name='C', type='RPR', ends='A','P', lengths=0.612, branch=1 /
&joint name='D', type='rigid', ends='A','B', offset=0.101,0.023 /
&joint name='K', type='RRP', ends='D', lengths=0.509, guide='P','C', guide_point=0.011,0.003, guide_angle=30.0, branch=-1 /
&joint name='E', type='RPP', ends='A', guide_point=0.0,0.307, guide_angle=10.0, slot_angle=80.0 /
&joint name='F', type='PRP', guide='P','C', guide2_point=0.0,0.501, guide2_angle=0.0 /
&link name='crank', from='O', to='A', mass=2.301, inertia=0.0021, center=0.013,0.007 /
&link name='rod', from='A', to='B', mass=0.617, inertia=0.0033, center=0.065,0.0 /
&link name='block', from='K', mass=0.303, inertia=0.0 /
&link name='yoke', from='E', mass=0.501, inertia=0.0 /
&link name='pin', from='F', mass=0.107, inertia=0.0 /
&frame mass=45.3, inertia=1.61, origin=0.003,0.051 /
&support position=-0.207,-0.25, stiffness=6.1e4,1.23e5, damping=61.0,123.0, angle=30.0 /
&support position=0.203,-0.25, stiffness=6.1e4,1.23e5, damping=61.0,123.0 /
&foundation stiffness=1.1e4,0.0,123.0, 0.0,1.3e4,211.0, 123.0,211.0,457.0, damping=3.0,5.0,7.0 /
"""
LENGTHS = dict.fromkeys("position radius lengths guide_point guide2_point offset center origin".split(), 3)


def typed_in(words, powers):
    """The machine in units `words`: the numbers of a key times 10 to its power, exactly; `foundation` is its matrix."""
    lines = []
    for line in SI.replace("@", f"&units {words} /\n").splitlines():
        for key, power in powers.items():
            if line.startswith("&foundation"):
                key = key.removeprefix("foundation ") if key.startswith("foundation ") else "none"
            line = re.sub(rf"\b{key}=([-0-9.e]+(?:,\s*[-0-9.e]+)*)", lambda found: f"{key}={scaled(found[1], power)}", line)
        lines.append(line)
    return "\n".join(lines) + "\n"


def scaled(numbers, power):
    words = re.split(r",\s*", numbers)
    powers = power if isinstance(power, list) else [power] * len(words)
    shifted = []
    for word, each in zip(words, powers):
        mantissa, _, exponent = word.partition("e")
        shifted.append(f"{mantissa}e{int(exponent or 0) + each}")
    return ",".join(shifted)


def bytes_of(what, text):
    with Folder(input=text) as folder:
        Run(folder, "-q", "input.nml").done(what)
        return {name: (folder / "input" / name).read_bytes() for name in files(folder / "input")}


def test_units():
    """Input in other units yields the same bytes as in SI units."""
    expected = bytes_of("SI", SI.replace("@", ""))
    equal("SI, files", len(expected), 4)
    # all numbers are integers, so that dividing them by an integer factor rounds like reading the decimal number
    for what, words, powers in (
            ("SI spelt out", "length='m', mass='kg', inertia='kg m^2', stiffness='N/m', force='N', moment='N m', "
             "damping='N s/m', rotary_damping='N m s', angle='deg'", {}),
            ("the other names of SI", "damping='kg/s', rotary_damping='kg m^2/s'", {}),
            ("mm and N/mm", "length='mm', stiffness='N/mm'",
             {**LENGTHS, "stiffness": -3, "foundation stiffness": [-3, -3, 0, -3, -3, 0, 0, 0, 0]}),
            ("mm, g, kg cm^2, N mm", "length='mm', mass='g', inertia='kg cm^2', stiffness='kN/m', moment='N mm', "
             "rotary_damping='N mm s'",
             {**LENGTHS, "mass": 3, "inertia": 4, "stiffness": -3, "foundation damping": [0, 0, 3],
              "foundation stiffness": [-3, -3, 0, -3, -3, 0, 0, 0, 3]}),
            ("kg mm^2, N/cm", "inertia='kg mm^2', stiffness='N/cm', moment='N cm'",
             {"inertia": 6, "stiffness": -2, "foundation stiffness": [-2, -2, 0, -2, -2, 0, 0, 0, 2]}),
            ("g cm^2", "inertia='g cm^2'", {"inertia": 7})):
        equal(f"{what}: the bytes of SI", bytes_of(what, typed_in(words, powers)) == expected, True)
    check("units have an effect", bytes_of("kN m", SI.replace("@", "&units moment='kN m' /\n")) != expected, "other bytes", "the same")

    # numbers with decimals are rounded twice, and the multipliers amplify this a hundredfold
    base = compute("deg", SI.replace("@", ""), *FINE)
    radians = re.sub(r"\b(\w*angle)=([-0-9.]+)", lambda key: f"{key[1]}={math.radians(float(key[2]))!r}",
                     SI.replace("@", "&units angle='rad' /\n"))
    for what, text in (
            ("rad", radians),
            ("cm, t, kN/mm", typed_in(
                "length='cm', mass='t', inertia='t m^2', stiffness='kN/mm', force='kN', moment='kN m', damping='kN s/m'",
                {**dict.fromkeys(LENGTHS, 2), "mass": -3, "inertia": -3, "stiffness": -6, "damping": -3,
                 "foundation stiffness": [-6, -6, -3, -6, -6, -3, -3, -3, -3], "foundation damping": [-3, -3, 0]})),
            ("N s/cm", typed_in("damping='N s/cm'", {"damping": -2, "foundation damping": [-2, -2, 0]})),
            ("N s/mm", typed_in("damping='N s/mm'", {"damping": -3, "foundation damping": [-3, -3, 0]}))):
        found = compute(what, text, *FINE)
        if base and found:
            for name in ("re", "im"):
                series(f"{what}, multipliers, {name}", found["multipliers.csv"][name], base["multipliers.csv"][name], 1e-11)

    # 1 kp = 9.80665 N, 1 in = 0.0254 m; each number of a key in the unit and in SI
    for unit, key, value, si in (
            ("length=in", "joint(A).radius", 2.1, 2.1 * 0.0254), ("mass=kp s^2/m", "frame.mass", 5.0, 5 * 9.80665),
            ("inertia=kp cm s^2", "frame.inertia", 20.0, 20 * 0.0980665),
            ("stiffness=kp/m", "support.stiffness", 7e3, 7e3 * 9.80665),
            ("stiffness=kp/cm", "support.stiffness", 70.0, 70 * 980.665),
            ("stiffness=kp/mm", "support.stiffness", 7.0, 7 * 9806.65),
            ("damping=kp s/m", "support.damping", 7.0, 7 * 9.80665),
            ("damping=kp s/cm", "support.damping", 0.1, 0.1 * 980.665),
            ("moment=kp m", "foundation.stiffness(3,3)", 50.0, 50 * 9.80665),
            ("moment=kp cm", "foundation.stiffness(3,3)", 5e3, 5e3 * 0.0980665),
            ("rotary_damping=kp m s", "foundation.damping(3)", 0.7, 0.7 * 9.80665),
            ("rotary_damping=kp cm s", "foundation.damping(3)", 70.0, 70 * 0.0980665)):
        quantity = unit.partition("=")[0]
        # the other keys of that quantity once in SI and once in the unit
        lone = OF_ONE_QUANTITY[quantity]
        one = compute(unit, lone, "-s", f"units.{unit}", "-s", f"{key}={value!r}", *FINE)
        other = compute(f"SI for {unit}", lone, "-s", f"{key}={si!r}", *FINE)
        if one and other:
            agree(unit, one, other, 1e-10)


# Machines in which only the set key and zeros have that quantity.
PLAIN = """\
&drive speed_rpm=600.0 /
&joint name='O', type='ground', position=0.0,0.0 /
&joint name='A', type='crank', pivot='O', radius=0.05 /
&link name='eccentric', from='A', mass=0.0, inertia=0.0 /
&frame mass=45.0, inertia=1.6, origin=0.1,0.2 /
&support position=0.0,0.0, stiffness=6.0e4,6.0e4, damping=60.0,60.0 /
&foundation stiffness=8*0.0,900.0, damping=0.0,0.0,4.0 /
"""
MOVED = PLAIN.replace("mass=0.0", "mass=0.7")
OF_ONE_QUANTITY = {"length": MOVED.replace("origin=0.1,0.2", "origin=0.0,0.0, dof='xi','eta'")}
OF_ONE_QUANTITY |= dict.fromkeys(("stiffness", "damping", "moment", "rotary_damping"), MOVED)
OF_ONE_QUANTITY |= dict.fromkeys(("mass", "inertia"), PLAIN)


# ---- mountings -------------------------------------------------------------------------------------------------------


def test_subsets_of_freedoms():
    """Held degrees of freedom rest and the others move."""
    for free in (["xi"], ["eta"], ["psi"], ["xi", "eta"], ["eta", "psi"], ["psi", "xi"], ["xi", "eta", "psi"]):
        for base, what in ((MACHINE, "linkage"), (FUNCTIONS, "mass functions")):
            found = compute(f"{what}, dof {free}", base, "-s", "frame.dof=" + ",".join(free))
            if not found:
                continue
            equal(f"{what}, dof {free}: multipliers", len(found["multipliers.csv"].rows), 2 * len(free))
            for name, column in zip(("xi", "eta", "psi"), QUANTITIES):
                moves = any(found["response.csv"][column])
                equal(f"{what}, dof {free}: {column} moves", moves, name in free)


def stiffness_of(x, y, k, degrees):
    """sum of k g g^T: the head of a support at (x, y) moves along its axis n by g . q, g = (n_x, n_y, x n_y - y n_x)."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    rows = [(k[0], (c, s, x * s - y * c)), (k[1], (-s, c, x * c + y * s))]
    return [[sum(each * g[i] * g[j] for each, g in rows) for j in range(3)] for i in range(3)]


def test_turned_supports():
    """Turned supports act like the equivalent stiffness and damping matrix."""
    head = MACHINE[:MACHINE.index("&support")]
    placed = [(-0.20, -0.25, (6.0e4, 1.2e5), 30.0), (0.30, -0.10, (9.0e4, 1.0e4), -75.0), (0.0, 0.2, (1.0e5, 5.0e4), 200.0)]
    supports = "".join(f"&support position={x},{y}, stiffness={k[0]},{k[1]}, angle={angle} /\n" for x, y, k, angle in placed)
    parts = [stiffness_of(*support) for support in placed]
    total = [sum(part[i][j] for part in parts) for i in range(3) for j in range(3)]
    for i, j in ((1, 3), (2, 6), (5, 7)):
        total[j] = total[i]
    damping = "damping=70.0,90.0,3.0 /\n"
    # a matrix stands for supports about rest only: they turn with the frame
    head += "&model frame='rest' /\n"
    one = compute("turned supports", head + supports + "&foundation " + damping, *FINE)
    other = compute("their matrix", head + "&foundation stiffness=" + ",".join(map(repr, total)) + ", " + damping, *FINE)
    if one and other:
        agree("turned supports and their matrix", one, other, 1e-10)
    upright = "&support position=0.0,0.0, stiffness=5e4,7e4, damping=60.0,90.0 /\n&foundation stiffness=8*0.0,3e3 /\n"
    quarter = upright.replace("5e4,7e4", "7e4,5e4").replace("60.0,90.0", "90.0,60.0, angle=90.0")
    one, other = compute("upright", head + upright, *FINE), compute("a quarter turned", head + quarter, *FINE)
    if one and other:
        agree("a support turned by a quarter", one, other, 1e-10)
    # a support at F whose damping is turned by 45 deg couples xi and eta: b12 = (b1 - b2) / 2
    half = upright.replace("60.0,90.0", "60.0,90.0, angle=45.0").replace("5e4,7e4", "6e4,6e4")
    found = compute("turned damping", head + half, "-s", "drive.speed_rpm=600")
    if found:
        table = found["response.csv"]
        x, y = table["xi_dot_m_s"], table["eta_dot_m_s"]
        force = [6e4 * q + 75.0 * u - 15.0 * v for q, u, v in zip(table["xi_m"], x, y)]
        # rounding of terms that partly cancel
        series("turned damping, fx", table["fx_N"], force, 1e-12 * max(map(abs, force)))


# ---- the report of --check -------------------------------------------------------------------------------------------

FOUR_BAR = """\
&drive speed_rpm=100.0 /
&joint name='O', type='ground', position=0.0,0.0 /
&joint name='Q', type='ground', position=@,0.0 /
&joint name='A', type='crank', pivot='O', radius=@ /
&joint name='B', type='RRR', ends='A','Q', lengths=@,@, branch=1 /
&link name='crank', from='O', to='A', mass=1.0, inertia=0.0 /
&link name='coupler', from='A', to='B', mass=1.0, inertia=0.0, center=0.1,0.0 /
&link name='rocker', from='Q', to='B', mass=1.0, inertia=0.0 /
&frame mass=45.0, inertia=1.6, origin=0.0,0.05 /
&support position=0.0,0.0, stiffness=6.0e4,1.2e5, damping=60.0,120.0 /
"""


def four_bar(ground, crank, coupler, rocker):
    text = FOUR_BAR
    for length in (ground, crank, coupler, rocker):
        text = text.replace("@", repr(length), 1)
    return text


def test_diagnosis():
    """--check reports links, dead points and transmission angles correctly."""
    # the angle between coupler and rocker by the cosine rule, where crank and ground are in line; it or its supplement
    ground, crank, coupler, rocker = 0.40, 0.07, 0.37, 0.16
    report = check_report("crank-rocker", four_bar(ground, crank, coupler, rocker))

    def between(distance):
        return math.acos((coupler ** 2 + rocker ** 2 - distance ** 2) / (2 * coupler * rocker))

    angles = [min(angle, math.pi - angle) for angle in (between(ground - crank), between(ground + crank))]
    margin = min(coupler + rocker - ground - crank, ground - crank - (coupler - rocker))

    # the rocker swings between the two lines of crank and coupler
    def rocker_at(distance):
        return math.acos((ground ** 2 + rocker ** 2 - distance ** 2) / (2 * ground * rocker))

    swing = rocker_at(coupler + crank) - rocker_at(coupler - crank)
    check_words("crank-rocker", report, "mobility 1 (4 links including the frame, 4 pairs); crank-rocker (shortest link: crank)",
          f"smallest transmission angle {math.degrees(min(angles)):.1f} deg at joint 'B', crank angle 180.0 deg",
          f"nearest dead point: reached if a link length at joint 'B' changes by {margin:.3g} m",
          f"swings through {math.degrees(swing):.2f} deg", "turns fully", "-0.07 to 0.07")
    report = check_report("double crank", four_bar(0.05, 0.20, 0.18, 0.22))
    check_words("double crank", report, "double crank (shortest link: frame)")
    equal("double crank, links that turn", report.count("turns fully"), 3)
    poor = check_report("poor transmission", four_bar(0.10, 0.07, 0.14, 0.16))
    check_words("poor transmission", poor, "  <- poor")
    # a slotted lever swings by twice asin(r / d), the stroke of its end is 2 l r / d
    lever = check_report("all joints", MACHINE)
    check_words("all joints", lever, "mobility 1 (12 links including the frame, 16 pairs)\n",
          f"{-0.6 * 0.05 / 0.35:.5g} to {0.6 * 0.05 / 0.35:.5g}")
    swings = MACHINE.replace("&frame", "&link name='lever', from='P', to='C', mass=1.0, inertia=0.1 /\n&frame")
    check_words("lever", check_report("lever", swings), f"swings through {2 * math.degrees(math.asin(0.05 / 0.35)):.2f} deg")
    single = "".join(line for line in MACHINE.splitlines(keepends=True)
                     if not re.match("&joint name='[PBCDEFK]'|&link name='(rod|yoke)'", line))
    check_words("crank alone", check_report("crank alone", single), "2 joints, 1 link of 2 kg", "mobility 1 (2 links including the frame, 1 pair)")


# ---- the same machine in other words ---------------------------------------------------------------------------------


def test_same_machine():
    """Different descriptions of one machine yield the same results."""
    base = compute("all joints", SI.replace("@", ""), *FINE)
    fixed = "guide_point=0.017,0.0, guide_angle=90.0"
    # the y-axis from O to Q, and a point 0.017 to the right of it
    carried = "guide='O','Q', guide_point=0.0,-0.017"
    text = SI.replace("@", "").replace(fixed, carried)
    ground = "&joint name='Q', type='ground', position=0.0,2.0 /\n"
    text = text.replace("&joint name='A'", ground + "&joint name='A'")
    other = compute("a fixed guide as one between ground joints", text, *FINE)
    if base and other:
        agree("a fixed guide as one between ground joints", other, base, 1e-11)
    # a slider on the guide from the other side
    text = SI.replace("@", "").replace(fixed + ", branch=1", "guide_point=0.017,5.0, guide_angle=-90.0, branch=-1")
    other = compute("a guide turned round", text, *FINE)
    if base and other:
        agree("a guide turned round", other, base, 1e-11)
    for what, old, new, setting in (
            ("guide_point(1)", "guide_point=0.017,0.0", "guide_point=0.021,0.0", "joint(B).guide_point(1)=0.021"),
            ("guide_angle", "guide_angle=30.0", "guide_angle=33.0", "joint(K).guide_angle=33"),
            ("slot_angle", "slot_angle=80.0", "slot_angle=70.0", "joint(E).slot_angle=70"),
            ("offset(2)", "offset=0.101,0.023", "offset=0.101,0.03", "joint(D).offset(2)=0.03"),
            ("guide2_angle", "guide2_angle=0.0", "guide2_angle=4.0", "joint(F).guide2_angle=4"),
            ("guide2_point", "guide2_point=0.0,0.501", "guide2_point=0.1,0.4", "joint(F).guide2_point=0.1,0.4"),
            ("guide", "ends='D', lengths=0.509, guide='P','C'", "ends='D', lengths=0.509, guide='O','C'",
             "joint(K).guide='O','C'"),
            ("a joint by its number", "lengths=0.612", "lengths=0.6", "joint(5).lengths(1)=0.6"),
            ("dof", "origin=0.003,0.051", "origin=0.003,0.051, dof='eta','psi'", "frame.dof='eta','psi'"),
            ("dof without quotes", "origin=0.003,0.051", "origin=0.003,0.051, dof='eta'", "frame.dof=eta"),
            ("support's angle", "damping=61.0,123.0, angle=30.0", "damping=61.0,123.0, angle=20.0", "support(1).angle=20"),
            ("matrix", "211.0,457.0", "211.0,500.0", "foundation.stiffness(3,3)=500")):
        plain = SI.replace("@", "")
        assert plain.count(old) == 1, old
        results = []
        for name, words, options in (("file", plain.replace(old, new), []), ("--set", plain, ["-s", setting])):
            with Folder(input=words) as folder:
                Run(folder, "-q", "input.nml", *options).done(f"{what} by {name}")
                results.append(body(folder / "input"))
        equal(f"--set of {what}: as in the file", results[0] == results[1], True)
        with Folder(input=plain) as folder:
            Run(folder, "-q", "input.nml")
            check(f"--set of {what}: has an effect", body(folder / "input") != results[0], "other numbers", "the same")


MECHANISM_TESTS = (test_slider_crank, test_scotch_yoke, test_mass_functions, test_units, test_subsets_of_freedoms,
                   test_turned_supports, test_diagnosis, test_same_machine)
