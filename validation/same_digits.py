#!/usr/bin/env python3
"""Compares the results of two builds of the program: every CSV of every input in data/, cell by cell.

usage: validation/same_digits.py [--compiler] BEFORE AFTER [input.nml ...]

Words must be equal. Numbers may differ by the error that their table states for them: a column NAME_error, with or without its
unit, or `error` of the row; without a stated error by 1e-9 of the largest in the column, which allows for rounding. Seconds are
not compared. A phase may differ by the angle that corresponds to the error of its amplitude.
--compiler: another compiler rounds each operation in another way. Instead of 1e-9, 1e-7 is allowed, because points that are found by
a search differ more. Numbers below 1e-20 count as zero, and estimates of errors are not compared.
Columns may be added at the end, and the version may differ. The last line counts tables that are identical, that agree within
errors, and that differ.
"""
import csv
import math
import subprocess
import sys
import tempfile
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parent.parent
FLOOR = {False: 1e-9, True: 1e-7}
ZERO = {False: 0, True: 1e-20}


def read(path):
    """Lines of the preamble without the program's version, names of the columns, rows of cells."""
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("# version:")]
    head = [line for line in lines if line.startswith("#")]
    rows = list(csv.reader(line for line in lines if not line.startswith("#")))
    return head, rows[0], rows[1:]


def number(cell):
    """The number in a cell, None for a word."""
    try:
        return float(cell)
    except ValueError:
        return None


def error_of(names, row, k):
    """The error that a row states for its column k; None if it states none."""
    whole = names[k]
    for name in [whole + "_error", "error_" + whole, *(whole[:i] + "_error" + whole[i:] for i, c in enumerate(whole) if c == "_"),
                 "error"]:
        if name in names and name != names[k]:
            value = number(row[names.index(name)])
            return abs(value) if value is not None and math.isfinite(value) else None
    return None


def differences(before, after, other_compiler=False):
    """Descriptions of the differences between two tables."""
    floor = FLOOR[other_compiler]
    (head, names, rows), (new_head, new_names, new_rows) = read(before), read(after)
    if head != new_head:
        yield "preamble: " + "; ".join(line for line in head + new_head if (line in head) != (line in new_head))
    if new_names[:len(names)] != names:
        yield f"columns {names} are now {new_names}"
        return
    if len(rows) != len(new_rows):
        yield f"{len(rows)} rows are now {len(new_rows)}"
        return
    def greatest_of(k):
        return max((abs(x) for x in (number(row[k]) for row in rows) if x is not None and math.isfinite(x)), default=0)

    for k, name in enumerate(names):
        if name == "seconds" or other_compiler and "error" in name:
            continue
        greatest = greatest_of(k)
        amplitude = name.replace("_phase_rad", "_amplitude") if name.endswith("_phase_rad") else None
        worst, message = 0, ""
        for i, (row, new) in enumerate(zip(rows, new_rows), 1):
            if row[k] == new[k]:
                continue
            a, b = number(row[k]), number(new[k])
            if a is None or b is None or not (math.isfinite(a) and math.isfinite(b)):
                yield f"{name}, row {i}: {row[k]} is now {new[k]}"
                break
            allowed = max(error_of(names, row, k) or 0, error_of(names, new, k) or 0, floor * greatest, ZERO[other_compiler])
            if amplitude in names:
                j = names.index(amplitude)
                # with a tolerance beyond half a turn the phase is arbitrary
                turned = floor * greatest_of(j) / max(abs(number(row[j])), 1e-300)
                allowed = max(allowed, turned if turned < math.pi else math.inf)
                a, b = 0, math.remainder(a - b, 2 * math.pi)
            if "error" in name:  # an estimate may move within its own size
                allowed = max(allowed, 0.1 * max(abs(a), abs(b)))
            if abs(a - b) > allowed and abs(a - b) > worst * allowed:
                worst, message = abs(a - b) / allowed if allowed else math.inf, f"{name}, row {i}: {row[k]} is now {new[k]}"
        if message:
            yield message + f" ({worst:.2g} times what is allowed)"


def main():
    """Runs both programs on all inputs and prints the differences."""
    other_compiler = "--compiler" in sys.argv
    names = [word for word in sys.argv[1:] if word != "--compiler"]
    programs = [Path(name).resolve() for name in names[:2]]
    inputs = [Path(name).resolve() for name in names[2:]] or sorted((CHECKOUT / "data").glob("*.nml"))
    same = within = different = 0
    with tempfile.TemporaryDirectory() as scratch:
        for case in inputs:
            folders = [Path(scratch, str(k), case.stem) for k in (0, 1)]
            runs = [subprocess.Popen([program, case, "-q", "-o", folder], cwd=CHECKOUT, stderr=subprocess.PIPE, text=True)
                    for program, folder in zip(programs, folders)]
            said = [run.communicate()[1] for run in runs]
            if runs[0].returncode != runs[1].returncode or said[0] != said[1]:
                print(f"{case.name}: exit {runs[0].returncode} {said[0]!r} is now {runs[1].returncode} {said[1]!r}")
                different += 1
            tables = [{path.name for path in folder.glob("*.csv")} for folder in folders]
            for name in sorted(tables[0] ^ tables[1]):
                print(f"{case.stem}/{name}: written by {'the first' if name in tables[0] else 'the second'} only")
                different += 1
            for name in sorted(tables[0] & tables[1]):
                before, after = (folder / name for folder in folders)
                if read(before) == read(after):
                    same += 1
                    continue
                found = list(differences(before, after, other_compiler))
                within, different = within + (not found), different + bool(found)
                for line in found:
                    print(f"{case.stem}/{name}: {line}")
    print(f"{same} tables the same, {within} within the errors, {different} different")
    return 1 if different or not same + within else 0


if __name__ == "__main__":
    sys.exit(main())
