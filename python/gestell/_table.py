"""Tables of results, over rows and over grids of parameters."""
from __future__ import annotations

import html
import importlib
from typing import TYPE_CHECKING, Any

import numpy
from numpy.typing import NDArray

from ._array import Array

if TYPE_CHECKING:
    import pandas  # type: ignore[import-untyped, import-not-found, unused-ignore]
    import xarray  # type: ignore[import-not-found, unused-ignore]

_SHOWN_ROWS = 20


def _package(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError:
        raise ImportError(f"{name} is not installed: python3 -m pip install {name}") from None


def _attributes(column: NDArray[Any]) -> dict[str, str]:
    """The unit of a column as xarray and the climate and forecast conventions name it."""
    return {"units": column.unit} if isinstance(column, Array) and column.unit else {}


class Table(dict[str, Any]):
    """A table: its columns by their keys, as in the CSV file.

    A column of numbers is an Array with `.error` and `.unit`; a column of words is an array of str.

    >>> table = Table("peaks", {"order": Array([1, 2]), "f_N": Array([30.5, 4.0], error=[0.1, 0.1], unit="N")})
    >>> table
    Table('peaks', 2 rows: order, f_N)
    >>> table["f_N"][0]
    30.5 N +- 0.1
    """

    def __init__(self, name: str, columns: dict[str, NDArray[Any]]):
        super().__init__(columns)
        self.name = name

    @property
    def rows(self) -> int:
        return len(next(iter(self.values()))) if self else 0

    def to_pandas(self) -> pandas.DataFrame:
        """The table as a DataFrame, with the units of the columns in `.attrs["units"]`."""
        frame: pandas.DataFrame = _package("pandas").DataFrame({key: numpy.asarray(column) for key, column in self.items()})
        frame.attrs["units"] = {key: column.unit for key, column in self.items() if isinstance(column, Array)}
        return frame

    def to_xarray(self) -> xarray.Dataset:
        """The table as a Dataset over its first column, with units."""
        first = next(iter(self))
        data: xarray.Dataset = _package("xarray").Dataset({key: (first, numpy.asarray(column), _attributes(column))
                                                           for key, column in self.items()})
        return data

    def __repr__(self) -> str:
        return f"Table({self.name!r}, {self.rows} rows: {', '.join(self)})"

    def _repr_html_(self) -> str:
        rows = [[f"{v:.6g}" if isinstance(v, (float, numpy.floating)) else str(v) for v in row]
                for row in zip(*(numpy.asarray(column[:_SHOWN_ROWS]) for column in self.values()))]
        cell = "".join
        body = cell("<tr>" + cell(f"<td>{html.escape(v)}</td>" for v in row) + "</tr>" for row in rows)
        head = cell(f"<th>{html.escape(key)}</th>" for key in self)
        more = f"<p>{self.rows} rows</p>" if self.rows > _SHOWN_ROWS else ""
        return f"<table><caption>{html.escape(self.name)}</caption><tr>{head}</tr>{body}</table>{more}"


class Grid(dict[str, Any]):
    """Results over a grid of parameters: each column is an array with one dimension for each parameter.

    `axes` are the values of the parameters by their paths, in the order of the dimensions.
    """

    def __init__(self, axes: dict[str, NDArray[Any]], columns: dict[str, NDArray[Any]]):
        super().__init__(columns)
        self.axes = axes

    @property
    def shape(self) -> tuple[int, ...]:
        return tuple(map(len, self.axes.values()))

    def table(self) -> Table:
        """The grid as a table with a row for each point; the last parameter varies fastest."""
        points = numpy.meshgrid(*self.axes.values(), indexing="ij")
        columns: dict[str, NDArray[Any]] = {path: values.ravel() for path, values in zip(self.axes, points)}
        for key, column in self.items():
            columns[key] = numpy.ravel(column)
            if isinstance(column, Array):
                columns[key] = Array(columns[key], None if column.error is None else column.error.ravel(), column.unit)
        return Table("sweep", columns)

    def to_pandas(self) -> pandas.DataFrame:
        """The grid as a DataFrame with a row for each point, whose index is the values of the parameters."""
        return self.table().to_pandas().set_index(list(self.axes))

    def to_xarray(self) -> xarray.Dataset:
        """The grid as a Dataset, whose coordinates are the values of the parameters."""
        columns = {key: (list(self.axes), numpy.asarray(column), _attributes(column)) for key, column in self.items()}
        data: xarray.Dataset = _package("xarray").Dataset(columns, coords=dict(self.axes))
        return data

    def __repr__(self) -> str:
        return f"Grid({' x '.join(f'{len(axis)} {path}' for path, axis in self.axes.items())}: {', '.join(self)})"

    def _repr_html_(self) -> str:
        return self.table()._repr_html_()
