"""Values that go in and out."""

from __future__ import annotations

import numbers
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Literal, Protocol, TypeAlias, Union

import numpy as np
import numpy.typing as npt

from ._errors import SettingError

Progress: TypeAlias = Callable[[str, int, Union[int, None]], object]
"""Is called with the name of a stage, the steps that are done, and their number where it is known."""

Touch: TypeAlias = Union[Sequence[Union[float, None]], npt.NDArray[np.float64]]
"""Three contact times in seconds, `None` or NaN for a finger that did not touch; with the probe's direction and alignment
nine numbers."""


Predictions: TypeAlias = npt.NDArray[Any]
"""Values or labels of rows."""


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


class _Numbers:
    """Values that are all numbers."""

    def __post_init__(self) -> None:
        for field in fields(self):  # type: ignore[arg-type]
            value = getattr(self, field.name)
            if isinstance(value, bool) or not isinstance(value, numbers.Real) and not (value is None and field.default is None):
                raise SettingError(f"{field.name} is {value!r}. Use a number; a file with a probe is for the program.")


@dataclass(frozen=True)
class Probe(_Numbers):
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
class Real(_Numbers):
    """Noise that a hand and a table add to touches: to those that maps expect, and to simulated ones, as standard deviations."""

    height: float = 0.5
    """Deviation of each finger's height, in millimeters."""
    lost: float = 0.02
    """Share of contacts with the object that are lost."""
    position: float = 0.0
    """Deviation of the hand's position along each axis, in millimeters."""
    drift: float = 0.0
    """Deviation of the object's move along x and y in an approach, in millimeters."""
    drift_yaw: float = 0.0
    """Deviation of its turn in an approach, in degrees."""
    size: float = 1.0
    """Size of the objects relative to their meshes; maps expect 1."""
    bent: float = 0.0
    """Deviation of each fingertip's offset across the row and along it, in millimeters, equal in all approaches to an object; maps
    expect none: state it as part of `position`."""
    tips: float = 0.0
    """Deviation of each fingertip's height, in millimeters, equal in all approaches to an object; maps expect none."""
    table: float = 0.0
    """Height of the table in the frame that heights are stated in, in millimeters, and no deviation; maps expect 0."""
    turned: float = 0.0
    """Turn of the row of fingers beyond the stated one, in degrees, and no deviation; maps expect 0."""


@dataclass(frozen=True)
class Mode:
    """A place where the object may lie. Numbers called `within` are half of a 95 % interval."""

    placement: str
    """How it lies."""
    x: float
    """Place of the placement's origin on the table, in millimeters."""
    y: float
    """Place of the placement's origin on the table, in millimeters."""
    yaw: float | None
    """Turn from the x axis towards y, in degrees; `None` for what looks the same from all sides."""
    x_within: float
    """In millimeters."""
    y_within: float
    """In millimeters."""
    yaw_within: float | None
    """In degrees."""
    share: float
    """Share of the belief in the object that is near here."""


@dataclass(frozen=True)
class Located:
    """The locator's answer after a touch."""

    state: Literal["undecided", "recognized", "unknown", "gave-up"]
    """An object was recognized, the touches fit none that the maps know, or the limit of touches was reached."""
    best: str
    """The object that was recognized; until then the one with the most evidence."""
    posterior: float
    """Its posterior, which goes on with touches after the verdict."""
    touches: int
    """The number of touches taken in."""
    modes: tuple[Mode, ...]
    """Its possible places, at most four, the one with the largest share first."""
    table_alone: bool = False
    """True if no finger met more than the table so far: if the state is "unknown" or "gave-up", there is probably no object."""
    contradicted: bool = False
    """True if another object has more evidence by now than the one that was recognized. The verdict stays: it is what a
    calibration promises."""
    exhausted: bool = False
    """True if the last search for the place ended before it was done. It names no object, however large the posterior is."""

    @property
    def decided(self) -> bool:
        """True once there is a verdict. It stays until `reset`; the place goes on with further touches."""
        return self.state != "undecided"

    @property
    def object(self) -> str | None:
        """The object that was recognized."""
        return self.best if self.state == "recognized" else None

    @property
    def placed(self) -> Mode | None:
        """The most likely place."""
        return self.modes[0] if self.modes else None

    def is_placed(self, millimeters: float = 3.0, degrees: float = 5.0) -> bool:
        """True if an object is recognized and its place is known as well as this, with 95 % of the belief; it may be turned as it
        looks the same."""
        mode = self.placed
        if self.object is None or mode is None:
            return False
        there = [
            other.share
            for other in self.modes
            if other.placement == mode.placement and max(abs(other.x - mode.x), abs(other.y - mode.y)) <= millimeters
        ]
        turned = mode.yaw_within is None or mode.yaw_within <= degrees
        return turned and max(mode.x_within, mode.y_within) <= millimeters and sum(there) >= 0.95

    def __str__(self) -> str:
        mode = self.placed
        if self.table_alone and self.state in ("unknown", "gave-up"):
            return f"{self.state}, nothing but the table was met"
        name = self.object or f"{self.state}, perhaps {self.best}"
        if mode is None:
            return name
        yaw = "any" if mode.yaw is None else f"{mode.yaw:.0f}"
        return f"{name}, {mode.placement}, {mode.x:.1f}, {mode.y:.1f} mm, {yaw}°"


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
