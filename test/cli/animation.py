"""Animations: what moves in the SVG files, against positions computed here, and the GIF files that gnuplot makes."""

import math
import re
import xml.etree.ElementTree

from harness import Folder, Run, check, equal, near
from plots import GNUPLOT, bare
from space import DATA

SVG = "{http://www.w3.org/2000/svg}"
# A crank on a frame that moves along eta only, on a spring far above the forcing frequency: F moves by -m e w^2 sin / c nearly.
ROTOR = """&case title='{title}', tasks='drawing' /
&drive speed_rpm=60 /
&joint name='O', type='ground', position=0,0 /
&joint name='A', type='crank', pivot='O', radius=0.1 /
&link name='disc', from='O', to='A', mass=1, inertia=0.01, center=0.1,0 /
&frame mass=9, inertia=1, origin=0,0, dof='eta' /
&support position=0,-0.2, stiffness=1e5,4e3, damping=0,0.1 /
{more}"""
TIGHT = "&accuracy tolerance=1e-10 /\n"


def animated(path):
    """Texts of an animation, and its elements with (class, frames): lists of numbers for each instant; one if it does not move."""
    root = xml.etree.ElementTree.fromstring(path.read_bytes())
    texts = ["".join(one.itertext()) for one in root.iter(SVG + "text")]
    elements = []
    for one in root:
        if "class" not in one.attrib:
            continue
        moves = {move.get("attributeName"): move.get("values").split(";") for move in one.iter(SVG + "animate")}
        if one.tag == SVG + "circle":
            pairs = zip(*(moves.get(name, [one.get(name)]) for name in ("cx", "cy")))
            elements.append((one.get("class"), [[int(x), int(y)] for x, y in pairs]))
        else:
            values = moves.get("points", [one.get("points")])
            elements.append((one.get("class"), [[int(x) for x in re.split("[ ,]", value)] for value in values]))
    return texts, elements


def test_rotor():
    """Crank pin and frame move as a single degree of freedom does; the motion is magnified as the caption says."""
    with Folder(input=ROTOR.format(title="Rotor", more=TIGHT)) as folder:
        run = Run(folder, "--plot", "input.nml")
        if not run.done("rotor"):
            return
        check("the last lines name the animation", "animations in input/: mechanism_motion.svg" in run.out, "mechanism_motion", run.out[-300:])
        texts, elements = animated(folder / "input/mechanism_motion.svg")
        w, mass, stiffness, unbalance = 2 * math.pi, 10.0, 4e3, 0.1
        reach = unbalance * w**2 / (stiffness - mass * w**2)
        magnification = 1
        for text in texts:
            found = re.search("motion of the frame magnified ([0-9e+]+) times", text)
            magnification = float(found.group(1)) if found else magnification
        # 1, 2 or 5 times a power of ten, such that the frame moves by at most 6 % of the machine's size, which is 0.3 m
        check("magnification", 0.4 * 0.018 < magnification * reach <= 0.0181, "about 0.018 m", magnification * reach)
        pins = [frames for kind, frames in elements if kind == "pin"]
        equal("pins", [len(frames) for frames in pins], [49, 49])
        center, pin = pins
        # the radius of the crank gives the scale
        scale = math.dist(center[0], pin[0]) / 0.1
        for k in range(49):
            turn = 2 * math.pi * k / 48
            # pixels count downward; each number is rounded to a tenth of a pixel, which is the unit
            near(f"frame at {k}", center[k][1], center[0][1] - scale * magnification * reach * math.sin(turn), 1.5)
            near(f"pin along xi at {k}", pin[k][0] - center[k][0], scale * 0.1 * math.cos(turn), 1.5)
            near(f"pin along eta at {k}", center[k][1] - pin[k][1], scale * 0.1 * math.sin(turn), 1.5)
        check("the ground is at rest", all(len(frames) == 1 for kind, frames in elements if kind == "ground"), "one position", elements)
        springs = [frames for kind, frames in elements if kind == "spring"]
        check("springs move with the frame", any(len(frames) == 49 for frames in springs), "49 positions", len(springs))
        equal("the animation is a loop", [frames[0] for _, frames in elements], [frames[-1] for _, frames in elements])
        if GNUPLOT:
            data = (folder / "input/mechanism_motion.gif").read_bytes()
            equal("GIF", (data[:6], data[-1:]), (b"GIF89a", b";"))
            # a graphic control extension before each picture
            equal("pictures in the GIF", data.count(b"\x21\xf9\x04"), 48)


def test_when():
    """Without --plot, and with --check, there is no animation; without a vibration the frame is at rest."""
    with Folder(input=ROTOR.format(title="Rotor", more="")) as folder:
        Run(folder, "-q", "input.nml").done("no pictures")
        check("no pictures", not any("motion" in name for name in bare(folder / "input")), "no animation", bare(folder / "input"))
        Run(folder, "-q", "--check", "--plot", "-o", "checked", "input.nml").done("check")
        check("check", not any("motion" in name for name in bare(folder / "checked")), "no animation", bare(folder / "checked"))
    loose = ROTOR.replace("damping=0,0.1", "damping=0,0").replace("stiffness=1e5,4e3", f"stiffness=1e5,{10 * 4 * math.pi**2!r}")
    with Folder(input=loose.format(title="Resonance", more="&model frame='rest' /\n")) as folder:
        Run(folder, "-q", "--plot", "input.nml").done("resonance")
        texts, _ = animated(folder / "input/mechanism_motion.svg")
        check("resonance", any("frame at rest" in text for text in texts), "frame at rest", texts)


def test_titles():
    """Titles and names inject nothing."""
    hostile = '</text><script>alert(1)</script> ]]> & "'
    with Folder(input=ROTOR.format(title=hostile, more="")) as folder:
        Run(folder, "-q", "--plot", "input.nml").done("hostile title")
        texts, _ = animated(folder / "input/mechanism_motion.svg")
        check("hostile title", hostile in texts, hostile, texts)
        check("no element is added", b"<script" not in (folder / "input/mechanism_motion.svg").read_bytes(), "no script", "")


def test_modes():
    """Three views of every mode in space; every mode of the plane with its frequency."""
    with Folder(input=ROTOR.format(title="Rotor", more="").replace("'drawing'", "'modes'")) as folder:
        Run(folder, "-q", "--plot", "input.nml").done("modes")
        texts, elements = animated(folder / "input/modes_motion.svg")
        frequency = math.sqrt(4e3 / 10) / (2 * math.pi)
        check("mode", any(text.startswith(f"mode 1: {frequency:.3g} Hz") for text in texts), f"{frequency:.3g} Hz", texts)
        pins = [frames for kind, frames in elements if kind == "pin"]
        middle = [frame[1] for frame in pins[0]]
        near("the mode moves up and down alike", max(middle) - middle[6], middle[6] - min(middle), 1.5)
    with Folder() as folder:
        Run(folder, "-q", "--plot", "-s", "case.tasks=modes", DATA / "khang_four_bar.nml").done("modes of three links")
        if GNUPLOT:
            # each link has a bar and a centre of mass in each of three pictures
            picture = (folder / "khang_four_bar/modes.svg").read_text()
            for colour in "0, 114, 178", "0, 158, 115", "213,  94,   0":
                equal(f"link of colour {colour}", len(re.findall(rf"rgb\( *{re.sub(' +', ' *', colour)}\)", picture)), 6)
    with Folder() as folder:
        Run(folder, "-q", "--plot", "-s", "case.tasks=modes,drawing", DATA / "v_twin.nml").done("modes in space")
        texts, _ = animated(folder / "v_twin/modes_motion.svg")
        for view in ("from the front", "from the left", "from above"):
            equal(view, texts.count(view), 6)


ANIMATION_TESTS = [test_rotor, test_when, test_titles, test_modes]
