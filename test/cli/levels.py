"""Borders of a level of a quantity: against a rotor's closed form, and against single runs of the exact frame."""

import math
import re

from broken_inputs import SOUND
from harness import Folder, Run, check, equal, files, near
from quantities import BAND, DAMPING, MASS, ROTOR, STIFFNESS, UNBALANCE
from sweeps import FIRST, Points, axis

LEVEL = ROTOR.replace("'sweep'", "'boundary'")
ALONG = "support(1).stiffness(1)"


def force(rpm, stiffness=STIFFNESS, damping=DAMPING):
    """Peak of the rotor's force along x."""
    w = rpm * 2 * math.pi / 60
    return UNBALANCE * w * w * abs((stiffness + 1j * damping * w) / (stiffness - MASS * w * w + 1j * damping * w))


def bisected(function, level, a, b):
    """Where a function that crosses its level once between a and b does so."""
    rises = function(a) < level
    for _ in range(200):
        middle = (a + b) / 2
        if (function(middle) < level) == rises:
            a = middle
        else:
            b = middle
    return a


def top(function, a, b):
    """Where a function with one maximum between a and b has it."""
    for _ in range(200):
        c, d = a + (b - a) / 3, b - (b - a) / 3
        a, b = (c, b) if function(c) < function(d) else (a, d)
    return a


def rows(folder, name="boundary"):
    lines = [line for line in (folder / f"{name}.csv").read_text().splitlines() if line[0] != "#"]
    return lines[0], [line.split(",") for line in lines[1:]]


def as_bisected(what, folder, function, level, a, b, path, downward=False):
    """Two crossings, on both sides of the maximum between a and b, each within its error."""
    header, table = rows(folder)
    equal(f"{what}, header", header, f"curve,{path},kind,{path}_error,below,above,state")
    equal(f"{what}, words", [(row[0], row[2], *row[4:]) for row in table],
          [("1", "level", *(["above", "within"] if downward else ["within", "above"]), "ok"),
           ("2", "level", *(["within", "above"] if downward else ["above", "within"]), "ok")])
    middle = top(function, a, b)
    right = [bisected(function, level, a, middle), bisected(function, level, middle, b)]
    for row, value in zip(table, reversed(right) if downward else right):
        # the closed form's own roundings beside the error that is told
        near(f"{what}, crossing", float(row[1]), value, float(row[3]) + 1e-12 * value)
        check(f"{what}, error", 0 < float(row[3]) < 1e-8 * value, "small", row[3])


def test_closed_form():
    ask = "&boundary quantity='fx', level={} /\n"
    for level in (1000, 2500):
        with Folder(input=LEVEL + axis(FIRST, 300, 900, 7) + ask.format(level)) as folder:
            run = Run(folder, "input.nml")
            run.done("level over the speed")
            equal("level, files", files(folder / "input"), ["boundary.csv", "level.csv"])
            as_bisected(f"level {level} over the speed", folder / "input", force, level, 300, 900, FIRST)
            check("level, report", "BORDERS OF A LEVEL  fx peak" in run.out and re.search(r"\d +within +above\n", run.out), "both", run.out)
            text = (folder / "input" / "boundary.csv").read_text()
            check("level, head", f"\n# level: fx_peak = {level / 1000:.16f}E+003 N\n" in text, "the level", text)
            header, curve = rows(folder / "input", "level")
            equal("level.csv, header", header, f"{FIRST},fx_peak_N,fx_peak_error_N,state")
            for row in curve:
                near(f"level.csv at {row[0]}", float(row[1]), force(float(row[0])), float(row[2]) + 1e-12 * force(float(row[0])))
        with Folder(input=LEVEL + axis(FIRST, 900, 300, 7, ", spacing='log'") + ask.format(level)) as folder:
            Run(folder, "-q", "input.nml").done("level, downward")
            as_bisected(f"level {level}, downward", folder / "input", force, level, 300, 900, FIRST, downward=True)
    for spacing in ("", ", spacing='log'"):
        with Folder(input=LEVEL + axis(ALONG, 4e4, 2e5, 7, spacing) + ask.format(1000)) as folder:
            Run(folder, "-q", "input.nml").done("level over a stiffness")
            as_bisected(f"level over a stiffness{spacing}", folder / "input", lambda c: force(600, c), 1000, 4e4, 2e5, ALONG)
    # rms of the force: the level of the peak over sqrt(2)
    words = f"&boundary quantity='fx', measure='rms', level={1000 / math.sqrt(2)!r} /\n"
    with Folder(input=LEVEL + axis(FIRST, 300, 900, 7) + words) as folder:
        Run(folder, "-q", "input.nml").done("level of an rms")
        as_bisected("level of an rms", folder / "input", force, 1000, 300, 900, FIRST)


def test_between_points():
    """A resonance far narrower than the search points are apart; without damping too; a level that is never reached."""
    with Folder(input=LEVEL.replace(f"damping={DAMPING}", "damping=0.2")
                + axis(FIRST, 300, 900, 3) + "&boundary quantity='fx', level=2e5 /\n") as folder:
        Run(folder, "-q", "input.nml").done("a narrow resonance")
        as_bisected("a narrow resonance", folder / "input", lambda n: force(n, damping=0.2), 2e5, 580, 630, FIRST)
        run = Run(folder, "input.nml", "-s", "boundary.level=1e7", "-o", "high")
        check("a level that is not reached", "not crossed in the range" in run.out and rows(folder / "high")[1] == [], "none", run.out)
        run = Run(folder, "-q", "input.nml", "-s", "support.damping=0,0", "-o", "none")
        run.done("a resonance that nothing damps")
        table = rows(folder / "none")[1]
        equal("nothing damps, states", [row[6] for row in table], ["undecided"] * 2)
        resonant = math.sqrt(STIFFNESS / MASS) * 60 / (2 * math.pi)
        for row, (a, b) in zip(table, ((300, resonant - 1e-9), (resonant + 1e-9, 900))):
            right = bisected(lambda n: force(n, damping=0), 2e5, a, b)
            near("nothing damps, crossing", float(row[1]), right, float(row[3]) + 1e-12 * right)


def test_error_across():
    """A level that the greatest peak meets within its error is told as open or undecided, never as a sure crossing."""
    greatest = force(top(force, 500, 700))
    text = LEVEL + axis(FIRST, 300, 900, 7) + f"&boundary quantity='fx', level={greatest!r} /\n"
    with Folder(input=text) as folder:
        run = Run(folder, "input.nml")
        run.done("a level at the top")
        table = rows(folder / "input")[1]
        marked = "# open: " in (folder / "input" / "boundary.csv").read_text()
        sure = [row for row in table if "undecided" not in row[4:6]]
        check("a level at the top", (marked or table) and not sure, "open or undecided", (table, run.out[-400:]))


def test_of_a_band():
    """The probe's own limit as the level; a jump where the band begins."""
    speed = axis(FIRST, 300, 900, 7)
    velocity = lambda n: 1000 / math.sqrt(2) * n * 2 * math.pi / 60 * force(n) / abs(STIFFNESS + 1j * DAMPING * n * 2 * math.pi / 60)
    with Folder(input=LEVEL.replace("band_hz=", "limit_mm_s=600, band_hz=") + speed
                + "&boundary quantity='probe(foot).v', measure='band' /\n") as folder:
        Run(folder, "-q", "input.nml").done("the limit of a probe")
        as_bisected("the limit of a probe", folder / "input", velocity, 600, 300, 900, FIRST)
        Run(folder, "-q", "input.nml", "-s", "boundary.level=100", "-o", "jump").done("a level below the band's end")
        table = rows(folder / "jump")[1]
        equal("jump, words", [row[2:3] + row[4:] for row in table], [["jump", "within", "above", "ok"]])
        near("jump, where the band begins", float(table[0][1]), 60 * BAND, float(table[0][3]))


def test_as_single_runs():
    """The exact frame: single runs on both sides of every crossing; the same bytes whatever the threads."""
    machine = SOUND.replace("'stability', 'response'", "'boundary'") + "&probe name='desk', position=0.3,0.25 /\n"
    words = "&boundary quantity='probe(desk).v', measure='band', level=18 /\n&response quantities='probe(desk).v', measures='band' /\n"
    with Folder(input=machine + axis(FIRST, 260, 330, 5) + words) as folder:
        Run(folder, "-q", "input.nml").done("level of the exact frame")
        table = rows(folder / "input")[1]
        # a resonance of the first order and narrow ones of others
        check("exact frame, crossings in pairs", len(table) >= 4 and len(table) % 2 == 0, "pairs", table)
        for row in table:
            for side, word in ((-1, row[4]), (1, row[5])):
                value = float(row[1]) + side * float(row[3])
                line = Run(folder, "--one-line", "-s", "case.tasks=response", "-s", f"{FIRST}={value!r}", "input.nml")
                came = Points(line.out).column("probe(desk).v_band_mm_s")[0]
                equal(f"exact frame, {word} at {value!r}: {came}", "within" if came <= 18 else "above", word)
        for threads in ("1", "3"):
            Run(folder, "-q", "input.nml", "-o", threads, environment={"OMP_NUM_THREADS": threads}).done("level, threads")
            for name in ("boundary.csv", "level.csv"):
                equal(f"level, {name} by {threads} threads", (folder / threads / name).read_bytes(),
                      (folder / "input" / name).read_bytes())


REFUSED = [
    ("no quantity of that name", "quantity='fz', level=1", re.compile(r"quantity = 'fz': 'fz' is no quantity: there are xi, .*")),
    ("no band", "quantity='fx', measure='band', level=1",
     re.compile(r"measure = 'band': 'band' is for velocities of probes, probe\(NAME\)\.v, \.vx, \.vy")),
    ("no such measure", "quantity='fx', measure='top', level=1",
     re.compile(r"measure = 'top': unknown; known: 'peak', 'rms', 'band'")),
    ("no level", "quantity='fx'", re.compile(r"level: must be given")),
    ("no limit", "quantity='probe(foot).v', measure='band'", re.compile(r"level: must be given")),
    ("negative", "quantity='fx', level=-1", re.compile(r"level = -1: must be positive")),
    ("level of nothing", "level=1", re.compile(r"level = 1: is one of a quantity: none is named")),
    ("measure of nothing", "measure='rms'", re.compile(r"measure = 'rms': tells of a quantity: none is named")),
]


def test_refused():
    line = LEVEL.count("\n") + 1
    for what, words, message in REFUSED:
        with Folder(input=LEVEL + axis(FIRST, 300, 900, 3) + f"&boundary {words} /\n") as folder:
            Run(folder, "input.nml").refused(f"level, {what}", 2,
                                             re.compile(re.escape(f"input.nml:{line + 1}: &boundary: ") + message.pattern))
            equal(f"level, {what}: nothing is written", files(folder), ["input.nml"])
    with Folder(input=LEVEL + axis(FIRST, 300, 900, 3) + axis(ALONG, 1e4, 2e4, 3) + "&boundary quantity='f', level=1 /\n") as folder:
        Run(folder, "input.nml").refused("level over two parameters", 2, f"input.nml:{line + 1}: &sweep 2: is one too many: the level "
                                         "of a quantity is sought over one parameter")
    with Folder(input=LEVEL + axis(FIRST, 300, 900, 3) + "&boundary quantity='f', level=1 /\n") as folder:
        run = Run(folder, "--check", "input.nml")
        check("level, --check", run.code == 0 and "BORDERS OF A LEVEL  f peak = 1 N" in run.out and "STABILITY" not in run.out, "it",
              run.out)


LEVEL_TESTS = [test_closed_form, test_between_points, test_error_across, test_of_a_band, test_as_single_runs, test_refused]
