"""Touching meshes, and data sets."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import palpate
import pandas
import pytest

SQUARE = ([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]])
TENT = ([[-1, -1, 0], [1, -1, 0], [1, 1, 1], [-1, 1, 1]], [[0, 1, 2], [0, 2, 3]])


def test_a_capture_in_memory_is_the_one_on_the_disk(tmp_path: Path) -> None:
    options = {"touches": 300, "seed": 5, "pose": True, "approaches": True}
    memory = palpate.capture(["bowl", "mouse"], **options)
    disk = palpate.capture(["bowl", "mouse"], out=tmp_path / "data", **options)
    assert memory.names == disk.names and memory.counts == disk.counts == [300, 300]
    np.testing.assert_array_equal(memory.times, disk.times)
    np.testing.assert_array_equal(memory.direction, disk.direction)
    assert memory.approaches == disk.approaches == [300, 300]
    assert memory.holds_approaches and np.isnan(memory.times).any()
    number = palpate.capture(["bowl", "mouse"], **(options | {"approaches": 300, "touches": 7}))
    np.testing.assert_array_equal(number.times, memory.times)


def test_threads_and_parts_change_no_touch() -> None:
    whole = palpate.capture(["bowl", "mouse"], touches=90, threads=1)
    ends = [(0, 1), (1, 40), (40, 90)]
    parts = [palpate.capture(["bowl", "mouse"], touches=90, samples=part, threads=2) for part in ends]
    joined = [part.times[part.objects == 0] for part in parts]
    np.testing.assert_array_equal(np.concatenate(joined), whole.times[whole.objects == 0])


def test_arrays_are_meshes() -> None:
    data = palpate.capture({"square": SQUARE, "tent": TENT}, touches=50)
    assert data.names == ["square", "tent"] and len(data) == 100

    class Trimesh:
        vertices, faces = SQUARE

    again = palpate.capture({"square": Trimesh(), "tent": TENT}, touches=50)
    np.testing.assert_array_equal(again.times, data.times)
    with pytest.raises(palpate.InputError, match="vertex 9"):
        palpate.capture({"square": (SQUARE[0], [[0, 1, 9]])}, touches=50)
    with pytest.raises(TypeError, match="float64"):
        palpate.capture({"square": (SQUARE[0], [[0.5, 1.0, 2.0]])}, touches=50)


def test_points_are_refused_with_what_makes_a_mesh_of_them(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "ball.xyz", np.eye(3))
    with pytest.raises(palpate.InputError, match="make a mesh of the points first"):
        palpate.capture([tmp_path / "ball.xyz"])


def test_the_probe_is_the_one_that_was_given() -> None:
    probe = palpate.Probe(spacing=1.0)
    assert palpate.capture("bowl", touches=20, probe=probe).probe == probe
    millimeters = palpate.Probe(radius=1.5, spacing=15.0, speed=100.0)
    data = palpate.capture({"square": SQUARE}, touches=20, probe=millimeters, millimeters=50.0)
    assert data.probe == millimeters


def test_arrays_belong_to_the_data_set_and_cannot_be_written_to(touches: palpate.DataSet) -> None:
    times = touches.times
    assert np.shares_memory(times, touches.times) and times.shape == (len(touches), 3)
    assert all(times[:, finger].flags.c_contiguous for finger in range(3))
    for array in (times, touches.objects):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    assert np.bincount(touches.objects).tolist() == touches.counts


def test_tables_share_the_arrays_memory() -> None:
    data = palpate.capture(["bowl", "mouse"], touches=50, pose=True)
    table = data.to_pandas()
    assert list(table.columns[:4]) == ["object", "t1", "t2", "t3"] and len(table.columns) == 10
    assert np.shares_memory(table["t2"].to_numpy(), data.times)
    assert table.groupby("object", observed=True).size().to_dict() == {"bowl": 50, "mouse": 50}


def same(data: palpate.DataSet, other: palpate.DataSet) -> None:
    assert (data.names, data.counts) == (other.names, other.counts)
    for name in ("times", "objects", "instances", "robots", "direction", "alignment", "position"):
        np.testing.assert_array_equal(getattr(data, name), getattr(other, name), err_msg=name)


def test_a_table_comes_back_as_the_same_touches_also_through_parquet(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    nan, count = np.nan, 600
    micros = rng.integers(0, 2_500_000, (count, 3))
    micros[np.arange(count), rng.integers(0, 3, count)] = 0
    times = np.where(rng.random((count, 3)) < 0.2, nan, micros / 1e6)
    direction, alignment = (touched[:count] for touched in poses())
    poseless = rng.random(count) < 0.1
    some = np.where(poseless[:, None], nan, direction), np.where(poseless[:, None], nan, alignment)
    position = rng.integers(-2_000_000_000, 2_000_000_000, (count, 3)) / 1e3
    objects, instances, robots = rng.integers(0, 3, count), rng.integers(0, 4, count), rng.integers(0, 5, count)
    names = ["mug", "fork", "a cup"]

    def made(**more: object) -> palpate.DataSet:
        return palpate.DataSet.from_arrays(times, objects, names, **more)

    posed = {"direction": some[0], "alignment": some[1]}
    located = {"direction": direction, "alignment": alignment, "position": position}
    for number, data in enumerate(
        [made(), made(instances=instances), made(robots=robots), made(**posed), made(**located, instances=instances, robots=robots)]
    ):
        table = data.to_pandas()
        same(palpate.DataSet.from_pandas(table), data)
        table.to_parquet(tmp_path / f"{number}.parquet")
        read = pandas.read_parquet(tmp_path / f"{number}.parquet")
        same(palpate.DataSet.from_pandas(read), data)
        # Other programs write names as text, and nulls.
        plain = table.astype({"object": str}).convert_dtypes()
        same(palpate.DataSet.from_pandas(plain), data)
    assert {"instance", "robot", "position_z", "alignment_x"} <= set(table.columns)
    # To the microsecond, in the order of the rows within an object, instance and robot.
    order = np.lexsort((robots, instances, np.array(names)[objects]))
    expected = np.round(1e6 * (times - np.fmin.reduce(times, axis=1)[:, None]))
    np.testing.assert_array_equal(np.round(1e6 * data.times), expected[order])
    probe = palpate.Probe(spacing=1.25)
    stated = palpate.DataSet.from_pandas(made().to_pandas(), probe=probe, approaches=True)
    assert stated.probe == probe and stated.holds_approaches


def poses() -> tuple[np.ndarray, np.ndarray]:
    data = palpate.capture(["bowl", "mouse"], touches=300, pose=True)
    assert data.direction is not None and data.alignment is not None
    return data.direction, data.alignment


def test_a_table_that_is_no_data_set_is_refused_by_name() -> None:
    table = palpate.DataSet.from_arrays([[0.0, 0.1, 0.2]], [0], ["cup"], robots=[3]).to_pandas()
    assert table["robot"].tolist() == [3]
    for wrong, message in [
        (table.drop(columns="t2"), "no column t2"),
        (table.drop(columns="object"), "no column object"),
        (table.assign(object=None), "a row without an object"),
        (table.assign(direction_x=1.0), "no column direction_y"),
        (table.assign(t1=-1.0), "row 1: the time -1 is negative"),
        (table.assign(robot=-1), "robots is -1"),
    ]:
        with pytest.raises(ValueError, match=message):
            palpate.DataSet.from_pandas(wrong)


def test_text_comes_back_as_it_was_and_parquet_is_refused_with_what_to_use_instead(tmp_path: Path) -> None:
    data = palpate.capture(["bowl", "mouse"], touches=80, pose=True, approaches=True)
    data.to_text(tmp_path / "text")
    read = palpate.DataSet.read(tmp_path / "text")
    same(read, data)
    assert read.probe == data.probe and read.approaches == [80, 80]
    with pytest.raises(palpate.InputError, match="bowl.txt"):
        data.to_text(tmp_path / "text")
    (tmp_path / "tables").mkdir()
    data.to_pandas().to_parquet(tmp_path / "tables" / "bowl.parquet")
    with pytest.raises(palpate.InputError, match="bowl.parquet: Parquet is not read. Instead, write text or CSV"):
        palpate.DataSet.read(tmp_path / "tables")


def test_touches_from_arrays_are_rounded_and_start_at_zero() -> None:
    nan = np.nan
    data = palpate.DataSet.from_arrays([[0.5, 0.51, nan], [nan] * 3, [0, 1e-7, 2e-6]], [1, 0, 1], ["spoon", "cup"])
    assert data.names == ["cup", "spoon"] and data.counts == [2, 1] and data.probe is None
    np.testing.assert_array_equal(data.times, [[0.0, 0.01, nan], [0.0, 0.0, 2e-6], [nan] * 3])
    for times, objects, message in [
        ([[0.0, -1.0, 0.0]], [0], "row 1: the time -1 is negative"),
        ([[0.0, np.inf, 0.0]], [0], "row 1: the time inf is not finite"),
        ([[0.0, 0.0, 0.0]], [2], "objects is 2"),
        ([[0.0, 0.0, 0.0]], [0, 0], "another length"),
        ([[0.0, 0.0]], [0], "times has 2 columns"),
    ]:
        with pytest.raises(ValueError, match=message):
            palpate.DataSet.from_arrays(times, objects, ["cup", "spoon"])


def test_times_that_are_not_in_seconds_and_captures_of_nothing_are_refused() -> None:
    slow = np.array([[0.0, 62.2, 80.0], [107.0, 0.0, np.nan], [np.nan, 0.0, np.nan], [0.0, 0.0, 1.0]])
    with pytest.raises(ValueError, match="touch 1 of cup: a finger touched 80.0 s .* hold at most 16.8 s.*not in milliseconds"):
        palpate.DataSet.from_arrays(slow, [0] * 4, ["cup"])
    with pytest.raises(ValueError, match="touch 1 of cup: .* no object of the data set's scale takes longer than 2.73 s"):
        palpate.DataSet.from_arrays(slow / 10, [0] * 4, ["cup"], probe=palpate.Probe())
    assert len(palpate.DataSet.from_arrays(slow / 10, [0] * 4, ["cup"]).times) == 4
    # A clock that counts from 1970.
    clock = palpate.DataSet.from_arrays([[1732819200.01, 1732819200.0, np.nan]], [0], ["cup"])
    np.testing.assert_array_equal(clock.times, [[0.01, 0.0, np.nan]])
    with pytest.raises(ValueError, match="meshes is empty"):
        palpate.capture([])


def test_no_data_set_forgets_which_touch_is_of_which_instance(tmp_path: Path) -> None:
    times = [[0.0, touch * 1e-3, 0.5] for touch in range(120)]
    objects, instances = [touch % 2 for touch in range(120)], [touch // 2 % 3 for touch in range(120)]
    names = ["cup", "spoon"]
    data = palpate.DataSet.from_arrays(
        times, objects, names, probe=palpate.Probe(), approaches=True, instances=instances
    )

    def kept(data: palpate.DataSet) -> bool:
        own = np.round(data.times[:, 1] * 1e3).astype(int)
        return bool((own // 2 % 3 == data.instances).all() and (own % 2 == data.objects).all())

    train, test = data.split(0.2)
    assert all(np.bincount(test.instances[test.objects == cup]).tolist() == [4, 4, 4] for cup in (0, 1))
    assert kept(data) and kept(train) and kept(test)
    for number, part in enumerate((data, train, test)):
        part.to_text(tmp_path / f"{number}")
        assert kept(palpate.DataSet.read(tmp_path / f"{number}"))
        assert kept(palpate.DataSet.from_pandas(part.to_pandas()))
    # Noise changes neither, and a copy states it.
    noisy = data.noisy("5ms")
    np.testing.assert_array_equal(noisy.instances, data.instances)
    noisy.to_text(tmp_path / "noisy")
    assert '"largest": 5000.0' in (tmp_path / "noisy" / "dataset.json").read_text()
    with pytest.raises(palpate.InputError, match="3 instances"):
        palpate.DataSet.from_arrays(times, objects, names, instances=instances).to_text(tmp_path / "unknown")


def test_splits_share_no_touch_and_noise_takes_a_seed(touches: palpate.DataSet) -> None:
    train, test = touches.split(0.2, seed=3)
    assert test.counts == [300] * 3 and train.counts == [1200] * 3 and train.probe == touches.probe
    noisy = touches.noisy("5ms", timer="1ms", seed=4)
    np.testing.assert_array_equal(noisy.times, touches.noisy("5ms", timer="1ms", seed=4).times)
    assert (noisy.times != touches.times).any()
    assert np.allclose(noisy.times * 1e3, np.round(noisy.times * 1e3))
    with pytest.raises(palpate.InputError, match="such as 5ms"):
        touches.noisy("5")
