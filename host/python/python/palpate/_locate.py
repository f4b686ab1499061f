"""Results of sequences that are played on a simulated table."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ._native import Maps


@dataclass(frozen=True)
class CalibratedMaps:
    """Maps that keep a promise, and what their calibration found."""

    maps: Maps
    """The maps with their threshold."""
    raw: dict[str, Any] = field(repr=False)
    """All figures."""

    @property
    def error(self) -> float:
        """Share of the names given that were wrong, between 0 and 1."""
        return float(self.raw["wrong"] / max(self.raw["given"], 1))

    @property
    def mean_approaches(self) -> float:
        """Approaches on average until the name."""
        return float(self.raw["mean_approaches"])

    @property
    def approaches_to_place(self) -> float | None:
        """Approaches on average until the place was as sure as `until` asked for; None without it."""
        until = self.raw.get("until")
        return None if until is None else float(until["mean_approaches"])

    @property
    def sequences(self) -> int:
        """Sequences that the promise rests on."""
        return int(self.raw["sequences"])


@dataclass(frozen=True)
class MapsEvaluation:
    """Verdicts on a simulated table. Shares are between 0 and 1."""

    raw: dict[str, Any]
    """All figures."""

    @property
    def error(self) -> float:
        """Share of wrong ones among the names given."""
        return float(self.raw["wrong"] / max(self.raw["given"], 1))

    @property
    def undecided(self) -> float:
        """Share of all sequences without a verdict."""
        return float(self.raw["undecided"] / self.raw["sequences"])

    @property
    def mean_approaches(self) -> float:
        """Approaches on average."""
        return float(self.raw["mean_approaches"])

    @property
    def off(self) -> tuple[float, float]:
        """Median of how far the place of right names was from the true one, and what 95 % were within, in millimeters."""
        median, most = self.raw["off"]
        return median, most

    @property
    def placed(self) -> float:
        """Share of the right names whose place was found, and as true as `until` asked for; 1 without it."""
        return float(self.raw["poses_within"] / max(self.raw["given"] - self.raw["wrong"], 1))
