"""Data sets as tables."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    import pandas
    from numpy.typing import NDArray

    from ._native import DataSet
    from ._types import Probe

VECTORS = ("direction", "alignment", "position")


def to_pandas(data: DataSet) -> pandas.DataFrame:
    """The touches as a table that shares the arrays' memory."""
    import pandas

    categories = pandas.Index(data.names)
    columns: dict[str, object] = {"object": pandas.Categorical.from_codes(data.objects, categories=categories)}
    columns.update({f"t{finger + 1}": data.times[:, finger] for finger in range(3)})
    for name in VECTORS:
        vectors = getattr(data, name)
        if vectors is not None:
            columns.update({f"{name}_{axis}": vectors[:, position] for position, axis in enumerate("xyz")})
    if data.instances.any():
        columns["instance"] = data.instances
    if data.robots is not None:
        columns["robot"] = data.robots
    return pandas.DataFrame(columns, copy=False)


def from_pandas(table: pandas.DataFrame, probe: Probe | None, approaches: bool) -> DataSet:
    """The touches of a table with the columns of `to_pandas`."""
    import pandas

    from ._errors import InputError
    from ._native import DataSet

    missing = [name for name in ("object", "t1", "t2", "t3") if name not in table.columns]
    if missing:
        raise InputError(f"the table has no column {missing[0]}. Give it those of DataSet.to_pandas.")
    if table["object"].isna().any():
        raise InputError("the table has a row without an object. Give each touch its object.")
    objects, names = pandas.factorize(table["object"].astype(str))

    def vectors(name: str) -> NDArray[np.float64] | None:
        columns = [f"{name}_{axis}" for axis in "xyz"]
        lacking = [column for column in columns if column not in table.columns]
        if 0 < len(lacking) < len(columns):
            raise InputError(f"the table has no column {lacking[0]}, and another one of {name}. Give all three.")
        return None if lacking else table[columns].to_numpy("f8", na_value=float("nan"))

    def numbers(name: str) -> NDArray[np.int64] | None:
        return table[name].to_numpy("i8") if name in table.columns else None

    return DataSet.from_arrays(
        table[["t1", "t2", "t3"]].to_numpy("f8", na_value=float("nan")),
        objects,
        list(names),
        direction=vectors("direction"),
        alignment=vectors("alignment"),
        position=vectors("position"),
        probe=probe,
        approaches=approaches,
        instances=numbers("instance"),
        robots=numbers("robot"),
    )
