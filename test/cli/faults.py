"""Faults of the system: every writing call fails once, full disks, closed streams, kills, small stacks, odd names."""

import errno
import os
import re
import resource
import shutil
import signal
import subprocess
import tempfile
from pathlib import Path

from broken_inputs import REST, SOUND
from harness import Folder, Run, check, equal

GNUPLOT = shutil.which("gnuplot")
SMALL = "&response points=4, harmonics=2 /\n"
PROBES = "&probe name='foot', position=-0.3,-0.2, limit_mm_s=2 /\n"
SPEEDS = "&sweep parameter='drive.speed_rpm', from={}, to={}, count={} /\n"
SIEVE = """&case title='Rocking', tasks='boundary' /
&drive speed_rpm=229 /
&joint name='O', type='ground', position=0,0 /
&joint name='A', type='crank', pivot='O', radius=0.12 /
&link name='eccentric', from='O', to='A', mass=9, inertia=0.02, center=0.12,0 /
&frame mass=40, inertia=2, origin=0.5,0, dof='psi' /
&foundation stiffness=8*0,630, damping=0,0,1.5 /
"""


def with_tasks(tasks, groups="", text=SOUND):
    return text.replace("'stability', 'response'", tasks) + groups


ALL = with_tasks("'stability', 'modes', 'response', 'forces', 'power', 'drawing'", SMALL + PROBES)
CASES = {
    "all tasks": (ALL, ()),
    "sweep": (with_tasks("'stability', 'sweep'", SPEEDS.format(200, 300, 5)), ()),
    "borders": (SIEVE + SPEEDS.format(200, 250, 5) + REST, ()),
    "over the speed": (with_tasks("'campbell', 'critical'", SPEEDS.format(200, 260, 3) + REST + "&resonance orders=1 /\n"), ()),
    "resonance": (with_tasks("'resonance'", SPEEDS.format(235, 240, 2) + "&resonance quantities='f', orders=1 /\n"), ()),
    "sensitivity": (with_tasks("'sensitivity'", "&sensitivity parameters='frame.mass', quantities='f' /\n"), ()),
    "vibrations": (with_tasks("'stability'", "&model vibrations='all' /\n"), ()),
    "flywheel": (with_tasks("'power'", SMALL).replace("&drive ", "&drive held_by='flywheel', flywheel_inertia=3.0, ", 1), ()),
    "page": (with_tasks("'stability'"), ("--report",)),
}
# Whole pictures, or their begin, in place of gnuplot's.
DRAWS = "#!/bin/sh\nname=${2%.gp}\ncase $name in *_motion) printf 'GIF89a;' >$name.gif; exit;; esac\nprintf '<svg>%s</svg>\\n' \"$name\" >$name.svg\nprintf 'PNG of %s IEND....' \"$name\" >$name.png\n"
BREAKS_OFF = DRAWS.replace("</svg>", "").replace("IEND", "").replace("GIF89a;", "GIF89a")


class Library:
    """The library that makes calls fail, built once; none where there is no compiler of C."""

    path = None

    @classmethod
    def build(cls, folder):
        compiler = shutil.which("gcc") or shutil.which("cc")
        if not compiler:
            print("skip  faults at every call: there is no compiler of C")
            return False
        cls.path = os.path.join(folder, "faults.so")
        source = Path(__file__).resolve().parent / "faults.c"
        done = subprocess.run([compiler, "-shared", "-fPIC", "-O1", "-o", cls.path, str(source), "-ldl"], capture_output=True)
        check("faults.c compiles", done.returncode == 0, "a library", done.stderr.decode())
        return done.returncode == 0


def faulty(folder, arguments, output, path="", **faults):
    """A run with injected faults below `output`."""
    environment = {"LD_PRELOAD": Library.path, "FAULT_PROGRAM": os.path.basename(Run.program), "FAULT_FOLDER": output}
    environment |= {f"FAULT_{name.upper()}": str(value) for name, value in faults.items()}
    if path:
        environment["PATH"] = f"{path}:{os.environ['PATH']}"
    return Run(folder, *arguments, "-o", output, environment=environment)


def contents(folder):
    """The files in a folder with their bytes, and the names of its other entries."""
    if not folder.is_dir():
        return {}, []
    there = {path.name: path for path in folder.iterdir()}
    files = {name: path.read_bytes() for name, path in there.items() if path.is_file() and not name.startswith(".")}
    return files, sorted(set(there) - set(files))


class Scene:
    """A case in its folder: an older result in `old`, a new one in `new`."""

    def __init__(self, what, folder, options):
        self.what, self.folder = what, folder
        gnuplot = folder / "bin" / "gnuplot"
        gnuplot.parent.mkdir()
        gnuplot.write_text(DRAWS)
        gnuplot.chmod(0o755)
        self.path = str(gnuplot.parent)
        self.arguments = ["-q", "input.nml", *options]
        environment = {"PATH": f"{self.path}:{os.environ['PATH']}"}
        mass = [*self.arguments, "--set", "frame.mass=19", "--set", "case.title=old"]
        for name, words in (("old", mass), ("new", self.arguments)):
            # the page names the folder
            Run(folder, *words, "-o", "out", environment=environment).done(f"{what}: the {name} result")
            (folder / "out").rename(folder / name)
        self.old, self.new = (contents(folder / name)[0] for name in ("old", "new"))
        check(f"{what}: the results differ", self.old.keys() == self.new.keys() and
              all(self.old[name] != self.new[name] for name in self.old if name.endswith(".csv")), "others", sorted(self.new))

    def begin(self):
        """A folder with the old result."""
        shutil.rmtree(self.folder / "out", ignore_errors=True)
        shutil.copytree(self.folder / "old", self.folder / "out")

    def run(self, **faults):
        return faulty(self.folder, self.arguments, "out", self.path, **faults)

    def count(self, **faults):
        self.begin()
        number = self.folder / "count"
        self.run(count=number, **faults).done(f"{self.what}: counted")
        return int(number.read_text())

    def judge(self, what, run, kept=()):
        """The exit code and one line; all old or all new files, and nothing else but what is `kept`."""
        found, others = contents(self.folder / "out")
        # if every further call fails, renamed files cannot be restored, and the message says so
        good = found == (self.new if run.code == 0 else self.old) or "have already replaced older files" in run.err
        wrong = [name for name in sorted(found.keys() | self.old.keys()) if found.get(name) not in (self.old.get(name),
                                                                                                  self.new.get(name))]
        lines = run.err.count("\n")
        check(f"{what}: code and line", (run.code, lines) in ((0, 0), (4, 1), (1, 1)), "0, or 4 or 1 with a line", (run.code, run.err))
        check(f"{what}: files", good and not wrong, "all new with 0, else all old", (run.code, wrong, run.err))
        check(f"{what}: nothing left", set(others) <= set(kept), sorted(kept), others)
        if run.code:
            check(f"{what}: the line", re.fullmatch(r".*(out|standard output).*: .*(space|error|quota).*\n", run.err), "what and why",
                  run.err)
            check(f"{what}: the message does not show the temporary place", ".gestell" not in run.err, "the file's own place", run.err)


def test_every_call():
    """If any file operation fails, all old results or all new ones remain.

    Each call that creates, writes, closes or renames fails once, and every fourth also from then on.
    """
    with tempfile.TemporaryDirectory() as place:
        if not Library.build(place):
            return
        for what, (text, options) in CASES.items():
            with Folder(input=text) as folder:
                scene = Scene(what, folder, options)
                calls = scene.count()
                check(f"{what}: calls", calls > 3 * len(scene.new), "some", calls)
                for n in range(1, calls + 1):
                    number = (errno.ENOSPC, errno.EIO, errno.EDQUOT)[n % 3]
                    for sticky in ("", "1")[:1 + (n % 4 == 0)]:
                        scene.begin()
                        run = scene.run(at=n, errno=number, sticky=sticky)
                        # finished tiles are kept
                        scene.judge(f"{what}, call {n} of {calls}{' and later' * bool(sticky)}", run, kept=["sweep.blocks"])
                if what == "sweep":
                    run = Run(folder, *scene.arguments, "-o", "out")
                    run.done("sweep after a fault")
                    equal("sweep after a fault, files", contents(folder / "out"), (scene.new, []))


def test_short_and_killed():
    """A killed run leaves either all old results or all new ones.

    Half a write is done; the process is killed at any call; the folder disappears; another run intervenes.
    """
    with tempfile.TemporaryDirectory() as place:
        if not Library.build(place):
            return
        with Folder(input=with_tasks("'stability', 'response'", SMALL)) as folder:
            scene = Scene("a run", folder, ())
            calls = scene.count()
            for n in range(1, calls + 1):
                scene.begin()
                scene.judge(f"short write at call {n}", scene.run(at=n, errno=errno.ENOSPC, short=1))
                scene.begin()
                run = scene.run(at=n, kill=1)
                found, others = contents(folder / "out")
                equal(f"killed at call {n}", run.code, -signal.SIGKILL)
                check(f"killed at call {n}: either old or new results", found.keys() == scene.old.keys() and all(
                    found[name] in (scene.old[name], scene.new[name]) for name in found), "whole files", sorted(found))
                check(f"killed at call {n}: one folder is left", others in ([], [".gestell-1"]), "at most one", others)
                Run(folder, *scene.arguments, "-o", "out").done(f"after a kill at call {n}")
                equal(f"after a kill at call {n}: no temporary files are left", contents(folder / "out"), (scene.new, []))
            for n in range(1, calls + 1):
                scene.begin()
                run = scene.run(at=n, command="rm -r out")
                check(f"folder removed at call {n}", (run.code, run.err.count("\n")) in ((4, 1), (1, 1), (0, 0)), "a line",
                      (run.code, run.err))
            # the other run ends during this run's calls: its files come first, then this run's. The first four calls create folders, one run at a time
            for n in range(5, calls + 1, 5):
                scene.begin()
                run = scene.run(at=n, command=f"'{Run.program}' -q --set case.title=other -o out input.nml")
                run.done(f"another run at call {n}")
                found, others = contents(folder / "out")
                titles = {data.split(b"\n")[0] for name, data in found.items() if name.endswith(".csv")}
                check(f"another run at call {n}: whole files", titles <= {b"# title: other", b"# title: four-bar"} and others == []
                      and found.keys() == scene.new.keys(), "whole files", (titles, others))


def test_standard_output():
    """Failing standard output is reported and costs no file."""
    sweep = with_tasks("'sweep'", SPEEDS.format(200, 300, 3))
    runs = {"report": ["input.nml"], "--check": ["--check", "input.nml"], "--help": ["--help"], "--version": ["--version"],
            "--one-line": ["--one-line", "input.nml"], "sweep": ["sweep.nml"], "one line of a sweep": ["--one-line", "sweep.nml"]}
    with Folder(input=SOUND, sweep=sweep) as folder:
        for what, words in runs.items():
            for stream in ("full", "closed", "nobody reads"):
                shutil.rmtree(folder / "out", ignore_errors=True)
                options = [*words, "-o", "out"] if "nml" in words[-1] else words
                reason = {"full": "No space left on device", "closed": "Bad file descriptor", "nobody reads": "Broken pipe"}[stream]
                if stream == "full":
                    with open("/dev/full", "wb") as full:
                        run = Run(folder, *options, stdout=full)
                elif stream == "closed":
                    run = Run(folder, *options, stdout=None, preexec_fn=lambda: os.close(1))
                else:
                    reader, writer = os.pipe()
                    os.close(reader)
                    run = Run(folder, *options, stdout=writer, restore_signals=True)
                    os.close(writer)
                run.refused(f"{what}, {stream}", 4, f"standard output cannot be written: {reason}")
                names = {"report": ["harmonics.csv", "multipliers.csv", "response.csv"], "sweep": ["sweep.csv"]}.get(what, [])
                found = [name for name in sorted(contents(folder / "out")[0]) if name.endswith(".csv")]
                equal(f"{what}, {stream}: files", (found, contents(folder / "out")[1]), (names, []))
    with tempfile.TemporaryDirectory() as place, Folder(input=SOUND) as folder:
        if not Library.build(place):
            return
        number = folder / "count"
        faulty(folder, ["input.nml"], "out", stdout=1, count=number).done("writes to standard output")
        for n in range(1, int(number.read_text()) + 1):
            run = faulty(folder, ["input.nml"], "out", stdout=1, at=n, errno=errno.EIO, short=n % 2 or "")
            check(f"write {n} to standard output fails", run.code == 4 and re.fullmatch(
                "standard output cannot be written: (Input/output error|No space left on device)\n", run.err), "4", (run.code, run.err))
            equal(f"write {n} to standard output fails: files", len(contents(folder / "out")[0]), 8)


def limited(kind, size):
    return lambda: resource.setrlimit(kind, (size, size))


def test_limits():
    """Limits on file size, path length and stack are reported in one line."""
    with Folder(input=SOUND, sweep=with_tasks("'sweep'", SPEEDS.format(200, 300, 3))) as folder:
        Run(folder, "-q", "input.nml", "-o", "out").done("before the limit")
        before = contents(folder / "out")
        run = Run(folder, "-q", "-s", "frame.mass=19", "input.nml", "-o", "out", preexec_fn=limited(resource.RLIMIT_FSIZE, 40960))
        run.refused("a file beyond the limit", 4, "out/response.csv: cannot be written: File too large")
        equal("a file beyond the limit: the old result remains", contents(folder / "out"), before)
        for name in ("x" * 5000, "x/" * 2500, "x" * 300):
            run = Run(folder, "-q", "input.nml", "-o", name)
            check("a long path", run.code == 1 and run.err.count("\n") == 1 and len(run.err) < 1300 and "File name too long" in run.err,
                  "a short line", (run.code, len(run.err), run.err[:300]))
        # the folder is checked before anything is computed: this sweep would take years
        run = Run(folder, "--set", "case.tasks=sweep", "--set", "sweep.count=100000000", "sweep.nml", "-o", "input.nml/x")
        check("the folder is checked first", (run.code, run.out) == (1, "") and "cannot be created: Not a directory" in run.err, 1, run.err)
        Run(folder, "-q", "input.nml", "-o", "o", preexec_fn=limited(resource.RLIMIT_STACK, 256 * 1024)).done("a small stack")
        for name in ("input.nml", "sweep.nml"):
            Run(folder, "-q", name, "-o", "o", environment={"OMP_NUM_THREADS": "2", "OMP_STACKSIZE": "256k"}).done("small stacks")
        run = Run(folder, "-q", "input.nml", preexec_fn=limited(resource.RLIMIT_STACK, 100 * 1024))
        run.refused("too small a stack", 1, "the stack is limited to 100 kB, but 256 kB are needed; set a larger limit with ulimit -s 8192")
        for size, kilobytes in (("40K", 40), ("50", 50), (" 32768 b", 32)):
            run = Run(folder, "-q", "input.nml", environment={"OMP_STACKSIZE": size})
            run.refused(f"too small stacks, {size}", 1, f"OMP_STACKSIZE is {kilobytes} kB, but every thread needs 256 kB")
        for size in ("1M", "1g", "nonsense", ""):
            run = Run(folder, "-q", "input.nml", "-o", "o", environment={"OMP_STACKSIZE": size})
            equal(f"OMP_STACKSIZE={size}", run.code, 0)


def test_pictures_break_off():
    """Pictures that gnuplot could not finish are not kept."""
    with Folder(input=SOUND) as folder:
        gnuplot = folder / "gnuplot"
        gnuplot.write_text(BREAKS_OFF)
        gnuplot.chmod(0o755)
        run = Run(folder, "-q", "--plot", "input.nml", "-o", "out", environment={"PATH": f"{folder}:{os.environ['PATH']}"})
        run.refused("pictures break off", 4, "out/mechanism.gp: gnuplot cannot draw it (exit code 0); run gnuplot mechanism.gp in "
                    "that folder to see why")
        found, others = contents(folder / "out")
        check("pictures break off: no picture, all other files", not any(name.endswith(("svg", "png", "gif")) for name in found
                                                                             if name != "mechanism_motion.svg") and len(found) == 12
              and others == [], "4 tables, 7 scripts and an animation", sorted(found))


def test_odd_names():
    """Odd names and titles are safe in messages, tables and pictures."""
    for what, name in (("two lines", "a\nb"), ("carriage return", "a\rb"), ("bell", "a\ab"), ("escape", "\033[2J")):
        with Folder(input=SOUND.replace("name='coupler'", f"name='{name}'")) as folder:
            run = Run(folder, "input.nml")
            check(f"name with {what}", run.code == 2 and run.err.count("\n") == 1 and not re.search(r"[\x00-\x09\x0b-\x1f]", run.err),
                  "a line", (run.code, run.err))
    with Folder() as folder:
        run = Run(folder, "--set", "case.title=\033[2J \u009b x", "input.nml")
        check("title with an escape", run.code == 0 and "?[2J ?? x" in run.out and "\033" not in run.out, "none on the terminal",
              (run.code, run.out[:200]))
        run = Run(folder, "--set", "link(coupler).name=a\nb", "input.nml")
        check("name of two lines by --set", run.code in (1, 2) and run.err.count("\n") == 1, "a line", (run.code, run.err))
    with Folder(input=SOUND, long=SOUND.replace("from='A0', to='A'", f"from='{'C' * 5000}', to='A'")) as folder:
        for words in (["no\nfile.nml"], ["--fo\no", "x"], ["long.nml"], ["y" * 5000], ["--" + "z" * 5000], ["-o"] + ["\n" * 3000],
                      ["--set", "a" * 100000 + "=1", "input.nml"], ["--set", "case.title" + " x" * 5000, "input.nml"]):
            run = Run(folder, *words)
            check(f"message on {words[0][:20]!r}", run.code in (1, 2) and run.err.count("\n") == 1 and len(run.err) <= 1300, "a line",
                  (run.code, len(run.err), run.err[:200]))
    names = ["50 %", "%d %s %%", "=cmd|' /C calc'!A0", "+1", "@a", "-x", "a\\b {c}_d ^e"]
    text = SOUND + "".join(f"&probe name='{name.replace(chr(39), chr(39) * 2)}', position=0.{i},0 /\n" for i, name in enumerate(names))
    with Folder(input=text) as folder:
        if not Run(folder, "-q", "input.nml", *(["--plot"] if GNUPLOT else [])).done("odd names"):
            return
        rows = [line for line in (folder / "input" / "probes.csv").read_text().split("\n") if line and not line.startswith("#")][1:]
        expected = ["50 %", "%d %s %%", "'=cmd|' /C calc'!A0", "+1", "'@a", "'-x", "a\\b {c}_d ^e"]
        equal("odd names in the table", [row.split(",")[0] for row in rows], expected)
        if GNUPLOT:
            for name in ("probes", "probes_history"):
                picture = (folder / "input" / f"{name}.svg").read_text().replace("&apos;", "'").replace("&#39;", "'")
                for word in names:
                    check(f"odd names in {name}.svg: {word}", f">{word}<" in picture, word, "not there")


def test_damaged_origin():
    """A message never contains control characters from a damaged file."""
    with Folder(input=with_tasks("'sweep'", SPEEDS.format(200, 300, 3))) as folder:
        Run(folder, "-q", "--part", "1/1", "input.nml").done("one part")
        (folder / "input" / "sweep.blocks" / "origin").write_bytes(b"\033[2J\x9bxx\n0123456789ABCDEF\n")
        run = Run(folder, "-q", "input.nml")
        check("damaged origin", run.code == 1 and "version ?[2J?xx of" in run.err and run.err.isprintable() is False
              and not re.search(r"[\x00-\x09\x0b-\x1f\x7f-\x9f]", run.err), "no control characters", (run.code, run.err))


FAULT_TESTS = (test_every_call, test_short_and_killed, test_standard_output, test_limits, test_pictures_break_off, test_odd_names,
               test_damaged_origin)
