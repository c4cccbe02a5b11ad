"""The reference of the library, by FORD, into build/reference: ./bootstrap python3 doc/reference/make.py

Fails where a name of the public modules in FACADES is not documented or not in the table of ford.md. The last line is
"N passed, M failed".
"""

import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
FORD = ROOT / ".bootstrap/venv/bin/ford"
VERSION = "7.0.13"
FACADES = ("src/gestell.f90", "src/api/numerics.f90")


def installed():
    return FORD.exists() and VERSION in subprocess.run([FORD, "--version"], capture_output=True, text=True).stdout


def facade():
    """Public names, and the names that these have in their own modules."""
    source = "".join(re.sub(r"&\s*\n\s*&", "", (ROOT / file).read_text(encoding="utf-8")) for file in FACADES)
    items = [item.strip() for names in re.findall(r"only: (.*)", source) for item in names.split(",")]
    pairs = [re.split(r"\s*=>\s*", item) for item in items if item.isidentifier() or "=>" in item]
    return {pair[0] for pair in pairs}, {pair[-1] for pair in pairs}


def main():
    if not installed():
        subprocess.run([ROOT / "bootstrap", "--pip", f"ford=={VERSION}"], check=True)
    ford = subprocess.run([FORD, ROOT / "doc/reference/ford.md"], cwd=ROOT, capture_output=True, text=True)
    words = " ".join((ford.stdout + ford.stderr).split())
    given, original = facade()
    page = (ROOT / "doc/reference/ford.md").read_text(encoding="utf-8")
    listed = set(re.findall(r"\[\[(\w+)\]\]|`(\w+)`", page))
    listed = {name for pair in listed for name in pair}
    bad = [f"not in the table of ford.md: {name}" for name in sorted(given - listed)]
    bad += [f"not documented: {name} in {file}" for kind, name, file in
            re.findall(r"Undocumented (\w+) '(\w+)' in file '([\w.]+)'", words) if kind != "variable" and name in original]
    # FORD does not know names that a module passes on; the compiler does
    bad += re.findall(r"Warning: (?!Undocumented|Could not extract|Unknown entity).{,200}", words)
    if ford.returncode != 0 or not (ROOT / "build/reference/index.html").exists():
        bad.append((ford.stdout + ford.stderr)[-2000:])
    print(*bad, sep="\n")
    print(f"{len(given) + 1 - len(bad)} passed, {len(bad)} failed")
    return len(bad) > 0


if __name__ == "__main__":
    sys.exit(main())
