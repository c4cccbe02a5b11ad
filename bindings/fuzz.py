"""Random texts, paths, values and calls through the packages for Python and C: python3 bindings/fuzz.py [INPUTS [FIRST [SEED]]]

Inputs FIRST (default 1) to FIRST + INPUTS - 1 (default 300) of SEED (default 1) are each a function of both numbers. A text is one
of the project's inputs with changed bytes, words and lines. It is read, changed by paths with sound and wild values, solved, and
everything that the solution holds is read. Then functions for C are called with sound, null and absurd arguments in any order. A fault
is a crash, an exception other than gestell.Error, a message that is not one line of bounded length, a code that gestell.h does not name,
or a text on which the program and the package disagree. Each batch runs in a process of its own, which is ended where it takes too
long. PROGRAM, where the environment names it, is the program to compare with. The last line is "N passed, M failed".
"""
import ctypes
import os
import pathlib
import pickle
import random
import resource
import signal
import subprocess
import sys
import tempfile
import traceback

ROOT = pathlib.Path(__file__).resolve().parent.parent
BATCH = 25
LONGEST_MESSAGE = 1000
SECONDS = 2  # of the processor, for one input; whoever needs more is ended and counted
CODES = range(1, 5)
TASKS = ["stability", "modes", "response", "forces", "power", "drawing", "separation", "balance", "probes", "nonsense", ""]
PATHS = ["drive.speed_rpm", "frame.mass", "frame.inertia", "support.stiffness", "support(1).stiffness(1)", "support(9).damping",
         "link(coupler).mass", "link(coupler", "joint(B).branch", "response.points", "model.frame", "case.title", "frame.dof", "", ".",
         "frame", "\0", "support(99999999999).angle", "x" * 5000, "ä", "a\nb", "\udcff"]
VALUES = [0, 1, -1, 7, 1e300, -1e300, 5e-324, float("nan"), float("inf"), True, "rest", "", "'", "x" * 5000, "a\nb", "\0", "ä",
          [1.0, 2.0], [], [float("nan")] * 40, 10**30, None, object(), b"bytes", ["a", "b"]]
WORDS = ["&", "/", "=", ",", "'", "!", "(", ")", "1e400", "NaN", "-1", "0", "2*3", "'x'", "\t", "&joint", "&sweep", "&frame", "ä", "\r"]


def changed(dice, text):
    """The text with up to six changes."""
    for _ in range(dice.choice([0, 0, 1, 1, 2, 6])):
        i = dice.randrange(len(text) + 1)
        j = min(len(text), i + dice.choice([0, 1, 1, 5, 80]))
        lines = text.split("\n")
        kind = dice.randrange(4)
        if kind == 0:
            text = text[:i] + dice.choice(WORDS) + text[j:]
        elif kind == 1:
            del lines[dice.randrange(len(lines))]
            text = "\n".join(lines)
        elif kind == 2:
            lines.insert(dice.randrange(len(lines)), dice.choice(lines))
            text = "\n".join(lines)
        else:
            text = text[:i] + text[j:]
    return text


def inputs():
    """The project's inputs, with sweeps of few machines."""
    texts = []
    for file in sorted((ROOT / "data").glob("*.nml")):
        lines = file.read_text().split("\n")
        texts.append("\n".join(line for line in lines if not line.startswith("&sweep")) + "\n&response points=6, harmonics=2 /\n")
    return texts


def expect_error(action):
    """The result of an action, or the gestell.Error that it ends with; any other exception but those of Python's own types passes on."""
    import gestell
    try:
        return action(), None
    except gestell.Error as error:
        lines = error.message.splitlines()
        assert error.code in CODES, f"code {error.code}"
        assert len(lines) == 1 and len(error.message) <= LONGEST_MESSAGE, f"a message of {len(lines)} lines: {error.message[:200]!r}"
        return None, error


def read_all(solution):
    """Everything that a solution holds."""
    assert solution.verdict in ("stable", "unstable", "undecided", "undamped", ""), solution.verdict
    assert isinstance(solution.report, str) and isinstance(solution.failure, str)
    multipliers, _ = expect_error(lambda: solution.multipliers)
    assert multipliers is None or len(multipliers) == len(multipliers.error)
    for quantity in ("f", "xi", "psi_dot", "probe(P).v", "nothing", ""):
        response, _ = expect_error(lambda: solution.response(quantity))
        assert response is None or response.peak >= 0
    for name in solution.tables:
        table = solution.table(name)
        assert len({len(column) for column in table.values()}) <= 1, f"{name}: columns of several lengths"


def package(dice, text, folder):
    """Reads, changes and solves a text by the package; without changes the program must agree."""
    import gestell
    machine, error = expect_error(lambda: gestell.Machine(text + "\n"))
    code = error.code if error else 0
    untouched = True
    if not error:
        again, _ = expect_error(lambda: pickle.loads(pickle.dumps(machine)))
        assert again is None or again.text == machine.text, "a pickled machine has another text"
        expect_error(lambda: dict(machine))
    for _ in range(0 if error else dice.choice([0, 0, 1, 3])):
        path, value = dice.choice(PATHS), dice.choice(VALUES)
        untouched = False
        try:
            _, missing = expect_error(lambda: machine[path])
            assert missing or path in machine, f"{path} is there, and not in the machine"
            if dice.random() < 0.2:
                expect_error(lambda: machine.remove(path.split(".")[0]))
            expect_error(lambda: machine.__setitem__(path, value))
        except (TypeError, ValueError):
            pass  # no number and no text: Python's own refusal
    if not error:
        tasks = None if untouched else dice.choice([None, dice.choice(TASKS), dice.sample(TASKS, 2)])
        solution, error = expect_error(lambda: machine.solve(tasks))
        code = error.code if error else 4 if solution.failure else 0
        if solution:
            read_all(solution)
    program = os.environ.get("PROGRAM")
    if program and untouched and "\0" not in text:
        file = folder / "input.nml"
        file.write_text(text + "\n", encoding="utf-8", newline="")
        run = subprocess.run([program, "-q", "-o", str(folder / "out"), str(file)], capture_output=True, timeout=20 * SECONDS)
        assert run.returncode == code, f"the package ends with {code}, the program with {run.returncode}: {run.stderr[:200]!r}"


def bare_calls(dice):
    """Functions for C in any order, with arguments that are sound, null or absurd. Buffers are larger than any size that is said."""
    from gestell import _library as library
    error = ctypes.c_void_p(library._library.gestell_new_error())
    machine = ctypes.c_void_p(library._library.gestell_new_machine())
    solution = ctypes.c_void_p()
    text = dice.choice(inputs()).encode()
    library.functions.parse(machine, text, error)
    library.functions.solve(machine, b"stability", ctypes.byref(solution), error)
    handles = {"machine": machine, "solution": solution}
    words = [None, b"", b"report", b"verdict", b"results", b"page", b"modes_motion.svg", b"multipliers", b"response", b"f", b"\xff",
             b"x" * 3000, text, b"&link /"] + \
        [path.encode("utf-8", "replace") for path in PATHS]
    for _ in range(30):
        name = dice.choice(sorted(vars(library.functions)))
        function = getattr(library.functions, name)
        if name in ("get_version", "get_error", "write", "read"):
            continue
        kind = "machine" if name in _OF_MACHINES else "solution"
        arguments = [dice.choice([handles[kind]] * 9 + [None])]
        for type_ in function.argtypes[1:-1]:
            if type_ is ctypes.c_int:
                arguments.append(dice.choice([-2**31, -1, 0, 1, 2, 7, 64, 300]))
            elif type_ is ctypes.c_double:
                arguments.append(dice.choice([0., 1., -1., 1e300, float("nan")]))
            elif type_ is ctypes.c_char_p and not (name, len(arguments)) in _TAKES_TEXT:
                arguments.append(dice.choice(words))
            elif type_ is ctypes.POINTER(ctypes.c_int):
                arguments.append(dice.choice([ctypes.byref(ctypes.c_int()), None]))
            elif type_ is ctypes.POINTER(ctypes.c_void_p):
                arguments.append(None if dice.random() < 0.2 else ctypes.byref(ctypes.c_void_p()))
            else:
                arguments.append(None if dice.random() < 0.1 else ctypes.create_string_buffer(300 * 300 * 8))
        code = function(*arguments, dice.choice([error, None]))
        assert code == 0 or code in CODES, f"{name} gives code {code}"
        if code:
            message = ctypes.create_string_buffer(4096)
            library.functions.get_error(error, 4096, message)
            assert len(message.value.splitlines()) <= 1, f"{name}: a message of several lines: {message.value[:200]!r}"
    for what, handle in handles.items():
        library._deleters[what](ctypes.byref(handle))
    library._library.gestell_delete_error(ctypes.byref(error))


# Functions whose first argument is a machine; that of all others is a solution.
_OF_MACHINES = {"copy_machine", "parse", "parse_named", "add", "remove", "set", "set_text", "count_values", "get_values",
                "size_parameters", "get_parameters", "size_input", "get_input", "solve"}
# Arguments of type char * into which the library writes: function and place.
_TAKES_TEXT = {("get_text", 3), ("get_input", 2), ("get_parameters", 3), ("describe_response", 5), ("name_table", 3), ("describe_column", 4),
               ("describe_column", 5), ("describe_column", 6)}


def one_input(seed, number, folder):
    dice = random.Random(f"{seed} {number}")
    package(dice, changed(dice, dice.choice(inputs())), folder)
    bare_calls(dice)


def child(seed, first, last):
    """Runs inputs first to last and says what becomes of each; the parent reads the numbers."""
    import gestell  # noqa: F401 - a package that is not there is no fault of an input
    with tempfile.TemporaryDirectory() as folder:
        for number in range(first, last + 1):
            print(number, "begins", flush=True)
            resource.setrlimit(resource.RLIMIT_CPU, (int(resource.getrusage(resource.RUSAGE_SELF).ru_utime) + SECONDS + 1, -1))
            try:
                one_input(seed, number, pathlib.Path(folder))
                print(number, "passes", flush=True)
            except Exception:
                print(number, "fails", " | ".join(traceback.format_exc().splitlines()[-3:]), flush=True)


def main():
    count, first, seed = (int(word) for word in (sys.argv[1:] + ["300", "1", "1"][len(sys.argv) - 1:])[:3])
    passed = failed = long = 0
    number, last = first, first + count - 1
    while number <= last:
        end = min(number + BATCH - 1, last)
        run = subprocess.run([sys.executable, __file__, "child", str(seed), str(number), str(end)], capture_output=True, text=True,
                             errors="replace")
        lines = [line.split(" ", 2) for line in run.stdout.splitlines() if line[:1].isdigit()]
        for words in lines:
            passed += words[1] == "passes"
            if words[1] == "fails":
                failed += 1
                print(f"FAIL  input {words[0]} of seed {seed}: {words[2]}")
        if not lines:
            sys.exit(f"the package cannot be used: {run.stderr[-300:]}")
        reached = max(int(words[0]) for words in lines)
        if run.returncode == 0:
            number = end + 1
            continue
        if run.returncode == -signal.SIGXCPU:
            long += 1
        else:
            failed += 1
            print(f"FAIL  input {reached} of seed {seed}: ends with {run.returncode}: {run.stderr[-300:]}")
        number = reached + 1
    print(f"{long} of {count} were ended because they took more than {SECONDS} s")
    print(f"{passed} passed, {failed} failed")
    return failed > 0 or passed == 0


if __name__ == "__main__":
    if sys.argv[1:2] == ["child"]:
        child(*(int(word) for word in sys.argv[2:5]))
    else:
        sys.exit(main())
