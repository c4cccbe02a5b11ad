"""Studies of a frame in space (sensitivities, borders, all vibrations, models, sweeps, designs) against a planar machine in a
tilted plane, single runs and their central differences."""

import math
import re

from harness import Folder, Run, check, equal, near
from space import ALL, DATA, FOUR_BAR, HOLDERS, VALIDATION, rows, tilted_machine, times, turned, words

MODELS = ("rest", "first_order", "exact")


def tilted(task, model, speed, more, damping=None, space_more=None):
    """Inputs of the planar machine and of that in a tilted plane; `damping`: of its supports along both axes."""
    plane, space, axes = tilted_machine()
    if damping is not None:
        plane = re.sub(r"damping=[0-9.]+,[0-9.]+", f"damping={damping},{damping}", plane)
        # two halves of each
        space = re.sub(r"damping=[0-9.]+,[0-9.]+,", f"damping={damping / 2},{damping / 2},", space)
    head = f"&case tasks='{task}' /\n&model frame='{model}' /\n&drive speed_rpm={speed} /\n"
    return head + more + plane, head + (more if space_more is None else space_more) + space, axes


def one_line(folder, name, *settings):
    """Names and numbers of a run with --one-line."""
    run = Run(folder, "--one-line", "-s", "accuracy.tolerance=1e-12", *settings, name)
    if not run.done(f"single run, {settings}"):
        return {}
    names, values = (line.split(",") for line in run.out.splitlines()[:2])
    return dict(zip(names, values))


def sensitivity_tests():
    """Sensitivities in space agree with the plane and with single runs."""
    paths = ("drive.speed_rpm", "frame.mass", "frame.inertia", "frame.origin", "link(coupler).mass", "link(rocker).inertia",
             "joint(A).radius", "support.stiffness", "support.damping", "support.position")
    text = "&sensitivity quantities='f','probe(a).v', parameters={} /\n&probe name='a', position=0,0 /\n".format(
        ",".join(f"'{path}'" for path in paths))
    for model in MODELS:
        plane, space, _ = tilted("sensitivity", model, 420, text)
        with Folder(plane=plane, space=space) as folder:
            for name in ("plane", "space"):
                if not Run(folder, "-q", f"{name}.nml").done(f"sensitivity, {model}, {name}"):
                    return
            both = [rows(folder / name / "sensitivity.csv") for name in ("plane", "space")]
        equal(f"sensitivity, {model}: rows", [len(table) for table in both], [2 * len(paths)] * 2)
        for one, other in zip(*both):
            for what in ("peak", "rms"):
                key = f"{what}_change_percent_per_percent"
                # both errors are some 1e-10
                near(f"sensitivity, {model}: {what} of {one['quantity']} to {one['parameter']}", float(other[key]), float(one[key]), 2e-9)
    numbers = {"support(2).stiffness(3)": 70.0, "support(1).position(3)": 100.0, "support(3).angle(3)": -15.0, "frame.inertia(5)": 0.30,
               "mechanism(forward).origin(1)": 110.0, "frame.origin(2)": -80.0, "link(throw).inertia(2)": 0.010, "link(forward).mass": 0.9}
    text = (DATA / "engine_in_space.nml").read_text()
    text = re.sub(r"tasks = [^/]*/", "tasks = 'sensitivity' /", text, count=1)
    text += "&sensitivity quantities='eta','rot_xi','zeta', parameters={} /\n".format(",".join(f"'{path}'" for path in numbers))
    with Folder(input=text) as folder:
        if not Run(folder, "-q", "input.nml").done("sensitivity of the engine"):
            return
        table = rows(folder / "input" / "sensitivity.csv")
        equal("sensitivity of the engine: rows", len(table), 3 * len(numbers))
        step = 1e-3
        for path, number in numbers.items():
            sides = [one_line(folder, "input.nml", "-s", "case.tasks=response", "-s", f"{path}={number * part!r}")
                     for part in (1 + step, 1 - step)]
            for row in table:
                if row["parameter"] != path or not all(sides):
                    continue
                key = f"{row['quantity']}_peak_{'rad' if 'rot' in row['quantity'] else 'm'}"
                change = math.log(float(sides[0][key]) / float(sides[1][key])) / math.log((1 + step) / (1 - step))
                equal(f"sensitivity of {row['quantity']} to {path}: state", row["state"], "ok")
                # for the n-th power of a number the error of the step is its square times n^3; and its square times that of the distance from
                # a resonance, some 10
                near(f"sensitivity of {row['quantity']} to {path}", float(row["peak_change_percent_per_percent"]), change,
                     step**2 * max(20.0, abs(change)**3))


def sweep_tests():
    """Points of sweeps in space agree with single runs."""
    names = ["xi_peak_m", "eta_peak_m", "psi_peak_rad", "zeta_peak_m", "rot_xi_peak_rad", "rot_eta_peak_rad"]
    text = re.sub(r"tasks = [^/]*/", "tasks = 'sweep' /", (DATA / "suspended_compressor.nml").read_text(), count=1)
    axes = {"drive.speed_rpm": (2000, 3000), "support(1).stiffness(3)": (600, 1200), "mechanism(compressor).origin(2)": (-10, 10)}
    for path, (low, high) in axes.items():
        for engine, model in (("direct", "exact"), ("auto", "rest")):
            axis = f"&sweep parameter='{path}', from={low}, to={high}, count=41, engine='{engine}' /\n&model frame='{model}' /\n"
            source = text + axis
            if "origin" in path:
                source = source.replace("axis=0.0,1.0,0.0 /", "axis=0.0,1.0,0.0, origin=0.0,0.0,0.0 /")
            with Folder(input=source, single=source.replace("'sweep'", "'stability','response'")) as folder:
                if not Run(folder, "-q", "input.nml").done(f"sweep over {path}, {engine}"):
                    return
                table = rows(folder / "input" / "sweep.csv")
                equal(f"sweep over {path}: columns", [key for key in table[0] if "peak" in key], names)
                for row in (table[0], table[17], table[-1]):
                    single = one_line(folder, "single.nml", "-s", f"{path}={row[path]}")
                    # the tolerance is 1e-9, more for a peak close to a resonance
                    near(f"sweep over {path}: rho", float(row["rho_max"]), float(single["rho_max"]), 2e-9)
                    for name in names:
                        size = float(single[name])
                        near(f"sweep over {path}, {engine}: {name}", float(row[name]), size, 1e-6 * size)
    with Folder(input=text + "&sweep parameter='drive.speed_rpm', from=2000, to=3000, count=5, columns='rot_xi_peak_rad' /\n") as folder:
        Run(folder, "-q", "input.nml").done("sweep of one peak")
        equal("sweep of one peak: columns", list(rows(folder / "input" / "sweep.csv")[0]), ["drive.speed_rpm", "rot_xi_peak_rad", "verdict"])
    plane = FOUR_BAR.format("") + "&frame mass=18, inertia=0.78, origin=0.1,-0.25 /\n&foundation stiffness=1e5,0,0,0,1e5,0,0,0,1e4 /\n"
    with Folder(input="&case tasks='sweep' /\n&drive speed_rpm=300 /\n" + plane +
                "&sweep parameter='frame.mass', from=10, to=20, count=3, columns='zeta_peak_m' /\n") as folder:
        Run(folder, "input.nml").refused("a peak in space in the plane", 2,
                                         "input.nml:12: &sweep: columns(1) = 'zeta_peak_m': exists only if the frame moves in space")


def border_tests():
    """Stability borders in space agree with the plane and with single runs."""
    for model, (low, high), damping in (("rest", (1000, 1100), 0.5), ("first_order", (1020, 1070), 4), ("exact", (1020, 1055), 4)):
        more = f"&sweep parameter='drive.speed_rpm', from={low}, to={high}, count=8 /\n"
        plane, space, _ = tilted("boundary", model, low, more, damping)
        with Folder(plane=plane, space=space) as folder:
            for name in ("plane", "space"):
                if not Run(folder, "-q", f"{name}.nml").done(f"borders, {model}, {name}"):
                    return
            both = [rows(folder / name / "boundary.csv") for name in ("plane", "space")]
            check(f"borders, {model}: some", len(both[0]) >= 1, "1 at least", len(both[0]))
            for row in both[0]:
                found = [other for other in both[1] if other["kind"] == row["kind"]
                         and abs(float(other["drive.speed_rpm"]) - float(row["drive.speed_rpm"])) <= 2e-7]
                equal(f"borders, {model}: {row['kind']} at {row['drive.speed_rpm']}", len(found), 1)
            for row in both[1]:
                for side, word in ((-1, row["below"]), (1, row["above"])):
                    value = float(row["drive.speed_rpm"]) + side * 20 * float(row["drive.speed_rpm_error"])
                    single = one_line(folder, "space.nml", "-s", "case.tasks=stability", "-s", f"drive.speed_rpm={value!r}")
                    if single:
                        equal(f"borders, {model}: verdict at {value}", single["verdict"], word)


def map_tests():
    """Border and level curves in space agree with the plane."""
    more = "&sweep parameter='drive.speed_rpm', from=1060, to=1090, count=4 /\n&sweep parameter='frame.mass', from=17, to=19, count=4 /\n"
    plane, space, _ = tilted("boundary", "rest", 1075, more, 0.5)
    with Folder(plane=plane, space=space) as folder:
        for name in ("plane", "space"):
            if not Run(folder, "-q", f"{name}.nml").done(f"map, {name}"):
                return
        both = [rows(folder / name / "boundary.csv") for name in ("plane", "space")]
        check("map: vertices", len(both[0]) > 5, "some", len(both[0]))
        equal("map: kinds", [row["kind"] for row in both[1]], [row["kind"] for row in both[0]])
        for one, other in zip(*both):
            for key in ("drive.speed_rpm", "frame.mass"):
                near(f"map: {key}", float(other[key]), float(one[key]), 2 * float(one[f"{key}_error"]))
    more = "&sweep parameter='drive.speed_rpm', from=400, to=440, count=5 /\n&boundary quantity='f', level=400 /\n"
    plane, space, _ = tilted("boundary", "exact", 400, more)
    with Folder(plane=plane, space=space) as folder:
        for name in ("plane", "space"):
            if not Run(folder, "-q", f"{name}.nml").done(f"level, {name}"):
                return
        one, other = ([float(row["drive.speed_rpm"]) for row in rows(folder / name / "boundary.csv")] for name in ("plane", "space"))
        equal("level: passed once", [len(one), len(other)], [1, 1])
        near("level: speed", other[0], one[0], 1e-6)


def tilted_yoke():
    """validation/exudyn/scotch_yoke.nml in a tilted plane."""
    plane = (VALIDATION.parent / "exudyn" / "scotch_yoke.nml").read_text()
    q = times(turned(2, 30), times(turned(1, -25), turned(0, 50)))
    tensor = times(times(q, [[0.7, 0, 0], [0, 0.8, 0], [0, 0, 1.1]]), [list(column) for column in zip(*q)])
    lines = [f"&mechanism name='m', axis={words(row[2] for row in q)}, x_axis={words(row[0] for row in q)} /"]
    for line in plane.splitlines():
        if line.startswith("&frame"):
            moments = [tensor[i][j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
            origin = [-0.04 * row[0] + 0.12 * row[1] for row in q]
            lines.append(f"&frame mass=38.0, inertia={words(moments)}, origin={words(origin)}, {ALL} /")
        elif line.startswith("&support"):
            x, y, kx, ky, bx, by, angle = (float(number) for number in re.findall(r"-?[0-9.]+(?:e[0-9]+)?", line))
            axes = times(q, turned(2, angle))
            angles = (math.degrees(math.atan2(axes[1][0], axes[0][0])), math.degrees(math.asin(-axes[2][0])),
                      math.degrees(math.atan2(axes[2][1], axes[2][2])))
            for z in (-0.2, 0.2):
                lines.append(f"&support position={words(row[0] * x + row[1] * y + row[2] * z for row in q)}, stiffness={kx / 2},{ky / 2},"
                             f"9e4, damping={bx / 2},{by / 2},60, angle={words(angles)} /")
        else:
            lines.append(re.sub("^&(joint|link) ", r"&\1 mechanism='m', ", line))
    return plane, "\n".join(lines) + "\n", [row[2] for row in q]


def vibrations_tests():
    """A tilted yoke has the same three vibrations as in the plane."""
    plane, space, normal = tilted_yoke()
    with Folder(plane=plane, space=space) as folder:
        for name in ("plane", "space"):
            if not Run(folder, "-q", "-s", "model.vibrations=all", "-s", "drive.speed_rpm=1138.6", f"{name}.nml").done(f"all, {name}"):
                return
        both = [rows(folder / name / "vibrations.csv") for name in ("plane", "space")]
        equal("vibrations: three", [len(table) for table in both], [3, 3])
        for one, other in zip(*both):
            for key in ("told", "turning_index", "verdict"):
                equal(f"vibrations, {one['index']}: {key}", other[key], one[key])
            # both vibrations are accurate to 1e-9; rotations of 0.8 rad
            near(f"vibrations, {one['index']}: rms of rot_xi", float(other["rot_xi_rms_rad"]), abs(normal[0]) * float(one["psi_rms_rad"]),
                 1e-7)
            near(f"vibrations, {one['index']}: peak of psi", float(other["psi_peak_rad"]), abs(normal[2]) * float(one["psi_peak_rad"]), 1e-6)
        near("vibrations: the one between turning points", float(both[1][1]["rho_max"]), float(both[0][1]["rho_max"]), 1e-7)


def trade_tests():
    """The comparison of models works for all degrees of freedom in space."""
    _, space, _ = tilted("trade", "exact", 420, "")
    with Folder(input=space) as folder:
        run = Run(folder, "input.nml")
        run.done("trade in space")
        for word in ("peak of rot_eta' (rad/s)", "peak of fz (N)", "peak of my (N m)"):
            equal(f"trade in space: {word}", run.out.count(word), 1)
        table = run.out.partition("THE FRAME'S MODELS")[2].split("\n\n")[0].splitlines()
        equal("trade in space: models twice", [sum(line.split()[:1] == [model] for line in table) for model in MODELS], [2] * 3)
        check("trade in space: width", all(len(line) <= 80 for line in run.out.splitlines()), "80", max(map(len, run.out.splitlines())))


def torque_design_tests():
    """Designs for the drive's torque agree with the plane and the task power."""
    design = "&design parameter='{}', from={}, to={} /\n"
    more = design.format("link(crank).center(1)", -0.2, 0.1) + design.format("frame.mass", 15, 25) + \
        "&objective quantity='torque', measure='{}' /\n&constraint quantity='f', measure='rms', at_most=400 /\n"
    for model, holder, measure in (("exact", HOLDERS[0], "rms"), ("exact", HOLDERS[2], "peak"), ("exact", HOLDERS[1], "rms")):
        what = f"design for torque, {model}, {holder.split(',')[0]}"
        plane, space, _ = tilted("design", model, 420, more.format(measure))
        plane, space = (text.replace("speed_rpm=420", f"speed_rpm=420, held_by={holder}") for text in (plane, space))
        with Folder(plane=plane, space=space) as folder:
            for name in ("plane", "space"):
                if not Run(folder, "-q", f"{name}.nml").done(f"{what}, {name}"):
                    return
            for one, other in zip(*(rows(folder / name / "design.csv") for name in ("plane", "space"))):
                # as in design_tests
                near(f"{what}: {one['parameter']}", float(other["after"]), float(one["after"]), 1e-5 * abs(float(one["after"])))
            goals = [rows(folder / name / "design_goals.csv") for name in ("plane", "space")]
            for one, other in zip(*goals):
                for key in ("before", "after"):
                    near(f"{what}: {one['quantity']} {key}", float(other[key]), float(one[key]), 1e-7 * abs(float(one[key])))
            if Run(folder, "-q", "-s", "case.tasks=power", "-s", "response.points=512", "-o", "single", "space/design.nml").done(what):
                torques = [float(row["torque_Nm"]) for row in rows(folder / "single" / "power.csv")[:-1]]
                size = max(map(abs, torques)) if measure == "peak" else math.sqrt(sum(value**2 for value in torques) / len(torques))
                # nine digits of the numbers; 512 rows of a peak
                near(f"{what}: as in the task power", size, float(goals[1][0]["after"]), (1e-4 if measure == "peak" else 1e-7) * size)
    text = (VALIDATION / "watt_beside.nml").read_text().replace("&drive ", "&drive held_by='flywheel', flywheel_inertia=0.3, ")
    text = re.sub(r"&case title = ('[^']*') /", "&case tasks='design' /", text) + \
        design.format("frame.mass", 40, 90) + "&objective quantity='torque', measure='rms' /\n"
    with Folder(input=text) as folder:
        if not Run(folder, "-q", "-s", "drive.speed_rpm=209", "input.nml").done("design with a flywheel"):
            return
        goal, number = rows(folder / "input" / "design_goals.csv")[0], rows(folder / "input" / "design.csv")[0]
        torques = {}
        for part in (0.98, 1.0, 1.02):
            mass = min(max(float(number["after"]) * part, 40.0), 90.0)
            Run(folder, "-q", "-s", "case.tasks=power", "-s", f"frame.mass={mass!r}", "-s", "response.points=256", "-s",
                "drive.speed_rpm=209", "-o", "one", "input.nml").done("design with a flywheel, power")
            values = [float(row["torque_Nm"]) for row in rows(folder / "one" / "power.csv")[:-1]]
            torques[part] = math.sqrt(sum(value**2 for value in values) / len(values))
        near("design with a flywheel: torque", torques[1.0], float(goal["after"]), 1e-8 * torques[1.0])
        check("design with a flywheel: not better on either side", torques[1.0] <= min(torques.values()) * (1 + 1e-12), min(torques.values()),
              torques)


def design_tests():
    """Designs in space agree with the plane and with single runs."""
    design = "&design parameter='{}', from={}, to={} /\n"
    more = design.format("link(crank).center(1)", -0.2, 0.1) + design.format("frame.mass", 15, 25) + \
        "&objective quantity='f', measure='{}' /\n&constraint quantity='{}', measure='{}', at_most={} /\n"
    for model, goals in (("rest", ("rms", "shaking.f", "rms", 60)), ("exact", ("rms", "probe(a).v", "peak", 0.25))):
        plane, space, _ = tilted("design", model, 420, more.format(*goals) + "&probe name='a', position=0,0 /\n")
        with Folder(plane=plane, space=space) as folder:
            for name in ("plane", "space"):
                if not Run(folder, "-q", f"{name}.nml").done(f"design, {model}, {name}"):
                    return
            both = [rows(folder / name / "design.csv") for name in ("plane", "space")]
            for one, other in zip(*both):
                # near an optimum the objective is flat: if it is accurate to 1e-8, the parameters are accurate to the root of that
                near(f"design, {model}: {one['parameter']}", float(other["after"]), float(one["after"]), 1e-5 * abs(float(one["after"])))
            both = [rows(folder / name / "design_goals.csv") for name in ("plane", "space")]
            for one, other in zip(*both):
                for key in ("before", "after"):
                    near(f"design, {model}: {one['quantity']} {key}", float(other[key]), float(one[key]), 1e-7 * abs(float(one[key])))
    torque_design_tests()
    text = re.sub(r"tasks = [^/]*/", "tasks = 'design' /", (DATA / "engine_in_space.nml").read_text(), count=1)
    text += "".join(f"&design parameter='support(1).stiffness({axis})', with='support(2).stiffness({axis})', from=20, to=300, starts=2 /\n"
                    for axis in (1, 2))
    text += "".join(f"&design parameter='support(3).stiffness({axis})', from=20, to=400 /\n" for axis in (1, 2, 3))
    text += "&objective quantity='f', measure='rms' /\n&constraint quantity='separation', at_least=20 /\n&model frame='rest' /\n"
    with Folder(input=text) as folder:
        run = Run(folder, "input.nml")
        if not run.done("design of the engine's mounts"):
            return
        goal, limit = rows(folder / "input" / "design_goals.csv")
        equal("design of the engine's mounts: limit", limit["state"], "met")
        single = Run(folder, "-q", "-s", "case.tasks=response", "-s", "response.quantities=f", "-s", "response.measures=rms",
                     "-o", "single", "input/design.nml")
        if single.done("the improved engine"):
            found = rows(folder / "single" / "quantities.csv")[0]
            # the input has nine digits of the numbers
            near("design of the engine's mounts: as reported", float(found["value"]), float(goal["after"]), 1e-6 * float(goal["after"]))


SPACE_STUDIES_TESTS = [sensitivity_tests, sweep_tests, border_tests, map_tests, vibrations_tests, trade_tests, design_tests]
