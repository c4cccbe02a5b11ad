"""The package as people use it who know numpy: python3 bindings/package.py

Copies, pickles, iteration, arrays, sweeps, the examples of the docstrings and of doc/python.md. The last line is
"N passed, M failed".
"""
import contextlib
import copy
import doctest
import importlib
import io
import multiprocessing
import os
import pickle
import shutil
import sys

import numpy

import gestell
import python as tests
from python import ROOT, check, refused

FILE = ROOT / "data/khang_four_bar.nml"


def read_back():
    """What the input says can be read: numbers, words, lists, groups."""
    machine = gestell.Machine(FILE)
    machine.add("probe", name="a.b(c)", position=[0.1, 0.2])
    for path, wanted in (("model.frame", "rest"), ("MODEL.frame", "rest"), ("case.tasks", ["stability", "response"]),
                         ("case.tasks(2)", "response"),
                         ("drive.speed_rpm", 240), ("joint(B).branch", 1), ("joint(B).ends", ["A", "B0"]), ("joint(B).name", "B"),
                         ("support(2).stiffness(1)", 196133), ("probe(a.b(c)).position(2)", 0.2)):
        check(f"{path} is read", numpy.array_equal(machine[path], wanted) and path in machine, machine[path])
    machine["case.tasks"] = ["modes"]
    check("a list of one word is a list", machine["case.tasks"] == ["modes"], machine["case.tasks"])
    check("a whole number", isinstance(machine["joint(B).branch"], int) and isinstance(machine["frame.mass"], float))
    machine["case.title"] = "it's, \"one\"; ü"
    check("a title", machine["case.title"] == "it's, \"one\"; ü"
          and gestell.Machine(machine.text)["case.title"] == machine["case.title"],
          machine["case.title"])
    check("all supports", machine["support.stiffness"].tolist() == 8 * [196133], machine["support.stiffness"])
    for path in ("foundation.stiffness", "drive.speed_rp", "nothing", "", "support(9).stiffness", "joint(Z).branch", "\udcff",
                 "a\0", 7, None):
        check(f"{path!r} is not in the machine", path not in machine)
    check("paths and values", all(numpy.array_equal(machine[path], value) for path, value in machine.items()), machine.items())
    check("iteration", list(machine) == machine.keys() == machine._ipython_key_completions_()
          and "joint(B).lengths" in list(machine)
          and "support(4).position" in list(machine) and dict(machine)["frame.mass"] == 18, list(machine))
    check("groups", list(machine.groups)[:4] == ["case", "model", "drive", "joint(A0)"]
          and machine.groups["link(rocker)"]["to"] == "B",
          machine.groups)
    one = machine.parameters("frame.mass")
    check("parameters", len(one) == 1 and one[0]["unit"] == "kg" and one[0]["positive"]
          and machine.parameters()[0]["path"] == "case.title", one)
    machine.add("units", length="mm")
    check("units", machine.parameters("frame.origin(1)")[0]["unit"] == "mm", machine.parameters("frame.origin(1)"))
    machine["frame.origin(1)"] = -5
    check("an element of several", machine["frame.origin"].tolist() == [-5, 0.2], machine["frame.origin"])
    part = gestell.Machine().add("support", **{"stiffness(2)": 5})
    check("an element that is not given", part["support.stiffness"] == 5 and "support.stiffness(1)" not in part,
          part["support.stiffness"])
    empty = gestell.Machine()
    check("an empty machine", list(empty) == [] and empty.groups == {} and "drive.speed_rpm" not in empty
          and repr(empty) == "Machine(empty)")
    refused("nothing to read", 2, "no value", lambda: machine["foundation.stiffness"])
    refused("nothing to read, empty", 2, "empty", lambda: empty["drive.speed_rpm"])


def removed():
    """Groups are removed with their lines; all others stay, as they were written."""
    text = FILE.read_text()
    machine = gestell.Machine(FILE)
    machine.remove("support(2)")
    lines = text.splitlines(True)
    lines.remove(next(line for line in lines if "position=-0.10" in line))
    check("one line less", machine.text == "".join(lines), machine.text)
    machine["support(2).stiffness(1)"] = 7.5
    check("the third support is the second", "position= 0.10,-0.20, stiffness=7.5,196133.0" in machine.text, machine.text)
    machine.add("probe", name="P", position=[0, 0]).add("probe", name="Q", position=[1, 1]).remove("probe(P)")
    check("a group that was added", "probe(Q).position" in machine and "'P'" not in machine.text, machine.text)
    machine.add("probe", name="P", position=[0, 0]).remove("probe")
    check("all of a kind", not any("probe" in path for path in machine) and machine.solve("stability").verdict == "stable",
          machine.text)
    for groups, code, words in (("probe", 2, "no &probe"), ("support(9)", 2, "no &support 9"), ("drive.speed_rpm", 1, "GROUP"),
                                ("", 1, "GROUP"),
                                ("joy", 2, "unknown group"), ("link(\udcff)", 1, "UTF-8")):
        machine = gestell.Machine(FILE)
        refused(f"remove {groups!r}", code, words, lambda groups=groups: machine.remove(groups))
        check(f"after removing {groups!r}", machine.text == text)
    refused("a group that is missing", 2, "&drive is missing", lambda: gestell.Machine(FILE).remove("drive").solve("stability"))
    machine = gestell.Machine(FILE).add("probe", name="P", position=[0, 0]).remove("drive")
    check("a group is added again", machine.add("drive", speed_rpm=250).solve("stability").verdict == "stable", machine.text)
    file = tests.INPUTS / "response.csv"
    file.write_text(text)
    solution = gestell.Machine(file).remove("support(2)").solve("response")
    refused("results in place of the input", 1, "response.csv: the results would replace the input",
            lambda: solution.write(tests.INPUTS))
    alone = gestell.Machine().add("frame", mass=1)
    refused("the last group", 2, "no other group", lambda: alone.remove("frame"))
    check("stays", alone["frame.mass"] == 1)


def copies():
    """A copy is a machine of its own; a pickle has the same text, also if it is not complete."""
    machine = gestell.Machine(FILE)
    machine["drive.speed_rpm"] = 250
    for name, again in (("copy", machine.copy()), ("copy.copy", copy.copy(machine)),
                        ("deepcopy", copy.deepcopy({"a": machine})["a"]),
                        ("pickle", pickle.loads(pickle.dumps(machine)))):
        check(f"{name}: text", again.text == machine.text and repr(again) == repr(machine), again.text)
        again["drive.speed_rpm"] = 300
        check(f"{name}: of its own", machine["drive.speed_rpm"] == 250, machine["drive.speed_rpm"])
    changed = machine.copy({"frame.mass": 20, "model.frame": "exact"})
    check("changes", changed["frame.mass"] == 20 and changed["model.frame"] == "exact" and machine["frame.mass"] == 18)
    refused("a wrong path", 2, "frame", lambda: machine.copy({"frame.mas": 20}))
    part = gestell.Machine().add("link", name="crank", from_="A0", to="A")
    for again in (part.copy(), pickle.loads(pickle.dumps(part))):
        check("a part of a machine", again["link(crank).from"] == "A0" and again.text == part.text, again.text)
    for again in (gestell.Machine().copy(), pickle.loads(pickle.dumps(gestell.Machine()))):
        check("an empty machine", again.add("frame", mass=1)["frame.mass"] == 1)
    file = tests.INPUTS / "round.nml"
    file.write_text(FILE.read_text().replace("frame='rest'", "frame='round'"))
    wrong = gestell.Machine(file)
    for again in (wrong, wrong.copy(), pickle.loads(pickle.dumps(wrong)), pickle.loads(pickle.dumps(wrong.copy()))):
        refused("messages name the file", 2, "round.nml:5: ", again.solve)
    refused("messages name the text", 2, "pump:1: ", lambda: gestell.Machine("&frame mas=1 /", name="pump"))


def restored_solution():
    """A pickled solution has its results, and computes what was not pickled."""
    solution = gestell.Machine(FILE).solve(["stability", "modes", "response"])
    again = pickle.loads(pickle.dumps(solution))
    check("verdict and tables", again.verdict == solution.verdict and again.tables == solution.tables
          and repr(again) == repr(solution))
    check("multipliers", numpy.array_equal(again.multipliers, solution.multipliers)
          and numpy.array_equal(again.multipliers.error, solution.multipliers.error), again.multipliers)
    for name in solution.tables:
        one, two = solution.table(name), again.table(name)
        check(f"table {name}", list(one) == list(two) and two.name == name and all(
            one[key].tobytes() == two[key].tobytes() and getattr(one[key], "unit", "") == getattr(two[key], "unit", "")
                                                                                   for key in one))
    check("nothing is computed for that", again._solved is None, "it was solved")
    once_more = pickle.loads(pickle.dumps(again))
    check("pickled twice", once_more.verdict == "stable" and once_more._solved is None)
    check("computed on request", again.response("f").peak == solution.response("f").peak and again.report == solution.report,
          again.report)
    refused("what cannot be computed", 1, "'joints'", lambda: once_more.table("joints"))
    check("copy", copy.copy(solution) is solution and copy.deepcopy(solution) is solution)
    check("input", gestell.Machine(solution.input)["case.tasks"] == ["stability", "modes", "response"], solution.input)


def solved(machine):
    return machine.solve("response")


def peak_of(machine):
    solution = machine.solve(["stability", "response"])
    return solution.verdict, solution.response("f"), solution.table("response"), solution.multipliers[:2]


def processes():
    """multiprocessing takes machines, and returns solutions, tables and numbers."""
    machines = [gestell.Machine(FILE).copy({"drive.speed_rpm": speed}) for speed in (200, 250, 300)]
    alone = [peak_of(machine) for machine in machines]
    for method in multiprocessing.get_all_start_methods():
        with multiprocessing.get_context(method).Pool(2) as pool:
            together = pool.map(peak_of, machines)
            solutions = pool.map(solved, machines[:1])
        for one, two in zip(alone, together):
            check(f"{method}: numbers", two[0] == one[0] and two[1].peak == one[1].peak and two[1].peak.error == one[1].peak.error
                  and two[1].history.unit == "N", two[1])
            check(f"{method}: arrays", two[2]["fx_N"].tobytes() == one[2]["fx_N"].tobytes() and two[2]["fx_N"].unit == "N"
                  and numpy.array_equal(two[3].error, one[3].error), two[2])
        check(f"{method}: solutions", solutions[0].table("response")["fx_N"].tobytes() == alone[0][2]["fx_N"].tobytes())


def arrays():
    """Errors and units follow their numbers, and nothing else has them."""
    table = gestell.Machine(FILE).solve("forces").table("supports")
    column = table["f_peak_N"]
    for name, part, index in (("slice", column[1:3], slice(1, 3)), ("backwards", column[::-1], slice(None, None, -1)),
                              ("mask", column[column > 40], numpy.asarray(column) > 40), ("list", column[[2, 0]], [2, 0]),
                              ("copy", column.copy(), slice(None)), ("copy.copy", copy.copy(column), slice(None)),
                              ("deepcopy", copy.deepcopy([column])[0], slice(None)), ("pickle", pickle.loads(pickle.dumps(column)),
                                                                                      slice(None)),
                              ("abs", abs(-column), slice(None))):
        check(f"{name}", numpy.array_equal(part, numpy.asarray(column)[index])
              and numpy.array_equal(part.error, column.error[index])
              and part.unit == "N", repr(part))
    check("an element", column[0] == numpy.asarray(column)[0] and column[0].error == column.error[0] and column[0].unit == "N"
          and [one.error for one in column] == column.error.tolist(), repr(column[0]))
    for name, plain in (("square", column**2), ("sum", column + column), ("product", 2 * column),
                        ("dot", numpy.dot(column, column)),
                        ("mean", column.mean()), ("maximum", column.max()), ("comparison", column > 3), ("cumsum", column.cumsum()),
                        ("round", column.round(1)), ("join", numpy.concatenate([column, column])),
                        ("reshape", column.reshape(-1, 1))):
        check(f"{name} has no error", getattr(plain, "error", None) is None, repr(plain))
        check(f"{name} has no unit", not getattr(plain, "unit", ""), repr(plain))
    check("sort has no error", numpy.sort(column).error is None, numpy.sort(column))
    check("numpy's numbers", type(column.max()) is numpy.float64 and type(column.sum()) is numpy.float64, type(column.max()))
    once = column.copy()
    once.sort()
    check("sorted in place", once.error is None and list(once) == sorted(numpy.asarray(column)), repr(once))
    once[0] = 3
    check("set", once[0] == 3)
    check("repr of an array", repr(gestell.Array([1.5, 2], [0.1, 0.25], "N")) == "Array([1.5, 2. ], unit='N', error<=0.25)"
          and repr(gestell.Array([1.5])) == "Array([1.5])" and repr(gestell.Array([])) == "Array([])", repr(gestell.Array([1.5])))
    for value, error, unit, words in ((137.66612, 0.003, "N", "137.666 N +- 0.003"), (0.0, 1e-9, "m", "0.0 m +- 1e-09"),
                                      (2.0, 0.0, "", "2.0 +- 0"),
                                      (-1234567.8, 300.0, "N", "-1.2346e+06 N +- 3e+02"), (1.0, 5.0, "", "1 +- 5"),
                                      (float("inf"), 1.0, "", "inf +- 1"), (1.0, float("nan"), "", "1.0 +- nan"),
                                      (1e-3, 1e-30, "", "0.001 +- 1e-30")):
        check(f"repr of {words}", repr(gestell.Value(value, error, unit)) == words, repr(gestell.Value(value, error, unit)))
    check("str of a value", str(gestell.Value(0.1, 1e-3, "N")) == f"{gestell.Value(0.1, 1e-3, 'N')}" == "0.1")
    values = [copy.deepcopy(gestell.Value(0.1, 1e-3, "N")), pickle.loads(pickle.dumps(gestell.Value(0.1, 1e-3, "N")))]
    check("copies of a value", all((value, value.error, value.unit) == (0.1, 1e-3, "N") for value in values), values)
    whole = pickle.loads(pickle.dumps(table))
    check("a pickled table", whole.name == "supports" and whole["f_peak_N"].unit == "N" and repr(whole) == repr(table), repr(whole))


def results():
    """The short ways to tables, and the message if a task was not requested."""
    solution = gestell.Machine(ROOT / "data/compressor.nml").solve(["drawing", "modes", "joints"])
    check("frequencies", solution.natural_frequencies.unit == "Hz" and abs(solution.natural_frequencies - [5.5688, 11.2422,
                                                                                                           17.3382]).max() < 1e-4
          and abs(solution.damping_ratios - [0.017495, 0.035319, 0.054469]).max() < 1e-6, solution.natural_frequencies)
    rho, modes = solution.multipliers, solution.modes
    check("modes", modes.shape == (6, 6) and modes.dtype == complex and abs(abs(modes**2).sum(0) - 1).max() < 1e-12, modes)
    # with nearly constant coefficients the motion of a mode is x = exp(s t), so x_dot = s x
    exponents = solution.table("multipliers")
    s = exponents["exponent_re_per_s"] + 1j * exponents["exponent_im_rad_per_s"]
    check("order of modes", numpy.allclose(modes[3, :2], s[:2] * modes[0, :2], rtol=0.02) and modes.shape[1] == len(rho),
          (modes[3], s * modes[0]))
    check("tables", solution.shaking_forces["component"][0] == "1" and "O" in solution.joint_forces["joint"])
    bare = gestell.Machine(FILE).solve("stability")
    for call, task in ((lambda: bare.natural_frequencies, "drawing"), (lambda: bare.damping_ratios, "drawing"),
                       (lambda: bare.modes, "modes"),
                       (lambda: bare.shaking_forces, "drawing"), (lambda: bare.joint_forces, "joints"),
                       (lambda: bare.table("sweep"), "sweep"),
                       (lambda: gestell.Machine(FILE).solve("response").table("multipliers"), "'stability' or 'modes'")):
        refused(f"not requested: {task}", 1, f"the task '{task}' computes it".replace("''", "'"), call)
    refused("no such table", 1, "no table 'joy'", lambda: bare.table("joy"))
    force = gestell.Machine(FILE).solve("response").response("f")
    check("repr of a response", repr(force).startswith("Response('f': peak 61.79330") and " N +- " in repr(force), repr(force))
    check("in a notebook, incomplete", gestell.Machine().add("frame", mass=1)._repr_html_() is None)


def sweeps():
    """A grid has the results of its points, whatever their spacing, and of the library's own sweep."""
    machine = gestell.Machine(FILE)
    speeds, masses = numpy.linspace(200, 300, 5), [18, 20, 30]
    grid = machine.sweep({"drive.speed_rpm": speeds, "frame.mass": masses}, columns=["rho_max", "rho_error", "f"])
    check("shape", grid.shape == (5, 3) and all(column.shape == (5, 3) for column in grid.values()), grid)
    check("units and errors", grid["f_peak_N"].unit == "N" and grid["f_peak_N"].error.shape == (5, 3)
          and grid["f_peak_N"][1, 2].error > 0, grid)
    for i, k in ((0, 0), (3, 1), (4, 2)):
        point = machine.copy({"drive.speed_rpm": speeds[i], "frame.mass": masses[k]}).solve(["stability", "response"])
        check(f"point {i}, {k}", abs(grid["f_peak_N"][i, k] / point.response("f").peak - 1) < 1e-9
              and abs(grid["rho_max"][i, k] - abs(point.multipliers[0])) < 1e-9 and grid["verdict"][i, k] == point.verdict,
              grid["f_peak_N"][i, k])
    check("bytes of one sweep", within(machine, speeds, grid), "other bytes")
    mixed = machine.sweep({"model.frame": ["rest", "exact"], "drive.speed_rpm": [200, 300, 250], "joint(B).branch": [1, -1],
                           "support.stiffness": numpy.geomspace(1e5, 4e5, 3), "frame.mass": 18}, ["rho_max", "verdict"])
    check("words, whole numbers, three ranges", mixed.shape == (2, 3, 2, 3, 1) and set(mixed["verdict"].flat) <= {"stable",
                                                                                                                  "unstable",
                                                                                                                  "undecided"},
          mixed)
    one = machine.copy({"model.frame": "exact", "drive.speed_rpm": 300, "joint(B).branch": -1,
                        "support.stiffness": 2e5}).solve("stability")
    check("one of its points", abs(mixed["rho_max"][1, 1, 1, 1, 0] - abs(one.multipliers[0])) < 1e-9,
          mixed["rho_max"][1, 1, 1, 1, 0])
    chart = gestell.Machine(ROOT / "data/khang_chart.nml")
    before = chart.text
    check("groups &sweep of the input", chart.sweep({"frame.mass": [18, 19]}, ["verdict"]).shape == (2,) and chart.text == before)
    lengths = machine.sweep({"joint(B).lengths(1)": [0.05, 0.37]}, ["rho_max"])
    check("impossible machines", numpy.isnan(lengths["rho_max"]).tolist() == [True, False], lengths["rho_max"])
    table = grid.table()
    check("table of a grid", list(table)[:2] == list(grid.axes) and table.rows == 15 and table["frame.mass"].tolist() == 5 * masses
          and table["f_peak_N"][7] == grid["f_peak_N"][2, 1] and table["f_peak_N"].unit == "N", table)
    check("repr of a grid", repr(grid).startswith("Grid(5 drive.speed_rpm x 3 frame.mass: ") and "<table" in grid._repr_html_(),
          repr(grid))
    again = pickle.loads(pickle.dumps(grid))
    check("a pickled grid", again.shape == (5, 3) and again["f_peak_N"].unit == "N" and list(again.axes) == list(grid.axes), again)
    check("options", "f_rms_N" in machine.sweep({"frame.mass": [18, 19]}, ["f"], measures=["peak", "rms"]))
    for name, code, words, values, columns in (
            ("no path", 1, "path", {}, None), ("no values", 1, "values", {"frame.mass": []}, None),
                                               ("a matrix", 1, "values", {"frame.mass": [[1, 2]]}, None),
            ("only words", 1, "real number", {"model.frame": ["rest"]}, None), ("unknown path", 2, "mas", {"frame.mas": [1, 2]},
                                                                                None),
            ("unknown column", 2, "joy", {"frame.mass": [18, 19]}, ["joy"]), ("NaN", 2, "finite", {"frame.mass": [18, numpy.nan]},
                                                                              None),
            ("an option", 2, "swep", {"frame.mass": [18, 19, 30]}, ["f"])):
        options = {"swep": 1} if name == "an option" else {}
        refused(f"sweep: {name}", code, words, lambda values=values, columns=columns,
                options=options: machine.sweep(values, columns, **options))


def within(machine, speeds, grid):
    """Whether a grid has the bytes of the library's own sweep over the speeds, at the first mass."""
    own = machine.copy({"frame.mass": 18}).add("sweep", parameter="drive.speed_rpm", from_=speeds[0], to=speeds[-1],
                                               count=len(speeds), columns=["f"])
    return own.solve("sweep").table("sweep")["f_peak_N"].tobytes() == numpy.ascontiguousarray(grid["f_peak_N"][:, 0]).tobytes()


def many():
    """solve_many returns solutions in order, or the errors too."""
    machine = gestell.Machine(FILE)
    machines = [machine.copy({"drive.speed_rpm": speed}) for speed in range(200, 300, 10)]
    alone = [one.solve("response").table("response")["fx_N"].tobytes() for one in machines]
    for threads in (None, 1, 4):
        together = gestell.solve_many(machines, "response", threads=threads)
        check(f"{threads} threads", [one.table("response")["fx_N"].tobytes() for one in together] == alone)
    machines[1]["joint(B).lengths(1)"] = 0.05
    refused("an impossible one", 3, "", lambda: gestell.solve_many(machines, "response"))
    found = gestell.solve_many(machines, "response", errors="return")
    check("errors in the list", [isinstance(one, gestell.Error) for one in found] == [False, True] + 8 * [False], found)
    try:
        gestell.solve_many(machines, errors="ignore")
        check("a wrong word", False)
    except ValueError as error:
        check("a wrong word", "ignore" in str(error), error)


def frames():
    """pandas and xarray, or a message that they are not installed."""
    machine = gestell.Machine(FILE)
    table, grid = machine.solve("response").table("response"), machine.sweep({"drive.speed_rpm": [200, 250],
                                                                              "frame.mass": [18, 19, 20]}, ["f"])
    for name, call in (("pandas", table.to_pandas), ("xarray", table.to_xarray), ("pandas", grid.to_pandas),
                       ("xarray", grid.to_xarray)):
        sys.modules[name], kept = None, sys.modules.pop(name, None)
        try:
            call()
            check(f"without {name}", False, "no error")
        except ImportError as error:
            check(f"without {name}", str(error) == f"{name} is not installed: python3 -m pip install {name}", error)
        sys.modules.pop(name)
        if kept:
            sys.modules[name] = kept
    with contextlib.suppress(ImportError):
        pandas = importlib.import_module("pandas")
        check("a DataFrame of a table", pandas.DataFrame(table).shape == (361, 11), pandas.DataFrame(table))
        frame = table.to_pandas()
        check("pandas", frame.shape == (361, 11) and frame.attrs["units"]["fx_N"] == "N"
              and (frame["fx_N"] == numpy.asarray(table["fx_N"])).all())
        check("pandas, grid", grid.to_pandas()["f_peak_N"].loc[(250, 19)] == grid["f_peak_N"][1, 1], grid.to_pandas())
        importlib.import_module("xarray")
        data = table.to_xarray()
        check("xarray", data["fx_N"].sel(crank_deg=90) == table["fx_N"][90] and data["fx_N"].attrs["units"] == "N", data)
        check("xarray, grid", grid.to_xarray()["f_peak_N"].sel({"drive.speed_rpm": 250, "frame.mass": 19}) == grid["f_peak_N"][1,
                                                                                                                               1],
              grid.to_xarray())


def examples():
    """Examples of the docstrings."""
    for name in ("_array", "_machine", "_many", "_solution", "_table"):
        module = importlib.import_module("gestell." + name)
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            found = doctest.testmod(module, extraglobs={"gestell": gestell}, optionflags=doctest.ELLIPSIS)
        check(f"examples of {name}", found.attempted > 2 and found.failed == 0, printed.getvalue()[:2000])
    for one in gestell.__all__:
        check(f"{one} is described", bool(getattr(gestell, one).__doc__))


def session():
    """The sessions of doc/python.md run as they stand."""
    names = {}
    printed = io.StringIO()
    for number, lines in enumerate((ROOT / "doc/python.md").read_text().split("```python\n")[1:]):
        with contextlib.redirect_stdout(printed):
            exec(compile(lines.split("```")[0], f"doc/python.md, {number}", "exec"), names)
    words = printed.getvalue().split()
    check("doc/python.md", words[0] == "stable" and "Hz," in words, words)
    check("its optimum", abs(names["best"] + 0.08) < 1e-12 and names["grid"].shape == (41, 3), (names["best"], names["grid"]))


def main():
    os.chdir(ROOT)
    for test in (read_back, removed, copies, restored_solution, arrays, results, sweeps, many, frames, examples, session,
                 processes):
        test()
    shutil.rmtree(tests.INPUTS)
    print(f"{tests.passed} passed, {tests.failed} failed")
    return tests.failed != 0


if __name__ == "__main__":
    sys.exit(main())
