"""Numbers with error bounds and units."""
from __future__ import annotations

import math
from typing import Any

import numpy
from numpy.typing import ArrayLike, NDArray

# Functions that do not change a number's distance from another.
_KEEP_ERRORS = (numpy.absolute, numpy.negative, numpy.positive, numpy.conjugate)


class Array(numpy.ndarray):  # type: ignore[type-arg, unused-ignore]
    """A numpy array with bounds on the errors of its elements, `error` (None if there are none), and a `unit` (may be empty).

    Parts, copies and pickles of an array keep both; an element with an error bound is a `Value`. So do -x and abs(x). All other
    functions of numpy lose both.

    >>> force = Array([3.0, 4.0], error=[0.1, 0.2], unit="N")
    >>> force[1:]
    Array([4.], unit='N', error<=0.2)
    >>> force[0]
    3.0 N +- 0.1
    >>> force**2
    array([ 9., 16.])
    """

    # `| Any`: a user of mypy need not test for None the errors of an array that has them
    error: NDArray[Any] | Any
    unit: str

    def __new__(cls, values: ArrayLike, error: ArrayLike | None = None, unit: str = "") -> Array:
        array = numpy.asarray(values).view(cls)
        array.error = None if error is None else numpy.asarray(error)
        array.unit = unit
        return array

    def __array_finalize__(self, origin: Any) -> None:
        self.error = None
        self.unit = ""

    def __array_wrap__(self, array: Any, context: Any = None, return_scalar: bool = False) -> Any:
        if context is not None and context[0] in _KEEP_ERRORS:
            return Array(array, self.error, self.unit)
        plain = numpy.asarray(array)
        return plain if plain.ndim else plain[()]

    def __getitem__(self, index: Any) -> Any:
        part = super().__getitem__(index)
        error = None if self.error is None else self.error[index]
        if isinstance(part, Array):
            part.error, part.unit = error, self.unit
        elif isinstance(part, float) and error is not None:
            return Value(part, error, self.unit)
        return part

    def sort(self, *arguments: Any, **options: Any) -> None:
        """Sorts the numbers in place. The array then has no error bounds."""
        super().sort(*arguments, **options)
        self.error = None

    def copy(self, order: Any = "C") -> Array:
        return Array(numpy.array(self, order=order), None if self.error is None else self.error.copy(), self.unit)

    def __copy__(self) -> Array:
        return self.copy()

    def __deepcopy__(self, memo: Any) -> Array:
        return self.copy()

    def __reduce__(self) -> Any:
        make, arguments, state = tuple(super().__reduce__())
        return make, arguments, (state, self.error, self.unit)

    def __setstate__(self, state: Any) -> None:
        super().__setstate__(state[0])
        self.error, self.unit = state[1:]

    def __repr__(self) -> str:
        words = numpy.array2string(numpy.asarray(self), separator=", ", prefix="Array(")
        unit = f", unit={self.unit!r}" if self.unit else ""
        error = f", error<={numpy.max(self.error):.2g}" if self.error is not None and self.error.size else ""
        return f"Array({words}{unit}{error})"


class Value(float):
    """A float with a bound on its error, `error`, and a `unit` (may be empty). Its `repr` has the digits that the bound supports.

    >>> Value(137.66612, 0.003, "N")
    137.666 N +- 0.003
    >>> print(Value(137.66612, 0.003, "N"))
    137.66612
    """

    error: float
    unit: str

    def __new__(cls, value: float, error: float, unit: str = "") -> Value:
        number = super().__new__(cls, value)
        number.error = float(error)
        number.unit = unit
        return number

    def __getnewargs__(self) -> tuple[float, float, str]:  # type: ignore[override]
        return float(self), self.error, self.unit

    def __repr__(self) -> str:
        number = float(self)
        words = repr(number)
        if number and math.isfinite(number) and 0 < self.error < math.inf:
            digits = math.floor(math.log10(abs(number))) - math.floor(math.log10(self.error)) + 1
            words = f"{number:#.{digits}g}".rstrip(".") if 0 < digits < 17 else words
        return f"{words} {self.unit}".rstrip() + f" +- {self.error:.2g}"

    __str__ = float.__repr__
