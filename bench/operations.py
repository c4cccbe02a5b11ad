#!/usr/bin/env python3
"""Counts instructions and floating point operations of one solution, exactly, with valgrind.

usage: operations.py COUNTED TIMED PEAK DATA ORDER...

COUNTED is bench/speed's program, built for a processor that valgrind knows (-march=x86-64-v3: it knows no AVX-512), TIMED
the same with the flags in question, PEAK the core's peak (peak.c), an ORDER one of the program's orders without the time:
'khang_four_bar 240 gauss6 64'. The counts are differences between runs with 21 and with 1
solutions, so that start and reading do not count. Every executed instruction is looked up in the disassembly: an
addition, multiplication, division or square root counts once for each number in its registers, a fused one twice.
Markdown on standard output.
"""
import re
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

REPEATED = 20
ARITHMETIC = re.compile(r"v?(add|sub|mul|div|sqrt|fn?m(?:add|sub|addsub|subadd)\d*|addsub|hadd|hsub)([sp])([sd])$")


def operations(mnemonic, operands):
    """Floating point operations of an instruction, and its lanes."""
    match = ARITHMETIC.match(mnemonic)
    if not match:
        return 0, 1
    size = {"d": 8, "s": 4}[match.group(3)]
    register = 64 if "zmm" in operands else 32 if "ymm" in operands else 16
    lanes = register // size if match.group(2) == "p" else 1
    return lanes * (2 if match.group(1).startswith("f") else 1), lanes


def disassembly(program):
    found = {}
    if not Path(program).is_file():  # what the kernel lends
        return found
    text = subprocess.run(["objdump", "-d", "--no-show-raw-insn", program], capture_output=True, text=True, check=True).stdout
    for line in text.splitlines():
        match = re.match(r"\s+([0-9a-f]+):\s+(\S+)\s*(.*)", line)
        if match:
            found[int(match.group(1), 16)] = match.group(2), match.group(3)
    return found


def executed(program, data, order, runs):
    """Executions of every instruction, by object and address, and their number."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        subprocess.run(["valgrind", "--tool=callgrind", "--dump-instr=yes", "--compress-pos=no", "--compress-strings=no",
                        f"--callgrind-out-file={out}", program, data],
                       input=f"{order} {-runs}\n", capture_output=True, text=True, check=True)
        counts, of_callee = Counter(), False
        for line in out.read_text().splitlines():
            if line.startswith("ob="):
                where = line[3:]
            elif line.startswith("calls="):
                of_callee = True
            elif line.startswith("0x"):
                address, _, cost = line.split()[:3]
                if not of_callee:
                    counts[where, int(address, 16)] += int(cost)
                of_callee = False
        return counts


def shortest_time(program, data, order):
    answers = subprocess.run([program, data], input=f"{order} 0.2\n" * 5, capture_output=True, text=True, check=True).stdout
    return min(float(line.split(",")[0]) for line in answers.splitlines())


def main():
    program, timed, peak, data, *orders = sys.argv[1:]
    code = {}
    print("| order | instructions | floating point operations | of them in vectors | shortest time, us | 1e9 operations/s "
          "| share of the peak |", "|---|--:|--:|--:|--:|--:|--:|", sep="\n")
    for order in orders:
        executions = executed(program, data, order, 1 + REPEATED)
        executions.subtract(executed(program, data, order, 1))
        flops = in_vectors = 0
        for (where, address), count in executions.items():
            if count == 0:
                continue
            if where not in code:
                code[where] = disassembly(where)
            each, lanes = operations(*code[where].get(address, ("", "")))
            flops += each * count
            in_vectors += each * count if lanes > 1 else 0
        time = shortest_time(timed, data, order)
        rate = 1e-9 * flops / REPEATED / time
        print(f"| {order} | {sum(executions.values()) / REPEATED:.0f} | {flops / REPEATED:.0f} | "
              f"{in_vectors / max(flops, 1):.0%} | {1e6 * time:.3g} | {rate:.3g} | {rate / float(peak):.0%} |", flush=True)


if __name__ == "__main__":
    main()
