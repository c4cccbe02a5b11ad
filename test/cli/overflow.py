"""Results beyond what double precision holds: told in words or refused, never NaN or Infinity without a word."""

import re
from pathlib import Path

from harness import Folder, Run, check, equal, files

DATA = Path(__file__).resolve().parents[2] / "data"


def test_shaking():
    for name, setting in (("flying_press", "drive.speed_rpm=1e200"), ("khang_four_bar", "link(rocker).center=1e160,0")):
        with Folder() as folder:
            run = Run(folder, "--check", "-s", setting, DATA / f"{name}.nml")
            run.done(f"shaking forces, {setting}")
            check(f"shaking forces, {setting}, report", "NaN" not in run.out and "at rest: they lie beyond" in run.out,
                  "words", run.out[-900:])


def test_probe():
    with Folder() as folder:
        run = Run(folder, "-s", "probe.position(1)=-9e241", "-o", "far", DATA / "compressor.nml")
        run.refused("a probe beyond all numbers", 4, re.compile(r"forces, motion of probes or torque overflow: .*"))
        left = files(folder / "far")
        equal("a probe beyond all numbers, files", left, ["harmonics.csv", "multipliers.csv", "response.csv"])
        text = "".join((folder / "far" / name).read_text() for name in left)
        check("a probe beyond all numbers, tables", not re.search("NaN|Infinity", text), "numbers", "others")


OVERFLOW_TESTS = [test_shaking, test_probe]
