"""Tables of results: columns as NumPy arrays, with their SI units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _taxel

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame as _DataFrame  # type: ignore[import-untyped, unused-ignore]


class _Arrays:
    """Columns that were a table before they travelled."""

    def __init__(self, columns: list[tuple[str, str, str, float]], arrays: dict[str, NDArray[Any]], rows: int) -> None:
        self._columns, self._arrays, self._rows = columns, arrays, rows

    def __len__(self) -> int:
        return self._rows

    def columns(self) -> list[tuple[str, str, str, float]]:
        return self._columns

    def column(self, name: str) -> NDArray[Any]:
        return self._arrays[name]


class Answers(Mapping[str, NDArray[Any]]):
    """Results in columns: a mapping of names to arrays of the shape ``(rows,)``.

    Numbers are ``float64`` in SI, counts ``int64``, words texts. A number that does not exist is
    NaN; a column whose cells are bounds in words is of the dtype ``object``. Names are the columns
    of the command.

    >>> import taxel
    >>> answers = taxel.Sensor("in-plane-50um").predict(fz=[0.0, 10.0])
    >>> answers["capacitance"].shape, answers.units["capacitance"]
    ((2,), 'F')
    """

    __slots__ = ("_table", "_units")

    def __init__(self, table: _taxel.Table | _Arrays) -> None:
        self._table = table
        self._units: dict[str, str] | None = None

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self._table.column(name)

    def __iter__(self) -> Iterator[str]:
        return (column[0] for column in self._table.columns())

    def __len__(self) -> int:
        return len(self._table.columns())

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self._table)

    @property
    def units(self) -> dict[str, str]:
        """SI unit of each column; empty for words, counts and plain numbers."""
        if self._units is None:
            self._units = {name: unit for name, unit, _, _ in self._table.columns()}
        return self._units

    def row(self, index: int) -> dict[str, Any]:
        """One row: names to values."""
        return {name: self[name][index] for name in self}

    def to_pandas(self) -> _DataFrame:
        """The table as a ``pandas.DataFrame``, SI; units stand in ``.attrs["units"]``.

        Needs pandas: ``pip install pandas``.
        """
        pandas = _needed("pandas")
        frame = pandas.DataFrame({name: self[name] for name in self})
        frame.attrs["units"] = self.units
        return frame

    def plot(self, x: str, *y: str, ax: Axes | None = None) -> Axes:
        """Draws the columns ``y`` over the column ``x``, in the units for people.

        Needs matplotlib: ``pip install matplotlib``. Returns the axes.

        Raises:
            KeyError: a column that is not there.
        """
        if ax is None:
            _, ax = _needed("matplotlib.pyplot").subplots()
        shown = {name: (unit, scale) for name, _, unit, scale in self._table.columns()}

        def label(name: str) -> str:
            words = name.replace("_", " ")
            return f"{words} [{shown[name][0]}]" if shown[name][0] else words

        for name in y:
            ax.plot(self[x] / shown[x][1], self[name] / shown[name][1], label=name.replace("_", " "))
        ax.set_xlabel(label(x))
        if len(y) == 1:
            ax.set_ylabel(label(y[0]))
        else:
            units = {shown[name][0] for name in y}
            ax.set_ylabel(units.pop() if len(units) == 1 else "")
            ax.legend()
        return ax

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Answers):
            return NotImplemented
        return (
            list(self) == list(other)
            and self.units == other.units
            and all(same(self[name], other[name]) for name in self)
        )

    __hash__ = None  # type: ignore[assignment]

    def __reduce__(self) -> tuple[Any, ...]:
        arrays = {name: self[name] for name in self}
        return _answers_of, (self._table.columns(), arrays, self.rows)

    def __repr__(self) -> str:
        return f"<Answers: {self.rows} rows of {', '.join(self)}>"

    def _repr_html_(self) -> str:
        head = "".join(
            f"<th>{_escaped(name)}{f' [{_escaped(unit)}]' if unit else ''}</th>" for name, _, unit, _ in self._table.columns()
        )
        body = []
        for index in range(min(self.rows, 10)):
            cells = []
            for name, _, _, scale in self._table.columns():
                value = self[name][index]
                number = isinstance(value, (float, np.floating))
                cells.append(f"<td>{value / scale:.6g}</td>" if number else f"<td>{_escaped(str(value))}</td>")
            body.append(f"<tr>{''.join(cells)}</tr>")
        more = f"<p>{self.rows} rows</p>" if self.rows > 10 else ""
        return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(body)}</tbody></table>{more}"


def _answers_of(columns: list[tuple[str, str, str, float]], arrays: dict[str, NDArray[Any]], rows: int) -> Answers:
    return Answers(_Arrays(columns, arrays, rows))


def same(one: NDArray[Any], other: NDArray[Any]) -> bool:
    """True if two arrays are equal, NaN equal to NaN."""
    if one.shape != other.shape or one.dtype != other.dtype:
        return False
    return bool(np.array_equal(one, other, equal_nan=one.dtype.kind in "fc"))


def _escaped(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;")


def _needed(module: str) -> Any:
    """A module that only this call needs."""
    import importlib

    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        raise ImportError(f"this needs {package}: pip install {package}") from error
