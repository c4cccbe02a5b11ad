"""The documents against the program: commands run, excerpts are what the program prints, all keys are described.

Run from the checkout: ./bootstrap python3 test/documents.py. The last line is "N passed, M failed".
"""

import pathlib
import re
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
    """Shell blocks of the README, but for the tests and for what CI runs as steps of its own."""
    for block in blocks("README.md", "sh"):
        if "fpm test" in block:
            continue
        result = program("bash", "-e", "-c", block)
        check(f"README: {block}", result.returncode == 0, result.stderr[-2000:])
    sweep = [ROOT / "sweep" / n / "response.csv" for n in ("240", "300", "360")]
    check("README: the sweep's files", all(file.exists() for file in sweep))
    shutil.rmtree(ROOT / "sweep", ignore_errors=True)


def but_for_rounding(report):
    """Without the digit of a defect that is rounding alone: it depends on the compiler's order of operations."""
    return re.sub(r"defect \de-1[2-6]", "defect", report)


def excerpts(gestell, folder):
    reports = program(gestell, ROOT / "data/khang_four_bar.nml", where=folder).stdout
    reports += program(gestell, ROOT / "data/rocking_sieve.nml", where=folder).stdout
    reports += program(gestell, ROOT / "data/sieve_borders.nml", where=folder).stdout
    reports += program(gestell, "--check", ROOT / "data/shaper.nml", where=folder).stdout
    for block in blocks("README.md", "text"):
        if not block.startswith("input.nml"):
            check("README: excerpt of the report", but_for_rounding(block) in but_for_rounding(reports), block)
    for file in sorted((ROOT / "data").glob("*.nml")):
        # A million machines take a minute in a debug build.
        fewer = ["--set", "sweep.count=50"] if "count=1000" in file.read_text() else []
        done = program(gestell, *fewer, file, where=folder)
        check(f"{file.name} runs", done.returncode == 0, done.stderr)
        check(f"README: {file.name} is listed", file.name in text("README.md"))
    printed, plain = ((folder / name) for name in ("khang_four_bar_printed", "khang_four_bar"))
    for name in ("multipliers.csv", "response.csv", "harmonics.csv"):
        same = [[line for line in (place / name).read_text().splitlines() if line[0] != "#"] for place in (printed, plain)]
        check(f"data as printed gives the same {name}", same[0] == same[1])
    (block,) = blocks("README.md", "fortran")
    (folder / "readme.nml").write_text(block)
    program(gestell, "readme.nml", where=folder)
    same = [
        [line for line in (folder / name / "response.csv").read_text().splitlines() if line[0] != "#"]
        for name in ("readme", "khang_four_bar")
    ]
    check("README: the input is the one in data/", same[0] == same[1])
    (folder / "input.nml").write_text(block.replace("lengths", "lenghts"))
    typo = program(gestell, "input.nml", where=folder).stderr.strip()
    check("README: the message", any(typo == block.strip() for block in blocks("README.md", "text")), typo)


def options(gestell):
    shown = set(re.findall(r"--[a-z-]+", program(gestell, "--help").stdout))
    described = set(re.findall(r"--[a-z-]+", "".join(blocks("doc/input.md", "text"))))
    check("doc/input.md: the options", shown == described, shown ^ described)


def keys():
    schema = re.findall(r'key_rule\("(\w+)", "(\w+)"', text("src/io/schema.f90"))
    check("schema was read", len(schema) > 30)
    document = text("doc/input.md")
    for group, key in schema:
        section = document.split(f"### `&{group}`")[-1].split("\n### ")[0]
        check(f"doc/input.md: &{group} {key}", f"`{key}`" in section)


def columns(gestell, folder):
    program(gestell, "--set", "case.tasks=modes,response", "-o", "all", ROOT / "data/khang_four_bar.nml", where=folder)
    document = text("doc/output.md")
    program(gestell, "--set", "case.tasks=trade", "-o", "all", ROOT / "data/rocking_sieve.nml", where=folder)
    for name in ("multipliers", "response", "trade"):
        lines = (folder / "all" / f"{name}.csv").read_text().splitlines()
        header = next(line for line in lines if line[0] != "#")
        for column in header.split(","):
            check(f"doc/output.md: {name}.csv {column}", f"`{column}`" in document)


def links():
    for document in [ROOT / "README.md", *sorted((ROOT / "doc").glob("*.md"))]:
        for target in re.findall(r"\]\(([^)#]+)\)", document.read_text(encoding="utf-8")):
            if "://" not in target:
                check(f"{document.name}: link {target}", (document.parent / target).exists())


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        install = program("fpm", "install", "--prefix", folder / "installed")
        check("fpm install", install.returncode == 0, install.stderr[-2000:])
        gestell = folder / "installed/bin/gestell"
        excerpts(gestell, folder)
        options(gestell)
        columns(gestell, folder)
    keys()
    links()
    run_commands()
    print(f"{passed} passed, {failed} failed")
    return failed > 0


if __name__ == "__main__":
    sys.exit(main())
