"""Pictures: the scripts next to the tables, and what gnuplot makes of them."""

import math
import os
import re
import shutil
import subprocess
import xml.etree.ElementTree
from pathlib import Path

from broken_inputs import REST, SOUND
from harness import SECONDS, Folder, Run, Table, check, equal, near, series

GNUPLOT = shutil.which("gnuplot")
DATA = Path(__file__).resolve().parents[2] / "data"
ALL = SOUND.replace("'stability', 'response'", "'stability', 'modes', 'response', 'drawing'")
# Files without a picture that the task drawing writes besides mechanism.csv.
CHECKED = ["balance_table.csv", "frequencies.csv", "unbalance.csv"]
# All tables without a picture.
BARE = {*CHECKED, "strokes.csv", "crossings.csv", "torque_roll.csv", "sweep_columns.csv"}
# Pictures of tables that have several.
FURTHER = dict(force_polar="response", transmissibility="harmonics", probes_orbit="probes_history", order_map="resonance",
               **{f"sweep_{i}": "sweep" for i in range(2, 13)})
SWEEP = SOUND.replace("'stability', 'response'", "'sweep'")
BORDERS = SOUND.replace("'stability', 'response'", "'sweep', 'boundary'")
SPEEDS = "&sweep parameter='drive.speed_rpm', from={}, to={}, count={} {} /\n"
STIFFNESS = "&sweep parameter='support.stiffness', from={}, to={}, count={} {} /\n"
# A frame that rocks, unstable in part of the range of speeds.
ROCKING = """&case title='Rocking', tasks='sweep','boundary' /
&drive speed_rpm=229 /
&joint name='O', type='ground', position=0,0 /
&joint name='A', type='crank', pivot='O', radius=0.12 /
&link name='eccentric', from='O', to='A', mass=9, inertia=0.02, center=0.12,0 /
&frame mass=40, inertia=2, origin=0.5,0, dof='psi' /
&foundation stiffness=8*0,630, damping=0,0,1.5 /
"""
MASS_FUNCTIONS = """&case title='Given', tasks='stability','response' /
&drive speed_rpm=240 /
&mass_functions mass=1, inertia=0.01, a1=0,0.01,0, a2=0,0,0.01, a3=0.01 /
&frame mass=18, inertia=0.78, origin=0,0 /
&support position=0,-0.2, stiffness=2e5,2e5, damping=10,10 /
&foundation stiffness=8*0,1e4 /
"""


def bare(folder):
    """All names in a folder."""
    return sorted(path.name for path in folder.iterdir()) if folder.is_dir() else []


def sound_picture(what, path):
    """Checks that a picture of either format is valid; returns its texts if it is an SVG."""
    data = path.read_bytes() if path.exists() else b""
    if path.suffix == ".png":
        check(f"{what}, {path.name}", data.startswith(b"\x89PNG\r\n\x1a\n") and len(data) > 3000, "a PNG", data[:20])
        return ""
    try:
        root = xml.etree.ElementTree.fromstring(data)
    except xml.etree.ElementTree.ParseError as error:
        check(f"{what}, {path.name}", False, "XML", (str(error), data[:60]))
        return ""
    texts = [" ".join("".join(one.itertext()).split()) for one in root.iter("{http://www.w3.org/2000/svg}text")]
    check(f"{what}, {path.name}", root.tag.endswith("svg") and texts, "an SVG with texts", root.tag)
    wrong = [text for text in texts if re.search(r"\b(nan|undefined|inf|infinity)\b", text, re.I)]
    equal(f"{what}, {path.name}, texts without a number", wrong, [])
    # At 390 pixels, the width of a column, letters must have at least 6 pixels: 11 pixels in a picture of 640.
    equal(f"{what}, {path.name}, width", root.get("width") in ("640", "720", "800") or path.stem == "balance", True)
    return "\n".join(texts)


def boxes_of(path):
    """The texts of an SVG with estimates of their boxes: (text, left, top, right, bottom); rotated texts are left out."""
    boxes = []
    root = xml.etree.ElementTree.fromstring(path.read_bytes())
    for group in root.iter("{http://www.w3.org/2000/svg}g"):
        text, place = group.find("{http://www.w3.org/2000/svg}text"), group.get("transform", "")
        if text is None or "rotate" in place:
            continue
        x, y = map(float, re.findall(r"[-\d.]+", place)[:2])
        words, size = " ".join("".join(text.itertext()).split()), float(group.get("font-size"))
        # half of an em is the width of a mean letter of a sans-serif font
        width = 0.5 * size * len(words)
        left = x - width * dict(start=0, middle=0.5, end=1)[group.get("text-anchor", "start")]
        boxes.append((words, left, y - 0.8 * size, left + width, y + 0.2 * size))
    return root, boxes


def legible(what, path):
    """Checks that the texts of an SVG are inside it and do not lie on each other; returns them."""
    root, boxes = boxes_of(path)
    outside = [box for box in boxes if box[1] < 0 or box[2] < 0 or box[3] > float(root.get("width")) or box[4] > float(root.get("height"))]
    equal(f"{what}, {path.name}, texts outside", outside, [])
    over = [(one[0], other[0]) for i, one in enumerate(boxes) for other in boxes[:i]
            if one[0] and other[0] and max(one[1], other[1]) < min(one[3], other[3]) and max(one[2], other[2]) < min(one[4], other[4])]
    equal(f"{what}, {path.name}, texts on each other", over, [])
    return [box[0] for box in boxes]


# Names of the pictures that were drawn as PNG. A PNG takes nine tenths of gnuplot's time, and the same commands draw both formats:
# one of each name shows that they do.
AS_PNG = set()


def drawn(what, folder):
    """Checks that every table has a script that runs without output; returns the texts of the pictures by name."""
    texts = {}
    tables = {path.stem for path in folder.glob("*.csv") if path.name not in BARE}
    pictures = sorted(path.stem for path in folder.glob("*.gp"))
    equal(f"{what}, tables of the scripts", {FURTHER.get(name, name) for name in pictures}, tables)
    for name in pictures:
        first = (folder / f"{name}.gp").read_text().partition("\n")[0]
        check(f"{what}, {name}.gp, names its table", f" from {FURTHER.get(name, name)}.csv: " in first, FURTHER.get(name, name), first)
    if not GNUPLOT:
        return texts
    for name in pictures:
        # In the locale C gnuplot warns that it cannot write a degree sign there; the pictures are the same.
        only_svg = ["-e", "picture='svg'"] * (name in AS_PNG)
        done = subprocess.run([GNUPLOT, "-d", *only_svg, f"{name}.gp"], cwd=folder, capture_output=True, timeout=SECONDS,
                              env={**os.environ, "LC_ALL": "C.UTF-8"})
        equal(f"{what}, gnuplot {name}.gp", (done.returncode, done.stdout + done.stderr), (0, b""))
        texts[name] = sound_picture(what, folder / f"{name}.svg")
        if not only_svg:
            sound_picture(what, folder / f"{name}.png")
            AS_PNG.add(name)
    return texts


def test_scripts():
    """Every table has a gnuplot script that runs silently."""
    with Folder(input=ALL) as folder:
        Run(folder, "-q", "input.nml").done("scripts")
        names = ["harmonics", "mechanism", "modes", "multipliers", "response"]
        equal("scripts, files", bare(folder / "input"), sorted([*CHECKED, *(f"{name}.{end}" for name in names for end in ("csv", "gp")),
                                                                "force_polar.gp", "transmissibility.gp"]))
        texts = drawn("scripts", folder / "input")
        units = dict(harmonics=["displacement (mm)", "moment (N m)", "order of the crank (1: 4 Hz)", "ξ"],
                     mechanism=["ξ (m)", "η (m)", "crank", "B0"], modes=["mode 1: 20.3 Hz, damping"],
                     multipliers=["stable", "Re ρ", "0.99", "frequency (Hz)", "damping ratio (%)"],
                     response=["ψ (mrad)", "force x (N)", "crank angle (deg)"],
                     force_polar=["force x (N)", "force y (N)", "shaking force", "90°"],
                     transmissibility=["transmissibility", "frequency (Hz)", "order of the crank", "moment"])
        for name, words in units.items():
            script = (folder / "input" / f"{name}.gp").read_text()
            for word in ["four-bar", "240 rpm" if name != "mechanism" else "60 deg", *words]:
                check(f"{name}.gp, {word}", word in script or word in texts.get(name, ""), word, script[-800:])
                if GNUPLOT:
                    check(f"{name}.svg, {word}", word in texts[name], word, texts[name])
            check(f"{name}.gp, no folders", str(folder) not in script, "names alone", script)


def test_titles():
    """Any text in a title appears as plain text in the pictures."""
    titles = ["It''s \"x\" \\n a\\ {b} _c ^d @e & <f> `touch bad` $5 # % %5.3f", "Ä ξ 日本 ½", "ends in \\", "''", "\"", "`touch bad`",
              "{/Symbol=90 r", "%", "a" * 300, "", "   ", "]]> <!-- --> &amp; &#65; &x &#x41;"]
    for i, title in enumerate(titles):
        text = ALL.replace("'four-bar'", f"'{title}'").replace("name='crank'", f"name='{title[:30].rstrip() or 'x'}'")
        if title in ("''", "ends in \\", "`touch bad`") or i == 0:
            text = ALL.replace("'four-bar'", f"'{title}'")
        with Folder(input=text) as folder:
            what = f"title {title[:20]!r}"
            if not Run(folder, "-q", "input.nml").done(what):
                continue
            for name, texts in drawn(what, folder / "input").items():
                plain = " ".join(title.replace("''", "'").replace("]]>", "]] >").replace("&#", "& #").split())
                check(f"{what}, {name}", plain[:84] in texts, plain, texts[:200])
            equal(f"{what}, nothing is run", list(folder.rglob("bad")), [])
    with Folder(input=ALL.encode().replace(b"four-bar", b"F\xff\xc3\xed\xa0\x80r")) as folder:
        Run(folder, "-q", "input.nml").done("title that is no UTF-8")
        for name, texts in drawn("title that is no UTF-8", folder / "input").items():
            check(f"title that is no UTF-8, {name}", "F?????r" in texts, "F?????r", texts[:200])


def test_nothing_to_plot():
    """Pictures of empty ranges and missing numbers are drawn."""
    still = ALL.replace("mass=0.50, inertia=0.0035", "mass=0, inertia=0").replace("mass=0.60, inertia=0.0070", "mass=0, inertia=0")
    still = still.replace("mass=0.25, inertia=0.0060", "mass=0, inertia=0")
    cases = dict(psi=(ALL.replace("origin=-0.20,0.20", "origin=-0.20,0.20, dof='psi'"), ()), still=(still, ()),
                 one_row=(ALL, ("response.points=1", "response.harmonics=0")), many=(ALL, ("response.harmonics=500",)),
                 clockwise=(ALL, ("drive.speed_rpm=-240",)), tiny=(ALL + REST, ("support.stiffness=1e-3",)),
                 damped=(ALL, ("foundation.damping=1e6,1e6,1e6",)), stiff=(ALL, ("support.stiffness=1e12",)),
                 slow=(ALL, ("drive.speed_rpm=2",)))
    for what, (text, settings) in cases.items():
        with Folder(input=text) as folder:
            run = Run(folder, "-q", "input.nml", *(word for one in settings for word in ("-s", one)))
            if run.done(what):
                drawn(what, folder / "input")


def test_crowded_pictures():
    """Labels of several joints or modes at one place are joined, and pictures show only what is there."""
    if not GNUPLOT:
        return
    with Folder() as folder:
        options = ("-q", "-s", "case.tasks='stability','response','separation','drawing'", "-o")
        Run(folder, *options, "four", DATA / "inline_four.nml").done("crowded pictures, inline four")
        texts = drawn("crowded pictures, inline four", folder / "four")
        lines = texts["mechanism"].split("\n")
        # one label for joints at one point; the legend has no entries for copies of links
        for word in ("A, four.A", "O, two.O, three.O, ...", "throw", "rod"):
            check(f"inline four, mechanism, {word}", word in lines, word, lines)
        equal("inline four, copies have no entry", [word for word in lines if word.startswith("four.")], [])
        # the animation has the colours of the legend: those of two bars of a cylinder, not of eight
        legend = set(re.findall(r"lw 4\.5 pt 6 ps 1\.1 lc rgb '#(\w{6})' title", (folder / "four/mechanism.gp").read_text()))
        Run(folder, "-q", "-s", "case.tasks='drawing'", "--plot", "-o", "moving", DATA / "inline_four.nml").done("inline four, moving")
        moving = (folder / "moving" / "mechanism_motion.svg").read_text().upper()
        equal("inline four, colours of the animation", [one for one in ("D55E00", "0072B2", "56B4E9") if one in moving],
              [one for one in ("D55E00", "0072B2", "56B4E9") if one in legend])
        equal("inline four, nothing is too close", "too close" in texts["separation"], False)
        Run(folder, "-q", "-s", "case.tasks='stability','response','power','forces'", "-o", "engine",
            DATA / "engine_four_stroke.nml").done("crowded pictures, engine")
        texts = drawn("crowded pictures, engine", folder / "engine")
        check("engine, modes 2 and 3", "2, 3" in texts["multipliers"].split("\n"), "2, 3", texts["multipliers"])
        equal("engine, no limit", "limit" in texts["probes"], False)
        for word in ("vibrating frame, mean -14", "drive, mean -4", "kinetic plus potential energy",
                     "difference from the mean speed"):
            check(f"engine, power, {word}", word in texts["power"], word, texts["power"])
        equal("engine, dampers that would be a line at zero", "dampers" in texts["power"], False)


def test_small_orders():
    """Orders with a small shaking force have no transmissibility: a ratio to a remainder says nothing."""
    with Folder() as folder:
        Run(folder, "-q", "-o", "four_bar", DATA / "khang_four_bar.nml").done("small orders")
        script = (folder / "four_bar" / "transmissibility.gp").read_text()
        for name, values in re.findall(r"(rigid\d)\(row\) = real\(word\('([^']*)'", script):
            amplitudes = [float(word) for word in values.split()]
            shown = [a for a in amplitudes if a > 0]
            check(f"small orders, {name}", len(shown) > 1 and min(shown) >= 0.01 * max(shown), "at least 1 %", amplitudes)
        equal("small orders, no lines between orders", "linespoints" in script, False)
        tics = re.search(r"set x2tics \w+(?: \w+ \d+)? \(([^)]*)\)", script)[1]
        equal("small orders, labels", re.findall(r"'(\d+)'", tics), ["1", "2", "3", "4"])


def test_sweeps():
    """Sweeps are drawn with the right axes and units."""
    one, two = SPEEDS, STIFFNESS
    cases = {
        "curves": one.format(200, 300, 8, ""),
        "many points": one.format(200, 300, 50, ""),
        "one point": one.format(200, 200, 1, ""),
        "logarithmic": one.format(100, 1000, 5, ", spacing='log'"),
        "narrow logarithmic": one.format(220, 221, 3, ", spacing='log'"),
        "downward": one.format(300, 200, 5, ""),
        "clockwise, logarithmic": one.format(-100, -400, 5, ", spacing='log'"),
        "through a dead point": "&sweep parameter='joint(B).lengths(1)', from=0.1, to=0.5, count=9 /\n",
        "all impossible": "&sweep parameter='joint(B).lengths(1)', from=0.01, to=0.02, count=4 /\n",
        "a path with a comma": "&sweep parameter='foundation.stiffness(1,1)', from=0, to=10, count=3 /\n",
        "verdicts": one.format(200, 300, 8, ", columns='verdict'"),
        "peaks": one.format(200, 300, 8, ", columns='eta_peak_m'"),
        "quantities": one.format(200, 300, 8, ", columns='f','support(1).fx','fy','m','psi_dot'"),
        "quantities and peaks": one.format(200, 300, 40, ", columns='rho_max','eta_peak_m','f', measures='rms','peak'"),
        "chart of a quantity": one.format(200, 300, 4, ", columns='m'") + two.format(1e5, 3e5, 4, ""),
        "chart": one.format(200, 300, 5, "") + two.format(1e5, 3e5, 4, ", spacing='log'"),
        "chart, 1 x 5": one.format(200, 200, 1, "") + two.format(1e5, 3e5, 5, ""),
        "chart, 5 x 1": one.format(200, 300, 5, "") + two.format(1e5, 1e5, 1, ""),
        "chart, 1 x 1": one.format(200, 200, 1, "") + two.format(1e5, 1e5, 1, ""),
        "chart, 2 x 2": one.format(200, 300, 2, "") + two.format(1e5, 3e5, 2, ""),
        "chart, downward": one.format(300, 200, 5, "") + two.format(3e5, 1e5, 4, ", spacing='log'"),
        "chart of verdicts": one.format(200, 300, 4, ", columns='verdict'") + two.format(1e5, 3e5, 4, ""),
        "chart of peaks": one.format(200, 300, 4, ", columns='psi_peak_rad'") + two.format(1e5, 3e5, 4, ""),
        "chart, all impossible": "&sweep parameter='joint(B).lengths(1)', from=0.01, to=0.02, count=3 /\n"
                                 + two.format(1e5, 3e5, 3, ""),
    }
    for what, groups in cases.items():
        with Folder(input=SWEEP + groups) as folder:
            if Run(folder, "-q", "input.nml").done(what):
                texts = "\n".join(drawn(what, folder / "input").values())
                axis = {"drive.speed_rpm": "crank speed (rpm)", "joint(B).lengths(1)": "joint(B) lengths(1) (m)",
                        "foundation.stiffness(1,1)": "foundation stiffness(1,1) (N/m)"}[groups.split("'")[1]]
                check(f"{what}, axis", not GNUPLOT or axis in texts or what.endswith("1 x 5"), axis, texts)
                if groups.count("&sweep") == 2 and " x " not in what:
                    # gnuplot leaves a label out of an SVG if long numbers at the axis push it out of the picture
                    check(f"{what}, second axis", not GNUPLOT or "support stiffness (N/m)" in texts, "support stiffness (N/m)", texts)
                requested = re.findall(r"columns=((?:'[^']*',?)+)", groups)
                shown = dict(verdict="verdict", rho_max="ln |ρ|max", eta_peak_m="η peak (mm)", psi_peak_rad="ψ peak (mrad)",
                             f="f {} (N)", fy="fy {} (N)", m="m {} (N m)", psi_dot="psi_dot {} (mrad/s)")
                shown["support(1).fx"] = "support(1).fx {} (N)"
                for column in re.findall("'([^']*)'", "".join(requested)):
                    for measure in ("rms", "peak") if "measures" in groups else ("peak",):
                        label = shown[column].format(measure)
                        check(f"{what}, picture of {column}", not GNUPLOT or label in texts, label, texts)
                equal(f"{what}, no picture of error bounds", "error" in texts, False)


def test_fewer_columns():
    """A sweep with fewer columns removes the pictures of an earlier run."""
    with Folder(input=SWEEP + SPEEDS.format(200, 300, 3, ", columns='f','m'"), fewer=SWEEP + SPEEDS.format(200, 300, 3, ", columns='f'")) \
            as folder:
        for name in ("input", "fewer"):
            Run(folder, "-q", "--plot", "-o", "o", f"{name}.nml").done(f"fewer columns, {name}")
            endings = ("csv", "gp", *(("png", "svg") if GNUPLOT else ()))
            expected = [f"sweep.{end}" for end in endings]
            expected += [f"sweep_2.{end}" for end in endings[1:]] if name == "input" else []
            equal(f"fewer columns, {name}", [one for one in bare(folder / "o") if one.startswith("sweep")], sorted(expected))


def test_borders():
    """Borders are drawn with shaded regions and the input's machine."""
    damping = "&sweep parameter='foundation.damping(3)', from=0.05, to=8, count=12 {} /\n"
    cases = {"values": SPEEDS.format(90, 300, 30, ""), "values, logarithmic": SPEEDS.format(90, 300, 30, ", spacing='log'"),
             "no value": SPEEDS.format(90, 120, 5, ""), "curve": SPEEDS.format(90, 300, 20, "") + damping.format(""),
             "curve, logarithmic": SPEEDS.format(300, 90, 20, "") + damping.format(", spacing='log'"),
             "no curve": SPEEDS.format(90, 120, 5, "") + damping.format("")}
    for what, groups in cases.items():
        with Folder(input=ROCKING + groups) as folder:
            if Run(folder, "-q", "input.nml").done(f"borders, {what}"):
                texts = drawn(f"borders, {what}", folder / "input").get("boundary", "")
                word = "none found" if what.startswith("no ") else "period doubling"
                # the machine itself, 229 rpm and 1.5 N m s, is in the middle of the unstable tongue
                word = {"v": "input: 229 rpm", "c": "input"}.get(what[0], "none found")
                check(f"borders, {what}, the input's machine", not GNUPLOT or word in texts, word, texts)
                check(f"borders, {what}, shaded", not GNUPLOT or ("unstable" in texts) != what.startswith("no "), "unstable", texts)
                word = "none found" if what.startswith("no ") else "period doubling"
                if "curve" in what and GNUPLOT:
                    check(f"borders, {what}, units", "foundation damping(3) (N m s)" in texts, "N m s", texts)
                if word == "none found" and GNUPLOT:
                    check(f"borders, {what}, in the frame", word in texts.split("\n"), word, texts)
                check(f"borders, {what}, words", not GNUPLOT or word in texts, word, texts)
                border = "boundary.csv" in (folder / "input" / "sweep.gp").read_text()
                equal(f"borders, {what}, in the chart", border, what.startswith("curve"))


def test_findings():
    """Forces, probes and drive are drawn."""
    probes = "&probe name='foot', position=-0.3,-0.2, limit_mm_s=2 /\n&probe name='it''s {x}_1, \"b\" @c', position=0,0.3 /\n"
    many = "".join(f"&probe name='p{i}', position=0.0{i},0 /\n" for i in range(9))
    names = ["power", "probes", "probes_harmonics", "probes_history", "probes_orbit", "force_polar", "supports", "supports_harmonics", "supports_history"]
    for what, text, settings in (("all", probes, ()), ("many probes", many, ()), ("one freedom", probes, ("frame.dof=psi",)),
                                 ("clockwise", probes, ("drive.speed_rpm=-240",)),
                                 ("one row", probes, ("response.points=1", "response.harmonics=0"))):
        with Folder(input=SOUND.replace("'response'", "'response', 'forces', 'power'") + text) as folder:
            if not Run(folder, "-q", "input.nml", *(word for one in settings for word in ("-s", one))).done(f"findings, {what}"):
                continue
            texts = drawn(f"findings, {what}", folder / "input")
            missing = set(names) - {path.stem for path in (folder / "input").glob("*.gp")}
            equal(f"findings, {what}, scripts", missing, set())
            if GNUPLOT and what == "all":
                for name, words in dict(power=["torque (N m)", "frame at rest", "drive, mean"], supports=["support 4", "total", "force (N)"],
                                        supports_history=["force x (N)", "support 1"], probes=["vibration velocity (mm/s)", "limit"],
                                        supports_harmonics=["force y (N)"], probes_history=["x'' (m/s²)"],
                                        probes_harmonics=["y' (mm/s)"],
                                        probes_orbit=["x (", "y (", "180°", "foot"]).items():
                    for word in words + (["it's {x}_1, \"b\" @c"] if name.startswith("probes") else []):
                        check(f"findings, {name}, {word}", word in texts[name], word, texts[name])


def test_over_speed():
    """Campbell diagrams, critical speeds and resonance curves are drawn."""
    quantities = "&resonance quantities='xi','f','support(2).fy','probe(it''s {x}_1).v', orders=3 /\n" \
                 "&probe name='it''s {x}_1', position=0,0 /\n"
    for what, text in {"wide": SPEEDS.format(200, 300, 8, ""), "none": SPEEDS.format(20, 22, 3, ""),
                       "clockwise": SPEEDS.format(-300, -200, 5, "")}.items():
        with Folder(input=SOUND.replace("'stability', 'response'", "'resonance'") + REST + quantities + text) as folder:
            if Run(folder, "-q", "input.nml").done(f"resonance, {what}"):
                texts = drawn(f"resonance, {what}", folder / "input")
                if GNUPLOT:
                    equal(f"resonance, {what}, order map", "order_map" in texts, True)
                    for word in ("crank speed (rpm)", "order", "xi (", "support(2).fy ("):
                        check(f"resonance, {what}, order map, {word}", word in texts.get("order_map", ""), word, texts.keys())
                    for name in ("resonance", "peaks"):
                        for word in ("crank speed (rpm)", "xi (", "m)", "support(2).fy (", "probe(it's {x}_1).v ("):
                            check(f"resonance, {what}, {name}, {word}", word in texts[name], word, texts[name])
    both = SOUND.replace("'stability', 'response'", "'campbell', 'critical'") + REST
    sieve = ROCKING.replace("'sweep','boundary'", "'campbell','critical'")
    for what, text in {"wide": both + SPEEDS.format(200, 700, 20, ""), "none": both + SPEEDS.format(20, 22, 3, ""),
                       "downward": both + SPEEDS.format(700, 300, 9, ""),
                       "clockwise": both + SPEEDS.format(-200, -700, 9, ""), "locked": sieve + SPEEDS.format(60, 300, 20, "")}.items():
        with Folder(input=text) as folder:
            if Run(folder, "-q", "input.nml").done(f"modes over the speed, {what}"):
                texts = drawn(f"modes over the speed, {what}", folder / "input")
                if GNUPLOT:
                    for name in ("campbell", "critical"):
                        inside = what in ("wide", "locked")
                        equal(f"modes over the speed, {what}, {name}, the input's speed", "input: 2" in texts[name], inside)
                        equal(f"modes over the speed, {what}, {name}, shaded", "unstable" in texts[name].lower().split("\n"),
                              what == "locked")
                    equal(f"modes over the speed, {what}, beyond small motions", "beyond small motions" in texts["critical"],
                          what != "none")
                    for word in ("frequency (Hz)", "damping (%)", "crank speed (rpm)", "mode 1"):
                        check(f"modes over the speed, {what}, {word}", word in texts["campbell"], word, texts["campbell"])


def test_pictures_in_space():
    """In space polar diagrams and orbits show three planes."""
    text = (DATA / "suspended_compressor.nml").read_text()
    with Folder(input=text) as folder:
        if Run(folder, "-q", "input.nml", "-s", "case.tasks='stability','response','forces'").done("pictures in space"):
            texts = drawn("pictures in space", folder / "input")
            for name, words in dict(force_polar=["force x", "force y", "force z"], probes_orbit=["x (", "y (", "z ("],
                                    transmissibility=["force z", "moment x"], multipliers=["6: ", "damping ratio (%)"],
                                    harmonics=["rotation (", "moment (mN m)", "ζ"]).items():
                for word in words:
                    check(f"pictures in space, {name}, {word}", not GNUPLOT or word in texts[name], word, texts.get(name))


def test_many_curves():
    """Legends and labels neither leave the picture nor lie on each other, however many curves and long names there are."""
    if not GNUPLOT:
        return
    supports = "".join(f"&support position={0.1 * i},-0.2, stiffness={1e4 * i},2e4, damping=10,10 /\n" for i in range(1, 10))
    probes = "".join(f"&probe name='probe {i}', position=0.0{i},0 /\n" for i in range(1, 14))
    with Folder(input=SOUND + supports + probes) as folder:
        if Run(folder, "-q", "input.nml", "-s", "case.tasks='forces','response'").done("many supports"):
            drawn("many supports", folder / "input")
            for name in ("supports", "supports_history", "supports_harmonics"):
                texts = legible("many supports", folder / "input" / f"{name}.svg")
                check(f"many supports, {name}, heading", any("the 7 largest of 1" in text for text in texts), "the number", texts)
            legible("many probes", folder / "input" / "probes_harmonics.svg")
    for name in ("inline_four", "engine_in_space", "flying_press", "khang_four_bar", "cam_press", "engine_four_stroke"):
        with Folder(input=(DATA / f"{name}.nml").read_text()) as folder:
            if not Run(folder, "-q", "input.nml", "-s", "case.tasks='joints','forces','response'").done(name):
                continue
            drawn(name, folder / "input")
            for path in sorted((folder / "input").glob("*.svg")):
                if path.stem in ("force_polar", "joints", "joints_history", "joints_harmonics", "joints_sources", "supports",
                                 "supports_history", "supports_harmonics"):
                    texts = legible(name, path)
                    units = {text.rpartition("(")[2] for text in re.findall(r"\(\S*N\)", (path.with_suffix(".gp")).read_text())}
                    check(f"{name}, {path.stem}, units of forces", len(units) < 2, "one", units)
                    what = "the 8 largest of 1"
                    if name == "inline_four" and path.stem.startswith("joints_h"):
                        check(f"{name}, {path.stem}, heading", any(what in text for text in texts), what, texts)
                    if name == "khang_four_bar":
                        check(f"{name}, {path.stem}, no foundation", "foundation" not in texts, "none", texts)
                    if name == "cam_press" and path.stem == "joints":
                        check("load diagram of the cam", any(text.startswith("R: ") for text in texts), "R", texts)
                    if path.stem == "joints_sources":
                        check(f"{name}, causes", "weights" not in texts and len(set(texts)) == len(texts), "no weights", texts)


def test_zero_forces():
    """A force that is zero has no axes, and a moment that is zero has no curve."""
    if not GNUPLOT:
        return
    with Folder(input=(DATA / "inline_four.nml").read_text()) as folder:
        if Run(folder, "-q", "input.nml", "-s", "case.tasks='joints'", "-s", "joints.names='O','L'").done("zero forces"):
            texts = drawn("zero forces", folder / "input")
            script = (folder / "input" / "joints_history.gp").read_text()
            equal("zero moments", [name for name in ("L:left", "R:right") if script.count(f'title "{name}"') > 1], [])
            check("constant forces", "constant: " in texts["joints"], "the force", texts["joints"])
    with Folder(input=SOUND) as folder:
        still = "link(crank).mass=0", "link(crank).inertia=0", "link(coupler).mass=0", "link(coupler).inertia=0", "link(rocker).mass=0", \
            "link(rocker).inertia=0"
        if Run(folder, "-q", "input.nml", *(word for one in still for word in ("-s", one))).done("zero shaking force"):
            texts = drawn("zero shaking force", folder / "input")
            check("zero shaking force", "zero" in texts["force_polar"].split("\n"), "zero", texts["force_polar"])


def test_little_to_show():
    """Pictures leave out what is locked, say what is not found, and gnuplot draws a machine that shakes nothing."""
    if not GNUPLOT:
        return
    balance = SOUND.replace("'stability', 'response'", "'balance'")
    still = [f"link({name}).{key}=0" for name in ("crank", "coupler", "rocker") for key in ("mass", "inertia")]
    with Folder(input=balance) as folder:
        if Run(folder, "-q", "input.nml", *(word for one in still for word in ("-s", one))).done("nothing to balance"):
            for name in ("balance_links", "balance_harmonics"):
                (folder / "input" / f"{name}.csv").unlink()  # they have no picture
            drawn("nothing to balance", folder / "input")
    with Folder(input=ROCKING.replace("'sweep','boundary'", "'response','sweep'") + SPEEDS.format(100, 400, 4, "")) as folder:
        if Run(folder, "-q", "input.nml").done("locked"):
            texts = drawn("locked", folder / "input")
            for name in ("response", "harmonics"):
                lines = texts[name].split("\n")
                equal(f"locked, {name}", [word for word in ("ξ (mm)", "force x (N)", "force (N)", "displacement (mm)", "ξ")
                                         if word in lines], [])
            check("locked, force on the ground", "force on the ground without guides" in texts["force_polar"], "it", texts["force_polar"])
            check("locked, sweep", "zero" in texts["sweep_2"].split("\n"), "zero", texts["sweep_2"])
    high = "'critical','resonance'"
    with Folder(input=SOUND.replace("'stability', 'response'", high) + REST + SPEEDS.format(5000, 5900, 4, "")
                + "&resonance quantities='xi','eta','psi','f','fx' /\n") as folder:
        if Run(folder, "-q", "input.nml").done("no peaks"):
            texts = drawn("no peaks", folder / "input")
            for name in ("critical", "peaks"):
                check(f"no peaks, {name}", "none found" in texts[name], "none found", texts[name])
            # in half a row there is room for four labels of a speed
            speeds = [text for text in texts["resonance"].split("\n") if re.fullmatch(r"5\d00", text)]
            check("labels of speeds", 0 < len(speeds) <= 2 * 4, "at most four in a panel", speeds)


def test_loads_drawn():
    """With external loads there is no transmissibility, because they shake the frame too."""
    with Folder(input=(DATA / "press.nml").read_text()) as folder:
        if Run(folder, "-q", "input.nml").done("loads drawn"):
            texts = drawn("loads drawn", folder / "input")
            equal("loads drawn, transmissibility", (folder / "input" / "transmissibility.gp").exists(), False)
            check("loads drawn, polar diagram", not GNUPLOT or "shaking force" not in texts["force_polar"], "none", texts.keys())


def test_sensitivity():
    """Sensitivities are drawn with names and units."""
    probe = "&probe name='it''s {x}_1', position=0,0 /\n"
    for what, groups in {"usual": "", "one": "&sensitivity parameters='frame.mass', quantities='f' /\n",
                         "zero": "&sensitivity quantities='guide.fx' /\n",
                         "names": "&sensitivity quantities='xi','probe(it''s {x}_1).v' /\n" + probe}.items():
        with Folder(input=SOUND.replace("'stability', 'response'", "'sensitivity'") + groups) as folder:
            if Run(folder, "-q", "input.nml").done(f"sensitivity, {what}"):
                texts = drawn(f"sensitivity, {what}", folder / "input").get("sensitivity", "")
                for word in ["frame.mass", "change of the peak (%)"] + (["probe(it's {x}_1).v"] if what == "names" else []):
                    check(f"sensitivity, {what}, {word}", not GNUPLOT or word in texts, word, texts)


def test_sensitivity_order():
    """The picture of sensitivities lists the greatest effect first."""
    group = "&sensitivity parameters='link(crank).inertia','frame.mass','support.stiffness','link(rocker).mass', quantities='xi' /\n"
    with Folder(input=SOUND.replace("'stability', 'response'", "'sensitivity'") + group) as folder:
        Run(folder, "-q", "input.nml").done("order of sensitivities")
        table = (folder / "input" / "sensitivity.csv").read_text().splitlines()
        rows = [line.split(",") for line in table if line.startswith("xi,")]
        expected = [row[2] for row in sorted(rows, key=lambda row: -abs(float(row[4])))]
        texts = drawn("order of sensitivities", folder / "input").get("sensitivity", "").split("\n")
        came = [word for word in texts if word in expected]
        check("order of sensitivities", not GNUPLOT or came == expected, expected, came)
        check("order of sensitivities, another than the input's", expected != [row[2] for row in rows], "another", expected)


def test_probes_drawn():
    """The picture of the mechanism shows probes and stiff support directions."""
    probe = "&probe name='it''s {x}_1', position=0.1,0.1 /\n"
    for what, ratio, stiff in (("equal", "", False), ("stiff", "support.stiffness(2)=4e5", True)):
        with Folder(input=ALL + probe) as folder:
            Run(folder, "-q", "input.nml", *(("-s", ratio) if ratio else ())).done(f"probes drawn, {what}")
            texts = drawn(f"probes drawn, {what}", folder / "input").get("mechanism", "")
            check(f"probes drawn, {what}, name", not GNUPLOT or "it's {x}_1" in texts, "it's {x}_1", texts)
            script = (folder / "input" / "mechanism.gp").read_text()
            equal(f"probes drawn, {what}, bold springs", "$stiff using" in script, stiff)


def test_drawing():
    """In the picture links keep their lengths and the crank its angle."""
    with Folder(input=ALL.replace("'stability', 'modes', 'response', 'drawing'", "'drawing'"), given=MASS_FUNCTIONS) as folder:
        Run(folder, "-q", "input.nml").done("drawing")
        equal("drawing, files", bare(folder / "input"), sorted([*CHECKED, "mechanism.csv", "mechanism.gp"]))
        table = Table(folder / "input" / "mechanism.csv")
        parts = ("joint(A0)", "joint(B0)", "joint(A)", "joint(B)", "link(crank)", "link(coupler)", "link(rocker)")
        equal("drawing, header", table.header, ",".join(["crank_deg", *(f"{part}.{axis}_m" for part in parts for axis in "xy"), *(
            f"{part}.{name}" for part in parts for name in ("vx_m_s", "vy_m_s", "ax_m_s2", "ay_m_s2"))]))
        equal("drawing, angles", table["crank_deg"], [float(i) for i in range(361)])

        def at(part):
            return [complex(x, y) for x, y in zip(table[f"{part}.x_m"], table[f"{part}.y_m"])]

        a0, b0, a, b = (at(f"joint({name})") for name in ("A0", "B0", "A", "B"))
        # roundoff of coordinates below 1 m
        near("drawing, origin in the frame's system", a0[0], -0.20 + 0.20j, 1e-15)
        near("drawing, second ground joint", b0[100], 0.20 + 0.20j, 1e-15)
        for i in (0, 37, 180, 359):
            near(f"drawing, crank at {i} deg", a[i] - a0[i], 0.07 * complex(math.cos(math.radians(i)), math.sin(math.radians(i))),
                 1e-15)
        series("drawing, coupler", [abs(q - p) for p, q in zip(a, b)], [0.37] * 361, 1e-14)
        series("drawing, rocker", [abs(q - p) for p, q in zip(b0, b)], [0.16] * 361, 1e-14)
        check("drawing, branch", all(((q - p).conjugate() * (r - p)).imag > 0 for p, q, r in zip(a, b0, b)), "B on the left", "right")
        center = [p + 0.18 * (q - p) / abs(q - p) for p, q in zip(a, b)]
        near("drawing, centre of the coupler", max(abs(p - q) for p, q in zip(center, at("link(coupler)"))), 0, 1e-14)
        run = Run(folder, "given.nml", "-s", "case.tasks='drawing'")
        equal("drawing of mass functions", (run.code, "cannot be drawn" in run.err), (2, True))


def test_plot_option():
    """--plot draws all pictures and removes outdated ones."""
    if not GNUPLOT:
        print("skip  --plot: gnuplot is not there (apt-get install gnuplot-nox)")
        return
    endings = ("csv", "gp", "png", "svg")
    names = ("harmonics", "mechanism", "multipliers", "response")
    further = ("force_polar", "transmissibility")
    animation = [f"mechanism_motion.{end}" for end in ("gif", "gp", "svg")]
    every = sorted([*(f"{name}.{end}" for name in names for end in endings), *animation,
                    *(f"{name}.{end}" for name in further for end in endings[1:])])
    with Folder(input=SOUND, given=MASS_FUNCTIONS, sweep=SWEEP + SPEEDS.format(200, 300, 6, "")) as folder:
        run = Run(folder, "input.nml", "--plot")
        run.done("--plot")
        equal("--plot, files", bare(folder / "input"), every)
        check("--plot, report", "pictures in input/, .svg and .png: mechanism, multipliers, response, harmonics, force_polar, "
              "transmissibility\nanimations in input/: mechanism_motion.svg\nVERDICT" in run.out, "the pictures", run.out[-200:])
        for name in ("a b", "it's", "-x", "$(touch bad)", "\"q\"", "a;b", "ä"):
            Run(folder, "-q", "--plot", "-o", name, "input.nml").done(f"--plot to {name}")
            equal(f"--plot to {name}, files", bare(folder / name), every)
        equal("--plot, nothing else is run", list(folder.rglob("bad")), [])
        Run(folder, "-q", "input.nml").done("without --plot again")
        equal("outdated pictures are removed", [name for name in bare(folder / "input") if name[-3:] in ("png", "svg")],
              ["mechanism.png", "mechanism.svg", "mechanism_motion.svg"])
        run = Run(folder, "--check", "--plot", "-o", "checked", "input.nml")
        run.done("--check --plot")
        equal("--check --plot, files", bare(folder / "checked"), sorted([*CHECKED, *(f"mechanism.{end}" for end in endings)]))
        check("--check --plot, report", "The input is valid" in run.out and run.out.endswith(": mechanism\n"), "both", run.out[-200:])
        run = Run(folder, "--check", "--plot", "-o", "checked_given", "given.nml")
        run.done("--check --plot of mass functions")
        equal("--check --plot of mass functions, tables alone", bare(folder / "checked_given"), CHECKED)
        Run(folder, "-q", "--plot", "given.nml").done("--plot of mass functions")
        equal("--plot of mass functions, files", bare(folder / "given"),
              sorted([*(f"{name}.{end}" for name in ("harmonics", "multipliers", "response") for end in endings), *animation,
                      *(f"{name}.{end}" for name in further for end in endings[1:])]))
        Run(folder, "-q", "sweep.nml", "--part", "1/1", "-o", "parts").done("one part")
        Run(folder, "-q", "sweep.nml", "--merge", "--plot", "-o", "parts").done("--merge --plot")
        # the growth, and the peaks of three degrees of freedom
        equal("--merge --plot, files", bare(folder / "parts"), sorted(
            [f"sweep.{end}" for end in endings] + [f"sweep_{i}.{end}" for i in (2, 3, 4) for end in endings[1:]]))
        for option in (["--part", "1/2"], ["--one-line"]):
            run = Run(folder, "sweep.nml", *option, "--plot", "-o", "none")
            equal(f"{option[0]} --plot", (run.code, "exclude each other" in run.err, bare(folder / "none")), (1, True, []))


def test_names():
    """Names of parts appear as plain text in every picture."""
    text = """&case tasks='design','drawing','sensitivity','resonance' /
&drive speed_rpm=300.0 /
&joint name='O', type='ground', position=0.0,0.0 /
&joint name='A', type='crank', pivot='O', radius=0.05 /
&link name='{0}', from='O', to='A', mass=2.0, inertia=0.01, center=0.01,0.0 /
&frame mass=40.0, inertia=1.5, origin=0.0,0.1 /
&support position=-0.3,-0.2, stiffness=1e5,2e5, damping=200.,300. /
&support position=0.3,-0.2, stiffness=1e5,2e5, damping=200.,300. /
&probe name='{0}', position=0.1,0.1 /
&design parameter='link({0}).center(1)', from=-0.1, to=0.1 /
&objective quantity='probe({0}).v', measure='rms' /
&constraint quantity='probe({0}).v', measure='band', at_most=1000 /
&resonance quantities='probe({0}).v' /
&sweep parameter='drive.speed_rpm', from=200, to=300, count=3 /
"""
    for name in ("\\1", "a]]>b", "\u00e9" * 64):
        with Folder(input=text.format(name)) as folder:
            if not Run(folder, "-q", "input.nml").done(f"names {name[:5]}"):
                continue
            shown = name.replace("]]>", "]] >")
            for picture, texts in drawn(f"names {name[:5]}", folder / "input").items():
                if picture in ("design", "design_goals", "sensitivity", "mechanism", "resonance", "peaks"):
                    check(f"names {name[:5]}, {picture}", not GNUPLOT or shown in texts, shown, texts[:300])


def test_no_gnuplot():
    """Without a working gnuplot all tables are still written."""
    with Folder(input=SOUND) as folder:
        (folder / "empty").mkdir()
        run = Run(folder, "input.nml", "--plot", environment={"PATH": str(folder / "empty")})
        equal("no gnuplot", (run.code, run.err), (4, "gnuplot is not installed, so no pictures were drawn (Debian package "
              "gnuplot-nox, or ./bootstrap --with gnuplot); all other files are written\n"))
        check("no gnuplot, report", "pictures in input/, .svg and .png: none\nanimations in" in run.out, "none", run.out[-200:])
        equal("no gnuplot, all other files are written", bare(folder / "input"),
              sorted([*(f"{name}.{end}" for name in ("harmonics", "mechanism", "multipliers", "response") for end in ("csv", "gp")),
                      "force_polar.gp", "transmissibility.gp", "mechanism_motion.gp", "mechanism_motion.svg"]))
        Run(folder, "-q", "input.nml", environment={"PATH": str(folder / "empty")}).done("no gnuplot, no --plot")
        fake = folder / "empty" / "gnuplot"
        fake.write_text("#!/bin/sh\nexit 3\n")
        fake.chmod(0o755)
        run = Run(folder, "-q", "input.nml", "--plot", "-o", "o", environment={"PATH": f"{folder / 'empty'}:{os.environ['PATH']}"})
        equal("gnuplot fails", (run.code, run.err), (4, "o/mechanism.gp: gnuplot cannot draw it (exit code 3); run gnuplot "
              "mechanism.gp in that folder to see why\n"))
        check("gnuplot fails, the tables are written", (folder / "o" / "response.csv").exists(), "response.csv", bare(folder / "o"))


def test_trade():
    """The picture of the trade shows every method."""
    with Folder(input=SOUND.replace("'stability', 'response'", "'trade'")) as folder:
        Run(folder, "-q", "input.nml").done("picture of the trade")
        texts = drawn("picture of the trade", folder / "input").get("trade", "")
        check("picture of the trade, methods", not GNUPLOT or "gauss8" in texts and "time of one solution (s)" in texts, "gauss8", texts)


PLOT_TESTS = (test_scripts, test_titles, test_nothing_to_plot, test_crowded_pictures, test_small_orders, test_sweeps,
              test_fewer_columns, test_borders, test_findings, test_over_speed, test_pictures_in_space, test_many_curves,
              test_zero_forces, test_little_to_show, test_loads_drawn, test_sensitivity, test_sensitivity_order, test_probes_drawn,
              test_drawing, test_plot_option, test_names, test_no_gnuplot, test_trade)
