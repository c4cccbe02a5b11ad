"""Numbers with their errors and their units."""
from __future__ import annotations

import numpy


class Array(numpy.ndarray):
    """An array of numpy that knows bounds on its errors, `error` (None: not told), and its `unit`, empty for none."""

    error: numpy.ndarray | None
    unit: str

    def __new__(cls, values, error=None, unit: str = "") -> "Array":
        array = numpy.asarray(values).view(cls)
        array.error = error
        array.unit = unit
        return array

    def __array_finalize__(self, origin) -> None:
        self.error = None
        self.unit = getattr(origin, "unit", "") if origin is not None else ""


class Value(float):
    """A number that knows a bound on its error, `error`, and its `unit`."""

    error: float
    unit: str

    def __new__(cls, value: float, error: float, unit: str = "") -> "Value":
        number = super().__new__(cls, value)
        number.error = float(error)
        number.unit = unit
        return number

    def __getnewargs__(self):
        return float(self), self.error, self.unit
