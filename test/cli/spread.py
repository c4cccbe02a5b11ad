"""Work that is spread over threads: the same bytes by any number of them."""

from pathlib import Path

from borders import SIEVE
from broken_inputs import REST, SOUND
from critical import NEEDLE
from harness import Folder, Run, check, equal, files

SPEEDS = "&sweep parameter='drive.speed_rpm', from={}, to={}, count={} /\n"
OVER_SPEED = "'campbell', 'critical', 'resonance'"
# With modes that are locked to orders.
LOCKED = SOUND.replace("'stability', 'response'", "'campbell', 'critical'") + REST + SPEEDS.format(150, 900, 20)
CASES = {
    "campbell, critical, resonance": NEEDLE.replace("'critical'", OVER_SPEED) + SPEEDS.format(500, 5000, 40),
    "campbell and critical": LOCKED,
    "borders on a line": SIEVE + SPEEDS.format(120, 300, 10),
    "borders on a line, about rest": SIEVE + REST + SPEEDS.format(60, 300, 20),
    "borders in a plane": SIEVE + REST + SPEEDS.format(200, 250, 5) + "&sweep parameter='foundation.damping(3)', from=0.2, to=10,"
                          " count=4 /\n",
    "sensitivity": SOUND.replace("'stability', 'response'", "'sensitivity'") + REST,
}


def contents(folder):
    return {name: (folder / name).read_bytes() for name in files(folder) if Path(name).suffix in (".csv", ".gp")}


def test_threads():
    for what, text in CASES.items():
        with Folder(input=text) as folder:
            outputs = {}
            for threads in "123":
                run = Run(folder, "-o", threads, "input.nml", environment={"OMP_NUM_THREADS": threads})
                run.done(f"{what}, {threads} threads")
                outputs[threads] = contents(folder / threads), run.out.replace(f"files in {threads}/", "")
            check(f"{what}: there are tables", any(name.endswith(".csv") for name in outputs["1"][0]), "some", sorted(outputs["1"][0]))
            for threads in "23":
                names = [name for name, data in outputs["1"][0].items() if outputs[threads][0].get(name) != data]
                equal(f"{what}, {threads} threads: files that differ from those of one", names, [])
                equal(f"{what}, {threads} threads: report as of one", outputs[threads][1] == outputs["1"][1], True)
        # as little as the program admits
        with Folder(input=text) as folder:
            Run(folder, "-q", "input.nml", environment={"OMP_NUM_THREADS": "2", "OMP_STACKSIZE": "64k"}).done(f"{what}, small stacks")


SPREAD_TESTS = (test_threads,)
