"""Numbers with error bounds and units."""
from __future__ import annotations

import numpy


class Array(numpy.ndarray):
    """A numpy array with bounds on the errors of its elements, `error` (None if there are none), and a `unit` (may be empty)."""

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
    """A float with a bound on its error, `error`, and a `unit` (may be empty)."""

    error: float
    unit: str

    def __new__(cls, value: float, error: float, unit: str = "") -> "Value":
        number = super().__new__(cls, value)
        number.error = float(error)
        number.unit = unit
        return number

    def __getnewargs__(self):
        return float(self), self.error, self.unit
