"""Unusual names of files, references and ends of lines: each yields one line that is safe to print."""

import re
import resource

from broken_inputs import SOUND, changed
from harness import SVG_ONLY, Folder, Run, check, equal

CONTROLS = re.compile(r"[\x00-\x09\x0b-\x1f\x7f-\x9f]")


def test_names_of_files():
    """Unusual file names stay on one line of report, tables and messages."""
    for name, shown, blank in (("a\x7fb.nml", "a?b.nml", "a?b.nml"), ("two\nlines.nml", "two?lines.nml", "two lines.nml"),
                              ("bell\x07.nml", "bell?.nml", "bell .nml"), ("a\u0085b.nml", "a??b.nml", "a??b.nml"),
                              ("m\u00fcller.nml", "m\u00fcller.nml", "m\u00fcller.nml")):
        with Folder() as folder:
            (folder / name).write_text(SOUND)
            run = Run(folder, "--report", "--set", "case.title=a\x7ft", "-o", "out", name, environment=SVG_ONLY)
            head, *lines = run.out.split("\n\n")[1].splitlines()
            equal(f"{shown}, report", (head, lines[0]), ("  title      a?t", f"  input      {shown}"))
            check(f"{shown}, report, control characters", not CONTROLS.search(run.out), "none", repr(run.out[:300]))
            for table in ("multipliers", "response"):
                text = (folder / "out" / f"{table}.csv").read_text()
                head = [line for line in text.splitlines() if line.startswith("#")]
                equal(f"{shown}, {table}.csv", [head[0], head[2]], ["# title: a?t", f"# input: {blank}"])
                check(f"{shown}, {table}.csv, control characters", not CONTROLS.search(text), "none", repr(text[:200]))
            page = (folder / "out" / "report.html").read_text()
            check(f"{shown}, page", shown in page and not CONTROLS.search(page),
                  "the name, no control characters", page[:900])
            run = Run(folder, "--set", "drive.speed_rpm=0", "-o", "out/" + name, name)
            check(f"{shown}, message", run.code == 2 and len(run.err.splitlines()) == 1 and not CONTROLS.search(run.err),
                  "one line", repr(run.err))
    with Folder() as folder:
        run = Run(folder, "-o", "two\nfolders", "input.nml")
        equal("a folder of two lines", run.out.splitlines()[-2], "files in two?folders/")


def test_long_references():
    """References longer than any name are refused in a readable line."""
    long = "of blanks " * 100
    for key, broken in (("from", changed("from='A0'", f"from='{long}'")), ("to", changed("from='A0', to='A'", f"from='A0', to='{long}'")),
                        ("pivot", changed("pivot='A0'", f"pivot='{long}'"))):
        with Folder(input=broken) as folder:
            run = Run(folder, "input.nml")
            run.refused(f"a name of 1000 characters, {key}", 2,
                        re.compile(rf"input\.nml:\d+: &\w+ '\w+': {key} = '.{{57}}\.\.\.': must not be longer than 64 characters"))


def test_characters():
    """Names may have 64 characters, however many bytes these take."""
    for letter in ("x", "\u00e9", "\u65e5", "\U0001d6a8"):
        probe = "&probe name='{0}', position=0.1,0.1 /\n&response quantities='probe({0}).v' /\n"
        with Folder(input=SOUND + probe.format(letter * 64)) as folder:
            if Run(folder, "-q", "input.nml").done(f"64 times {letter}"):
                for table in ("probes", "quantities"):
                    check(f"64 times {letter}, {table}", letter * 64 in (folder / "input" / f"{table}.csv").read_text(), "whole", "cut")
        with Folder(input=SOUND + probe.format(letter * 65)) as folder:
            Run(folder, "input.nml").refused(f"65 times {letter}", 2, re.compile("input.nml:16: &probe '.*must not be longer than 64 characters"))


def test_long_title():
    """A title of any length works with the smallest permitted stack."""
    with Folder(input=SOUND.replace("'four-bar'", f"'{'T' * 300000}'")) as folder:
        run = Run(folder, "--json", "input.nml", preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_STACK, (2**18, resource.RLIM_INFINITY)))
        run.done("a long title")
        check("a long title, report", "T" * 300000 in run.out, "whole", run.out[-200:])


def test_controls_of_two_bytes():
    """Two-byte control characters in names are refused."""
    with Folder(input=SOUND + "&probe name='a\u0085b', position=0,0 /\n") as folder:
        Run(folder, "input.nml").refused("a control character of two bytes in a name", 2, "input.nml:16: &probe 'a??b': name = 'a??b': "
                                         "must not contain control characters, such as line ends")


def test_carriage_return():
    """A carriage return within a line is refused with its line number.

    The number is the one that grep counts. Lines that end with CR LF are accepted.
    """
    for name, broken, line in (("in a comment", SOUND.replace("&drive", "! one\rtwo\n&drive"), 2),
                               ("alone", SOUND.replace("\n", "\r"), 1), ("between", SOUND.replace("= 240.0 /\n", "= 240.0\r/\n"), 2)):
        with Folder() as folder:
            (folder / "input.nml").write_bytes(broken.encode())
            Run(folder, "input.nml").refused(f"a carriage return {name}", 2, f"input.nml:{line}: a carriage return within a line")
    with Folder() as folder:
        (folder / "input.nml").write_bytes((SOUND + "&drve /\n").replace("\n", "\r\n").encode())
        Run(folder, "input.nml").refused("lines that end with CR LF", 2, "input.nml:16: unknown group &drve: did you mean &drive?")


def test_hash_name():
    """A row whose name begins with # is not taken for a comment."""
    with Folder(input=SOUND + "&probe name='#1', position=0.1,0.2 /\n") as folder:
        if Run(folder, "-q", "-o", "out", "input.nml").done("a probe named #1"):
            lines = (folder / "out" / "probes.csv").read_text().splitlines()
            equal("a probe named #1", [line[:5] for line in lines if line[0] != "#"][1:], ['"#1",'])


def test_zero_speed():
    """A range of speeds for borders must not contain zero."""
    one, two = (f"&sweep parameter='{path}, count=3 /\n" for path in ("drive.speed_rpm', from=125.0, to=-125.0",
                                                                    "frame.inertia', from=0.7, to=0.8"))
    for sweeps, line, name in ((one, 16, "&sweep"), (two + one, 17, "&sweep 2")):
        with Folder(input=changed("'stability', 'response'", "'boundary'") + sweeps.replace("count=3", "count=4")) as folder:
            Run(folder, "input.nml").refused(f"borders over speeds through zero, {name}", 2, f"input.nml:{line}: {name}: to = "
                                             "-125.0: the range must not include standstill: 'from' and 'to' must have the same sign")


UNUSUAL_NAME_TESTS = [test_names_of_files, test_long_references, test_characters, test_long_title, test_controls_of_two_bytes, test_carriage_return, test_hash_name, test_zero_speed]
