"""The layout of the report: its width, its first and last words, and what only --verbose adds."""

import json
import re
import shutil
from pathlib import Path

from harness import SVG_ONLY, Folder, Run, check, equal

DATA = Path(__file__).resolve().parents[2] / "data"
# Fewer points for large sweeps; the width of the tables does not change.
FEWER = {"khang_chart": "sweep.count=20", "khang_speeds": "sweep.count=9 sweep.to=400", "sieve_borders": "sweep.count=9"}
EVERY = {"compressor": "case.tasks='stability','modes','response','forces','power','drawing','sensitivity'",
         "watt_six_bar": "case.tasks='trade'"}
DIAGNOSTICS = ("relative error of Phi(T) at most ", "Liouville's defect", "motion repeats after a turn within",
               "power balance: the mean powers of drive and dampers differ by")
WIDEST = 80


def narrow(what, report):
    """Checks that no line is wider than a terminal."""
    wide = [line for line in report.splitlines() if len(line) > WIDEST]
    check(f"{what}: at most {WIDEST} columns", not wide, WIDEST, "\n".join(f"{len(line)}: {line}" for line in wide))


def test_width():
    """No line of a report is wider than a terminal."""
    for path in sorted(DATA.glob("*.nml")):
        settings = " ".join(group[path.stem] for group in (FEWER, EVERY) if path.stem in group).split()
        settings = [word for setting in settings for word in ("-s", setting)]
        with Folder() as folder:
            shutil.copy(path, folder)
            # --verbose prints everything (test_verbose)
            for option in ("--verbose", "--check"):
                run = Run(folder, option, *settings, path.name)
                what = f"{path.name} {option}"
                if run.done(what):
                    narrow(what, run.out)


def test_long_names():
    """Long names are printed completely."""
    name = "bearing_of_the_crank_shaft_beside_the_motor_and_next_to_the_wall"
    equal("the longest name", len(name), 64)
    with Folder() as folder:
        text = (DATA / "compressor.nml").read_text().replace("'bearing'", f"'{name}'")
        (folder / "long.nml").write_text(text)
        run = Run(folder, "-s", "case.tasks='response','forces'", "long.nml")
        run.done("a long name")
        check("a long name is whole", run.out.count(name) >= 3, "three times", run.out)
        narrow("a long name", run.out)


def test_last_line():
    """The last line of the report shows the verdict and exceeded limits."""
    with Folder() as folder:
        run = Run(folder, DATA / "compressor.nml")
        lines = run.out.splitlines()
        limit = "bearing: 213.7 mm/s, 11.9 times the limit of 18 mm/s"
        equal("the last line", lines[-1], f"VERDICT  stable; {limit}")
        first = next(i for i, line in enumerate(lines) if line.startswith("VERDICT"))
        equal("the exceeded limit below the first verdict", lines[first + 1], f"  {limit}")
        # with a third limit there is no room for all
        more = Run(folder, "-s", "probe(foot).limit_mm_s=20", DATA / "compressor.nml").out.splitlines()
        equal("two limits", more[-1], f"VERDICT  stable; {limit}; 1 warning above")
        for task, last in (("campbell", "VERDICT  stable at all speeds"), ("resonance", "VERDICT  stable at all speeds; 1 warning above"),
                           ("sweep", "Sweep: 9 points, 9 stable")):
            run = Run(folder, "-s", f"case.tasks='{task}'", "-s", "sweep.count=9", DATA / "khang_speeds.nml")
            equal(f"the last line of {task}", run.out.splitlines()[-1], last)
        # without verdicts the last line names the largest multiplier
        for machine, options, last in (
                ("khang_chart", ["sweep.count=3"], r"Sweep: 9 points, largest multiplier \|rho\| = [\d.]+$"),
                ("sieve_borders", ["case.tasks='sweep'", "sweep.count=12"], r"Sweep: 144 points, \d+ stable, \d+ unstable$")):
            settings = [word for one in options for word in ("-s", one)]
            line = Run(folder, *settings, DATA / f"{machine}.nml").out.splitlines()[-1]
            check(f"the last line of a sweep of {machine}", re.match(last, line) is not None, last, line)


def test_verbose():
    """The report omits only what --verbose adds."""
    with Folder() as folder:
        plain, verbose = (Run(folder, *options, DATA / "compressor.nml") for options in ([], ["--verbose"]))
        for words in DIAGNOSTICS:
            equal(f"'{words}'", (words in plain.flat, words in verbose.flat), (False, True))
        check("errors of results are printed", re.search(r"\|rho\| = 0\.97498834\d+ \+- \de-", plain.out) is not None, "+-", plain.out)
        rest = [line for line in plain.out.splitlines() if line not in verbose.out.splitlines()]
        equal("--verbose prints all other lines too", rest, [])
        quiet = Run(folder, "-q", "--verbose", DATA / "compressor.nml")
        equal("-q --verbose", (quiet.code, quiet.out, quiet.err), (0, "", ""))
        found = json.loads(Run(folder, "-q", "--json", DATA / "compressor.nml").out)
        flat = " ".join(found["diagnostics"].split())
        for words in DIAGNOSTICS:
            check(f"json: '{words}'", words in flat, words, flat)
        if shutil.which("gnuplot"):
            Run(folder, "-q", "--report", "-o", "page", DATA / "compressor.nml", environment=SVG_ONLY).done("page")
            page = (folder / "page" / "report.html").read_text()
            before, _, folded = page.partition("<summary>accuracy of the numerical solution</summary>")
            check("page: in a folded section", "accuracy   " in folded and "accuracy   " not in before, "in its fold", folded[:500])
            check("page: no folders", str(DATA) not in page and str(folder) not in page, "names alone", page[:600])
            summary = re.sub(r"<[^>]*>", "|", page.partition('<section id="summary">')[2].partition("</section>")[0])
            summary = re.sub(r"[|\n]+", "|", summary)
            for words in ("|1450 rpm|", "|5.569|1.749 %|11.24|3.532 %|17.34|5.447 %|", "|x|68.98|48.8|N|y|494.6|341.4|N|magnitude|494.6|",
                          "|probe closest to its limit|bearing: 213.7 mm/s rms, limit 18 mm/s|", "|bearing: 213.7 mm/s, 11.9 times the limit of 18 mm/s|"):
                check(f"page: {words}", words in summary, words, summary)


REPORT_LAYOUT_TESTS = (test_width, test_long_names, test_last_line, test_verbose)
