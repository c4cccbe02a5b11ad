"""Tables for other programs: the equations of motion, the motion of the mechanism, and the tables that --check reports."""

import math
import re

from broken_inputs import SOUND
from harness import Folder, Run, Table, equal, near, series
from space import DATA, rows

DOFS = {"plane": ["xi", "eta", "psi"], "space": ["xi", "eta", "psi", "zeta", "rot_xi", "rot_eta"]}
UNITS = {"m": ("kg", "kg_m", "kg_m2"), "b": ("Ns_m", "Ns", "Nms"), "c": ("N_m", "N", "Nm")}
TURNING = ("psi", "rot_xi", "rot_eta")


# ---- equations of motion -----------------------------------------------------------------------------------------------


def solved(a, b):
    """The columns of A^-1 B, by elimination with pivots."""
    n = len(a)
    rows_of = [list(a[i]) + list(b[i]) for i in range(n)]
    for k in range(n):
        pivot = max(range(k, n), key=lambda i: abs(rows_of[i][k]))
        rows_of[k], rows_of[pivot] = rows_of[pivot], rows_of[k]
        rows_of[k] = [value / rows_of[k][k] for value in rows_of[k]]
        for i in range(n):
            if i != k and rows_of[i][k] != 0:
                factor = rows_of[i][k]
                rows_of[i] = [x - factor * y for x, y in zip(rows_of[i], rows_of[k])]
    return [row[n:] for row in rows_of]


def product(a, b):
    columns = list(zip(*b))
    return [[sum(x * y for x, y in zip(row, column)) for column in columns] for row in a]


def equations(path, dofs):
    """Of each row of matrices.csv: the matrix M^-1 [C, B, h]."""
    table = Table(path)

    def element(matrix, i, k, row):
        unit = UNITS[matrix][(dofs[i] in TURNING) + (dofs[k] in TURNING)]
        return table[f"{matrix}_{dofs[i]}_{dofs[k]}_{unit}"][row]
    n = range(len(dofs))
    found = []
    for row in range(len(table.rows)):
        m, b, c = ([[element(matrix, i, k, row) for k in n] for i in n] for matrix in "mbc")
        h = [table[f"h_{dof}_{'Nm' if dof in TURNING else 'N'}"][row] for dof in dofs]
        found.append(solved(m, [c[i] + b[i] + [h[i]] for i in n]))
    return table["t_s"], found


def integrated(times, found, start):
    """The state transition over the period, and the motion from the state `start`: classic Runge-Kutta steps over two rows."""
    n = len(found[0])

    def rate(state, row):
        # the last column of the state is that of the motion, which the load drives
        force = [[-value for value in line] for line in product([line[:2 * n] for line in found[row]], state)]
        for i in range(n):
            force[i][-1] += found[row][i][-1]
        return state[n:] + force

    def moved(state, step, rates):
        return [[x + step * y for x, y in zip(line, other)] for line, other in zip(state, rates)]
    state = [[float(i == k) for k in range(2 * n)] + [start[i]] for i in range(2 * n)]
    motion = [[line[-1] for line in state]]
    for row in range(0, len(times) - 1, 2):
        step = times[row + 2] - times[row]
        first = rate(state, row)
        second = rate(moved(state, step / 2, first), row + 1)
        third = rate(moved(state, step / 2, second), row + 1)
        fourth = rate(moved(state, step, third), row + 2)
        total = [[a + 2 * b + 2 * c + d for a, b, c, d in zip(*lines)] for lines in zip(first, second, third, fourth)]
        state = moved(state, step / 6, total)
        motion.append([line[-1] for line in state])
    return [line[:-1] for line in state], motion


def test_matrices():
    """The equations in matrices.csv have the program's multipliers and its vibration.

    The traces of the powers of Phi(T), computed with classic Runge-Kutta steps, are the sums of powers of the multipliers. With w T =
    82 and n = 1800 steps the error of these steps is w T (w T/n)^4/120 = 3e-6.
    """
    space = (DATA / "engine_in_space.nml").read_text()
    cases = [("exact", SOUND, "plane", 3600, "exact"), ("averaged", SOUND, "plane", 3600, "averaged"),
             ("clockwise", SOUND, "plane", 3600, "rest"), ("in space", space, "space", 2400, "exact")]
    for what, text, kind, points, model in cases:
        dofs = DOFS[kind]
        settings = [f"response.points={points}", "case.tasks='matrices','response','stability'"]
        settings.append("model.coefficients='averaged'" if model == "averaged" else f"model.frame='{model}'")
        if what == "clockwise":
            settings.append("drive.speed_rpm=-240")
        with Folder(input=text) as folder:
            run = Run(folder, "-q", *(word for setting in settings for word in ("-s", setting)), "input.nml")
            if not run.done(what):
                continue
            times, found = equations(folder / "input/matrices.csv", dofs)
            equal(f"{what}: rows", len(times), points + 1)
            response, multipliers = Table(folder / "input/response.csv"), Table(folder / "input/multipliers.csv")
            states = [f"{dof}_{'rad' if dof in TURNING else 'm'}" for dof in dofs]
            states += [f"{dof}_dot_{'rad_s' if dof in TURNING else 'm_s'}" for dof in dofs]
            phi, motion = integrated(times, found, [response[state][0] for state in states])
            rho = [complex(re, im) for re, im in zip(multipliers["re"], multipliers["im"])]
            power = phi
            for k in range(1, 2 * len(dofs) + 1):
                near(f"{what}: trace of Phi^{k}", sum(power[i][i] for i in range(len(phi))), sum(z**k for z in rho).real, 2e-5 * k)
                power = product(power, phi)
            for i, state in enumerate(states):
                scale = max(map(abs, response[state])) or 1.0
                series(f"{what}: {state}", [row[i] / scale for row in motion], [value / scale for value in response[state][::2]], 1e-5)


# ---- motion of the mechanism -------------------------------------------------------------------------------------------

# Coefficients of central differences of order 8 for the first and second derivative, from the middle.
FIRST = (0.0, 4 / 5, -1 / 5, 4 / 105, -1 / 280)
SECOND = (-205 / 72, 8 / 5, -1 / 5, 8 / 315, -1 / 560)


def test_motion():
    """Velocities and accelerations in mechanism.csv are the derivatives of the positions."""
    for name, settings in (("khang_four_bar", ()), ("khang_four_bar", ("-s", "drive.speed_rpm=-97")), ("inline_twin", ()),
                           ("cam_press", ())):
        with Folder(input=(DATA / f"{name}.nml").read_text()) as folder:
            run = Run(folder, "-q", "-s", "case.tasks='drawing'", *settings, "input.nml")
            if not run.done(f"{name}: drawing"):
                continue
            table = Table(folder / "input/mechanism.csv")
            speed = float(re.search(r"drive +(\S+) rpm", Run(folder, "--check", *settings, "input.nml").out)[1])
            step = abs(table["crank_deg"][1]) / (6 * speed)
            for column in [column for column in table.columns if re.search(r"\)\.[xyz]_m$", column)]:
                x = table[column][:-1]
                n = len(x)
                name_of, axis = column[:-3], column[-3]
                pairs = [[x[(i + k) % n] - x[i - k] for k in range(5)] for i in range(n)]
                speeds = [sum(FIRST[k] * pair[k] for k in range(1, 5)) / step for pair in pairs]
                twice = [sum(SECOND[k] * (x[(i + k) % n] + x[i - k]) for k in range(1, 5)) + SECOND[0] * x[i] for i in range(n)]
                accelerations = [value / step**2 for value in twice]
                # the same scale for all points of the machine: 1 m within a degree would be 1 / step
                series(f"{name}: v{axis} of {name_of}", table[f"{name_of}v{axis}_m_s"][:-1], speeds, 1e-9 / step)
                series(f"{name}: a{axis} of {name_of}", table[f"{name_of}a{axis}_m_s2"][:-1], accelerations, 1e-9 / step**2)


# ---- tables of --check -------------------------------------------------------------------------------------------------


def numbers(text):
    return [float(word) for word in text.split() if re.fullmatch(r"[-+]?\d[\d.]*(e[-+]?\d+)?", word)]


def test_crank():
    """The tables of an unbalanced slider-crank agree with closed forms."""
    text = ("&drive speed_rpm=-300 /\n&joint name='O', type='ground', position=0,0 /\n"
            "&joint name='A', type='crank', pivot='O', radius=0.05 /\n"
            "&joint name='B', type='RRP', ends='A', lengths=0.2, guide_point=0,0, guide_angle=0, branch=1 /\n"
            "&link name='crank', from='O', to='A', mass=2, inertia=0.01, center=0.03,0.04 /\n"
            "&frame mass=40, inertia=1.5, origin=0,0 /\n"
            "&support position=-0.2,0, stiffness=4e4,8e4 /\n&support position=0.2,0, stiffness=4e4,8e4 /\n")
    omega, ahead = 10 * math.pi, math.atan2(0.04, 0.03)
    with Folder(input=text) as folder:
        run = Run(folder, "-s", "case.tasks='drawing'", "input.nml")
        if not run.done("slider-crank"):
            return
        stroke, = rows(folder / "input/strokes.csv")
        equal("name of the slider", stroke["slider"], "B")
        near("stroke", float(stroke["stroke_m"]), 0.1, 1e-12)
        near("greatest acceleration", float(stroke["acceleration_m_s2"]), 0.05 * omega**2 * 1.25, 1e-9)
        near("forward motion", float(stroke["forward_deg"]), 180, 1e-6)
        near("time ratio", float(stroke["time_ratio"]), 1, 1e-8)
        table = {row["component"]: row for row in rows(folder / "input/balance_table.csv")}
        equal("rows of the balance table", list(table), [*map(str, range(1, 9)), "peak", "rms"])
        force = 2 * 0.05 * omega**2
        for row, share in (("1", 1), ("peak", 1), ("rms", math.sqrt(0.5)), ("2", 0)):
            near(f"fx, {row}", float(table[row]["fx_N_amplitude"]), share * force, 1e-10 * force)
            near(f"moment, {row}", float(table[row]["m_Nm_amplitude"]), 0, 0)
        # the crank angle is negative: force cos(phi + ahead), where phi is the crank angle
        near("phase of fx", float(table["1"]["fx_N_phase_rad"]), ahead, 1e-10)
        near("phase of fy", float(table["1"]["fy_N_phase_rad"]), ahead - math.pi / 2, 1e-10)
        equal("no phase of order 2", table["2"]["fx_N_phase_rad"], "NaN")
        unbalance = {row["rotation"]: row for row in rows(folder / "input/unbalance.csv")}
        near("unbalance", float(unbalance["with"]["unbalance_kg_m"]), 0.1, 1e-12)
        near("angle of the unbalance", float(unbalance["with"]["angle_rad"]), ahead, 1e-10)
        near("unbalance against the crank", float(unbalance["against"]["unbalance_kg_m"]), 0, 0)
        modes = rows(folder / "input/frequencies.csv")
        near("frequency along xi", float(modes[0]["frequency_Hz"]), math.sqrt(8e4 / 42) / (2 * math.pi), 0.05)
        equal("no damping", [float(mode["damping_ratio"]) for mode in modes], [0.0] * 3)


def test_files_and_report():
    """The report of --check and the files contain the same numbers."""
    for name in ("khang_four_bar", "engine_in_space", "compressor"):
        with Folder(input=(DATA / f"{name}.nml").read_text()) as folder:
            report = Run(folder, "--check", "input.nml").out
            run = Run(folder, "-q", "-s", "case.tasks='drawing'", "input.nml")
            if not run.done(f"{name}: drawing"):
                continue
            printed = [numbers(line) for line in report.partition("NATURAL FREQUENCIES")[2].splitlines() if re.match(r"  \d ", line)]
            modes = rows(folder / "input/frequencies.csv")
            equal(f"{name}: number of frequencies", len(printed), len(modes))
            for line, mode in zip(printed, modes):
                for value, column, digits in zip(line[1:], ("frequency_Hz", "damping_ratio", "crank_speeds"), (6, 3, 5)):
                    near(f"{name}: {column}", value, float(mode[column]), 0.6 * 10.0**(1 - digits) * abs(value) + 1e-12)
            lines = [line.split() for line in report.partition("SHAKING FORCES")[2].partition("\n\n")[0].splitlines()]
            printed = {words[0]: words[1:] for words in lines if words and re.fullmatch(r"[1-8]|peak|rms", words[0])}
            table = rows(folder / "input/balance_table.csv")
            columns = [column for column in table[0] if column.endswith("_amplitude")]
            for row in table:
                words = printed[row["component"]]
                # the rows peak and rms have no phases
                words = words[::2] if len(columns) == 3 and len(words) == 6 else words[:6]
                if name == "engine_in_space" and len(words) < 6:
                    continue
                for column, word in zip(columns, words):
                    near(f"{name}: {column}, {row['component']}", float(word), float(row[column]), 6e-5 * abs(float(row[column])))


OTHER_PROGRAM_TESTS = (test_matrices, test_motion, test_crank, test_files_and_report)
