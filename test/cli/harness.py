"""Runs the program, reads its files as tables, and counts comparisons."""

import functools
import inspect
import math
import os
import re
import subprocess
import tempfile
from pathlib import Path

from broken_inputs import SOUND

# Environment in which the program draws pictures as SVG only. For tests that do not look at PNG and GIF files.
SVG_ONLY = {"PATH": f"{Path(__file__).resolve().parent / 'svg_only'}:{os.environ['PATH']}"}
# Time limit of a run. It is far longer than any run takes on a busy computer, so only a run that hangs reaches it.
SECONDS = 600

MULTIPLIERS = "index,re,im,abs,log_abs,arg_rad,exponent_re_per_s,exponent_im_rad_per_s,error,lost".split(",")
STATES = ["xi", "eta", "psi", "xi_dot", "eta_dot", "psi_dot"]
MODES = ["index"] + [f"{state}_{part}" for state in STATES for part in ("re", "im")]
QUANTITIES = "xi_m,eta_m,psi_rad,xi_dot_m_s,eta_dot_m_s,psi_dot_rad_s,fx_N,fy_N,m_Nm".split(",")
RESPONSE = ["crank_deg", "t_s"] + QUANTITIES
HARMONICS = ["order", "frequency_Hz"]
HARMONICS += [f"{name}_{part}" for name in QUANTITIES for part in ("amplitude", "phase_rad")]
HEADERS = {"multipliers.csv": MULTIPLIERS, "modes.csv": MODES, "response.csv": RESPONSE, "harmonics.csv": HARMONICS}


class Count:
    """Checks that passed and failed, and what the running test says must hold."""

    passed = failed = 0
    title = "no test"


def title_of(test):
    """What must hold: the first sentence of a test's docstring. Failures are printed below it."""
    assert test.__doc__, f"{test.__name__} has no docstring that says what must hold"
    return inspect.getdoc(test).partition("\n")[0].removesuffix(".")


def check(name, good, expected, came):
    """Counts one check and prints it if it fails: the test's title, the check's name, the expected and the actual value."""
    if good:
        Count.passed += 1
        return
    Count.failed += 1
    print(f"FAILED  {Count.title}\n    check     {name}\n    expected  {expected}\n    actual    {came}", flush=True)


def equal(name, came, expected):
    check(name, came == expected, repr(expected), repr(came))


def near(name, came, expected, tolerance):
    check(name, abs(came - expected) <= tolerance, f"{expected!r} +- {tolerance:.1e}", f"{came!r}")


def printed(name, came, digits, factor=0.501):
    """Checks that `came` agrees with a published number in all its decimals."""
    near(name, came, float(digits), factor * 10.0 ** -len(digits.partition(".")[2]))


def series(name, came, expected, tolerance):
    """Checks that two lists agree within a tolerance; reports the row with the largest difference."""
    if len(came) != len(expected):
        check(name, False, f"{len(expected)} numbers", f"{len(came)} numbers")
        return
    worst = max(range(len(came)), key=lambda i: abs(came[i] - expected[i]) if came[i] == came[i] else math.inf)
    near(f"{name}, row {worst}", came[worst], expected[worst], tolerance)


class Run:
    """One run of the program in a folder."""

    program = None

    def __init__(self, folder, *arguments, environment=None, **keywords):
        keywords.setdefault("stdout", subprocess.PIPE)
        try:
            done = subprocess.run([self.program, *map(str, arguments)], cwd=folder, stdin=subprocess.DEVNULL,
                                  stderr=subprocess.PIPE, timeout=SECONDS,
                                  env={**os.environ, **(environment or {})}, **keywords)
            self.code, self.out, self.err = done.returncode, done.stdout, done.stderr
        except subprocess.TimeoutExpired:
            self.code, self.out, self.err = "none, still running", b"", b""
        self.out = (self.out or b"").decode(errors="replace")
        self.err = self.err.decode(errors="replace")

    @property
    def flat(self):
        """Standard output with all white space replaced by single blanks, so that line breaks do not matter."""
        return " ".join(self.out.split())

    def done(self, name, code=0):
        """Checks that the run ended with `code` and printed nothing on standard error."""
        equal(name, (self.code, self.err), (code, ""))
        return self.code == code

    def refused(self, name, code, message):
        """Checks that the run ended with `code` and exactly one line on standard error. `{group.key}` in the message stands for the
        words that this key allows."""
        if isinstance(message, str):
            message = re.sub(r"\{(\w+\.\w+)\}", lambda key: ", ".join(map(repr, allowed(self.program, key[1]))), message)
            equal(name, (self.code, self.err), (code, message + "\n"))
        else:
            good = self.code == code and message.fullmatch(self.err.removesuffix("\n")) and self.err.endswith("\n")
            check(name, good, (code, message.pattern), (self.code, self.err))


@functools.cache
def allowed(program, key):
    """The words that a key allows, as `--help group.key` lists them."""
    help_text = subprocess.run([program, "--help", key], capture_output=True, text=True, timeout=SECONDS).stdout
    words = re.findall(r"'([^']+)'", re.sub(r"\s+", " ", re.search(r"^  values((?:.|\n   )*)", help_text, re.M)[1]))
    assert len(words) > 1, f"no words of {key} in\n{help_text}"
    return words


class Folder:
    """A temporary folder with input files."""

    def __init__(self, **inputs):
        self.inputs = inputs or {"input": SOUND}

    def __enter__(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.path = Path(self.temporary.name)
        for name, text in self.inputs.items():
            data = text if isinstance(text, bytes) else text.encode()
            (self.path / f"{name}.nml").write_bytes(data)
        return self.path

    def __exit__(self, *error):
        self.temporary.cleanup()


def files(folder):
    """Names of the files in a folder, except gnuplot scripts of pictures whose table is in the folder."""
    if not folder.is_dir():
        return []

    def has_table(script):
        table = re.search(r" from (\w+\.csv):", script.read_text().partition("\n")[0])
        return bool(table) and (folder / table[1]).exists()

    return sorted(path.name for path in folder.iterdir() if path.suffix != ".gp" or not has_table(path))


class Table:
    """A result file with its numbers by column."""

    def __init__(self, path):
        lines = path.read_text().split("\n")
        self.ends_with_newline = lines.pop() == ""
        self.preamble = [line for line in lines if line.startswith("#")]
        self.header = lines[len(self.preamble)]
        self.rows = [line.split(",") for line in lines[len(self.preamble) + 1:]]
        names = self.header.split(",")
        self.columns = {name: [float(row[i]) for row in self.rows] for i, name in enumerate(names)}

    def __getitem__(self, name):
        # NaN if the column is missing, so that every comparison fails
        return self.columns.get(name, [math.nan] * len(self.rows))


def tables(folder):
    return {name: Table(folder / name) for name in files(folder) if name in HEADERS}


def body(folder):
    """The numbers of all result files in a folder, without preambles."""
    return {name: [[float(word) for word in row] for row in table.rows] for name, table in tables(folder).items()}
