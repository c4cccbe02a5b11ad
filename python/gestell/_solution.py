"""Results of a machine."""
from __future__ import annotations

import base64
import ctypes
import html
import json
import os
import tempfile
from ctypes import byref, c_int
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy
from numpy.typing import NDArray

from ._array import Array, Value
from ._library import Error, Handle, call, decoded, delete, encoded, encoded_path, functions
from ._table import Table

_LONGEST_NAME = 256
_LONGEST_UNIT = 64
_NUMBERS, _INTEGERS, _WORDS = range(3)
_NOT_KNOWN = -2**31 + 1


@dataclass(frozen=True, repr=False, eq=False)
class Response:
    """Vibration of a quantity over the period, in SI units.

    `peak` and `rms` have an `.error` each. `amplitudes` are those of the orders 1, 2, ...; if gear ratios make the period several
    turns long, those of the harmonics of the period. `history` has the values at equidistant times, both ends included.
    """

    name: str
    unit: str
    peak: Value
    rms: Value
    amplitudes: Array
    history: Array

    def __repr__(self) -> str:
        return f"Response({self.name!r}: peak {self.peak!r}, rms {self.rms!r})"


class Animation:
    """An animated picture as SVG text, `svg`, which notebooks and browsers play."""

    def __init__(self, svg: str):
        self.svg = svg

    def save(self, path: str | bytes | os.PathLike[str]) -> None:
        """Writes the picture to a file, whose name should end with .svg."""
        with open(path, "w", encoding="utf-8", newline="") as file:
            file.write(self.svg)

    def _repr_html_(self) -> str:
        return _image("animation", self.svg)


def _image(name: str, picture: str) -> str:
    """An HTML image of an SVG picture. Ids of several pictures cannot clash, because each is a document of its own."""
    data = base64.b64encode(picture.encode()).decode()
    return f'<img alt="{html.escape(name)}" src="data:image/svg+xml;base64,{data}">'


class Solution:
    """Results of a machine: verdict, multipliers, vibrations, tables and the report.

    A pickled solution contains its input, verdict, multipliers and tables; what else it is asked for is then computed again.

    >>> solution = gestell.Machine("data/khang_four_bar.nml").solve(["stability", "response", "drawing"])
    >>> solution.verdict
    'stable'
    >>> solution.response("f")
    Response('f': peak 61.7933... N +- ..., rms 36.6352... N +- ...)
    >>> print(solution.natural_frequencies.round(2), solution.natural_frequencies.unit)
    [20.26 32.05 52.49] Hz
    """

    def __init__(self, handle: Handle | None, name: bytes, pickled: dict[str, Any] | None = None):
        self._solved = handle
        self._name = name
        self._pickled = pickled or {}

    def __del__(self) -> None:
        if getattr(self, "_solved", None):
            delete("solution", self._handle)

    @property
    def _handle(self) -> Handle:
        if self._solved is None:
            from ._machine import restored
            again = restored(self._pickled["input"], self._name).solve()
            self._solved, again._solved = again._handle, None
        return self._solved

    def __reduce__(self) -> Any:
        if not self._pickled:
            multipliers: Array | None = None
            try:
                multipliers = self.multipliers
            except Error:
                pass
            self._pickled = {"input": self.input, "verdict": self.verdict, "failure": self.failure, "multipliers": multipliers,
                             "tables": {name: self.table(name) for name in self.tables}}
        return Solution, (None, self._name, self._pickled)

    def __copy__(self) -> Solution:
        return self

    def __deepcopy__(self, memo: Any) -> Solution:
        return self

    def _text(self, what: str) -> str:
        if what in self._pickled:
            return str(self._pickled[what])
        size = c_int()
        call(functions.size_text, self._handle, encoded(what), byref(size))
        text = ctypes.create_string_buffer(size.value)
        call(functions.get_text, self._handle, encoded(what), size.value, text)
        return text.value.decode("utf-8", "replace")

    @property
    def verdict(self) -> str:
        """The worst verdict of all tasks: "stable", "undamped", "undecided" or "unstable"; empty if no task judges stability."""
        return self._text("verdict")

    @property
    def input(self) -> str:
        """The text of an input file that requests these results."""
        return self._text("input")

    @property
    def report(self) -> str:
        """The report that the program prints."""
        return self._text("report")

    @property
    def page(self) -> str:
        """The HTML page of the report, without the pictures of gnuplot."""
        return self._text("page")

    @property
    def machine(self) -> Any:
        """The machine of the solution, as in results.json: its values with units and ranges, and its scenes."""
        return json.loads(self._text("machine"))

    @property
    def results(self) -> Any:
        """All results, as in results.json."""
        return json.loads(self._text("results"))

    def animate(self, what: str = "mechanism") -> Animation:
        """The machine in motion, with the vibration of its frame magnified; with "modes" its mode shapes, if they were computed."""
        return Animation(self._text(what + "_motion.svg"))

    @property
    def failure(self) -> str:
        """Why a result other than the verdict could not be computed; empty if all were."""
        return self._text("failure")

    @property
    def multipliers(self) -> Array:
        """Complex multipliers in descending magnitude, with bounds on their errors in `.error`."""
        kept: Array | None = self._pickled.get("multipliers")
        if kept is not None:
            return kept
        count = c_int()
        call(functions.count_multipliers, self._handle, byref(count))
        parts = numpy.empty((3, count.value))
        first, step = parts.ctypes.data, parts.strides[0]
        call(functions.get_multipliers, self._handle, count.value, first, first + step, first + 2 * step)
        return Array(parts[0] + 1j * parts[1], error=parts[2])

    @property
    def natural_frequencies(self) -> Array:
        """Natural frequencies in Hz, without damping and about rest (task `drawing`)."""
        return self._column_of("frequencies", "frequency_Hz")

    @property
    def damping_ratios(self) -> Array:
        """Damping ratios of the modes of `natural_frequencies` (task `drawing`)."""
        return self._column_of("frequencies", "damping_ratio")

    @property
    def modes(self) -> NDArray[numpy.complex128]:
        """Eigenvectors of Phi(T) at crank angle 0, in the order of the multipliers: displacements and velocities in SI units (task
        `modes`). modes[:, i] belongs to multipliers[i]; modes[0] is the displacement along xi.
        """
        table = self.table("modes")
        return numpy.array([table[key] + 1j * table[key[:-2] + "im"] for key in table if key.endswith("_re")])

    @property
    def shaking_forces(self) -> Table:
        """Amplitudes and phases of the forces of the mechanism on a frame at rest, for each order (task `drawing`)."""
        return self.table("balance_table")

    @property
    def joint_forces(self) -> Table:
        """Peak and rms of the forces in the joints (task `joints`). The table "joints_history" contains their courses."""
        return self.table("joints")

    def _column_of(self, table: str, key: str) -> Array:
        column: Array = self.table(table)[key]
        return column

    def response(self, quantity: str) -> Response:
        """The vibration of a quantity, for example "f" or "probe(outlet).v"."""
        orders, points = c_int(), c_int()
        text = ctypes.create_string_buffer(_LONGEST_UNIT)
        call(functions.describe_response, self._handle, encoded(quantity), byref(orders), byref(points), _LONGEST_UNIT, text)
        numbers, amplitudes, history = numpy.empty(4), numpy.empty(orders.value), numpy.empty(points.value)
        call(functions.get_response, self._handle, encoded(quantity), numbers.ctypes.data, orders.value, amplitudes.ctypes.data,
             points.value, history.ctypes.data)
        peak, rms, peak_error, rms_error = numbers
        unit = decoded(text.value)
        return Response(quantity, unit, Value(peak, peak_error, unit), Value(rms, rms_error, unit), Array(amplitudes, unit=unit),
                        Array(history, unit=unit))

    def write(self, folder: str | bytes | os.PathLike[str], pictures: bool = False) -> None:
        """Writes the program's files: tables, gnuplot scripts and, if `pictures` is true, the pictures that gnuplot draws."""
        call(functions.write, self._handle, encoded_path(folder), int(pictures))

    def pictures(self) -> dict[str, str]:
        """All pictures as SVG, by the names of their tables. Fails if gnuplot is missing."""
        with tempfile.TemporaryDirectory() as folder:
            self.write(folder, pictures=True)
            return {file.stem: file.read_text(encoding="utf-8") for file in sorted(Path(folder).glob("*.svg"))}

    @property
    def tables(self) -> list[str]:
        """Names of all tables."""
        if self._pickled:
            return list(self._pickled["tables"])
        count = c_int()
        call(functions.count_tables, self._handle, byref(count))
        name = ctypes.create_string_buffer(_LONGEST_NAME)
        names = []
        for index in range(count.value):
            call(functions.name_table, self._handle, index, _LONGEST_NAME, name)
            names.append(decoded(name.value))
        return names

    def table(self, name: str) -> Table:
        """The table with this name, with all its columns. If there is none, the error names the task that computes it."""
        if self._pickled and name in self._pickled["tables"]:
            kept: Table = self._pickled["tables"][name]
            return kept
        rows, count = c_int(), c_int()
        call(functions.shape_table, self._handle, encoded(name), byref(rows), byref(count))
        columns: dict[str, NDArray[Any]] = {}
        errors = {}
        for index in range(count.value):
            key, values, error = self._column(name, index, rows.value)
            columns[key] = values
            errors[key] = error
        for key, error in errors.items():
            column = columns[key]
            if error in columns and isinstance(column, Array):
                column.error = numpy.asarray(columns[error])
        return Table(name, columns)

    def _column(self, table: str, index: int, rows: int) -> tuple[str, NDArray[Any], str]:
        texts = [ctypes.create_string_buffer(_LONGEST_NAME) for _ in range(3)]
        kind, width = c_int(), c_int()
        call(functions.describe_column, self._handle, encoded(table), index, _LONGEST_NAME, *texts, byref(kind), byref(width))
        key, unit, error = (decoded(text.value) for text in texts)
        where = (self._handle, encoded(table), index, rows)
        if kind.value == _WORDS:
            words = numpy.zeros(rows, dtype=f"S{width.value}")
            call(functions.get_words, *where, width.value, words.ctypes.data)
            return key, numpy.array([decoded(word) for word in words.tolist()], dtype=str), error
        if kind.value == _INTEGERS:
            integers = numpy.empty(rows, dtype=numpy.intc)
            call(functions.get_integers, *where, integers.ctypes.data)
            if (integers == _NOT_KNOWN).any():
                return key, Array(numpy.where(integers == _NOT_KNOWN, numpy.nan, integers), unit=unit), error
            return key, Array(integers, unit=unit), error
        values = numpy.empty(rows)
        call(functions.get_numbers, *where, values.ctypes.data)
        return key, Array(values, unit=unit), error

    def _repr_html_(self) -> str:
        parts = [f"<p><b>{html.escape(self.verdict)}</b></p>"] if self.verdict else []
        try:
            rho = self.multipliers
            columns = {"multiplier": rho, "abs": abs(rho), "error": numpy.asarray(rho.error)}
            parts.append(Table("multipliers", columns)._repr_html_())
        except Error:
            pass
        parts.append("<p>tables: " + ", ".join(html.escape(name) for name in self.tables) + "</p>")
        try:
            parts += [_image(name, picture) for name, picture in self.pictures().items()]
        except Error as error:
            parts.append(f"<p>no pictures: {html.escape(error.message)}</p>")
        return "".join(parts)

    def __repr__(self) -> str:
        return f"Solution({self.verdict or 'no verdict'}; tables: {', '.join(self.tables) or 'none'})"
