"""Machines described in the language of input files."""
from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from ctypes import byref, c_int, create_string_buffer
from typing import Any

import numpy
from numpy.typing import ArrayLike

from ._library import Error, Handle, call, decoded, delete, encoded, encoded_path, functions, new_machine
from ._many import sweep
from ._solution import Solution
from ._table import Grid

_LONGEST_WHOLE = 1e15


def _spelled(value: Any) -> str:
    """The value as written in an input file."""
    if isinstance(value, str):
        return "'" + value.replace("'", "''") + "'"
    if isinstance(value, (bool, numpy.bool_)):
        return ".true." if value else ".false."
    if numpy.ndim(value) == 0:
        number = _number(value)
        return str(int(number)) if number.is_integer() and abs(number) < _LONGEST_WHOLE else repr(number)
    return ",".join(_spelled(one) for one in value)


def _number(value: Any) -> float:
    try:
        return float(value)
    except OverflowError:
        raise Error("a number is too large", 2) from None


class Machine:
    """A machine, read from an input file or a text in the same language (doc/input.md), or built with `add`.

    A str that contains an & or a line break is a text, which messages call `name`; any other str, a Path or bytes is the path of a
    file. The values of the input are items of the machine, in the units of the input. Machines can be copied and pickled.

    >>> machine = gestell.Machine("data/khang_four_bar.nml")
    >>> machine
    Machine('Four-bar mechanism': 4 joint, 3 link, 4 support)
    >>> machine["drive.speed_rpm"], machine["joint(B).lengths"], machine["model.frame"]
    (240.0, array([0.37, 0.16]), 'rest')
    >>> machine["drive.speed_rpm"] = 300
    >>> "foundation.stiffness" in machine
    False
    """

    def __init__(self, path_or_text: str | bytes | os.PathLike[str] | None = None, name: str | bytes = "text"):
        self._handle = new_machine()
        self._name = encoded_path(name)
        if isinstance(path_or_text, str) and ("&" in path_or_text or "\n" in path_or_text):
            call(functions.parse_named, self._handle, encoded(path_or_text), self._name)
        elif path_or_text is not None:
            self._name = encoded_path(path_or_text)
            call(functions.read, self._handle, self._name)

    def add(self, group: str, **values: Any) -> Machine:
        """Adds a group of the input and returns the machine.

        An underscore at the end of a key is ignored, because `from` is a word of Python. Missing groups and keys are reported when
        the machine is solved.

        >>> machine = gestell.Machine()
        >>> machine.add("joint", name="B", type="RRR", ends=["A", "B0"], lengths=[0.37, 0.16])
        Machine(1 joint)
        >>> machine.add("link", name="rocker", from_="B0", to="B", mass=0.25)
        Machine(1 joint, 1 link)
        """
        words = ", ".join(f"{key[:-1] if key.endswith('_') else key}={_spelled(value)}" for key, value in values.items())
        call(functions.add, self._handle, encoded(f"&{group} {words} /"))
        return self

    def remove(self, groups: str) -> Machine:
        """Removes one group, such as "support(2)", or all groups of a kind, such as "probe", and returns the machine."""
        call(functions.remove, self._handle, encoded(groups))
        return self

    def parameters(self, path: str | None = None) -> list[dict[str, Any]]:
        """All values of the input, or those at a path, with their units, ranges and meanings, as in results.json.

        >>> found = gestell.Machine("data/khang_four_bar.nml").parameters("frame.mass")
        >>> found[0]["values"], found[0]["unit"], found[0]["meaning"]
        ([18.0], 'kg', 'mass of the frame without the links')
        """
        size = c_int()
        place = None if path is None else encoded(path)
        call(functions.size_parameters, self._handle, place, byref(size))
        text = create_string_buffer(size.value)
        call(functions.get_parameters, self._handle, place, size.value, text)
        found: list[dict[str, Any]] = json.loads(decoded(text.value))
        return found

    def __getitem__(self, path: str) -> Any:
        """The value at a path: a number or a str, several numbers as an array, several words as a list."""
        return _value(self.parameters(path))

    def __setitem__(self, path: str, value: float | str | bool | Sequence[Any] | numpy.ndarray[Any, Any]) -> None:
        if isinstance(value, str):
            call(functions.set_text, self._handle, encoded(path), encoded(value))
        elif isinstance(value, (bool, numpy.bool_)) or numpy.ndim(value) != 0:
            call(functions.set_text, self._handle, encoded(path), encoded(_spelled(value)))
        else:
            call(functions.set, self._handle, encoded(path), _number(value))

    def __contains__(self, path: object) -> bool:
        """Whether the input contains a value at this path."""
        try:
            return isinstance(path, str) and bool(self.parameters(path))
        except Error:
            return False

    def __iter__(self) -> Iterator[str]:
        return iter(self.keys())

    def keys(self) -> list[str]:
        """The paths of all values of the input."""
        return list(dict(self.items()))

    _ipython_key_completions_ = keys

    def items(self) -> list[tuple[str, Any]]:
        """The paths of all values of the input, and the values."""
        try:
            return [(one["path"], _value([one])) for one in self.parameters()]
        except Error:
            if self._is_empty():
                return []
            raise

    @property
    def groups(self) -> dict[str, dict[str, Any]]:
        """The groups of the input by name or number, each with its keys and values. Changes of the dicts do not change the machine.

        >>> gestell.Machine("data/khang_four_bar.nml").groups["link(rocker)"]
        {'from': 'B0', 'to': 'B', 'mass': 0.25, 'inertia': 0.006, 'center': array([0.08, 0.  ])}
        """
        groups: dict[str, dict[str, Any]] = {}
        for path, value in self.items():
            group, _, key = path.rpartition(".")
            groups.setdefault(group, {})[key] = value
        return groups

    @property
    def text(self) -> str:
        """The machine as the text of an input file: the text that was read, with all values set and all groups added since then."""
        size = c_int()
        call(functions.size_input, self._handle, byref(size))
        text = create_string_buffer(size.value)
        call(functions.get_input, self._handle, size.value, text)
        return decoded(text.value)

    def write(self, path: str | bytes | os.PathLike[str]) -> None:
        """Writes the machine as an input file."""
        with open(path, "w", encoding="utf-8", newline="") as file:
            file.write(self.text)

    def copy(self, changes: Mapping[str, Any] | None = None) -> Machine:
        """A copy of the machine, with the values of `changes` at their paths.

        >>> machine = gestell.Machine("data/khang_four_bar.nml")
        >>> machine.copy({"drive.speed_rpm": 300})["drive.speed_rpm"], machine["drive.speed_rpm"]
        (300.0, 240.0)
        """
        handle = Handle()
        call(functions.copy_machine, self._handle, byref(handle))
        copy = object.__new__(type(self))
        copy._handle, copy._name = handle, self._name
        for path, value in (changes or {}).items():
            copy[path] = value
        return copy

    def __copy__(self) -> Machine:
        return self.copy()

    def __deepcopy__(self, memo: Any) -> Machine:
        return self.copy()

    def __reduce__(self) -> Any:
        return (Machine, ()) if self._is_empty() else (restored, (self.text, self._name))

    def _is_empty(self) -> bool:
        size = c_int()
        try:
            call(functions.size_input, self._handle, byref(size))
        except Error:
            return True
        return False

    def solve(self, tasks: str | Sequence[str] | None = None) -> Solution:
        """Runs the tasks of the input, or the given ones, and returns their results. Writes no files.

        >>> gestell.Machine("data/khang_four_bar.nml").solve(["stability", "response"])
        Solution(stable; tables: multipliers, response, harmonics)
        """
        if tasks is not None and not isinstance(tasks, str):
            tasks = ", ".join(tasks)
        handle = Handle()
        call(functions.solve, self._handle, None if tasks is None else encoded(tasks), byref(handle))
        return Solution(handle, self._name)

    def sweep(self, values: Mapping[str, ArrayLike], columns: Sequence[str] | None = None, **options: Any) -> Grid:
        """Solves the machine at all combinations of values, on all cores, by the task `sweep`. Groups &sweep of the input are
        ignored.

        `values`: for each path its values. At least one path must denote a real number; others may denote words or whole numbers.
        Equally spaced numbers, linear or logarithmic, are fastest. `columns` and `options`: results and other keys of &sweep
        (doc/input.md), such as measures=["peak", "rms"].

        >>> machine = gestell.Machine("data/khang_four_bar.nml")
        >>> grid = machine.sweep({"drive.speed_rpm": [200, 250, 300], "frame.mass": [18, 24]}, columns=["rho_max", "f"])
        >>> grid
        Grid(3 drive.speed_rpm x 2 frame.mass: rho_max, verdict, f_peak_N, f_peak_error_N)
        >>> grid["f_peak_N"].shape, grid["f_peak_N"].unit
        ((3, 2), 'N')
        """
        return sweep(self, values, columns, options)

    def __repr__(self) -> str:
        try:
            groups = self.groups
        except Error:
            return "Machine(...)"
        kinds = Counter(name.partition("(")[0] for name in groups)
        counts = ", ".join(f"{kinds[kind]} {kind}" for kind in ("mechanism", "joint", "link", "support") if kind in kinds)
        title = groups.get("case", {}).get("title", "")
        return f"Machine({repr(title) + ': ' if title else ''}{counts or ('other groups' if groups else 'empty')})"

    def _repr_html_(self) -> str | None:
        """The machine in motion, for notebooks, if it can be drawn."""
        try:
            return self.solve("drawing").animate()._repr_html_()
        except Error:
            return None

    def __del__(self) -> None:
        if getattr(self, "_handle", None):
            delete("machine", self._handle)


def _value(parameters: list[dict[str, Any]]) -> Any:
    values = [value for one in parameters for value in one["values"] if value is not None]
    if isinstance(values[0], str):
        return values if len(values) > 1 or parameters[0].get("list") else values[0]
    return values[0] if len(values) == 1 else numpy.array(values)


def restored(text: str, name: bytes) -> Machine:
    """The machine of a text, which may lack groups."""
    try:
        return Machine(text, name)
    except Error:
        machine = Machine()
        call(functions.add, machine._handle, encoded(text))
        return machine
