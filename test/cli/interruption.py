"""Work that is distributed over threads: any number of threads writes the same bytes, and so does a run resumed after any
interruption."""

import functools
import os
import random
import shutil
import signal
import struct
import subprocess
import time
from pathlib import Path

from stability_borders import DATA, SIEVE
from broken_inputs import REST, SOUND
from critical import NEEDLE
from harness import Folder, Run, check, equal, files, near
from quantities import ROTOR

SPEEDS = "&sweep parameter='drive.speed_rpm', from={}, to={}, count={} /\n"
OVER_SPEED = "'campbell', 'critical', 'resonance'"
YOKE = (DATA.parent / "validation" / "exudyn" / "scotch_yoke.nml").read_text().replace("&case ", "&case tasks='boundary', ")
CASES = {
    "campbell, critical, resonance": NEEDLE.replace("'critical'", OVER_SPEED) + SPEEDS.format(500, 5000, 40),
    # with modes that are locked to orders
    "campbell and critical": SOUND.replace("'stability', 'response'", "'campbell', 'critical'") + REST + SPEEDS.format(150, 900, 20),
    "borders on a line": SIEVE + SPEEDS.format(120, 300, 10),
    # round turning points, of two vibrations
    "borders on branches": YOKE + SPEEDS.format(643, 650, 2),
    "borders on a line, about rest": SIEVE + REST + SPEEDS.format(60, 300, 20),
    "borders in a plane": SIEVE + REST + SPEEDS.format(200, 250, 5) + "&sweep parameter='foundation.damping(3)', from=0.2, to=10,"
                          " count=4 /\n",
    "a level": SOUND.replace("'stability', 'response'", "'boundary'") + REST + SPEEDS.format(250, 330, 5)
               + "&boundary quantity='f', level=300 /\n",
    "a level in a plane": ROTOR.replace("'sweep'", "'boundary'") + SPEEDS.format(300, 900, 4) + "&sweep "
                          "parameter='support(1).stiffness(1)', from=4e4, to=2e5, count=3 /\n&boundary quantity='fx', level=1000 /\n",
    "sensitivity": SOUND.replace("'stability', 'response'", "'sensitivity'"),
}
# Threads share the speeds and maxima of a design with one start; it keeps no journal.
DESIGNS = {"a design over a range": SOUND.replace("'stability', 'response'", "'design'") + REST + SPEEDS.format(200, 300, 4) + """\
&design parameter='support.stiffness', from=1e5, to=4e5, starts=1 /
&design parameter='foundation.damping(3)', from=0.5, to=20 /
&objective quantity='f', measure='peak' /
&constraint quantity='support(1).fy', at_most=100 /
"""}
# The record of a piece begins with "gestell" and 2.
MAGIC = 0x67657374656C6C02.to_bytes(8, "little")


def contents(folder):
    return {name: (folder / name).read_bytes() for name in files(folder) if Path(name).suffix in (".csv", ".gp")}


def journal(folder):
    """The journal that a run keeps while it goes on; it may disappear if the run ends."""
    try:
        return (folder / ".gestell-1" / "journal").read_bytes()
    except FileNotFoundError:
        return b""


@functools.cache
def undisturbed(what, threads="1", stack="8M"):
    """The tables, the report and the names of all files of a run that is not interrupted."""
    with Folder(input=(CASES | DESIGNS)[what]) as folder:
        run = Run(folder, "-o", "out", "input.nml", environment={"OMP_NUM_THREADS": threads, "OMP_STACKSIZE": stack})
        run.done(f"{what}, {threads} threads")
        return contents(folder / "out"), run.out, sorted(path.name for path in (folder / "out").iterdir())


def test_threads():
    """Any number of threads writes the same bytes."""
    for what in CASES | DESIGNS:
        tables, report, _ = undisturbed(what)
        check(f"{what}: tables exist", any(name.endswith(".csv") for name in tables), "some", sorted(tables))
        # two of them with the smallest stacks that the program accepts
        for threads, stack in (("2", "256k"), ("3", "8M")):
            others, other_report, _ = undisturbed(what, threads, stack)
            names = [name for name, data in tables.items() if others.get(name) != data]
            equal(f"{what}, {threads} threads: files that differ from those of one", names, [])
            equal(f"{what}, {threads} threads: report as of one", other_report == report, True)


def killed(folder, output, more):
    """Kills a run as soon as its journal has grown by so many bytes, unless it has already written its tables. Returns the exit code,
    the error output and the journal."""
    before = len(journal(folder / output))
    run = subprocess.Popen([Run.program, "-q", "input.nml", "-o", output], cwd=folder, stderr=subprocess.PIPE,
                           env={**os.environ, "OMP_NUM_THREADS": "2"})
    while run.poll() is None and len(journal(folder / output)) < before + more:
        time.sleep(0.001)
    if run.poll() is None:
        # the run is stopped, so that nothing changes between reading the journal and the kill
        run.send_signal(signal.SIGSTOP)
        keeping = len(journal(folder / output)) >= before + more and files(folder / output) == [".gestell-1"]
        run.send_signal(signal.SIGKILL if keeping else signal.SIGCONT)
    message = run.communicate()[1]
    return run.returncode, message, journal(folder / output)


def kept_of(what, folder, least):
    """The results kept by a killed run, at least so many bytes. A run that ends before it can be killed is repeated."""
    code, kept = 0, b""
    for _ in range(20):
        shutil.rmtree(folder / "out", ignore_errors=True)
        code, _, kept = killed(folder, "out", least)
        if code != 0:
            break
    equal(f"{what}: killed", code, -signal.SIGKILL)
    return kept


def test_killed():
    """A run killed again and again finally writes the same bytes."""
    chance = random.Random(16)
    for what, text in CASES.items():
        with Folder(input=text) as folder:
            right, _, names = undisturbed(what)
            kept, now, kills = b"", b"", 0
            for _ in range(200):
                code, message, now = killed(folder, "out", chance.randrange(1, 300 + len(now)))
                if code == 0:
                    break
                kills += 1
                equal(f"{what}: killed", (code, message), (-signal.SIGKILL, b""))
                if code != -signal.SIGKILL:
                    break
                equal(f"{what}: no results are written", files(folder / "out"), [".gestell-1"])
                check(f"{what}: kept results are used", now.startswith(kept), f"the {len(kept)} bytes and more", len(now))
                kept = now[:now.rfind(MAGIC)]
            check(f"{what}: runs were killed", kills > 0, "at least once", kills)
            equal(f"{what}: files after {kills} kills", contents(folder / "out") == right, True)
            equal(f"{what}: no temporary files are left", sorted(path.name for path in (folder / "out").iterdir()), names)


def test_pieces_are_read():
    """Results kept from a killed run are not computed again.

    A kept number that was changed together with its checksum appears in the table.
    """
    with Folder(input=CASES["campbell, critical, resonance"]) as folder:
        kept = kept_of("kept", folder, 30000)
        records = [bytearray(MAGIC + record) for record in kept.split(MAGIC)[1:]]
        # a speed's point of the Campbell diagram: head of three words, round, piece, words, speed; which of them are kept first is
        # chance
        point = next(record for record in records if record[24:32] == (1).to_bytes(8, "little"))
        piece, (speed,) = int.from_bytes(point[32:40], "little"), struct.unpack("<d", point[48:56])
        near("kept: the speed", speed, 500 + 4500 * (piece - 1) / 39, 1e-9)
        point[48:56] = struct.pack("<d", speed - 1)
        point[-8:] = checksum(point[:-8])
        (folder / "out" / ".gestell-1" / "journal").write_bytes(b"".join(records))
        Run(folder, "-q", "input.nml", "-o", "out").done("kept: after a kill")
        rows = [line for line in contents(folder / "out")["campbell.csv"].decode().splitlines() if line[0] != "#"]
        speeds = sorted({float(row.split(",")[0]) for row in rows[1:]})
        equal("kept: the changed speed", speeds[piece - 1], speed - 1)


def checksum(data):
    """The checksum of src/base/hash.f90."""
    value = 0x4BF29CE484222325
    for i in range(0, len(data), 8):
        value = (value ^ int.from_bytes(data[i:i + 8], "little")) * (2**40 + 435) % 2**64
        value ^= value >> 29
    return value.to_bytes(8, "little")


def test_damaged_and_foreign():
    """Damaged intermediate results are computed again, foreign ones are ignored."""
    note = "note: out: the journal of an interrupted run is damaged; its damaged part is computed again\n"
    with Folder(input=CASES["campbell, critical, resonance"]) as folder:
        right = undisturbed("campbell, critical, resonance")[0]
        kept = kept_of("damaged", folder, 30000)
        place = folder / "out" / ".gestell-1"
        cases = [("torn", kept[:len(kept) // 2], ""), ("torn in a head", kept[:kept.rfind(MAGIC) + 12], ""), ("empty", b"", ""),
                 ("a bit of a number", kept[:20000] + bytes([kept[20000] ^ 1]) + kept[20001:], note),
                 ("a bit of the head", bytes([kept[0] ^ 128]) + kept[1:], note),
                 ("zeros", bytes(len(kept)), note), ("a text", b"gestell " * 1000, note)]
        for what, data, message in cases:
            place.mkdir(exist_ok=True)
            (place / "made_by_gestell").touch()
            (place / "journal").write_bytes(data)
            run = Run(folder, "-q", "input.nml", "-o", "out")
            equal(f"damaged, {what}", (run.code, run.err), (0, message))
            equal(f"damaged, {what}: files", contents(folder / "out") == right, True)
        for what, options in (("another machine", ["-s", "frame.mass=23"]), ("no such task", ["-s", "case.tasks=stability"])):
            for output in ("out", "other"):
                (folder / output / ".gestell-1").mkdir(parents=True, exist_ok=True)
                (folder / output / ".gestell-1/made_by_gestell").touch()
            (place / "journal").write_bytes(kept)
            for output in ("out", "other"):
                Run(folder, "-q", "input.nml", "-o", output, *options).done(f"foreign, {what}, {output}")
            equal(f"foreign, {what}: files", contents(folder / "out") == contents(folder / "other"), True)
            equal(f"foreign, {what}: no temporary files are left", (folder / "out" / ".gestell-1").exists(), False)
            for output in ("out", "other"):
                shutil.rmtree(folder / output)


INTERRUPTION_TESTS = (test_threads, test_killed, test_pieces_are_read, test_damaged_and_foreign)
