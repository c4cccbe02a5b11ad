"""Checks the documents against the program: their commands run, their excerpts are its output, all keys are described.

Run from the checkout: ./bootstrap python3 test/documents.py. The last line is "N passed, M failed".
test/documents.py --write-tables GESTELL writes the tables of keys into doc/input.md.
"""

import os
import csv
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
passed = failed = 0


def check(name, good, detail=""):
    global passed, failed
    passed, failed = passed + bool(good), failed + (not good)
    if not good:
        print(f"FAILED: {name}\n{detail}")


def text(name):
    return (ROOT / name).read_text(encoding="utf-8")


def blocks(document, language):
    return re.findall(rf"^```{language}\n(.*?)^```$", text(document), re.M | re.S)


def program(*arguments, where=ROOT):
    return subprocess.run(arguments, cwd=where, capture_output=True, text=True, timeout=600)


def run_commands():
    """Runs the shell blocks of the README and of the page on installation, except the tests, which are separate steps of CI."""
    for page in ("README.md", "doc/installation.md"):
        for block in blocks(page, "sh"):
            flags = re.search(r'fpm build .*--flag "(.*)"$', block.strip())
            if flags:
                # to check that the compiler accepts the flags, one file and fpm's list suffice
                with tempfile.TemporaryDirectory() as folder:
                    done = program("gfortran", *flags[1].split(), "-c", ROOT / "src/base/kinds.f90", where=folder)
                check(f"{page}: flags {flags[1]}", done.returncode == 0, done.stderr)
                block = block.strip() + " --list"
            for line in block.splitlines():
                if "fpm test" not in line:
                    result = program("bash", "-e", "-c", line)
                    check(f"{page}: {line}", result.returncode == 0, result.stderr[-2000:])


def but_for_rounding(report):
    """The report without digits of numbers that are only rounding errors, which depend on the compiler."""
    return re.sub(r"\b\de-1[1-6]\b", "1e-1x", report)


def excerpts(gestell, folder):
    reports = program(gestell, ROOT / "data/khang_four_bar.nml", where=folder).stdout
    for block in blocks("README.md", "text"):
        if not block.startswith("input.nml"):
            check("README: excerpt of the report", but_for_rounding(block) in but_for_rounding(reports), block)
    for file in sorted((ROOT / "data").glob("*.nml")):
        # A million machines take a minute in a debug build.
        fewer = ["--set", "sweep.count=50"] if "count=1000" in file.read_text() else []
        done = program(gestell, *fewer, file, where=folder)
        check(f"{file.name} runs", done.returncode == 0, done.stderr)
        check(f"doc/machines.md: {file.name} is listed", f"`{file.name}`" in text("doc/machines.md"))
    printed, plain = ((folder / name) for name in ("khang_four_bar_printed", "khang_four_bar"))
    for name in ("multipliers.csv", "response.csv", "harmonics.csv"):
        same = [[line for line in (place / name).read_text().splitlines() if line[0] != "#"] for place in (printed, plain)]
        check(f"the mechanism with the printed data has the same {name}", same[0] == same[1])
    (block,) = blocks("README.md", "fortran")
    (folder / "readme.nml").write_text(block)
    # The file in data/ selects the paper's equations.
    program(gestell, "--set", "model.frame=rest", "readme.nml", where=folder)
    same = [
        [line for line in (folder / name / "response.csv").read_text().splitlines() if line[0] != "#"]
        for name in ("readme", "khang_four_bar")
    ]
    check("README: the input is the one in data/", same[0] == same[1])
    (folder / "input.nml").write_text(block.replace("lengths", "lenghts"))
    typo = program(gestell, "input.nml", where=folder).stderr.strip()
    check("README: the message on a typing error", any(typo == block.strip() for block in blocks("README.md", "text")), typo)


def table(path):
    """The rows of a result file, by column."""
    lines = (line for line in path.read_text().splitlines() if line[0] != "#")
    return list(csv.DictReader(lines))


def critical_speeds(folder):
    """Critical speeds of the paper's machine, found from its modes, agree one for one with the peaks of the resonance curve of
    the force, which is computed independently. doc/validation.md lists some of them."""
    speeds, lines = {}, set()
    for row in table(folder / "khang_speeds/critical.csv"):
        # Both lists contain peaks of 5 % prominence and more; NaN means that the force has no peak.
        if row["outcome"] == "peak" and float(row["force_prominence"]) > 1.05:
            speeds[float(row["force_speed_rpm"])] = row
    maxima = [row for row in table(folder / "khang_speeds/peaks.csv") if row["quantity"] == "f"]
    check("critical speeds: as many as peaks of the resonance curve", len(speeds) == len(maxima), (len(speeds), len(maxima)))
    for row in maxima:
        at = float(row["speed_rpm"])
        nearest = min(speeds, key=lambda speed: abs(speed - at))
        found = speeds[nearest]
        # Both are accurate to 1e-6 of the speed; the sharpest peak is 0.03 rpm wide.
        check(f"critical speed {at}", abs(nearest - at) < 1e-5 * at, nearest)
        check(f"force at {at}", abs(float(found["force_N"]) / float(row["value"]) - 1) < 1e-3, (found["force_N"], row["value"]))
        lines.add(f"| {found['mode']} | {float(found['order']):g} | {float(found['crossing_rpm']):.3f} | {at:.3f} | "
                  f"{float(row['value']):.5g} |")
    shown = set(re.findall(r"^\| \d \| \d \| [\d.]+ \| [\d.]+ \| [\d.]+ \|$", text("doc/validation.md"), re.M))
    check("doc/validation.md: critical speeds", len(shown) > 3 and shown <= lines, sorted(shown - lines))


def readme_pictures(gestell, folder):
    """Checks that the script draws exactly the pictures that the README shows."""
    if not shutil.which("gnuplot"):
        return
    (folder / "pictures").mkdir()
    done = program("bash", ROOT / "doc/pictures/make.sh", gestell, folder / "pictures", where=folder)
    made = {path.name for path in (folder / "pictures").iterdir()}
    shown = set(re.findall(r'src="doc/pictures/([\w.]+)"', text("README.md")))
    check("README: pictures", done.returncode == 0 and made == shown, (made, shown, done.stderr))
    for name in shown:
        check(f"README: {name} exists", (ROOT / "doc/pictures" / name).exists())


def options(gestell):
    shown = set(re.findall(r"--[a-z-]+", program(gestell, "--help").stdout))
    described = set(re.findall(r"--[a-z-]+", "".join(blocks("doc/input.md", "text"))))
    check("doc/input.md: the options", shown == described, shown ^ described)


def keys(gestell):
    """Checks that the tables of keys in doc/input.md agree with the program's records. --write-tables replaces them."""
    document = text("doc/input.md")
    sections = program(gestell, "--help", "tables").stdout.split("### ")[1:]
    described = len(re.findall(r"^### `&", document, re.M))
    check("--help tables: as many groups as doc/input.md has", len(sections) == described, (len(sections), described))
    for section in sections:
        heading, *tables = re.split(r"\n\n+", section.strip())
        start = document.find(f"### {heading}")
        check(f"doc/input.md: {heading}", start >= 0)
        for table in tables:
            end = document.find("\n#", start + 4)
            head = table.splitlines()[0]
            found = re.search(rf"^{re.escape(head)}\n(?:\|.*\n)*", document[start:end], re.M)
            check(f"doc/input.md: table of {heading}", found, head)
            if found and "--write-tables" in sys.argv:
                document = document[:start + found.start()] + table + "\n" + document[start + found.end():]
            elif found:
                check(f"doc/input.md: the table of {heading} agrees with the records (else run test/documents.py --write-tables)",
                      found[0].strip() == table, f"{found[0]}--- but\n{table}")
    if "--write-tables" in sys.argv:
        (ROOT / "doc/input.md").write_text(document, encoding="utf-8")


def columns(gestell, folder):
    program(gestell, "--set", "case.tasks=modes,response", "-o", "all", ROOT / "data/khang_four_bar.nml", where=folder)
    document = text("doc/output.md")
    program(gestell, "--set", "case.tasks=trade", "-o", "all", ROOT / "data/rocking_sieve.nml", where=folder)
    program(gestell, "-o", "all", ROOT / "data/compressor.nml", where=folder)
    for name in ("multipliers", "response", "trade", "power"):
        lines = (folder / "all" / f"{name}.csv").read_text().splitlines()
        header = next(line for line in lines if line[0] != "#")
        for column in header.split(","):
            check(f"doc/output.md: {name}.csv {column}", f"`{column}`" in document)


# Pages whose every command is run. A page is one script of bash, in a folder that holds the checkout as `gestell`:
# "```sh" is run, the text of "```text" below it must be its output ("..." stands for omitted lines), and any other
# block is the contents of a file if the line above it ends in "`NAME`:", and is appended to it if that line contains "add".
PAGES = ["doc/tutorial.md", *sorted(str(page.relative_to(ROOT)) for page in (ROOT / "doc").glob("howto_*.md"))]


def page_blocks(page):
    """(language, text, name of the file or None, True to append to the file) for each block."""
    found = []
    for above, language, block in re.findall(r"^([^\n]*)\n+```(\w+)\n(.*?)^```$", text(page), re.M | re.S):
        file = re.search(r"`([\w./-]+)`:$", above.strip())
        found.append((language, block, file and file.group(1), "add" in above.lower()))
    return found


def script_of(blocks, outputs):
    """A bash script that writes the page's files and runs its commands. The output of command i goes to the file i. A user's package
    compiles the library with the flags of `fpm test`, as test/use_as_library.sh does."""
    flags = re.search(r"^debug_flags='(.*)'$", text("bootstrap"), re.M)[1] + " -fopenmp"
    lines = ["set -e"]
    for i, (language, block, file, grows) in enumerate(blocks):
        if language == "sh":
            if not shutil.which("gnuplot"):
                block = block.replace(" --plot", "").replace(" --report", "")
            block = re.sub(r"^fpm run$", f"FPM_FFLAGS={shlex.quote(flags)} fpm run", block, flags=re.M)
            lines += [f"exec >{shlex.quote(str(outputs))}/{i} 2>&1", block]
        elif file:
            lines += [f"cat {'>>' if grows else '>'}{file} <<'END-OF-FILE'", f"{block}END-OF-FILE"]
    return "\n".join(lines) + "\n"


def printed(excerpt, output):
    """True if the output contains the parts of the excerpt between lines "..." in their order."""
    at, out = 0, re.sub(r" +$", "", but_for_rounding(output), flags=re.M)
    for part in re.split(r"^ *\.\.\.\n", but_for_rounding(excerpt), flags=re.M):
        at = out.find(part, at)
        if at < 0:
            return False
        at += len(part)
    return True


def pictures(page, work):
    """Checks that the page's commands have drawn its pictures: pictures/PAGE/FOLDER/NAME.svg in FOLDER. --write-pictures copies
    them to the page."""
    for folder, picture in re.findall(r"\((pictures/\w+)/([\w./]+\.svg)\)", text(page)):
        if not shutil.which("gnuplot"):
            continue
        made = [place / picture for place in (work, *work.iterdir()) if (place / picture).exists()]
        check(f"{page}: {picture} was drawn", made)
        if made and "--write-pictures" in sys.argv:
            shutil.copyfile(made[0], ROOT / "doc" / folder / picture)


def run_page(page, folder):
    outputs, work = folder / "outputs" / page, folder / "work" / page
    outputs.mkdir(parents=True)
    work.mkdir(parents=True)
    (work / "gestell").symlink_to(ROOT)
    blocks = page_blocks(page)
    # Pages show pictures as SVG only.
    own = {"HOME": str(folder / "home"), "PATH": f"{ROOT}/test/cli/svg_only:{folder}/home/.local/bin:{os.environ['PATH']}"}
    done = subprocess.run(
        ["bash"], input=script_of(blocks, outputs), cwd=work, env=os.environ | own, capture_output=True, text=True, timeout=600
    )
    output = ""
    for i, (language, block, file, _) in enumerate(blocks):
        check(f"{page}: a file without a name", language in ("sh", "text") or file, block)
        if language == "sh":
            log = outputs / str(i)
            output = log.read_text() if log.exists() else "(not reached)\n"
            last = i == max((k for k, b in enumerate(blocks) if b[0] == "sh" and (outputs / str(k)).exists()), default=i)
            check(f"{page}: {block}", log.exists() and (done.returncode == 0 or not last), output + done.stderr)
        elif language == "text":
            check(f"{page}: printed output", block and printed(block, output), f"{block}--- but\n{output}")
    pictures(page, work)


def one_line_columns(gestell, folder):
    """Checks that every column of --one-line is described with the option or as a column of sweep.csv."""
    case = program(gestell, "--one-line", ROOT / "data/compressor.nml", where=folder)
    described = "".join(blocks("doc/input.md", "text"))
    for column in case.stdout.splitlines()[0].split(","):
        name = re.sub(r"probe\(\w+\)", "probe(NAME)", re.sub(r"support\(\d+\)", "support(1)", column))
        check(f"doc/input.md: --one-line {column}", name in described or f"`{name}`" in text("doc/output.md"))


def library_calls(home):
    """Checks that the calls in doc/library.md's table of joints compile."""
    rows = re.findall(r"^\|[^|\n]*\| `((?:call |rail = |linkage%)[^`]*)` \|$", text("doc/library.md"), re.M)
    check("doc/library.md: the joints", len(rows) == 12, rows)
    calls = [row if row.startswith(("call", "rail")) else f"call {row}" for row in rows]
    lines = ["use gestell_api_numerics", "implicit none", "type(linkage_type) :: linkage", "type(guide_type) :: rail, carried"]
    lines += ["type(error_type), allocatable :: error", *(call.replace(" ...)", " error=error)") for call in calls), "end"]
    (home / "joints.f90").write_text("\n".join(lines) + "\n")
    done = program("gfortran", "-fsyntax-only", f"-I{home}/.local/include", home / "joints.f90")
    check("doc/library.md: the calls compile", done.returncode == 0, done.stderr)


def suites():
    """Checks that an unknown suite makes `fpm test` list the suites and test nothing."""
    names = re.findall(r"new_testsuite\(\"([\w-]+)\"", text("test/main.f90"))
    check("test/main.f90: suites", len(names) > 50, names)
    done = program("./bootstrap", "fpm", "test", "--", "no-such-suite")
    check("fpm test -- no-such-suite: code", done.returncode != 0, done.stdout[-2000:])
    output = done.stdout + done.stderr
    check("fpm test -- no-such-suite: message", "there is no suite 'no-such-suite'; besides 'all' and 'slow' there are" in output, output[-2000:])
    check("fpm test -- no-such-suite: listed", all(f"\n  {name}\n" in output for name in names), output[-2000:])
    check("fpm test -- no-such-suite: nothing is tested", "PASSED" not in output, output[-2000:])


def links():
    for document in [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "doc").glob("*.md"))]:
        for target in re.findall(r"\]\(([^)#]+)\)", document.read_text(encoding="utf-8")):
            if "://" not in target:
                check(f"{document.name}: link {target}", (document.parent / target).exists())


def tables():
    """Checks that every table has a heading, a separator, and the same number of columns in all rows."""
    for document in [ROOT / "README.md", *sorted((ROOT / "doc").glob("*.md"))]:
        plain = re.sub(r"^```.*?^```$", "", document.read_text(encoding="utf-8"), flags=re.M | re.S)
        bad = []
        for table in re.findall(r"(?:^\|[ -].*\n)+", plain, re.M):
            rows = [re.sub(r"`[^`]*`", "", row).count("|") for row in table.splitlines()]
            if not re.match(r".*\n\|[| :-]+\n", table) or min(rows) < max(rows):
                bad.append(table[:200])
        check(f"{document.name}: tables", not bad, "\n".join(bad))


def main():
    if "--write-tables" in sys.argv:
        keys(sys.argv[-1])
        return failed > 0
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        install = program("fpm", "install", "--profile", "release", "--prefix", folder / "home/.local")
        check("fpm install", install.returncode == 0, install.stderr[-2000:])
        gestell = folder / "home/.local/bin/gestell"
        excerpts(gestell, folder)
        critical_speeds(folder)
        readme_pictures(gestell, folder)
        options(gestell)
        keys(gestell)
        columns(gestell, folder)
        one_line_columns(gestell, folder)
        library_calls(folder / "home")
        for page in PAGES:
            run_page(page, folder)
        written = {file.name for file in folder.rglob("*.csv") if file.read_text(encoding="utf-8").startswith("# ")}
        for name in sorted(written):
            check(f"doc/output.md: {name}", f"`{name}`" in text("doc/output.md"))
    suites()
    links()
    tables()
    run_commands()
    print(f"{passed} passed, {failed} failed")
    return failed > 0


if __name__ == "__main__":
    sys.exit(main())
