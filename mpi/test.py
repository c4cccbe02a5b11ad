"""Sweeps by many ranks write the same table as one process, whatever happens in between.

    ./bootstrap python3 mpi/test.py                   builds gestell and gestell_mpi, then tests
    python3 mpi/test.py GESTELL GESTELL_MPI           tests existing programs

Needs mpifort and mpirun of Open MPI. The last line is "N passed, M failed".
"""

import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.dont_write_bytecode = True
CHECKOUT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(CHECKOUT / "test" / "cli"))

from broken_inputs import REST, SOUND  # noqa: E402
from sweeps import MARK, marks_of  # noqa: E402
from harness import Count, Folder, Run, check, equal, files, title_of  # noqa: E402

# Time limit of a run, far longer than any run takes on a busy computer; it ends runs that hang.
SECONDS = 600
# More ranks than cores, as root too, and ranks that wait leave the core to those that work.
MPI = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMPI_MCA_rmaps_base_oversubscribe": "1",
       "OMPI_MCA_mpi_yield_when_idle": "1", "OMPI_MCA_pml": "ob1", "OMPI_MCA_btl": "self,vader",
       "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
# The distribution of points does not depend on the model; about rest they are quick.
SWEEP = SOUND.replace("'stability', 'response'", "'sweep'") + REST + """\
&sweep parameter='drive.speed_rpm', from=150, to=450, count=24, engine='direct' /
&sweep parameter='support.stiffness', from=1e5, to=4e5, count=30 /
"""
# 3 tiles along the first axis, 4 along the second
TILES = 12


class Ranks(Run):
    """One run of gestell_mpi by some ranks."""

    ranked = None

    def __init__(self, folder, ranks, *arguments):
        self.program = "mpirun"
        super().__init__(folder, *command(ranks, *arguments)[1:], environment=MPI)


def command(ranks, *arguments):
    return ["mpirun", "-q", "-n", str(ranks), Ranks.ranked, *map(str, arguments)]


def table(folder):
    path = folder / "sweep.csv"
    return path.read_bytes() if path.exists() else None


def complete(name, run, folder, expected):
    """Checks that the run succeeded, that the table is right and that nothing else is left."""
    run.done(name)
    check(f"{name}: table", table(folder) == expected, "the bytes of one process", f"others, or none: {files(folder)}")
    equal(f"{name}: files", files(folder), ["sweep.csv"])


def undisturbed(folder):
    run = Run(folder, "-q", "-o", "one", "input.nml")
    run.done("one process")
    return table(folder / "one")


def test_any_number_of_ranks():
    """Any number of ranks writes the table of one process."""
    with Folder(input=SWEEP) as folder:
        expected = undisturbed(folder)
        for ranks in (1, 2, 3, 4):
            complete(f"{ranks} ranks", Ranks(folder, ranks, "-q", "-o", f"n{ranks}", "input.nml"), folder / f"n{ranks}", expected)
        run = Run(folder, "-q", "-o", "one", "--set", "frame.mass=20", "input.nml")
        again = Ranks(folder, 3, "-q", "-o", "set", "--set", "frame.mass=20", "input.nml")
        run.done("--set, one process")
        complete("--set", again, folder / "set", table(folder / "one"))
        check("--set: another machine", table(folder / "one") != expected, "another table", "the same")


def test_more_ranks_than_tiles():
    """More ranks than tiles do no harm."""
    line = SWEEP.replace("count=24", "count=1").replace("to=450", "to=150").replace("count=30", "count=9")
    with Folder(input=line) as folder:
        expected = undisturbed(folder)
        complete("more ranks than tiles", Ranks(folder, 4, "-q", "-o", "n", "input.nml"), folder / "n", expected)


def test_report():
    """Several ranks print the report of one process and their number."""
    with Folder(input=SWEEP) as folder:
        one, many = Run(folder, "-o", "n", "input.nml"), Ranks(folder, 2, "-o", "n", "input.nml")
        many.done("report")
        equal("report: that of gestell and who computed", many.out.replace("  computed by 2 ranks\n", ""), one.out)


def test_parts():
    """Parts computed by ranks and processes merge to one table."""
    with Folder(input=SWEEP) as folder:
        expected = undisturbed(folder)
        Ranks(folder, 2, "-q", "-o", "n", "--part", "2/3", "input.nml").done("part 2 of 3")
        equal("part 2 of 3: its tiles", [*marks_of(folder / "n")], [*range(2, TILES + 1, 3)])
        Ranks(folder, 2, "-q", "-o", "n", "--part", "1/1", "input.nml").done("all, without the table")
        equal("all, without the table: files", files(folder / "n"), ["sweep.blocks"])
        complete("merged", Run(folder, "-q", "-o", "n", "--merge", "input.nml"), folder / "n", expected)


def test_refusals():
    """Invalid input is refused with the message and exit code of gestell."""
    with Folder(input=SWEEP, typo=SWEEP.replace("lengths", "lenghts"), single=SOUND,
                range=SWEEP.replace("from=150", "from=450")) as folder:
        for name in ("typo.nml", "range.nml", "none.nml"):
            one = Run(folder, name)
            many = Ranks(folder, 3, name)
            equal(f"{name}: as gestell", (many.code, many.err, many.out), (one.code, one.err, ""))
        Ranks(folder, 2).refused("no input", 1, "no input file; usage: gestell [options] input.nml (gestell --help lists the options)")
        for option in ("--check", "--fail-if-unstable", "--json", "--merge", "--one-line", "--plot", "--report"):
            Ranks(folder, 2, option, "input.nml").refused(option, 1, "gestell_mpi does not support --check, --fail-if-unstable, --json, "
                                                          "--merge, --one-line, --plot and --report; use gestell")
        Ranks(folder, 2, "single.nml").refused("no sweep", 1, "single.nml: gestell_mpi needs the task 'sweep'; use gestell "
                                               "for other tasks")
        equal("refused: nothing is written", files(folder), ["input.nml", "range.nml", "single.nml", "typo.nml"])
        for option in ("--help", "--version"):
            run = Ranks(folder, 3, option)
            run.done(option)
            equal(f"{option}: said once", run.out.count("usage:" if option == "--help" else "gestell_mpi "), 1)


def children(process):
    """The processes that a process has started, and their children."""
    found = []
    for task in Path(f"/proc/{process}/task").glob("*/children"):
        for child in task.read_text().split():
            found += [int(child), *children(child)]
    return found


def interrupted(folder, output, ranks, wanted, victim):
    """Begins a sweep and kills one rank, or mpirun, as soon as `wanted` tiles are done. Returns whether it was killed in time."""
    process = subprocess.Popen(command(ranks, "-q", "-o", output, "input.nml"), cwd=folder, env={**os.environ, **MPI},
                               stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    begin = time.monotonic()
    while process.poll() is None and len(marks_of(folder / output)) < wanted and time.monotonic() - begin < SECONDS:
        time.sleep(0.002)
    started = children(process.pid) if process.poll() is None else []
    killed = process.pid if victim == "mpirun" else started[victim % len(started)] if started else None
    if killed:
        os.kill(killed, signal.SIGKILL)
    process.wait(SECONDS)
    begin = time.monotonic()
    while any(Path(f"/proc/{child}").exists() for child in started) and time.monotonic() - begin < SECONDS:
        time.sleep(0.01)
    return killed is not None and table(folder / output) is None


def test_killed():
    """A sweep whose ranks are killed resumes and writes the same table."""
    draw = random.Random(6)
    with Folder(input=SWEEP) as folder:
        expected = undisturbed(folder)
        came = 0
        for k, (ranks, victim, then) in enumerate([(2, 0, 3), (2, 1, 2), (3, 1, 0), (2, "mpirun", 4)]):
            name = f"k{k}"
            came += interrupted(folder, name, ranks, draw.randrange(1, TILES - 3), victim)
            if then:
                run = Ranks(folder, then, "-q", "-o", name, "input.nml")
            else:
                run = Run(folder, "-q", "-o", name, "input.nml")
            complete(f"killed ({victim} of {ranks}), finished by {then or 'gestell'}", run, folder / name, expected)
        check("runs were killed before their end", came >= 3, "3 of 4 at least", came)


def limited(folder, name, expected, tile):
    """A run by two ranks that can write no tile from number `tile` on, one of 5, ... 8: file sizes are limited before its last row."""
    head = expected.index(b"\n", expected.index(b"\ndrive.speed_rpm,") + 1) + 1
    width = (len(expected) - head) // (24 * 30)
    # tiles 5 to 8 lie next to each other, of 8 rows of the first axis, 9 to 16, and 7, 8, 7, 8 of the second
    size = head + (15 * 30 + (0, 7, 15, 22)[tile - 5]) * width
    # without files of shared memory, which are longer
    words = ["mpirun", "-q", "--mca", "osc", "pt2pt", "--mca", "btl", "self,tcp", "-n", "2", sys.executable, "-c",
             "import os, resource, signal, sys; signal.signal(signal.SIGXFSZ, signal.SIG_IGN); "
             f"resource.setrlimit(resource.RLIMIT_FSIZE, ({size}, {size})); os.execvp(sys.argv[1], sys.argv[1:])",
             Ranks.ranked, "-q", "-o", name, "input.nml"]
    return subprocess.run(words, cwd=folder, env={**os.environ, **MPI, "OMPI_MCA_btl": "self,tcp"}, stdin=subprocess.DEVNULL,
                          capture_output=True, text=True, timeout=SECONDS)


def test_damaged_and_foreign():
    """Damaged tiles are computed again, foreign ones are refused."""
    with Folder(input=SWEEP) as folder:
        expected = undisturbed(folder)
        Ranks(folder, 2, "-q", "-o", "n", "--part", "1/1", "input.nml").done("all, without the table")
        store = folder / "n" / "sweep.blocks"
        marks, rows = bytearray((store / "marks").read_bytes()), bytearray((store / "rows").read_bytes())
        marks[MARK + 100] ^= 1
        rows[-2] ^= 1
        (store / "marks").write_bytes(marks)
        (store / "rows").write_bytes(rows)
        before = files(store)
        for ranks in (1, 3):
            run = Ranks(folder, ranks, "-q", "-o", "n", "--set", "frame.mass=20", "input.nml")
            check(f"foreign blocks, {ranks} ranks", run.code == 1 and run.err.count("\n") == 1 and "--output" in run.err,
                  "code 1 and one line", (run.code, run.err))
        equal("foreign blocks: nothing is changed", files(store), before)
        run = Ranks(folder, 3, "-q", "-o", "n", "input.nml")
        equal("damaged blocks: one line", (run.code, run.err.count("\n"), "2 damaged tiles" in run.err), (0, 1, True))
        equal("damaged blocks: table", table(folder / "n") == expected, True)


def test_first_error():
    """The error of the lowest tile is reported and ends all ranks."""
    with Folder(input=SWEEP) as folder:
        expected = undisturbed(folder)
        # the first tile that cannot be written is now that of one rank, now that of the other
        for first in (5, 6, 7):
            name = f"n{first}"
            run = limited(folder, name, expected, first)
            check(f"error: the first by number, {first}",
                  run.returncode == 4 and run.stderr.count("\n") == 1 and f"/rows: tile {first}: cannot" in run.stderr,
                  f"code 4 and one line on tile {first}", (run.returncode, run.stderr))
            kept = [*marks_of(folder / name)]
            equal("error: what was done stays, and no rank goes on for long", kept, [*range(1, first)])
        complete("after an error", Ranks(folder, 3, "-q", "-o", "n5", "input.nml"), folder / "n5", expected)


def build(folder):
    """Builds both programs with the same options."""
    for package, compiler in ((".", os.environ.get("FPM_FC", "gfortran")), ("mpi", "mpifort")):
        done = subprocess.run(["fpm", "install", "--profile", "release", "--directory", package, "--prefix", folder],
                              cwd=CHECKOUT, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                              env={**os.environ, "FPM_FC": compiler})
        if done.returncode != 0:
            print(done.stdout)
            sys.exit(f"{package} could not be built")
    return Path(folder, "bin", "gestell"), Path(folder, "bin", "gestell_mpi")


def main():
    for program in ("mpifort", "mpirun"):
        if not shutil.which(program):
            sys.exit(f"no {program}: install the packages libopenmpi-dev and openmpi-bin")
    with tempfile.TemporaryDirectory() as folder:
        Run.program, Ranks.ranked = map(os.path.abspath, sys.argv[1:3] if len(sys.argv) > 2 else build(folder))
        for name, test in list(globals().items()):
            if name.startswith("test_"):
                Count.title = title_of(test)
                test()
    print(f"{Count.passed} passed, {Count.failed} failed")
    return Count.failed > 0


if __name__ == "__main__":
    sys.exit(main())
