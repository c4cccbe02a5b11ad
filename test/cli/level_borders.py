"""Borders where a quantity crosses a level: against a rotor's closed form, and against single runs of the exact frame."""

import math
import re

from stability_borders import DAMPING as SIEVE_DAMPING, SIEVE, SPEED as SIEVE_SPEED
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
    """The place between a and b where a function crosses its level once, by bisection."""
    rises = function(a) < level
    for _ in range(200):
        middle = (a + b) / 2
        if (function(middle) < level) == rises:
            a = middle
        else:
            b = middle
    return a


def top(function, a, b):
    """The place between a and b of a function's only maximum."""
    for _ in range(200):
        c, d = a + (b - a) / 3, b - (b - a) / 3
        a, b = (c, b) if function(c) < function(d) else (a, d)
    return a


def rows(folder, name="boundary"):
    lines = [line for line in (folder / f"{name}.csv").read_text().splitlines() if line[0] != "#"]
    return lines[0], [line.split(",") for line in lines[1:]]


def as_bisected(what, folder, function, level, a, b, path, downward=False):
    """Checks two crossings, on both sides of the maximum between a and b, each within its error."""
    header, table = rows(folder)
    equal(f"{what}, header", header, f"curve,{path},kind,{path}_error,below,above,state")
    equal(f"{what}, words", [(row[0], row[2], *row[4:]) for row in table],
          [("1", "level", *(["above", "within"] if downward else ["within", "above"]), "ok"),
           ("2", "level", *(["within", "above"] if downward else ["above", "within"]), "ok")])
    middle = top(function, a, b)
    right = [bisected(function, level, a, middle), bisected(function, level, middle, b)]
    for row, value in zip(table, reversed(right) if downward else right):
        # the reported error, plus rounding of the closed form
        near(f"{what}, crossing", float(row[1]), value, float(row[3]) + 1e-12 * value)
        check(f"{what}, error", 0 < float(row[3]) < 1e-8 * value, "small", row[3])


def test_closed_form():
    """Speeds where a quantity crosses its level agree with the closed form."""
    ask = "&boundary quantity='fx', level={} /\n"
    for level in (1000, 2500):
        with Folder(input=LEVEL + axis(FIRST, 300, 900, 7) + ask.format(level)) as folder:
            run = Run(folder, "input.nml")
            run.done("level over the speed")
            equal("level, files", files(folder / "input"), ["boundary.csv", "level.csv"])
            as_bisected(f"level {level} over the speed", folder / "input", force, level, 300, 900, FIRST)
            check("level, report", "CROSSINGS OF A LEVEL  fx peak" in run.out and re.search(r"\d +within +above\n", run.out), "both", run.out)
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
    """Crossings on both sides of a very narrow resonance are found.

    The resonance is far narrower than the distance of the search points, damped or not. A level that is never reached has none.
    """
    with Folder(input=LEVEL.replace(f"damping={DAMPING}", "damping=0.2")
                + axis(FIRST, 300, 900, 3) + "&boundary quantity='fx', level=2e5 /\n") as folder:
        Run(folder, "-q", "input.nml").done("a narrow resonance")
        as_bisected("a narrow resonance", folder / "input", lambda n: force(n, damping=0.2), 2e5, 580, 630, FIRST)
        run = Run(folder, "input.nml", "-s", "boundary.level=1e7", "-o", "high")
        check("a level that is not reached", "the quantity does not cross the level within the range" in run.out and rows(folder / "high")[1] == [], "none", run.out)
        run = Run(folder, "-q", "input.nml", "-s", "support.damping=0,0", "-o", "none")
        run.done("an undamped resonance")
        table = rows(folder / "none")[1]
        equal("undamped, states", [row[6] for row in table], ["undamped"] * 2)
        resonant = math.sqrt(STIFFNESS / MASS) * 60 / (2 * math.pi)
        for row, (a, b) in zip(table, ((300, resonant - 1e-9), (resonant + 1e-9, 900))):
            right = bisected(lambda n: force(n, damping=0), 2e5, a, b)
            near("undamped, crossing", float(row[1]), right, float(row[3]) + 1e-12 * right)


def test_error_across():
    """A level that the peak meets within its error is not a sure crossing.

    It is reported as open or undecided.
    """
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
    """A probe's limit serves as level, and a band's edge as jump."""
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
    """Crossings of the exact model agree with single runs on both sides.

    The files are the same for any number of threads.
    """
    machine = SOUND.replace("'stability', 'response'", "'boundary'") + "&probe name='desk', position=0.3,0.25 /\n"
    words = "&boundary quantity='probe(desk).v', measure='band', level=18 /\n&response quantities='probe(desk).v', measures='band' /\n"
    with Folder(input=machine + axis(FIRST, 260, 330, 5) + words) as folder:
        Run(folder, "-q", "input.nml", environment={"OMP_NUM_THREADS": "3"}).done("level of the exact frame")
        table = rows(folder / "input")[1]
        # a resonance of the first order and narrow ones of others
        check("exact frame, crossings in pairs", len(table) >= 4 and len(table) % 2 == 0, "pairs", table)
        for row in table:
            for side, word in ((-1, row[4]), (1, row[5])):
                value = float(row[1]) + side * float(row[3])
                line = Run(folder, "--one-line", "-s", "case.tasks=response", "-s", f"{FIRST}={value!r}", "input.nml")
                came = Points(line.out).column("probe(desk).v_band_mm_s")[0]
                equal(f"exact frame, {word} at {value!r}: {came}", "within" if came <= 18 else "above", word)
        Run(folder, "-q", "input.nml", "-o", "one", environment={"OMP_NUM_THREADS": "1"}).done("level, one thread")
        for name in ("boundary.csv", "level.csv"):
            equal(f"level, {name} by one thread", (folder / "one" / name).read_bytes(), (folder / "input" / name).read_bytes())


REFUSED = [
    ("no quantity of that name", "quantity='fz', level=1", re.compile(r"quantity = 'fz': unknown quantity 'fz': use xi, .*")),
    ("no band", "quantity='fx', measure='band', level=1",
     re.compile(r"measure = 'band': 'band' is available only for velocities of probes: probe\(NAME\)\.v, \.vx, \.vy, in space \.vz")),
    ("no such measure", "quantity='fx', measure='top', level=1",
     re.compile(r"measure = 'top': unknown; choose from 'peak', 'rms', 'band'")),
    ("no level", "quantity='fx'", re.compile(r"level: must be given")),
    ("no limit", "quantity='probe(foot).v', measure='band'", re.compile(r"level: must be given")),
    ("negative", "quantity='fx', level=-1", re.compile(r"level = -1: must be positive")),
    ("level of nothing", "level=1", re.compile(r"level = 1: requires the key 'quantity', which is missing")),
    ("measure of nothing", "measure='rms'", re.compile(r"measure = 'rms': requires the key 'quantity', which is missing")),
]


MAP_HEADER = "curve,{0},{1},kind,{0}_error,{1}_error,state"


def vertices_on(what, folder, paths, function, level):
    """The rows of a map's boundary.csv. Checks that the curve passes within the error of each vertex: the square around it
    has both sides."""
    header, table = rows(folder)
    equal(f"{what}, header", header, MAP_HEADER.format(*paths))
    for row in table:
        x, y, dx, dy = (float(row[i]) for i in (1, 2, 4, 5))
        # rounding of the closed form, plus the errors, which lie along the line of the search
        corners = [function(x + i * (1.01 * dx + 1e-12 * x), y + j * (1.01 * dy + 1e-12 * y)) for i in (-1, 1) for j in (-1, 1)]
        check(f"{what}, vertex {x!r}, {y!r}", min(corners) <= level <= max(corners), level, corners)
    return table


def follows(what, table, function, level, axes, deviation):
    """Checks points next to the lines between vertices, at one and a half times the deviation: above the level on the left,
    below on the right."""
    place = lambda value, a, b, log: math.log(value / a) / math.log(b / a) if log else (value - a) / (b - a)
    value = lambda u, a, b, log: a * (b / a) ** u if log else a + u * (b - a)
    # a descending range mirrors the plane: "left" refers to the first parameter pointing to the right, the second upward
    turned = (axes[0][1] < axes[0][0]) != (axes[1][1] < axes[1][0])
    seen = 0
    for row, after in zip(table, table[1:]):
        if row[0] != after[0]:
            continue
        u, v = ([place(float(r[i + 1]), *axes[i]) for i in (0, 1)] for r in (row, after))
        length = math.dist(u, v)
        left = [(u[1] - v[1]) / length, (v[0] - u[0]) / length]
        for part in range(1, 20):
            for side in (-1, 1):
                at = [u[i] + (v[i] - u[i]) * part / 20 + 1.5 * side * deviation * left[i] for i in (0, 1)]
                if 0 <= min(at) and max(at) <= 1:
                    came, above = function(*(value(at[i], *axes[i]) for i in (0, 1))), (side > 0) != turned
                    check(f"{what}, {'left' if side > 0 else 'right'} of {at}", (came > level) == above, level, came)
                    seen += 1
    check(f"{what}, points next to the curve", seen > 200, "many", seen)


def test_map():
    """Level curves over speed and stiffness agree with the closed form.

    Every vertex and the lines between them; whichever way the axes run.
    """
    text = LEVEL + "&boundary quantity='fx', level=1000 /\n"
    speed, stiffness = (300, 900, False), (4e4, 2e5, False)
    for what, paths, axes in (
            ("map", (FIRST, ALONG), (speed, stiffness)),
            ("map, axes exchanged", (ALONG, FIRST), ((4e4, 2e5, True), (900, 300, False)))):
        groups = "".join(axis(path, a, b, 9, ", spacing='log'" * log) for path, (a, b, log) in zip(paths, axes))
        function = lambda x, y: force(*((x, y) if paths[0] == FIRST else (y, x)))
        with Folder(input=text + groups) as folder:
            run = Run(folder, "input.nml")
            run.done(what)
            equal(f"{what}, files", files(folder / "input"), ["boundary.csv"])
            table = vertices_on(what, folder / "input", paths, function, 1000)
            equal(f"{what}, one curve", {(row[0], row[3], row[6]) for row in table}, {("1", "level", "ok")})
            follows(what, table, function, 1000, axes, 1e-3)
            for found in ("CROSSINGS OF A LEVEL  fx peak = 1000 N, tolerance 0.001 of the ranges\n", "  1 curve, ", ": level\n",
                          f"Crossings of fx peak = 1000 N over {paths[0]} and {paths[1]}: 1 curve"):
                check(f"{what}, report", found in run.out, found, run.out)
            script = (folder / "input" / "boundary.gp").read_text()
            for words in ("'above the level'", "'input'", "Where fx peak crosses 1000 N: 1 found"):
                check(f"{what}, picture", words in script, words, script[:2000])
    # rather exactly, of the rms
    words = f"&boundary quantity='fx', measure='rms', level={1000 / math.sqrt(2)!r}, tolerance=1e-4 /\n"
    with Folder(input=LEVEL + words + axis(FIRST, *speed[:2], 4) + axis(ALONG, *stiffness[:2], 4)) as folder:
        Run(folder, "-q", "input.nml").done("a finer map")
        follows("a finer map", vertices_on("a finer map", folder / "input", (FIRST, ALONG), force_rms, 1000 / math.sqrt(2)), force,
                1000, (speed, stiffness), 1e-4)
        run = Run(folder, "input.nml", "-s", "boundary.level=1e7", "-o", "high")
        check("a map without curves", "  0 curves" in run.out and "  quantity at the centre of the ranges, compared with the level: within\n" in run.out
              and rows(folder / "high")[1] == [], "within", run.out)
        run = Run(folder, "input.nml", "-s", "boundary.level=1", "-o", "low")
        check("a map above its level", "  0 curves" in run.out and "  quantity at the centre of the ranges, compared with the level: above\n" in run.out,
              "above", run.out)


def force_rms(rpm, stiffness):
    return force(rpm, stiffness) / math.sqrt(2)


def test_narrow_map():
    """A ridge much narrower than the search grid has its two level curves.

    Damped or not; the ridge is on the left of both.
    """
    groups = axis(FIRST, 300, 900, 4) + axis(ALONG, 4e4, 2e5, 4)
    for damping, state in ((0.2, "ok"), (0.0, "undamped")):
        with Folder(input=LEVEL.replace(f"damping={DAMPING}", f"damping={damping}") + "&boundary quantity='fx', level=2e5 /\n"
                    + groups) as folder:
            run = Run(folder, "input.nml")
            run.done(f"ridge, damping {damping}")
            table = vertices_on(f"ridge, damping {damping}", folder / "input", (FIRST, ALONG),
                                lambda n, c: force(n, c, damping), 2e5)
            equal(f"ridge, damping {damping}, words", {(row[0], row[3], row[6]) for row in table},
                  {("1", "level", state), ("2", "level", state)})
            for row, after in zip(table, table[1:]):
                faster = float(row[1]) > math.sqrt(float(row[2]) / MASS) * 60 / (2 * math.pi)
                if row[0] == after[0]:
                    equal(f"ridge, damping {damping}, upward at {row}", float(after[2]) > float(row[2]), faster)
            # without damping the quantity has no value on the ridge
            text = (folder / "input" / "boundary.csv").read_text()
            equal(f"ridge, damping {damping}, open places are reported", ("# open: " in text, "open: there may be a boundary" in run.out),
                  (state != "ok",) * 2)


def test_map_of_a_band():
    """A level curve follows the edge of a band in a straight line."""
    words = "&boundary quantity='probe(foot).v', measure='band', level=100 /\n"
    with Folder(input=LEVEL + words + axis(FIRST, 300, 900, 5) + axis(ALONG, 7e4, 9e4, 3)) as folder:
        run = Run(folder, "input.nml")
        run.done("map of a band")
        table = rows(folder / "input")[1]
        equal("map of a band, words", {(row[0], row[3], row[6]) for row in table}, {("1", "jump", "ok")})
        for row in table:
            near("map of a band, where the band begins", float(row[1]), 60 * BAND, float(row[4]))
        equal("map of a band, from end to end", sorted(float(row[2]) for row in (table[0], table[-1])), [7e4, 9e4])
        check("map of a band, report", ": jump\n" in run.out, "jump", run.out)


def test_map_where_unstable():
    """States along a level curve agree with single runs through a tongue.

    Its corners at the tongue's borders are found within the deviation.
    """
    ranges = [(120.0, 300.0), (0.2, 10.0)]
    with Folder(input=SIEVE + SIEVE_SPEED + SIEVE_DAMPING + "&boundary quantity='f', level=800 /\n") as folder:
        run = Run(folder, "input.nml")
        run.done("map of a sieve")
        paths = ("drive.speed_rpm", "foundation.damping(3)")
        header, table = rows(folder / "input")
        equal("map of a sieve, header", header, MAP_HEADER.format(*paths))
        check("map of a sieve, report", ": level, level with " in run.out, "both", run.out)
        place = lambda row: [(float(row[i + 1]) - a) / (b - a) for i, (a, b) in enumerate(ranges)]
        corners = [math.dist(place(row), place(after)) for row, after in zip(table, table[1:])
                   if row[0] == after[0] and row[6] != after[6]]
        check("map of a sieve, corners", len(corners) == 1 and corners[0] <= 1e-3, "one, within the deviation", corners)
        for row in table:
            words = [word for path, value in zip(paths, row[1:3]) for word in ("-s", f"{path}={value}")]
            single = Run(folder, "-s", "case.tasks=stability", "-s", "accuracy.tolerance=1e-12", *words, "input.nml")
            verdict = {"ok": "stable", "unstable": "unstable"}[row[6]]
            check(f"map of a sieve, {row[1:3]}", f"VERDICT  {verdict}" in single.out, verdict, single.out[-900:])


def test_map_as_single_runs():
    """Vertices of the exact model's level curve agree with single runs."""
    machine = SOUND.replace("'stability', 'response'", "'boundary'") + "&probe name='desk', position=0.3,0.25 /\n"
    words = "&boundary quantity='probe(desk).v', measure='band', level=18 /\n&response quantities='probe(desk).v', measures='band' /\n"
    with Folder(input=machine + axis(FIRST, 280, 310, 3) + axis(ALONG, 15000, 30000, 2) + words) as folder:
        Run(folder, "-q", "input.nml").done("map of the exact frame")
        table = rows(folder / "input")[1]
        # both sides of the first order's resonance, which differ
        equal("map of the exact frame, curves", {(row[0], row[3]) for row in table}, {("1", "level"), ("2", "level")})
        for row in table:
            x, y = float(row[1]), float(row[2])
            came = []
            for side in (-1, 1):
                # along the speed, at twice the reported error, at least a billionth of the range
                at = x + side * 2 * max(float(row[4]), 30e-9)
                line = Run(folder, "--one-line", "-s", "case.tasks=response", "-s", f"{FIRST}={at!r}", "-s", f"{ALONG}={y!r}",
                           "input.nml")
                came.append(Points(line.out).column("probe(desk).v_band_mm_s")[0])
            check(f"map of the exact frame, both sides of {x!r}, {y!r}", min(came) <= 18 <= max(came), 18, came)


def test_refused():
    """Invalid levels are refused and nothing is written."""
    line = LEVEL.count("\n") + 1
    for what, words, message in REFUSED:
        with Folder(input=LEVEL + axis(FIRST, 300, 900, 3) + f"&boundary {words} /\n") as folder:
            Run(folder, "input.nml").refused(f"level, {what}", 2,
                                             re.compile(re.escape(f"input.nml:{line + 1}: &boundary: ") + message.pattern))
            equal(f"level, {what}: nothing is written", files(folder), ["input.nml"])
    with Folder(input=LEVEL + axis(FIRST, 300, 900, 3) + "&boundary quantity='f', level=1 /\n") as folder:
        run = Run(folder, "--check", "input.nml")
        check("level, --check", run.code == 0 and "CROSSINGS OF A LEVEL  f peak = 1 N" in run.out and "STABILITY" not in run.out, "it",
              run.out)


LEVEL_BORDER_TESTS = [test_closed_form, test_between_points, test_error_across, test_of_a_band, test_as_single_runs, test_map, test_narrow_map,
               test_map_of_a_band, test_map_where_unstable, test_map_as_single_runs, test_refused]
