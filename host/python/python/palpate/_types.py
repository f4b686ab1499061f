"""Values that go in and out."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol, TypeAlias, Union

import numpy as np
import numpy.typing as npt

Progress: TypeAlias = Callable[[str, int, Union[int, None]], object]
"""Is called with the name of a stage, the steps that are done, and their number where it is known."""

Touch: TypeAlias = Union[Sequence[Union[float, None]], npt.NDArray[np.float64]]
"""Three contact times in seconds, `None` or NaN for a finger that did not touch; with the probe's direction and alignment
nine numbers."""


class HasFaces(Protocol):
    """A mesh of another library, such as trimesh."""

    @property
    def vertices(self) -> npt.ArrayLike:
        """Rows of three coordinates."""

    @property
    def faces(self) -> npt.ArrayLike:
        """Rows of three positions among the vertices."""


Mesh: TypeAlias = Union[tuple[npt.ArrayLike, npt.ArrayLike], HasFaces]

Source: TypeAlias = Union[str, "os.PathLike[str]"]

Meshes: TypeAlias = Union[Source, Sequence[Source], Mapping[str, Union[Mesh, Source]]]
"""Files, directories and built-in objects; or names with their meshes or files."""


@dataclass(frozen=True)
class Probe:
    """Three spheres in a row, in units of which an object's longest side has 10, or in millimeters."""

    radius: float = 0.15
    """The fingers' radius."""
    spacing: float = 1.5
    """The distance between neighboring fingers."""
    speed: float = 10.0
    """The probe's speed, in units per second."""
    tilt: float = 10.0
    """The largest tilt of the row to either side, in degrees."""
    stroke: float | None = None
    """How far the hand goes on after the first contact; a later contact is missing. None: past the object."""
    travel: float | None = None
    """How far the hand goes from its start before an approach is a miss. None: past the object."""
    stroke_tolerance: float | None = None
    """How much later than the stroke a recorded contact may be, and counts as missing. None: 2 % of the stroke."""


@dataclass(frozen=True)
class Verdict:
    """The recognizer's answer after a touch."""

    state: Literal["undecided", "recognized", "unknown", "gave-up"]
    """An object was recognized, the touches fit none that the model knows, or the limit of touches was reached."""
    object: str | None
    """The object that was recognized; of a model with an output for each placement, `object/placement`."""
    posterior: float | None
    """The posterior of that object."""
    touches: int
    """The number of touches counted."""
    refused: str | None = None
    """The reason why the last touch was not counted, if it was not."""
    share: float | None = None
    """The share of the object's posterior that its placement has; 1 where objects have one output."""

    @property
    def decided(self) -> bool:
        """True if further touches change nothing."""
        return self.state != "undecided"
