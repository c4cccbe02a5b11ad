"""--json: all results of a run, as doc/output.md describes them, compared with the tables."""

import csv
import json
import math
from pathlib import Path

from harness import Folder, Run, check, equal, files

DATA = Path(__file__).resolve().parents[2] / "data"
MEMBERS = ["gestell", "title", "input", "model", "speed_held_by", "settings", "verdict", "headlines", "diagnostics",
           "failure", "machine", "tables"]


def cells(path):
    """Header and rows of a table."""
    with open(path, newline="", encoding="utf-8") as file:
        rows = [row for row in csv.reader(line for line in file if not line.startswith("#"))]
    return rows[0], rows[1:]


def same(value, cell):
    """True if a value of the object equals the cell: words, NaN as null, numbers to the last bit."""
    if value is None:
        return math.isnan(float(cell))
    return value == cell if isinstance(value, str) else value == float(cell)


def same_as_tables(what, found, folder):
    """Checks that names, columns and cells of the object are those of the CSV files."""
    equal(f"{what}: tables", sorted(found["tables"]), sorted(name[:-4] for name in files(folder) if name.endswith(".csv")))
    for name, table in found["tables"].items():
        header, rows = cells(folder / f"{name}.csv")
        keys = [column["key"] for column in table["columns"]]
        equal(f"{what}: keys of {name}", keys, header)
        good = len(rows) == len(table["rows"]) and all(len(row) == len(line) and all(map(same, row, line))
                                                       for row, line in zip(table["rows"], rows))
        check(f"{what}: rows of {name}", good, rows[:1], table["rows"][:1])
        for column in table["columns"]:
            check(f"{what}: {name}, meaning of {column['key']}", column["meaning"], "words", column)
            check(f"{what}: {name}, error of {column['key']}", column["error"] is None or column["error"] in keys, "a key", column)
        check(f"{what}: {name}, heading", table["heading"], "words", table["heading"])


def test_tables():
    """The JSON output contains every table of every task."""
    tasks = "case.tasks='stability','modes','response','forces','power','drawing','sensitivity'"
    with Folder() as folder:
        run = Run(folder, "--json", "-o", "one", "-s", tasks, DATA / "compressor.nml")
        run.done("json in addition to the tables")
        found = json.loads((folder / "one" / "results.json").read_text())
        equal("json: members", list(found), MEMBERS)
        equal("json: verdict", found["verdict"], "stable")
        equal("json: settings", found["settings"], [tasks])
        check("json: the exceeded limit is a headline", any(line["state"] == "unstable" and "times the limit" in line["words"]
                                                            for line in found["headlines"]), "one", found["headlines"])
        same_as_tables("json", found, folder / "one")
        quiet = Run(folder, "--json", "-q", "-o", "one", "-s", tasks, DATA / "compressor.nml")
        equal("json on standard output", json.loads(quiet.out), found)


def test_machine():
    """The parameters of the machine, set to their own values, describe the same machine; the scenes are those of the animations."""
    with Folder() as folder:
        for name in ("compressor", "engine_in_space", "cam_press"):
            run = Run(folder, "--json", "-q", "-o", name, DATA / f"{name}.nml")
            machine = json.loads(run.out)["machine"]
            equal(f"{name}: scenes", machine["scenes"], [])
            settings = []
            for one in machine["parameters"]:
                good = isinstance(one["meaning"], str) and one["meaning"] and isinstance(one["unit"], str)
                check(f"{name}: {one['path']}", good, "a meaning and a unit", one)
                numbers = [value for value in one["values"] if isinstance(value, float | int)]
                good = all((one["least"] is None or value >= one["least"]) and (one["most"] is None or value <= one["most"])
                           and (value > 0 or not one["positive"]) for value in numbers)
                check(f"{name}: range of {one['path']}", good, "values within the range", one)
                if len(numbers) == len(one["values"]) and one["path"].split(".")[1] not in ("points", "harmonics", "count", "cycle"):
                    settings += ["-s", one["path"] + "=" + ",".join(map(repr, numbers))]
            check(f"{name}: numbers", len(settings) > 20, "more than ten", settings)
            again = Run(folder, "--check", "-o", "again", *settings, DATA / f"{name}.nml")
            plain = Run(folder, "--check", "-o", "plain", DATA / f"{name}.nml")
            equal(f"{name}: the same machine", again.out, plain.out)
        run = Run(folder, "--json", "-q", "--plot", "-o", "drawn", "-s", "case.tasks=drawing", DATA / "compressor.nml")
        scene = json.loads(run.out)["machine"]["scenes"][0]
        equal("scene: instants", (len(scene["motion"]), len(scene["moving"]), len(scene["degrees"])), (48, 48, 48))
        check("scene: indices", all(0 <= i < len(scene["points"]) for line in scene["lines"] for i in line["points"]), "points", "")
        # the crank pin is 50 mm from the pivot at all instants
        pins = [scene["points"][line["points"][0]][4] for line in scene["lines"] if line["kind"] == "pin"]
        reach = [math.dist(frame[pins[0]], frame[pins[1]]) for frame in scene["moving"]]
        check("scene: crank", max(abs(x - 0.05) for x in reach) < 1e-6, "0.05", (min(reach), max(reach)))


def test_speeds():
    """JSON output over the speed contains the worst verdict."""
    with Folder() as folder:
        tasks = "case.tasks='campbell','critical','resonance'"
        run = Run(folder, "--json", "-q", "-o", "one", "-s", tasks, "-s", "sweep.count=9", "-s", "sweep.to=400", DATA / "khang_speeds.nml")
        found = json.loads(run.out)
        equal("json over the speed: the worst verdict", found["verdict"], "stable")
        equal("json over the speed: the modes are about rest", found["tables"]["campbell"]["model"], "rest")
        same_as_tables("json over the speed", found, folder / "one")


def test_sweep():
    """JSON output of a sweep contains its table."""
    with Folder() as folder:
        run = Run(folder, "--json", "-q", "-o", "one", "-s", "sweep.count=30", DATA / "khang_chart.nml")
        same_as_tables("json of a sweep", json.loads(run.out), folder / "one")
        equal("json of a sweep: no blocks are left", (folder / "one" / "sweep.blocks").exists(), False)


def test_words():
    """Quotes, backslashes and invalid UTF-8 are valid JSON."""
    with Folder() as folder:
        title = 'a "b" \\ c, d'
        run = Run(folder, "--json", "-q", "-s", f"case.title='{title}'", "-s", "case.tasks='stability'", DATA / "khang_four_bar.nml")
        equal("json: a title with quotes", json.loads(run.out)["title"], title)


def test_failure():
    """JSON output with a failure contains what was computed."""
    with Folder() as folder:
        run = Run(folder, "--json", "-q", "-s", "probe.position(1)=-9e306", DATA / "compressor.nml")
        equal("json with a failure: exit code", run.code, 4)
        found = json.loads(run.out)
        check("json with a failure", "the motion of a probe overflows" in (found["failure"] or "") and "multipliers" in found["tables"],
              "the failure and the multipliers", (found["failure"], list(found["tables"])))


def test_refused():
    """--json cannot be combined with --check or --one-line."""
    with Folder() as folder:
        for option in ("--check", "--one-line"):
            Run(folder, "--json", option, DATA / "khang_four_bar.nml").refused(
                f"--json and {option}", 1, f"options '{option}' and '--json' exclude each other")


JSON_TESTS = (test_tables, test_machine, test_speeds, test_sweep, test_words, test_failure, test_refused)
