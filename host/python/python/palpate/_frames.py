"""Data sets as tables."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas

    from ._native import DataSet


def to_pandas(data: DataSet) -> pandas.DataFrame:
    """The touches as a table that shares the arrays' memory."""
    import pandas

    categories = pandas.Index(data.names)
    columns: dict[str, object] = {"object": pandas.Categorical.from_codes(data.objects, categories=categories)}
    columns.update({f"t{finger + 1}": data.times[:, finger] for finger in range(3)})
    for name, vectors in (("direction", data.direction), ("alignment", data.alignment), ("position", data.position)):
        if vectors is not None:
            columns.update({f"{name}_{axis}": vectors[:, position] for position, axis in enumerate("xyz")})
    return pandas.DataFrame(columns, copy=False)
