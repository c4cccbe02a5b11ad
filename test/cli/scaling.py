"""Machines of other size, mass and speed: every number of every table, bounds included, follows from the first by its dimension.

Factors are powers of two, so that the arithmetic is the same to the last bit except where a constant has a dimension.
"""

import json
import re

from harness import Folder, Run, check, equal
from records import DATA, NEEDLE, REST, SHORT, SPEEDS

# Exponents of mass, length and time.
UNITS = {"kg": (1, 0, 0), "m": (0, 1, 0), "s": (0, 0, 1), "N": (1, 1, -2), "W": (1, 2, -3), "J": (1, 2, -2), "Hz": (0, 0, -1),
         "mm": (0, 1, 0), "rpm": (0, 0, -1), "rad": (0, 0, 0), "deg": (0, 0, 0), "%": (0, 0, 0), "1": (0, 0, 0)}
KEYS = {"mass": "kg", "inertia": "kg m^2", "flywheel_inertia": "kg m^2", "stiffness": "N/m", "damping": "N s/m", "speed_rpm": "rpm",
        "limit_mm_s": "mm/s", "band_hz": "Hz", "position": "m", "radius": "m", "lengths": "m", "center": "m", "origin": "m",
        "guide_point": "m", "from": "rpm", "to": "rpm"}
MACHINES = {
    "compressor": ((DATA / "compressor.nml").read_text().replace("limit_mm_s=18.0", "limit_mm_s=18.0, band_hz=10,1000").replace(
        "'foot', position=-0.20,-0.25", "'foot', position=-0.20,-0.25, band_hz=10,1000") + SHORT,
        "stability modes response forces power drawing balance separation"),
    "engine in space": ((DATA / "engine_in_space.nml").read_text() + SHORT, "stability modes response forces power separation"),
    "needle bar": (NEEDLE + REST + SPEEDS.format(2000, 4000, 9), "campbell critical resonance"),
}
# Larger, heavier, faster, and all at once.
SCALES = ((2, 0, 0), (0, 1, 0), (0, 0, -1), (-1, 2, 1))


def exponent(unit, scale):
    """The power of two by which a number with this unit grows."""
    total, sign = 0, 1
    for word in re.findall(r"/|[^ /]+", unit or ""):
        if word == "/":
            sign = -1
            continue
        name, _, power = word.partition("^")
        total += sign * int(power or 1) * sum(a * b for a, b in zip(UNITS[name], scale))
    return total


def scaled(text, scale):
    """The input with all its dimensional numbers multiplied."""
    def numbers(found):
        factor = 2.0 ** exponent(KEYS[found[1]], scale)
        return found[1] + found[2] + re.sub(r"-?\d[\d.]*(?:[eE]-?\d+)?", lambda one: repr(float(one[0]) * factor), found[3])
    lines = (line.split("!")[0] for line in text.splitlines())
    return "\n".join(re.sub(rf"\b({'|'.join(KEYS)})( *= *)((?:-?[\d.]+(?:[eE]-?\d+)?[, ]*)+)", numbers, line) for line in lines) + "\n"


def found(folder, what, text, tasks):
    (folder / "input.nml").write_text(text)
    run = Run(folder, "-q", "--json", "-s", "case.tasks=" + ",".join(f"'{task}'" for task in tasks.split()), "input.nml")
    equal(what, (run.code, run.err), (0, ""))
    return json.loads(run.out)["tables"] if run.code == 0 else {}


def test_scaling():
    """Scaled machines have results scaled by their dimensions."""
    for name, (text, tasks) in MACHINES.items():
        with Folder(input=text) as folder:
            first = found(folder, name, scaled(text, (0, 0, 0)), tasks)
            for scale in SCALES:
                what = f"{name} by 2^{scale}"
                other = found(folder, what, scaled(text, scale), tasks)
                equal(f"{what}: tables", list(other), list(first))
                for table in first.keys() & other.keys():
                    compare(f"{what}: {table}", first[table], other[table], scale)


def test_reports():
    """Reports of a machine with a mass 1024 times as large say the same, and only forces, energies and masses grow.

    A threshold with the wrong dimension changes words, or a number that does not depend on the mass.
    """
    number = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?!\w)")
    # Harmonics of a four-bar's forces fall below rounding errors, where the report's mean ratio of amplitudes must end.
    four_bar = {"four-bar": ((DATA / "khang_four_bar.nml").read_text() + SHORT, "stability modes response drawing")}
    for name, (text, tasks) in {**MACHINES, **four_bar}.items():
        texts = []
        for scale in ((0, 0, 0), (10, 0, 0)):
            with Folder(input=scaled(text, scale)) as folder:
                run = Run(folder, "--verbose", "-o", "out", "-s", "case.tasks=" + ",".join(f"'{task}'" for task in tasks.split()),
                          "input.nml")
                equal(f"{name} by 2^{scale}", (run.code, run.err), (0, ""))
                texts.append(run.flat)
        words = [number.sub("#", text).split() for text in texts]
        differing = next((k for k, pair in enumerate(zip(*words)) if pair[0] != pair[1]), None)
        check(f"{name}, words of the report", words[0] == words[1], *(" ".join(each[max(differing or 0, 8) - 8:][:16]) for each in words))
        numbers = list(zip(*map(number.findall, texts)))
        wrong = [(one, two) for one, two in numbers if not grows(float(one), float(two))]
        check(f"{name}, numbers of the report", not wrong, "the same numbers, or 1024 times as large", wrong[:10])


def grows(one, two):
    """True if the second number equals the first one, or is 1024 times as large, within 6 %: reports round to two digits at least.
    Numbers below 1e-6 are rounding errors or their bounds."""
    return any(abs(two - factor * one) <= 0.06 * factor * abs(one) for factor in (1, 1024, 1 / 1024)) or max(abs(one), abs(two)) < 1e-6


def compare(what, one, two, scale):
    """Compares numbers within 1e-9 of the largest of their column, amplitudes of the harmonics of one quantity within 1e-9 of the
    largest harmonic: the smallest ones are rounding errors. Bounds follow the mass alone, because their norms combine metres,
    radians and m/s."""
    equal(f"{what}: rows", len(two["rows"]), len(one["rows"]))
    bounds = {column["error"] for column in one["columns"]}
    quantities = [re.sub(r"_order_\d+", "", column["key"]) for column in one["columns"]]
    for k, column in enumerate(one["columns"]):
        mixed = column["key"] in bounds
        # Mode shapes are normalised separately in every table. A force that reverses after half a turn has two equal peaks.
        free = column["key"].endswith(("_re", "_im")) or "phase" in column["key"] or "engine" in what and "crank_deg" in column["key"]
        pairs = [(a[k], b[k]) for a, b in zip(one["rows"], two["rows"]) if (a[k], b[k]) != (None, None)]
        if any(not isinstance(x, (int, float)) for pair in pairs for x in pair):
            equal(f"{what}: {column['key']}", [b for _, b in pairs], [a for a, _ in pairs])
            continue
        factor = 2.0 ** exponent(column["unit"], scale)
        alike = [i for i, quantity in enumerate(quantities) if quantity == quantities[k]]
        greatest = max((abs(row[i]) for row in one["rows"] for i in alike if row[i] is not None), default=0)
        good = free or mixed and any(scale[1:]) or all(abs(b - a * factor) <= 1e-9 * greatest * factor for a, b in pairs)
        worst = max(pairs, key=lambda pair: abs(pair[1] - pair[0] * factor), default=None)
        check(f"{what}: {column['key']}", good, f"{factor} times", worst)


SCALING_TESTS = (test_scaling, test_reports)
