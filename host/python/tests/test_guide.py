"""The Python of the guides runs as it stands there; that of docs/guide/locate.md with a simulated robot."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import palpate
import pytest

GUIDES = Path(__file__).parents[3] / "docs" / "guide"


class Robot:
    """A hand over a table on which a cylinder stands; it touches as the guide's robot does."""

    place, radius, height, tip, spacing, speed, stroke = (9.0, -14.0), 20.0, 60.0, 1.5, 15.0, 100.0, 20.0

    def __init__(self) -> None:
        self.presses = 0

    def press(self, x: float, y: float, roll: float) -> tuple[list[float | None], float]:
        self.presses += 1
        cos, sin = math.cos(math.radians(roll)), math.sin(math.radians(roll))
        heights = []
        for finger in (-1, 0, 1):
            across = math.hypot(
                x + finger * self.spacing * cos - self.place[0], y + finger * self.spacing * sin - self.place[1]
            )
            over = max(across - self.radius, 0.0)
            heights.append(self.height - self.tip + math.sqrt(self.tip**2 - over**2) if over < self.tip else 0.0)
        first = max(heights)
        return [(first - h) / self.speed if first - h <= self.stroke else None for h in heights], first


def cylinder() -> tuple[np.ndarray, np.ndarray]:
    around = np.linspace(0.0, 2 * math.pi, 64, endpoint=False)
    ring = np.stack([Robot.radius * np.cos(around), Robot.radius * np.sin(around)], axis=1)
    corners = np.vstack([np.column_stack([ring, np.full(64, z)]) for z in (0.0, Robot.height)])
    corners = np.vstack([corners, [[0, 0, 0], [0, 0, Robot.height]]])
    after = (np.arange(64) + 1) % 64
    own = np.arange(64)
    sides = [np.stack([own, after, own + 64], 1), np.stack([after, after + 64, own + 64], 1)]
    ends = [np.stack([after, own, np.full(64, 128)], 1), np.stack([own + 64, after + 64, np.full(64, 129)], 1)]
    return corners, np.vstack(sides + ends)


@pytest.fixture
def meshes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A can and its lid in meshes/ of the current directory."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "meshes").mkdir()
    corners, faces = cylinder()
    lines = [f"v {x / 10} {y / 10} {z / 10}" for x, y, z in corners] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
    (tmp_path / "meshes" / "can.obj").write_text("\n".join(lines) + "\n")
    flat = [f"v {x / 10} {y / 10} {z / 30}" for x, y, z in corners] + lines[len(corners) :]
    (tmp_path / "meshes" / "lid.obj").write_text("\n".join(flat) + "\n")


def followed(guide: str, **given: object) -> dict[str, object]:
    """The names that the Python of a guide leaves."""
    path = GUIDES / guide
    blocks = re.findall(r"^```python guide\n(.*?)^```", path.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    assert blocks
    for block in blocks:
        exec(compile(block, str(path), "exec"), given)
    return given


@pytest.mark.usefixtures("meshes")
def test_the_guide_locates_an_object() -> None:
    names = followed("locate.md", robot=Robot())
    locator = names["locator"]
    assert isinstance(locator, palpate.Locator)
    located = locator.located
    mode = located.placed
    assert located.object == "can" and mode is not None and located.touches < 25
    assert abs(mode.x - Robot.place[0]) < 3 and abs(mode.y - Robot.place[1]) < 3


@pytest.mark.usefixtures("meshes")
def test_a_loop_over_settings_finds_a_small_model(tmp_path: Path) -> None:
    names = followed("small.md")
    smallest = names["smallest"]
    assert isinstance(smallest, palpate.Model) and smallest.leaf == "i8"
    assert palpate.Model.load(tmp_path / "small.palpate").to_bytes() == smallest.to_bytes()


@pytest.mark.usefixtures("meshes")
def test_a_loop_over_probes_finds_one_that_needs_few_approaches() -> None:
    names = followed("real-probe.md")
    best, approaches = names["best"], names["approaches"]
    assert isinstance(best, palpate.Probe) and callable(approaches) and 1 < approaches(best) < 100
