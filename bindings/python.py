"""The package against the program's own files: python3 bindings/python.py PROGRAM

The last line is "N passed, M failed".
"""
import concurrent.futures
import csv
import difflib
import faulthandler
import gc
import json
import multiprocessing
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import threading

import numpy

import gestell

ROOT = pathlib.Path(__file__).resolve().parent.parent
INPUTS = pathlib.Path(tempfile.mkdtemp())
FILES = {"khang_four_bar": ("multipliers", "response", "harmonics"), "compressor": ("multipliers", "response"),
         "khang_chart": ("sweep",)}
passed = failed = 0


def input_of(name):
    """A file of data/, a chart with fewer points."""
    file = INPUTS / f"{name}.nml"
    file.write_text((ROOT / "data" / file.name).read_text().replace("count=1000", "count=40"))
    return file


def check(name, good, told=""):
    global passed, failed
    if good:
        passed += 1
    else:
        failed += 1
        print(f"FAIL  {name}: {told}")


def rows_of(file):
    return list(csv.DictReader(line for line in file.read_text().splitlines() if not line.startswith("#")))


def same(table, rows):
    """The greatest difference to the file's numbers, which have 17 digits, or what else differs."""
    if list(table) != list(rows[0]):
        return f"columns {list(table)}, of the file {list(rows[0])}"
    for key, column in table.items():
        for i, row in enumerate(rows):
            if column.dtype.kind in "US":
                if column[i] != row[key]:
                    return f"{key}[{i}] {column[i]}, of the file {row[key]}"
            elif float(row[key] or "nan") != column[i] and not (row[key] in ("", "NaN") and numpy.isnan(column[i])):
                return f"{key}[{i}] {column[i]!r}, of the file {row[key]}"
    return ""


def tables(program):
    for name, wanted in FILES.items():
        file = input_of(name)
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([program, "-q", "-o", folder, file], check=True)
            solution = gestell.Machine(file).solve()
            for table in wanted:
                told = same(solution.table(table), rows_of(pathlib.Path(folder) / f"{table}.csv"))
                check(f"{name}, {table}", not told, told)


def paths():
    machine = gestell.Machine(ROOT / "data/khang_four_bar.nml")
    check("one number", machine["drive.speed_rpm"] == 240, machine["drive.speed_rpm"])
    check("several numbers", list(machine["frame.origin"]) == [-0.2, 0.2], machine["frame.origin"])
    machine["drive.speed_rpm"] = 300
    machine["frame.origin"] = [-0.1, 0.3]
    machine["case.title"] = "another"
    check("set", machine["drive.speed_rpm"] == 300 and list(machine["frame.origin"]) == [-0.1, 0.3], machine["frame.origin"])
    text = (ROOT / "data/khang_four_bar.nml").read_text()
    again = gestell.Machine(text)
    again["drive.speed_rpm"] = 300
    again["frame.origin"] = [-0.1, 0.3]
    one, two = machine.solve("stability"), again.solve(["stability"])
    check("file and text", (one.multipliers == two.multipliers).all() and one.verdict == two.verdict, two.multipliers)
    check("errors of multipliers", (one.multipliers.error > 0).all() and one.multipliers.error.shape == (6,), one.multipliers.error)
    force = machine.solve("response").response("f")
    check("peak", abs(force.history.max() - force.peak) < 0.01 * force.peak and 0 < force.peak.error < 1e-6 * force.peak
          and force.unit == "N", (force.peak, force.peak.error, force.unit))


def units():
    """Tables follow &units results, quantities stay in SI units, and a value that another key gives keeps its key."""
    text = input_of("khang_four_bar").read_text().replace("speed_rpm = 240.0", "speed_hz = 4.0")
    machine = gestell.Machine(text + "&units force='lbf', moment='lbf in', results='input' /\n")
    si = gestell.Machine(text).solve(["response"])
    own = machine.solve(["response"])
    lbf = 4.4482216152605
    check("table in lbf", own.table("response")["fx_lbf"].unit == "lbf"
          and abs(lbf * own.table("response")["fx_lbf"] - si.table("response")["fx_N"]).max() < 1e-12, list(own.table("response")))
    check("quantity in N", (own.response("f").peak, own.response("f").unit) == (si.response("f").peak, "N"), own.response("f").unit)
    machine["drive.speed_rpm"] = 300
    check("speed in Hz", "speed_hz=5" in machine.text and "speed_rpm" not in machine.text, machine.text)


def built_in_code():
    """The machine of a file, group by group, is the file's."""
    machine = gestell.Machine()
    machine.add("case", title="Four-bar mechanism", tasks=["stability", "response"]).add("model", frame="rest")
    machine.add("drive", speed_rpm=240)
    machine.add("joint", name="A0", type="ground", position=[0, 0]).add("joint", name="B0", type="ground", position=[0.4, 0])
    machine.add("joint", name="A", type="crank", pivot="A0", radius=0.07, phase=0.0)
    machine.add("joint", name="B", type="RRR", ends=("A", "B0"), lengths=numpy.array([0.37, 0.16]), branch=1)
    machine.add("link", **{"name": "crank", "from": "A0", "to": "A", "mass": 0.5, "inertia": 0.0035, "center": [0.03, 0]})
    machine.add("link", **{"name": "coupler", "from": "A", "to": "B", "mass": 0.6, "inertia": 0.007, "center": [0.18, 0]})
    machine.add("link", **{"name": "rocker", "from": "B0", "to": "B", "mass": 0.25, "inertia": 0.006, "center": [0.08, 0]})
    machine.add("frame", mass=18, inertia=0.78, origin=[-0.2, 0.2]).add("foundation", damping=[0.5, 0.5, 0.05])
    for x in (-0.3, -0.1, 0.1, 0.3):
        machine.add("support", position=[x, -0.2], stiffness=[196133, 196133])
    one, two = (of.solve().table("response") for of in (machine, gestell.Machine(ROOT / "data/khang_four_bar.nml")))
    check("built in code", all((one[key] == two[key]).all() for key in two), one["fx_N"].max())
    machine["support(3).stiffness(1)"] = 1e5
    check("built and set", machine["support(3).stiffness(1)"] == 1e5, machine["support(3).stiffness"])


def kinds_of_numbers():
    """Whole numbers, words and flags are set as Python has them."""
    machine = gestell.Machine(ROOT / "data/khang_four_bar.nml")
    for path, value, wanted in (("response.points", 7, 7), ("response.points", numpy.int64(8), 8), ("response.points", 9.0, 9),
                                ("joint(B).branch", -1, -1), ("drive.speed_rpm", numpy.float32(0.1), float(numpy.float32(0.1))),
                                ("drive.speed_rpm", numpy.uint8(200), 200), ("drive.speed_rpm", 10**200, 1e200)):
        machine[path] = value
        check(f"{path} = {value!r}", machine[path] == wanted, machine[path])
    machine["frame.origin"] = numpy.array([1, -2])
    check("whole numbers as a list", list(machine["frame.origin"]) == [1, -2], machine["frame.origin"])
    machine["case.tasks"] = ["stability", "response"]
    again = gestell.Machine(ROOT / "data/khang_four_bar.nml")
    again["response.points"] = 12
    check("points by number", again.solve(["response"]).table("response").rows == 13, again["response.points"])
    for value in (7.5, True, 10**12, 10**400, "seven"):
        refused(f"points {value!r:.20}", 2, "", lambda: machine.__setitem__("response.points", value))


def names():
    """A Path is a path; names that are no UTF-8 are those of files, or refused where they are those of a machine."""
    text = (ROOT / "data/khang_four_bar.nml").read_text()
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        for name in (b"a&b.nml", b"two\nlines.nml", b"\xff.nml"):
            path = os.fsencode(folder) + b"/" + name
            with open(path, "w") as file:
                file.write(text)
            for given in (pathlib.Path(os.fsdecode(path)), path):
                verdict = gestell.Machine(given).solve("stability").verdict
                check(f"a file {given!r}", verdict == "stable", verdict)
        refused("no file", 2, "no such file", lambda: gestell.Machine(folder / "&none.nml"))
        solution = gestell.Machine(text).solve("response")
        solution.write(os.fsencode(folder) + b"/\xfe")
        check("a folder", b"response.csv" in os.listdir(os.fsencode(folder) + b"/\xfe"), os.listdir(folder))
        (folder / "latin.nml").write_bytes(text.encode() + b"\n&probe name='a\xff' position=0.1,0.1 /\n")
        solution = gestell.Machine(folder / "latin.nml").solve("response")
        refused("a name", 2, "UTF-8", lambda: solution.table("probes"))
        machine = gestell.Machine(text)
        for what, call in (("text", lambda: gestell.Machine("&case title='\udcff' /")), ("path", lambda: machine["link(\udcff).mass"]),
                           ("value", lambda: machine.__setitem__("case.title", "\udcff")),
                           ("added", lambda: machine.add("probe", name="\udcff", position=[0, 0]))):
            refused(f"surrogates: {what}", 1, "UTF-8", call)
        own_input(folder)


def own_input(folder):
    """What was read is not replaced, also when the working directory has changed meanwhile."""
    text = (ROOT / "data/khang_four_bar.nml").read_text()
    (folder / "response.csv").write_text(text)
    here = os.getcwd()
    os.chdir(folder)
    solution = gestell.Machine("response.csv").solve()
    os.chdir(here)
    refused("the input is a result", 1, "response.csv: the results would replace the input", lambda: solution.write(folder))
    check("the input stays", (folder / "response.csv").read_text() == text, "another text")


def refused(name, code, words, call):
    try:
        call()
        check(name, False, "no error")
    except gestell.Error as error:
        check(name, error.code == code and words in error.message and "\n" not in error.message, (error.code, error.message))


class Cycle:
    """What only the garbage collector deletes."""

    def __init__(self):
        self.machine, self.self = gestell.Machine(), self


def garbage():
    """The collector deletes machines at any moment: within a call of its own thread, and while another thread is in the library."""
    base = gestell.Machine()
    limits = gc.get_threshold()
    gc.set_threshold(1)
    for _ in range(300):
        Cycle()
        refused("a mass below zero", 2, "machine is empty", lambda: base.__setitem__("frame.mass", -1.0))
    gc.set_threshold(*limits)
    gc.collect()
    held, done, deleted = threading.Event(), threading.Event(), []
    library, delete = gestell._library, gestell._library._deleters["machine"]
    library._deleters["machine"] = lambda handle: deleted.append(delete(handle))

    def hold():
        with library._gate:
            held.set()
            done.wait()

    other = threading.Thread(target=hold)
    machine = gestell.Machine()
    other.start()
    held.wait()
    del machine
    gc.collect()
    check("deleted while another thread is in the library", len(deleted) == 1, deleted)
    done.set()
    other.join()
    library._deleters["machine"] = delete


def side_by_side():
    """Threads that solve machines of their own, or one machine that another thread changes, get the same results as one thread."""
    four_bar = gestell.Machine(ROOT / "data/khang_four_bar.nml")
    speeds = [150.0 + k for k in range(40)]
    shared = four_bar.copy()

    def multipliers(speed):
        shared["drive.speed_rpm"] = speed
        shared.solve("stability")
        refused("an unknown path", 2, "speed_rp", lambda: four_bar.copy({"drive.speed_rp": speed}))
        return four_bar.copy({"drive.speed_rpm": speed}).solve("stability, response").multipliers.tobytes()

    alone = [multipliers(speed) for speed in speeds]
    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        check("in four threads", list(pool.map(multipliers, speeds)) == alone, "other multipliers")


def swept(_=None):
    machine = gestell.Machine((ROOT / "data/khang_chart.nml").read_text())
    machine["sweep.count"] = 3
    table = machine.solve("sweep").table("sweep")
    return b"".join(column.tobytes() for column in table.values())


def forks():
    """A sweep in children of fork, also while another thread of the parent computes."""
    if not hasattr(os, "fork"):
        return
    alone, stop = swept(), threading.Event()

    def work():
        while not stop.wait(0.01):
            swept()

    for busy in (False, True):
        other = threading.Thread(target=work)
        if busy:
            other.start()
        with multiprocessing.get_context("fork").Pool(2) as pool:
            found = pool.map(swept, [1, 2, 3])
        check(f"children of fork, parent busy: {busy}", found == [alone] * 3, "other bytes")
    stop.set()
    other.join()


def files(program):
    """write leaves the program's files, report its words."""
    for name in FILES:
        file = input_of(name)
        with tempfile.TemporaryDirectory() as one, tempfile.TemporaryDirectory() as two:
            told = subprocess.run([program, "-o", one, file], check=True, capture_output=True, text=True).stdout
            solution = gestell.Machine(file).solve()
            solution.write(two)
            listed = [sorted(path.name for path in pathlib.Path(folder).iterdir()) for folder in (one, two)]
            check(f"{name}, files", listed[0] == listed[1], listed)
            other = [path.name for path in pathlib.Path(one).iterdir()
                     if path.read_bytes() != (pathlib.Path(two) / path.name).read_bytes()]
            check(f"{name}, their bytes", not other, other)
            before, after = (told.split("\nfiles in")[0], told[told.index("VERDICT", len(told) - 200):]) if "VERDICT" in told[-200:] \
                else (told.split("\nfiles in")[0], "")
            check(f"{name}, report", solution.report.startswith(before) and solution.report.endswith(after),
                  "\n".join(difflib.unified_diff(told.splitlines(), solution.report.splitlines(), lineterm="")))


def pictures():
    solution = gestell.Machine(ROOT / "data/khang_four_bar.nml").solve()
    if not shutil.which("gnuplot"):
        check("no gnuplot", "no pictures: gnuplot is not installed" in solution._repr_html_())
        return
    drawn = solution.pictures()
    check("pictures", {"multipliers", "response"} <= set(drawn) and all("</svg>" in picture for picture in drawn.values()), list(drawn))
    check("in a notebook", solution._repr_html_().count("data:image/svg+xml") == len(drawn), len(drawn))


def texts(program):
    """The text of a machine, its results and page are those of the program; machines and solutions move in notebooks."""
    file = ROOT / "data/khang_four_bar.nml"
    machine = gestell.Machine(file)
    check("text", machine.text == file.read_text(), machine.text[:200])
    for path, value in {"drive.speed_rpm": 0.1 + 0.2, "link(rocker).center": [0.07, 1e-5], "case.title": "it's"}.items():
        machine[path] = value
    copy = INPUTS / "copy.nml"
    machine.write(copy)
    again = gestell.Machine(copy)
    check("written text", again["drive.speed_rpm"] == 0.1 + 0.2 and again.text == machine.text, again.text)
    tasks = "drawing, modes, forces"
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([program, "--json", "--plot", "-o", folder, "--set", f"case.tasks={tasks}", file], check=False,
                       capture_output=True)
        files = {path.name: path.read_text() for path in pathlib.Path(folder).iterdir() if path.suffix in (".json", ".svg")}
    solution = gestell.Machine(file).solve(tasks)
    written = json.loads(files["results.json"])
    results = solution.results
    for member in "machine", "verdict", "headlines", "tables":
        check(f"results, {member}", results[member] == written[member], str(results[member])[:300])
    check("machine", solution.machine == results["machine"] and len(results["machine"]["scenes"]) == 4)
    check("page", solution.page.startswith("<!DOCTYPE html>") and solution.page.endswith("</html>\n") and "<svg" not in
          solution.page.split("<script")[0], solution.page[:99])
    for what in "mechanism", "modes":
        motion = solution.animate(what)
        check(f"animation, {what}", motion.svg == files[f"{what}_motion.svg"] and "data:image/svg+xml" in motion._repr_html_())
        motion.save(INPUTS / "motion.svg")
        check(f"animation, {what}, saved", (INPUTS / "motion.svg").read_text() == motion.svg)
    check("a machine in a notebook", "data:image/svg+xml" in gestell.Machine(file)._repr_html_())
    # what was not computed at first is computed on request
    later = gestell.Machine(file).solve("modes")
    check("animation on request", later.animate("modes").svg == files["modes_motion.svg"])


def refusals():
    machine = gestell.Machine(ROOT / "data/khang_four_bar.nml")
    for name, code, words, call in (
            ("no file", 2, "no such file", lambda: gestell.Machine("no/such/file.nml")),
            ("no machine", 2, "&drive", lambda: gestell.Machine("&case /")),
            ("no path", 2, "speed_rpm", lambda: machine["drive.speed_rp"]),
            ("NaN", 2, "finite", lambda: machine.__setitem__("drive.speed_rpm", float("nan"))),
            ("zero", 1, "zero", lambda: machine.__setitem__("case.title", "a\0b")),
            ("no task", 2, "dance", lambda: machine.solve("dance")),
            ("no table", 1, "no table", lambda: machine.solve("stability").table("response")),
            ("no quantity", 2, "unknown quantity", lambda: machine.solve("response").response("zeta")),
            ("no text", 1, "no text", lambda: machine.solve("stability").animate("joy")),
            ("empty text", 2, "empty", lambda: gestell.Machine().text),
            ("impossible", 3, "", lambda: impossible().solve("stability"))):
        try:
            call()
            check(name, False, "no error")
        except gestell.Error as error:
            check(name, error.code == code and words in error.message and "\n" not in error.message, (error.code, error.message))


def impossible():
    machine = gestell.Machine(ROOT / "data/khang_four_bar.nml")
    machine["joint(B).lengths(1)"] = 0.05
    return machine


def threads():
    def solve(speed):
        machine = gestell.Machine(ROOT / "data/khang_four_bar.nml")
        machine["drive.speed_rpm"] = speed
        return machine.solve().table("response")["fx_N"].tobytes()

    speeds = [200 + 10 * k for k in range(40)]
    alone = [solve(speed) for speed in speeds]
    found = {}
    workers = [threading.Thread(target=lambda k=k: found.update({s: solve(s) for s in speeds[k::4]})) for k in range(4)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    check("four threads", [found.get(speed) for speed in speeds] == alone, "other bytes")


def main():
    # A deadlock ends with the place where every thread stands.
    faulthandler.dump_traceback_later(1200, exit=True)
    tables(sys.argv[1])
    paths()
    units()
    kinds_of_numbers()
    names()
    garbage()
    side_by_side()
    forks()
    built_in_code()
    files(sys.argv[1])
    texts(sys.argv[1])
    pictures()
    refusals()
    threads()
    shutil.rmtree(INPUTS)
    print(f"{passed} passed, {failed} failed")
    return failed != 0


if __name__ == "__main__":
    sys.exit(main())
