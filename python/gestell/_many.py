"""Many machines at once, on all cores."""
from __future__ import annotations

import itertools
import os
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy
from numpy.typing import ArrayLike, NDArray

from ._array import Array
from ._library import Error, use_one_core
from ._solution import Solution
from ._table import Grid

if TYPE_CHECKING:
    from ._machine import Machine

# A range may differ from its equally spaced values by rounding errors.
_ROUNDING = 1e-13
# The library varies so many parameters in one sweep.
_MOST_RANGES = 2


@overload
def solve_many(machines: Iterable[Machine], tasks: str | Sequence[str] | None = ..., *, threads: int | None = ...,
               errors: Literal["raise"] = ...) -> list[Solution]: ...


@overload
def solve_many(machines: Iterable[Machine], tasks: str | Sequence[str] | None = ..., *, threads: int | None = ...,
               errors: Literal["return"]) -> list[Solution | Error]: ...


def solve_many(machines: Iterable[Machine], tasks: str | Sequence[str] | None = None, *, threads: int | None = None,
               errors: str = "raise") -> Any:
    """Solves machines in threads, by default one for each core, and returns their solutions in the order of the machines.

    Each of several threads uses one core; if `threads` is 1, the sweep of a machine uses all. If `errors` is "return", the list
    contains the `gestell.Error` of each machine that cannot be solved.

    >>> machine = gestell.Machine("data/khang_four_bar.nml")
    >>> machines = [machine.copy({"drive.speed_rpm": speed}) for speed in (200, 300)]
    >>> [solution.verdict for solution in gestell.solve_many(machines, "stability")]
    ['stable', 'stable']
    """
    if errors not in ("raise", "return"):
        raise ValueError(f"errors must be 'raise' or 'return', not {errors!r}")

    def solve(machine: Machine) -> Solution | Error:
        try:
            return machine.solve(tasks)
        except Error as error:
            if errors == "raise":
                raise
            return error

    if threads == 1:
        return [solve(machine) for machine in machines]
    with ThreadPoolExecutor(threads or _cores(), initializer=use_one_core) as pool:
        return list(pool.map(solve, machines))


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def sweep(machine: Machine, values: Mapping[str, ArrayLike], columns: Sequence[str] | None, options: dict[str, Any]) -> Grid:
    """See `Machine.sweep`. Up to two parameters vary within the library, equally spaced values in one sweep. All others are set."""
    axes = {path: numpy.atleast_1d(numpy.asarray(axis)) for path, axis in values.items()}
    if not axes or any(axis.ndim != 1 or axis.size == 0 for axis in axes.values()):
        raise Error("a sweep needs at least one path, and one or more values for each", 1)
    base = machine.copy()
    if any(name.partition("(")[0] == "sweep" for name in machine.groups):
        base.remove("sweep")
    spacings = {path: _spacing(axis) for path, axis in axes.items() if _varies_within(machine, path, axis)}
    inner = sorted(spacings, key=lambda path: (spacings[path] == "", -len(axes[path])))[:_MOST_RANGES]
    if not inner:
        raise Error("a sweep must vary at least one real number of the machine or its drive", 1)
    parts = [[slice(0, len(axis))] if path in inner and spacings[path] else [slice(i, i + 1) for i in range(len(axis))]
             for path, axis in axes.items()]
    blocks = list(itertools.product(*parts))
    machines = (_block(base, axes, block, inner, spacings, columns, options) for block in blocks)
    points = max(int(numpy.prod([part.stop - part.start for part in block])) for block in blocks)
    # many small sweeps side by side, or few large ones on all cores one after the other
    solutions = solve_many(machines, "sweep", threads=None if len(blocks) > points else 1)
    tables = [solution.table("sweep") for solution in solutions]
    shape = tuple(map(len, axes.values()))

    def joined(arrays: list[NDArray[Any]]) -> NDArray[Any]:
        whole = numpy.empty(shape, numpy.result_type(*arrays))
        for block, array in zip(blocks, arrays):
            whole[block] = numpy.reshape(array, whole[block].shape)
        return whole

    results: dict[str, NDArray[Any]] = {}
    for key, column in tables[0].items():
        if key in axes:
            continue
        results[key] = joined([numpy.asarray(table[key]) for table in tables])
        if isinstance(column, Array):
            error = None if column.error is None else joined([table[key].error for table in tables])
            results[key] = Array(results[key], error, column.unit)
    return Grid(axes, results)


def _varies_within(machine: Machine, path: str, axis: NDArray[Any]) -> bool:
    """Whether the library can vary what a path denotes: a real number."""
    if axis.dtype.kind not in "iuf":
        return False
    return path not in machine or not any("whole" in one for one in machine.parameters(path))


def _spacing(axis: NDArray[Any]) -> str:
    """The spacing of equidistant values on a linear or logarithmic scale; empty for other values."""
    first, last = axis[0], axis[-1]
    if len(axis) == 1:
        return "linear"
    if not first != last:
        return ""
    limit = _ROUNDING * max(abs(first), abs(last))
    if numpy.all(abs(axis - numpy.linspace(first, last, len(axis))) <= limit):
        return "linear"
    if first * last > 0 and numpy.all(abs(axis - numpy.geomspace(first, last, len(axis))) <= limit):
        return "log"
    return ""


def _block(base: Machine, axes: dict[str, NDArray[Any]], block: tuple[slice, ...], inner: list[str], spacings: dict[str, str],
           columns: Sequence[str] | None, options: dict[str, Any]) -> Machine:
    """The machine that sweeps one part of a grid."""
    machine = base.copy()
    if columns is not None:
        options = {**options, "columns": columns}
    for (path, axis), part in zip(axes.items(), block):
        if path not in inner:
            machine[path] = axis[part.start].item()
            continue
        values = axis[part]
        machine.add("sweep", parameter=path, from_=values[0], to=values[-1], count=len(values), spacing=spacings[path] or "linear",
                    **options)
    return machine
