"""Machines described in the language of input files."""
from __future__ import annotations

import os
from collections.abc import Sequence
from ctypes import byref, c_double, c_int, c_void_p, create_string_buffer

import numpy

from ._library import Error, call, decoded, delete, encoded, encoded_path, functions, new_machine
from ._solution import Solution


_LONGEST_WHOLE = 1e15


def _spelled(value) -> str:
    """The value as written in an input file."""
    if isinstance(value, str):
        return "'" + value.replace("'", "''") + "'"
    if isinstance(value, (bool, numpy.bool_)):
        return ".true." if value else ".false."
    if numpy.ndim(value) == 0:
        number = _number(value)
        return str(int(number)) if number.is_integer() and abs(number) < _LONGEST_WHOLE else repr(number)
    return ",".join(_spelled(one) for one in value)


def _number(value) -> float:
    try:
        return float(value)
    except OverflowError:
        raise Error("a number is too large", 2) from None


class Machine:
    """A machine, read from an input file or a text in the same language (doc/input.md), or built with `add`.

    A str that contains an & or a line break is a text; any other str, a Path or bytes is the path of a file.
    `machine["drive.speed_rpm"]` reads or sets the number at a path, in the units of the input. Several numbers are returned as an
    array. Words can be set too: `machine["model.frame"] = "rest"`.
    """

    def __init__(self, path_or_text: str | bytes | os.PathLike | None = None):
        self._handle = new_machine()
        if isinstance(path_or_text, str) and ("&" in path_or_text or "\n" in path_or_text):
            call(functions.parse, self._handle, encoded(path_or_text))
        elif path_or_text is not None:
            call(functions.read, self._handle, encoded_path(path_or_text))

    def add(self, group: str, **values) -> "Machine":
        """Adds a group of the input and returns the machine.

        Example: add("joint", name="B", type="RRR", ends=["A", "B0"], lengths=[0.37, 0.16]). Missing groups and keys are reported
        when the machine is solved.
        """
        words = ", ".join(f"{key}={_spelled(value)}" for key, value in values.items())
        call(functions.add, self._handle, encoded(f"&{group} {words} /"))
        return self

    def __getitem__(self, path: str) -> float | numpy.ndarray:
        count = c_int()
        call(functions.count_values, self._handle, encoded(path), byref(count))
        values = (c_double * count.value)()
        call(functions.get_values, self._handle, encoded(path), count.value, values)
        return values[0] if count.value == 1 else numpy.array(values)

    def __setitem__(self, path: str, value: float | str | bool | Sequence) -> None:
        if isinstance(value, str):
            call(functions.set_text, self._handle, encoded(path), encoded(value))
        elif isinstance(value, (bool, numpy.bool_)) or numpy.ndim(value) != 0:
            call(functions.set_text, self._handle, encoded(path), encoded(_spelled(value)))
        else:
            call(functions.set, self._handle, encoded(path), _number(value))

    @property
    def text(self) -> str:
        """The machine as the text of an input file: the text that was read, with all values set and all groups added since then."""
        size = c_int()
        call(functions.size_input, self._handle, byref(size))
        text = create_string_buffer(size.value)
        call(functions.get_input, self._handle, size.value, text)
        return decoded(text.value)

    def write(self, path: str | bytes | os.PathLike) -> None:
        """Writes the machine as an input file."""
        with open(path, "w", encoding="utf-8", newline="") as file:
            file.write(self.text)

    def _repr_html_(self) -> str:
        """The machine in motion, for notebooks."""
        return self.solve("drawing").animate()._repr_html_()

    def solve(self, tasks: str | Sequence[str] | None = None) -> Solution:
        """Runs the tasks of the input, or the given ones: "stability", or ["stability", "response"]. Writes no files."""
        if tasks is not None and not isinstance(tasks, str):
            tasks = ", ".join(tasks)
        handle = c_void_p()
        call(functions.solve, self._handle, None if tasks is None else encoded(tasks), byref(handle))
        return Solution(handle)

    def __del__(self) -> None:
        if getattr(self, "_handle", None):
            delete("machine", self._handle)
