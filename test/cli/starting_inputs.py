"""Inputs that `gestell --new` prints: each runs as printed, and help, completion and messages name the kinds."""

import math
import re
import subprocess
from pathlib import Path

from harness import Folder, Run, check, equal, near

ROOT = Path(__file__).resolve().parents[2]
KINDS = ["slider-crank", "four-bar", "six-bar", "cam", "inline-engine", "v-engine", "machine-on-mounts"]
# What the report says if something about the machine is not as it should be.
COMPLAINTS = re.compile(r"warning|UNSTABLE|not small|near$|near parametric|near resonance|poor|times the limit|note:", re.M)


def test_kinds_run():
    """Every starting input runs without a warning and is stable within its limits."""
    for kind in KINDS:
        with Folder() as folder:
            printed = Run(folder, "--new", kind)
            printed.done(f"--new {kind}")
            # else run share/new/write_texts.py
            equal(f"{kind} as in share/new", printed.out, (ROOT / f"share/new/{kind}.nml").read_text())
            (folder / "machine.nml").write_text(printed.out)
            run = Run(folder, "--fail-if-unstable", "machine.nml")
            run.done(f"{kind} runs")
            equal(f"{kind}, last line", run.out.splitlines()[-1], "VERDICT  stable")
            found = COMPLAINTS.search(run.out)
            check(f"{kind}, complaints", not found, "none", found and run.out[max(0, found.start() - 80):found.end() + 40])


def test_groups_are_explained():
    """In a starting input a comment with an empty line above it explains the first of several equal groups."""
    for kind in KINDS:
        with Folder() as folder:
            blocks = Run(folder, "--new", kind).out.split("\n\n")
        seen = set()
        for block in blocks:
            groups = set(re.findall(r"^&(\w+)", block, re.M))
            check(f"{kind}: {sorted(groups)}", block.startswith("! ") and groups, "a comment and groups", block)
            seen |= groups
        check(f"{kind}: groups", {"case", "units", "drive", "joint", "link", "frame", "support", "probe"} <= seen, "all", sorted(seen))


def test_known_numbers():
    """The starting inputs have the strokes and the force of unbalance that their comments lead to expect."""
    for kind, joint, stroke in (("slider-crank", "B", 0.1), ("cam", "R", 0.02), ("inline-engine", "four.B", 0.086), ("v-engine", "left.B", 0.08)):
        with Folder() as folder:
            (folder / "machine.nml").write_text(Run(folder, "--new", kind).out)
            run = Run(folder, "--check", "machine.nml")
            found = re.search(rf"^  {re.escape(joint)} .* ([0-9.]+)$", run.out, re.M)
            near(f"{kind}, stroke of {joint}", float(found[1]) if found else math.nan, stroke, 1e-9)
    with Folder() as folder:
        (folder / "machine.nml").write_text(Run(folder, "--new", "machine-on-mounts").out)
        run = Run(folder, "--check", "machine.nml")
        found = re.search(r"^ +1 +([0-9.]+) +", run.out, re.M)
        # m e Omega^2 to the printed five digits
        force = 40 * 0.0406e-3 * (1480 * math.pi / 30) ** 2
        near("force of the unbalance", float(found[1]) if found else math.nan, force, 1e-4 * force)


def test_list_and_messages():
    """`--new` lists the kinds, and refuses an unknown kind with the nearest one."""
    with Folder() as folder:
        listed = Run(folder, "--new")
        listed.done("--new")
        equal("kinds", re.findall(r"^  ([a-z-]+)  ", listed.out, re.M), KINDS)
        for kind in KINDS:
            first = (ROOT / f"share/new/{kind}.nml").read_text().splitlines()[0].removeprefix("! ")
            check(f"{kind} is described", first in listed.out, first, listed.out)
        equal("capital letters", Run(folder, "--new", "V-Engine").out, Run(folder, "--new", "v-engine").out)
        Run(folder, "--new", "six-bars").refused("nearest kind", 1, "--new: unknown kind of machine 'six-bars'; did you mean 'six-bar'?")
        Run(folder, "--new", "turbine").refused(
            "no kind is near", 1, "--new: unknown kind of machine 'turbine'; choose from " + ", ".join(f"'{kind}'" for kind in KINDS))
        Run(folder, "--new", "cam", "input.nml").refused(
            "an input file", 1, "option '--new' reads no input file; to write one: gestell --new KIND > machine.nml")
        check("--help", re.search(r"^ +--new \[KIND\] ", Run(folder, "--help").out, re.M), "--new [KIND]", "")


def test_completion():
    """The completion of bash offers the kinds behind `--new`."""
    script = ROOT / "share/bash-completion/completions/gestell"
    for word, expected in (("", KINDS), ("s", ["slider-crank", "six-bar"])):
        commands = f"source {script}; COMP_WORDS=('{Run.program}' --new '{word}'); COMP_CWORD=2; _gestell; printf '%s\\n' \"${{COMPREPLY[@]}}\""
        done = subprocess.run(["bash", "-c", commands], capture_output=True, text=True, timeout=60)
        equal(f"--new {word}", done.stdout.split(), expected)


STARTING_INPUT_TESTS = [test_kinds_run, test_groups_are_explained, test_known_numbers, test_list_and_messages, test_completion]
