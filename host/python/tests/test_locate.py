"""Objects on a table: maps of them, and where they lie."""

from __future__ import annotations

import math
import pickle
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import palpate
import pytest

PROBE = palpate.Probe(radius=1.5, spacing=15.0, speed=100.0, tilt=0.0, stroke=20.0)
OBJECTS = ["bowl", "mouse"]
UNIT = 10.0  # millimeters


@pytest.fixture(scope="module")
def maps() -> palpate.Maps:
    return palpate.Maps.of_meshes(OBJECTS, probe=PROBE, millimeters=UNIT)


BOXES = {"brick": (60.0, 40.0, 30.0), "slab": (70.0, 50.0, 10.0)}  # millimeters


@pytest.fixture(scope="module")
def boxes() -> palpate.Maps:
    def mesh(sides: tuple[float, float, float]) -> tuple[npt.NDArray[np.float64], list[list[int]]]:
        corners = np.array([[corner >> axis & 1 for axis in range(3)] for corner in range(8)]) * sides
        quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
        return corners, [face for a, b, c, d in quads for face in ([a, b, c], [a, c, d])]

    return palpate.Maps.of_meshes({name: mesh(sides) for name, sides in BOXES.items()}, probe=PROBE, millimeters=1)


def heights(
    box: str, x: float, y: float, roll: float, place: tuple[float, float] = (0.0, 0.0), yaw: float = 0.0
) -> tuple[float, float, float]:
    """Heights that the fingers meet on a box that lies on its largest side at a place, turned by `yaw`."""
    cos, sin = math.cos(math.radians(yaw)), math.sin(math.radians(yaw))
    along = math.cos(math.radians(roll)), math.sin(math.radians(roll))

    def height(finger: int) -> float:
        u, v = x + 15 * finger * along[0] - place[0], y + 15 * finger * along[1] - place[1]
        inside = 2 * abs(cos * u + sin * v) <= BOXES[box][0] and 2 * abs(cos * v - sin * u) <= BOXES[box][1]
        return BOXES[box][2] if inside else 0.0

    return height(-1), height(0), height(1)


def follow(locator: palpate.Locator, box: str) -> palpate.Located:
    locator.reset()
    while not locator.located.decided:
        x, y, roll = locator.next()
        located = locator.push_heights(heights(box, x, y, roll, (12.0, -7.0), 40.0), x, y, roll)
    return located


def test_the_posterior_is_that_of_the_object_that_is_stated(maps: palpate.Maps) -> None:
    locator = palpate.Locator(maps, error_rate=1e-9)
    for heights in [(0.0, 0.0, 0.0), (12.0, 14.0, 9.0), (11.0, None, 10.0)]:
        located = locator.push_heights(heights, *locator.next())
        assert located.posterior == locator.posteriors[located.best], located
        assert located.posterior >= 1 / len(maps.objects) - 0.01, located


def test_a_verdict_stays(boxes: palpate.Maps) -> None:
    locator = palpate.Locator(boxes)
    named = follow(locator, "brick")
    assert named.object == "brick" and not named.contradicted and not named.exhausted
    contradicted = False
    while locator.touches < 30:
        x, y, roll = locator.next()
        located = locator.push_heights(heights("slab", x, y, roll, (12.0, -7.0), 40.0), x, y, roll)
        assert located.object == "brick" and located.decided, located
        assert all(mode.placement in [lies for name, lies in boxes.placements if name == "brick"] for mode in located.modes)
        assert located.contradicted == (max(locator.posteriors, key=lambda name: locator.posteriors[name]) != "brick")
        contradicted |= located.contradicted
    assert contradicted
    locator.reset()
    assert locator.located.object is None


def test_an_object_is_named_and_located(boxes: palpate.Maps) -> None:
    locator = palpate.Locator(boxes)
    for name in BOXES:
        located = follow(locator, name)
        assert located.object == located.best == name and located.posterior > 0.98, located
        mode = located.placed
        assert mode is not None and mode == located.modes[0]
        # Its place, or one that looks the same so far.
        assert any(math.hypot(mode.x - 12.0, mode.y + 7.0) < 10.0 for mode in located.modes), located
        assert str(located).startswith(f"{name}, {mode.placement}, ")
        assert locator.located == located and locator.touches == located.touches
        assert max(locator.posteriors, key=lambda name: locator.posteriors[name]) == name


def test_times_and_heights_say_the_same(maps: palpate.Maps) -> None:
    times, heights = palpate.Locator(maps), palpate.Locator(maps)
    by_times = times.push((0.03, None, 0.0), (5.0, 2.0, 25.0), 30.0)
    by_heights = heights.push_heights((22.0, math.nan, 25.0), 5.0, 2.0, 30.0, lowest=5.0)
    assert by_times == by_heights and by_times.touches == 1
    times.reset()
    row = (math.cos(math.radians(30.0)), math.sin(math.radians(30.0)), 0.0)
    assert times.push((0.03, None, 0.0), np.array([5.0, 2.0, 25.0]), row) == by_heights
    times.reset([0, 5])
    assert times.touches == 0 and not times.located.decided and times.located.best == "mouse"
    with pytest.raises(palpate.SettingError, match="weights"):
        times.reset([0, 0])


def test_the_next_approach_stays_the_same_and_within_the_region(maps: palpate.Maps) -> None:
    locator = palpate.Locator(maps, workspace=20.0)
    assert locator.next()[:2] == (0.0, 0.0)
    for height in (12.0, 9.0, 15.0):
        x, y, roll = locator.next()
        assert locator.next() == (x, y, roll)
        assert abs(x) <= 20.0 and abs(y) <= 20.0 and 0.0 <= roll < 360.0
        locator.push_heights((height, height, None), x, y, roll)


def test_on_an_empty_table_nothing_but_the_table_is_met(maps: palpate.Maps) -> None:
    locator = palpate.Locator(maps, error_rate=1e-6, max_touches=3)
    assert not locator.located.table_alone
    while not locator.located.decided:
        located = locator.push_heights((0.4, None, -0.2), *locator.next())
        assert located.table_alone
    assert str(locator.located) == "gave-up, nothing but the table was met"
    locator.reset()
    assert not locator.push_heights((12.0, 0.0, 0.0), *locator.next()).table_alone


def test_maps_are_bytes_files_and_pickles(maps: palpate.Maps, tmp_path: Path) -> None:
    path = tmp_path / "maps.palpate"
    maps.save(path)
    for other in (palpate.Maps.load(path), palpate.Maps(maps.to_bytes()), pickle.loads(pickle.dumps(maps))):
        assert other.to_bytes() == maps.to_bytes() == path.read_bytes()
    assert maps.objects == OBJECTS and {name for name, _ in maps.placements} == set(OBJECTS)
    assert maps.probe == PROBE and maps.range == 30.0
    assert repr(maps).startswith(f"Maps({maps.size} bytes, ")
    path.write_bytes(maps.to_bytes()[:-1])
    with pytest.raises(palpate.InputError, match=r"maps.palpate"):
        palpate.Maps.load(path)
    with pytest.raises(palpate.FileError):
        palpate.Maps.load(tmp_path / "none.palpate")


def test_maps_are_learned_from_recorded_touches() -> None:
    random = np.random.default_rng(1)
    count = 300
    places, rolls = random.uniform(-40, 40, (count, 2)), random.uniform(0, 360, count)
    met = np.array([heights("brick", *place, roll) for place, roll in zip(places, rolls, strict=True)])
    radians = np.radians(rolls)
    recorded = palpate.DataSet.from_arrays(
        (met.max(1, keepdims=True) - met) / PROBE.speed,
        np.zeros(count, dtype=int),
        ["brick"],
        direction=np.tile([0.0, 0.0, -1.0], (count, 1)),
        alignment=np.c_[np.cos(radians), np.sin(radians), np.zeros(count)],
        position=np.c_[places, met.max(1)],
        probe=PROBE,
    )
    learned = palpate.Maps.learn(recorded, cell=2.0)
    assert learned.placements == [("brick", "")] and learned.size < palpate.Maps.learn(recorded).size
    with pytest.raises(palpate.PalpateError, match="position|true size"):
        palpate.Maps.learn(palpate.capture(["bowl"], touches=10))
    with pytest.raises(TypeError, match="position"):
        palpate.capture(["bowl"], touches=10, position=True)  # type: ignore[call-arg]


def test_thresholds_keep_a_promise_on_a_simulated_table(maps: palpate.Maps) -> None:
    calibrated = maps.calibrate(OBJECTS, millimeters=UNIT, error_rate=0.05, sequences=120)
    assert calibrated.error <= 0.05 and calibrated.sequences == 120 and calibrated.mean_approaches < 6
    assert calibrated.maps.objects == OBJECTS and maps.promise is None
    assert calibrated.maps.promise is not None and calibrated.maps.promise["aimed"] == "chosen"
    found = calibrated.maps.evaluate(OBJECTS, millimeters=UNIT, sequences=40)
    # A name may be sure before the place is: half of the places are near.
    assert found.error <= 0.1 and found.mean_approaches < 6 and found.off[0] < 10 and found.off[0] <= found.off[1]
    assert found.undecided < 0.2
    random = calibrated.maps.evaluate(OBJECTS, millimeters=UNIT, sequences=10, aimed="random", real=palpate.Real(lost=0.1))
    assert random.raw["sequences"] == 10


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"cell": 3.0}, "cell is 3"),
        ({"range": 200.0}, "range is 200"),
        ({"real": palpate.Real(height=9.0)}, "noise is 9"),
        ({"max_touches": 99}, "max_touches is 99"),
    ],
)
def test_settings_out_of_range_are_named(settings: dict[str, object], message: str) -> None:
    with pytest.raises(palpate.SettingError, match=message):
        palpate.Maps.of_meshes(["bowl"], probe=PROBE, millimeters=UNIT, **settings)  # type: ignore[arg-type]


@pytest.mark.parametrize("real", [{"height": -1.0}, {"height": math.nan}, {"lost": 2.0}, {"size": 0.0}, {"table": math.nan}])
def test_noise_that_is_none_is_named(maps: palpate.Maps, real: dict[str, float]) -> None:
    with pytest.raises(palpate.SettingError, match=next(iter(real))):
        maps.evaluate(OBJECTS, millimeters=UNIT, sequences=2, real=palpate.Real(**real))


@pytest.mark.parametrize("millimeters", [math.nan, -1.0, 0.0])
def test_a_length_of_a_unit_that_is_none_is_named(maps: palpate.Maps, millimeters: float) -> None:
    with pytest.raises(palpate.SettingError, match="millimeters"):
        palpate.Maps.of_meshes(OBJECTS, probe=PROBE, millimeters=millimeters)
    with pytest.raises(palpate.SettingError, match="millimeters"):
        maps.evaluate(OBJECTS, millimeters=millimeters, sequences=2)


def test_a_finger_far_below_the_table_and_more_touches_than_there_is_room_for_are_refused(maps: palpate.Maps) -> None:
    locator = palpate.Locator(maps)
    with pytest.raises(palpate.InputError, match="below the table"):
        locator.push((0.0, None, 0.1), (0.0, 0.0, -30.0), 0.0)
    with pytest.raises(palpate.InputError, match="below the table"):
        locator.push_heights((-100.0, 0.0, 0.0), 0.0, 0.0, 0.0)
    assert locator.touches == 0
    for max_touches in (0, 33):
        with pytest.raises(palpate.SettingError, match="max_touches"):
            maps.calibrate(OBJECTS, millimeters=UNIT, sequences=2, max_touches=max_touches)


def test_wrong_touches_are_refused(maps: palpate.Maps, tmp_path: Path) -> None:
    locator = palpate.Locator(maps)
    with pytest.raises(ValueError, match="2 numbers, where 3 are needed"):
        locator.push((0.0, 0.1), (0.0, 0.0, 0.0), 0.0)
    with pytest.raises(palpate.PalpateError, match="coordinate NaN"):
        locator.push((0.0, 0.1, 0.0), (0.0, None, 0.0), 0.0)
    with pytest.raises(palpate.SettingError, match="aimed is best"):
        maps.evaluate(OBJECTS, millimeters=UNIT, aimed="best")
    # A file of this format does not state its unit; the built-in objects have one.
    wedge = tmp_path / "wedge.obj"
    wedge.write_text("v 0 0 0\nv 40 0 0\nv 0 40 0\nv 0 0 40\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    with pytest.raises(palpate.PalpateError, match="the true size is unknown"):
        palpate.Maps.of_meshes([str(wedge)], probe=PROBE)
    with pytest.raises(palpate.PalpateError, match="meshes is empty"):
        palpate.Maps.of_meshes({}, probe=PROBE)
    assert locator.touches == 0


@pytest.mark.parametrize(
    ("heights", "x", "y", "alignment", "lowest", "message"),
    [
        ((math.inf, 0.0, 0.0), 0.0, 0.0, 0.0, 0.0, "a height is inf mm"),
        ((0.0, None, 1e9), 0.0, 0.0, 0.0, 0.0, "a height is 1000000000 mm"),
        ((-20.0, 0.0, 0.0), 0.0, 0.0, 0.0, 0.0, "stopped 20 mm below the table"),
        ((0.0, 0.0, 0.0), 5000.0, 0.0, 0.0, 0.0, "x is 5000 mm, and places and heights are at most 2000 mm"),
        ((0.0, 0.0, 0.0), 0.0, math.nan, 0.0, 0.0, "y is NaN mm"),
        ((0.0, 0.0, 0.0), 0.0, 0.0, 1e9, 0.0, "alignment is 1000000000. Use degrees from -360 to 360"),
        ((0.0, 0.0, 0.0), 0.0, 0.0, math.nan, 0.0, "alignment is NaN"),
        ((0.0, 0.0, 0.0), 0.0, 0.0, (5.0, 5.0, 0.0), 0.0, "alignment"),
        ((0.0, 0.0, 0.0), 0.0, 0.0, 0.0, math.inf, "lowest is inf mm"),
    ],
)
def test_heights_that_no_hand_met_are_refused_by_locator_and_shape_alike(
    maps: palpate.Maps, heights: Any, x: float, y: float, alignment: Any, lowest: float, message: str
) -> None:
    for owner in (palpate.Locator(maps), palpate.Shape(PROBE, workspace=30)):
        with pytest.raises(palpate.PalpateError, match=message):
            owner.push_heights(heights, x, y, alignment, lowest=lowest)
        assert owner.touches == 0


def test_places_that_no_locator_keeps_are_refused_in_touches_too(maps: palpate.Maps) -> None:
    for owner in (palpate.Locator(maps), palpate.Shape(PROBE, workspace=30)):
        with pytest.raises(palpate.PalpateError, match="y is -5000 mm"):
            owner.push((0.0, 0.1, 0.0), (0.0, -5000.0, 10.0), 0.0)
        owner.push((0.0, 0.1, 0.0), (900.0, 0.0, 500.0), -360.0)
        assert owner.touches == 1


def test_weights_are_numbers_in_any_unit_of_which_none_is_below_0(maps: palpate.Maps) -> None:
    locator = palpate.Locator(maps)
    for weights in ([-1, 2], [math.nan, 1], [math.inf, 1], [0, 0.0], [1]):
        with pytest.raises(palpate.SettingError, match="weights"):
            locator.reset(weights)
    shares = []
    for weights in ([1, 3], [0.25, 0.75], [1e9, 3e9]):
        locator.reset(weights)
        shares.append(locator.posteriors)
    assert shares[0] == shares[1] == shares[2] and shares[0]["mouse"] > 2 * shares[0]["bowl"]


def test_meshes_of_a_size_that_the_hand_is_not_for_are_noted() -> None:
    wedge = [[0, 0, 0], [40, 0, 0], [0, 40, 0], [0, 0, 40]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    for millimeters, size in ((10.0, "400 × 400 × 400"), (0.1, "4 × 4 × 4"), (1.0, None)):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", palpate.ModelWarning)
            palpate.Maps.of_meshes({"wedge": wedge}, probe=PROBE, millimeters=millimeters, cell=2.0)
        said = f"wedge is {size} mm, for fingers 15 mm apart. See whether `millimeters` is right."
        assert [str(one.message) for one in caught] == ([] if size is None else [said])


@pytest.mark.parametrize("millimeters", [math.nan, 0.0, -1.0])
def test_what_is_known_to_no_length_is_no_share(millimeters: float) -> None:
    with pytest.raises(palpate.SettingError, match="millimeters"):
        palpate.Shape(PROBE, workspace=30).known(millimeters)


def test_an_object_without_a_mesh_is_explored_until_it_is_known(maps: palpate.Maps) -> None:
    def height(x: float, y: float) -> float:
        return 12.0 if abs(x) < 20 and abs(y) < 10 else 0.0

    shape = palpate.Shape(PROBE, workspace=30)
    while shape.known(2.0) < 0.6 and shape.touches < 80:
        x, y, roll = shape.next()
        assert max(abs(x), abs(y)) <= 30
        row = [(finger * 15 * math.cos(math.radians(roll)), finger * 15 * math.sin(math.radians(roll))) for finger in (-1, 0, 1)]
        first, second, third = (height(x + u, y + v) for u, v in row)
        shape.push_heights((first, second, third), x, y, roll)
    assert shape.known(2.0) >= 0.6
    low, high = shape.bounds
    middle = shape.heights.shape[0] // 2, shape.heights.shape[1] // 2
    assert low[middle] <= 12 <= high[middle] and abs(shape.heights[middle] - 12) < 1
    vertices, triangles = shape.mesh()
    assert max(z for _, _, z in vertices) < 14 and len(triangles) > 100
    with pytest.raises(palpate.SettingError, match="workspace"):
        palpate.Shape(PROBE, workspace=math.nan)
