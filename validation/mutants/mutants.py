"""Finds lines of src that no test protects: one line is changed, compiled and linked, and the tests that execute it must fail.

    python3 validation/mutants/mutants.py fixed                 thirty known mutants, each with the test that must find it
    python3 validation/mutants/mutants.py change [BASE [N]]     N (default 20) of the lines changed since BASE (default main)
    python3 validation/mutants/mutants.py draw N SEED           N of all lines: 500 take a night

The last line is "N passed, M failed": a mutant passes if a test fails. Survivors are listed; whether one is equivalent, that is
without any effect for a user, a reader must judge (README.md). `fixed` runs the one test that each line names, and first
without the mutant, when it must pass. The others run the quick tests of `fpm test`, of test/cli and of bindings/refusals.c that
execute the mutated line, those that are short and execute few lines first; `draw` ends with 1 if fewer than 90 % are found.
build/mutants keeps the build, and which test executes which lines.
"""
import argparse
import concurrent.futures
import functools
import hashlib
import json
import os
import pathlib
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time

from reach import executed_lines, procedures_of

ROOT = pathlib.Path(__file__).resolve().parents[2]
HOME = ROOT / "build/mutants"
FIXED = pathlib.Path(__file__).with_name("fixed.txt")
# Time limit of a test in seconds, and as a multiple of its time with the counted build, which is slower: processor time, on the
# command line wall time.
SECONDS, TIMES = 10, 4
# Limit of its memory in bytes.
MEMORY = 6 * 1024**3
# Share of the mutants drawn from all lines that tests must find.
SHARE = 0.9
# Suite names that stand for test/cli, and for the C program bindings/refusals.c.
COMMAND_LINE, C = "command line", "C"

# ---- where a line may change, and how

_DECLARATION = re.compile(r"::|^\s*(use|implicit|import|private|public|interface|type|module|program|contains|end\b|function|subroutine|"
                          r"(pure|elemental|recursive|impure|integer|real|logical|complex|class|character)\b.*\b(function|subroutine)\b|"
                          r"(select|case|class is|type is|associate|block|error stop|else\s*$|do\s*$|exit|cycle|return)\b)", re.I)


def executable_lines(text):
    """Numbers of the lines in procedure bodies that a mutant may change: one statement each, no declaration, no text."""
    lines, found = text.split("\n"), []
    inside = interface = continued = False
    for number, line in enumerate(lines):
        code = line.split("!")[0] if "'" not in line and '"' not in line else line
        whole = not continued and not code.rstrip().endswith("&")
        continued = code.rstrip().endswith("&")
        if re.match(r"\s*(abstract )?interface\b", code):
            interface = True
        if re.match(r"\s*end interface", code):
            interface = False
        if re.match(r"\s*contains\s*$", code):
            inside = True
        if inside and not interface and whole and code.strip() and not _DECLARATION.search(code) and "'" not in code and '"' not in code:
            found.append(number)
    return found


def _sign(line):
    return [line[:m.start()] + {"+": " - ", "-": " + "}[m[1]] + line[m.end():] for m in re.finditer(r" ([+-]) ", line)]


def _factor(line):
    return [line[:m.start()] + {"*": " / ", "/": " * "}[m[1]] + line[m.end():] for m in re.finditer(r" ([*/]) ", line)]


def _number(line):
    return [line[:m.start()] + str(int(m[0]) + 1) + line[m.end():] for m in re.finditer(r"(?<![\w.%])\d+(?![\w.])", line)]


def _comparison(line):
    other = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "/=", "/=": "=="}
    return [line[:m.start()] + f" {other[m[1]]} " + line[m.end():] for m in re.finditer(r" (<=|>=|==|/=|<|>) ", line)]


def _logic(line):
    other = {"and": "or", "or": "and"}
    return [line[:m.start()] + f".{other[m[1]]}." + line[m.end():] for m in re.finditer(r"\.(and|or)\.", line)]


def _function(line):
    other = {"min": "max", "max": "min", "sin": "cos", "cos": "sin", "minval": "maxval", "maxval": "minval", "floor": "ceiling",
             "abs": "", "sqrt": ""}
    return [line[:m.start()] + other[m[1]] + line[m.end():] for m in re.finditer(rf"\b({'|'.join(other)})(?=\()", line)]


def _condition(line):
    m = re.match(r"(\s*(?:else )?if \()(.*)(\) (?:then\b.*|[a-z].*))$", line)
    return [f"{m[1]}.not. ({m[2]}){m[3]}"] if m and m[2].count("(") == m[2].count(")") else []


def _dropped(line):
    return [re.match(r"\s*", line)[0] + "continue"] if re.match(r"(?!\s*do\b)\s*(call \w|[\w%(), :]+ = )", line) else []


def _bound(line):
    m = re.match(r"(\s*[\w%(), :]*(?:error|bound|rounding|deviation)[\w%(), :]* = )(.+)$", line)
    return [f"{m[1]}({m[2]}) / 10"] if m and m[2] != "0" and "allocated" not in line else []


OPERATORS = {"sign": _sign, "factor": _factor, "number": _number, "comparison": _comparison, "logic": _logic, "function": _function,
             "condition": _condition, "dropped": _dropped, "bound": _bound}


class Mutant:
    """A file of src, the number of a line in it from 0, and the line that replaces it."""

    def __init__(self, path, number, new, kind=""):
        self.path, self.number, self.new, self.kind = path, number, new, kind
        self.old = (ROOT / path).read_text().split("\n")[number]

    def __str__(self):
        return f"{self.path}:{self.number + 1}: {self.old.strip()}  ->  {self.new.strip()}"

    def write(self, file):
        lines = (ROOT / self.path).read_text().split("\n")
        lines[self.number] = self.new
        file.write_text("\n".join(lines))


def draw(dice, places):
    """A mutant on one of the places [(path, line)]; each kind of change that the line permits is equally likely."""
    while True:
        path, number = dice.choice(places)
        line = (ROOT / path).read_text().split("\n")[number]
        kinds = {name: operator(line) for name, operator in OPERATORS.items()}
        kinds = {name: lines for name, lines in kinds.items() if lines}
        if kinds:
            kind = dice.choice(sorted(kinds))
            return Mutant(path, number, dice.choice(kinds[kind]), kind)


# ---- build, link, run

class Build:
    """A build by fpm in one folder: modules, and objects of src, of the program, of the tests and of test-drive. With `tests`, the
    objects of the tests and of test-drive are those of this other build."""

    def __init__(self, place, tests=None):
        mains = list(place.glob(f"build/*/gestell/{'app' if tests else 'test'}_main.f90.o"))
        if not mains:
            sys.exit("the tests are not built: ./bootstrap fpm test")
        self.objects = max(mains, key=lambda path: path.stat().st_mtime).parent
        own, program = sorted(self.objects.glob("src_*.o")), sorted(self.objects.glob("app_*.o"))
        drivers = sorted(path for kind in ("test_*.o", "*testdrive*.o") for path in (tests or self).objects.glob(kind))
        self.parts = {"test": own + drivers, "app": own + program, "c": list(own)}
        self.parts["c"].append(ROOT / "bindings/refusals.c")
        # fpm keeps the objects of C elsewhere
        for parts in self.parts.values():
            parts += (ROOT / "src").rglob("*.c")

    def object_of(self, path):
        return self.objects / (path.replace("/", "_") + ".o")

    def compile(self, mutant, folder):
        """The mutant's object; None if it does not compile, or if it changes what other files use of its module."""
        source = folder / pathlib.Path(mutant.path).name
        mutant.write(source)
        # The profiles of fpm ask for -fcoarray=single, which adds components to types. A kept object may have been compiled without.
        for coarray in ("none", "single"):
            run = subprocess.run(["gfortran", "-c", "-O1", "-w", "-fPIC", "-fopenmp", f"-fcoarray={coarray}", "-fcheck=bounds", "-ffree-form",
                                  "-fimplicit-none", f"-I{ROOT}/include", f"-I{(ROOT / mutant.path).parent}", f"-J{folder}",
                                  f"-I{self.objects.parent}", str(source), "-o", str(folder / "mutant.o")], capture_output=True)
            if run.returncode:
                return None
            if all(module.read_bytes() == (self.objects.parent / module.name).read_bytes() for module in folder.glob("*.mod")):
                return folder / "mutant.o"
        return None

    def link(self, folder, main="test", mutant=None, counting=False):
        """Links the tests, by main="app" the program, or by main="c" the tests in C, in a folder, with a mutant's object in place of
        its file's."""
        program = folder / {"test": "tests", "app": "gestell", "c": "refusals"}[main]
        parts = [path for path in self.parts[main] if not mutant or path != self.object_of(mutant.path)]
        parts += [folder / "mutant.o"] * (mutant is not None)
        run = subprocess.run(["gfortran", "-fopenmp", f"-I{ROOT}/include", "-o", str(program)] + ["--coverage"] * counting + [str(path) for path in parts]
                             + ["-llapack", "-lblas"], capture_output=True, text=True, cwd=folder)
        if run.returncode:
            sys.exit(f"linking fails: {run.stderr[-1000:]}")
        return program


def optimised_build():
    """The tests of this checkout, built by fpm for speed. Mutants are linked with its objects."""
    build_by_fpm(ROOT, "build --tests --flag '-O3 -funroll-loops -fPIC -fopenmp'")
    return Build(ROOT)


def counted_build(tests):
    """The program, built by fpm in a folder of links to this checkout, with counters of executed lines. `tests`: the build whose
    tests run it."""
    copy = HOME / "checkout"
    copy.mkdir(parents=True, exist_ok=True)
    for name in os.listdir(ROOT):
        if name not in ("build", ".git") and not (copy / name).is_symlink():
            (copy / name).symlink_to(ROOT / name)
    if not (copy / "build/dependencies").exists():
        shutil.copytree(ROOT / "build/dependencies", copy / "build/dependencies", symlinks=True)
    build_by_fpm(copy, "build --flag '-O1 -g1 -fPIC -fopenmp --coverage'")
    return Build(copy, tests)


def build_by_fpm(folder, command):
    """Runs fpm in a folder."""
    run = subprocess.run([str(ROOT / "bootstrap"), "sh", "-c", f"cd '{folder}' && fpm {command}"], capture_output=True, text=True)
    if run.returncode:
        sys.exit(f"the build fails:\n{run.stdout[-2000:]}{run.stderr[-2000:]}")


def run_test(program, test, seconds, counters=None):
    """Runs a test. Returns whether it passes within its seconds, its error output, and its seconds. `counters`: a folder for the
    counters."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    run = subprocess.run([str(program), *test], capture_output=True, text=True, errors="replace", cwd=ROOT, env=environment(program, counters),
                         preexec_fn=lambda: limit(seconds))
    return run.returncode == 0, run.stderr, resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def run_on_command_line(program, name, seconds, counters=None):
    """Runs a test of test/cli and ends it at the first failure. Returns whether it passes, its output, and its seconds."""
    begin = time.time()
    run = subprocess.Popen([sys.executable, str(ROOT / "test/cli/run.py"), str(program), name], stdout=subprocess.PIPE, text=True,
                           stderr=subprocess.DEVNULL, errors="replace", cwd=program.parent, env=environment(program, counters),
                           start_new_session=True, preexec_fn=lambda: limit(seconds))
    clock = threading.Timer(seconds, os.killpg, (run.pid, signal.SIGKILL))
    clock.start()
    output = ""
    for line in run.stdout:
        output += line
        if line.startswith("FAILED"):
            os.killpg(run.pid, signal.SIGKILL)
    clock.cancel()
    return run.wait() == 0, output, time.time() - begin


def environment(program, counters):
    """The environment of a test: one thread, and temporary files that disappear with the program."""
    return dict(os.environ, OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", TMPDIR=str(program.parent),
                GCOV_PREFIX=str(counters or program.parent))


def limit(seconds):
    """Limits processor time and memory, because a mutant may run for ever."""
    resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 1, int(seconds) + 2))
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))


def way_of(test):
    """What runs a test: a procedure, the program that it runs, and the test's name for it."""
    if test[0] == COMMAND_LINE:
        return run_on_command_line, "app", test[1]
    if test[0] == C:
        return run_test, "c", [str(ROOT / "data/khang_four_bar.nml")]
    return run_test, "test", test


def quick_tests(program):
    """(key, [suite, test]) of the unit tests that are not slow, of the tests in C, and of the tests of test/cli, whose keys change with
    their files."""
    # A name that does not exist makes the program list the names that do.
    for suite in re.findall(r"^  (\S+)$", run_test(program, ["?"], SECONDS)[1], re.M):
        for name in re.findall(r"- (.+)$", run_test(program, [suite, "?"], SECONDS)[1], re.M):
            if not name.startswith("slow: "):
                yield f"{suite} | {name}", [suite, name]
    yield "refusals", [C, "refusals"]
    listed = subprocess.run([sys.executable, str(ROOT / "test/cli/run.py"), str(program), "--list"], capture_output=True, text=True)
    for name in listed.stdout.split():
        yield f"{name} {digest([ROOT / 'test/cli' / (name.split('.')[0] + '.py')])}", [COMMAND_LINE, name]


def digest(files):
    """A digest of the contents of files."""
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()


@functools.cache
def procedures_in(counted):
    """{name of an object: (file of src, its procedures)}."""
    paths = {str(path.relative_to(ROOT)).replace("/", "_"): str(path.relative_to(ROOT)) for path in (ROOT / "src").rglob("*.f90")}
    return {notes.stem: (paths[notes.stem], procedures_of(notes)) for notes in counted.objects.glob("src_*.gcno") if notes.stem in paths}


class Reach:
    """For each quick test: its seconds with the counted build, and the lines of src that it executes: {file: [line]}.
    build/mutants/reach.json keeps them until a line of src changes; new or renamed unit tests, and the tests of each changed file of
    test/cli, are recorded when they are first needed."""

    def __init__(self, counted):
        file = HOME / "reach.json"
        source = digest(sorted((ROOT / "src").rglob("*.f90")))
        known = json.loads(file.read_text()) if file.exists() else {}
        if known.get("source") != source:
            known = {"source": source, "tests": {}}
        self.tests = []
        self.procedures = dict(procedures_in(counted).values())
        saved = time.time()
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            programs = {main: counted.link(folder, main, counting=True) for main in counted.parts}
            for key, test in quick_tests(programs["test"]):
                if key not in known["tests"]:
                    found = self.record(counted, programs, test, folder / "counters")
                    if not found:
                        print(f"{' | '.join(test)} fails without any mutant; it is skipped", flush=True)
                        continue
                    known["tests"][key] = found
                    if time.time() > saved + 60:
                        file.write_text(json.dumps(known))
                        saved = time.time()
                test, seconds, reached = known["tests"][key]
                self.tests.append((test, seconds, {path: set(lines) for path, lines in reached.items()}))
        file.write_text(json.dumps(known))

    @staticmethod
    def record(counted, programs, test, counters):
        """[test, seconds, {file: [line]}] of a test, or None if it fails."""
        run, main, what = way_of(test)
        passed, _, seconds = run(programs[main], what, 1000, counters)
        reached = {}
        for one in counters.rglob("src_*.gcda"):
            path, procedures = procedures_in(counted).get(one.stem, (None, None))
            # A program that is killed leaves unfinished files.
            lines = executed_lines(one, procedures) if path and passed else None
            if lines:
                reached[path] = sorted(lines)
        shutil.rmtree(counters, ignore_errors=True)
        return [test, seconds, reached] if passed else None

    def of(self, mutant):
        """The tests that execute the mutant's line, or any line of its procedure if the compiler has merged the line with others.
        The first tests are short and execute few lines: they fail soonest. Of the tests of test/cli, those that compare all
        results with a record come first."""
        line = mutant.number + 1
        procedures = self.procedures[mutant.path].values()
        wanted = {line}
        if not any(line in lines for procedure in procedures for lines in procedure.lines.values()):
            around = [procedure for procedure in procedures if procedure.first <= line <= procedure.last]
            wanted = {each for procedure in around for each in range(procedure.first, procedure.last + 1)}
        found = [(test[0] == COMMAND_LINE and not test[1].startswith("records."),
                  (seconds + 0.1) * sum(len(lines) for lines in reached.values()), seconds, test)
                 for test, seconds, reached in self.tests if not wanted.isdisjoint(reached.get(mutant.path, ()))]
        return [(seconds, test) for _, _, seconds, test in sorted(found, key=lambda each: each[:2])]


def examine(build, mutant, tests, patience=float("inf")):
    """"killed by" a test, "survives" so many of the tests, or "" where it is no mutant. No test begins after `patience` seconds."""
    begin = time.time()
    with tempfile.TemporaryDirectory() as folder:
        folder, programs = pathlib.Path(folder), {}
        if not build.compile(mutant, folder):
            return ""
        for count, (seconds, test) in enumerate(tests):
            if time.time() - begin > patience:
                return f"survives {count} of {len(tests)} tests"
            run, main, what = way_of(test)
            if main not in programs:
                programs[main] = build.link(folder, main, mutant)
            if not run(programs[main], what, SECONDS + TIMES * seconds)[0]:
                return "killed by " + " | ".join(test)
    return f"survives {len(tests)} tests"


# ---- the three ways

def fixed(arguments):
    """The mutants of fixed.txt: one line `path | old | new | suite | test` each."""
    build = Build(ROOT)
    lines = [line for line in FIXED.read_text().split("\n") if line and not line.startswith("#")]
    with tempfile.TemporaryDirectory() as folder:
        program = build.link(pathlib.Path(folder))
        passes = functools.cache(lambda suite, test: run_test(program, [suite, test], SECONDS)[0])

        def one(line):
            path, old, new, suite, test = (word.strip() for word in line.split(" | "))
            places = [i for i, text in enumerate((ROOT / path).read_text().split("\n")) if text.strip() == old]
            if len(places) != 1:
                return f"{path}: `{old}` stands there {len(places)} times; bring fixed.txt up to date"
            if not passes(suite, test):
                return f"{suite} | {test}: there is no such test, or it fails without the mutant of {path}"
            verdict = examine(build, Mutant(path, places[0], new), [(SECONDS, [suite, test])])
            return "" if verdict.startswith("killed") else f"{path}: {old}  ->  {new}: {verdict or 'no mutant'}, {suite} | {test}"

        with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
            faults = [fault for fault in pool.map(one, lines) if fault]
    for fault in faults:
        print("FAIL ", fault)
    print(f"{len(lines) - len(faults)} passed, {len(faults)} failed")
    return len(faults) > 0


def drawn(arguments):
    """Mutants of random lines, of all lines or of those that a change touches."""
    if arguments.way == "change":
        places = changed_lines(arguments.base)
    else:
        places = [(str(path.relative_to(ROOT)), number) for path in sorted((ROOT / "src").rglob("*.f90"))
                  for number in executable_lines(path.read_text())]
    if not places:
        sys.exit("no line can be changed")
    build = optimised_build()
    reach = Reach(counted_build(build))
    dice, seen, survivors, killed = random.Random(arguments.seed), set(), [], 0
    begin, wanted = time.time(), arguments.number
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        while wanted > 0 and len(seen) < 20 * arguments.number:
            batch = []
            for _ in range(20 * wanted):
                mutant = draw(dice, places)
                if str(mutant) not in seen and len(batch) < wanted:
                    seen.add(str(mutant))
                    batch.append(mutant)
            if not batch:
                break
            for mutant, verdict in zip(batch, pool.map(lambda each: examine(build, each, reach.of(each), arguments.patience), batch)):
                if not verdict:
                    continue
                wanted -= 1
                killed += verdict.startswith("killed")
                if verdict.startswith("survives"):
                    survivors.append(mutant)
                print(f"{mutant}  [{mutant.kind}]  {verdict}", flush=True)
    print(f"\n{killed + len(survivors)} mutants in {time.time() - begin:.0f} s; survivors:")
    for mutant in survivors:
        print(" ", mutant)
    few = arguments.way == "draw" and killed < SHARE * (killed + len(survivors))
    if few:
        print(f"the tests found fewer than {SHARE:.0%} of the mutants")
    print(f"{killed} passed, {len(survivors)} failed")
    return few


def changed_lines(base):
    """The mutable lines that are in src and not in `base`."""
    output = subprocess.run(["git", "diff", "-U0", base, "--", "src"], capture_output=True, text=True, cwd=ROOT, check=True).stdout
    places, path = [], None
    for line in output.split("\n"):
        if line.startswith("+++ b/"):
            path = line[6:]
            allowed = set(executable_lines((ROOT / path).read_text())) if path.endswith(".f90") else set()
        found = re.match(r"@@ -\S+ \+(\d+)(?:,(\d+))? @@", line)
        if found and path:
            first, count = int(found[1]), int(found[2] or 1)
            places += [(path, i) for i in range(first - 1, first - 1 + count) if i in allowed]
    return places


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--patience", type=float, default=float("inf"), metavar="SECONDS", help="time after which a mutant counts as a "
                        "survivor even if tests remain")
    ways = parser.add_subparsers(dest="way", required=True)
    ways.add_parser("fixed")
    change = ways.add_parser("change")
    change.add_argument("base", nargs="?", default="main")
    change.add_argument("number", nargs="?", type=int, default=20)
    change.add_argument("seed", nargs="?", type=int, default=1)
    all_lines = ways.add_parser("draw")
    all_lines.add_argument("number", type=int)
    all_lines.add_argument("seed", type=int)
    arguments = parser.parse_args()
    HOME.mkdir(parents=True, exist_ok=True)
    sys.exit(fixed(arguments) if arguments.way == "fixed" else drawn(arguments))


if __name__ == "__main__":
    main()
