"""Rows of features from tables whose columns have names, such as pandas' data frames: each feature from its column."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from ._errors import InputError, ModelWarning


class _Named(Protocol):
    """Receiver of rows: a model, an ensemble or a recognizer."""

    def _columns(self, header: Sequence[str]) -> tuple[list[int], str | None]:
        """The positions of the features among columns with these names, and what to know about that."""


def rows_of(owner: _Named, rows: Any) -> npt.NDArray[np.float64]:
    """The rows as an array of numbers, NaN where one is missing. Of a table (pandas, polars, pyarrow) the columns are the
    owner's features, found by their names."""
    header = names_of(rows)
    if header is None:
        return np.ascontiguousarray(rows, dtype=np.float64)
    positions, note = owner._columns(header)
    if note is not None:
        warnings.warn(note, ModelWarning, stacklevel=2)
    columns = [_numbers(_column(rows, position), header[position]) for position in positions]
    return np.ascontiguousarray(np.stack(columns, axis=1)) if columns else np.empty((len(rows), 0))


def row_of(owner: _Named, row: Any) -> npt.NDArray[np.float64]:
    """Values of one row with names, such as a series of pandas."""
    first: npt.NDArray[np.float64] = rows_of(owner, row.to_frame().T)[0]
    return first


def names_of(rows: Any) -> list[str] | None:
    """The names of a table's columns; `None` for anything but a table."""
    for attribute in ("column_names", "columns"):
        names = getattr(rows, attribute, None)
        if names is not None and not callable(names):
            return [str(name) for name in names]
    return None


def take(rows: Any, chosen: npt.NDArray[np.bool_]) -> Any:
    """The chosen rows: of a table a table, so that its names stay, and of anything else an array."""
    if hasattr(rows, "iloc"):
        return rows.iloc[np.flatnonzero(chosen)]
    return np.asarray(rows)[chosen] if names_of(rows) is None else rows.filter(chosen)


POSITION = "position"
"""The name of the column that is a row's number in its sequence."""


def numbered(rows: Any, numbers: npt.NDArray[np.float64]) -> Any:
    """The rows with their numbers as another column, the last one."""
    names = names_of(rows)
    if names is None:
        return np.column_stack([rows, numbers])
    if POSITION in names:
        raise InputError(f"X has a column {POSITION!r}, which is what position=True adds. Leave the column out, or rename it.")
    if hasattr(rows, "iloc"):
        return rows.assign(**{POSITION: numbers})
    if hasattr(rows, "append_column"):
        return rows.append_column(POSITION, [numbers])
    return rows.hstack([type(rows.to_series(0))(POSITION, numbers)])


def _column(rows: Any, position: int) -> Any:
    if hasattr(rows, "iloc"):
        return rows.iloc[:, position]
    return rows.column(position) if hasattr(rows, "column") else rows[:, position]


_CATEGORIES = ("category", "categorical", "enum", "dictionary")
"""Prefixes of types of categories, in pandas, polars and pyarrow."""


def _numbers(column: Any, name: str) -> npt.NDArray[np.float64]:
    """The numbers of a column."""
    kind = str(getattr(column, "dtype", getattr(column, "type", ""))).lower()
    if kind.startswith(_CATEGORIES):
        raise InputError(
            f"the column {name!r} is of categories. Give the numbers that they had in training: of pandas its `cat.codes`, NaN "
            "where a code is -1."
        )
    if kind.startswith(("date", "time", "duration")):
        raise InputError(f"the column {name!r} is of {kind}. Give numbers, in the unit that they had in training.")
    values = column.to_numpy()
    try:
        return np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        return np.array([_number(value, name, row) for row, value in enumerate(values, 1)])


def _number(value: Any, name: str, row: int) -> float:
    # In pandas, a missing value is neither equal to anything nor a number.
    if value is None or type(value).__name__ in ("NAType", "NaTType"):
        return np.nan
    try:
        return float(value)
    except (TypeError, ValueError):
        raise InputError(
            f"the column {name!r} has {value!r} in row {row}, which is no number. Give numbers, and NaN where one is missing."
        ) from None
