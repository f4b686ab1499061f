"""Training, compiling, recognizing, evaluating."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import palpate
import pytest
from conftest import OBJECTS


def test_a_trained_model_recognizes(model: palpate.Model, unseen: palpate.DataSet) -> None:
    recognizer = palpate.Recognizer(model)
    for number, name in enumerate(OBJECTS):
        recognizer.reset()
        for touch in unseen.times[unseen.objects == number]:
            verdict = recognizer.push(touch)
            if verdict.decided:
                break
        assert verdict.state == "recognized" and verdict.object == name == recognizer.best
        assert verdict.posterior is not None and verdict.posterior > 0.98
        assert verdict.touches == recognizer.touches and verdict == recognizer.verdict
        assert abs(sum(recognizer.posteriors.values()) - 1.0) < 1e-6


def test_touches_may_be_tuples_lists_or_arrays(model: palpate.Model) -> None:
    recognizer = palpate.Recognizer(model)
    numbers = [0.25, 0.26, 0.0]
    expected = recognizer.push(numbers)
    for touch in (tuple(numbers), np.array(numbers), np.array(numbers, dtype=np.float32), iter(numbers)):
        recognizer.reset()
        assert recognizer.push(touch) == expected
    for touch, message in [
        ((0.0, 0.1), "2 numbers"),
        ((0.0,) * 12, "12 numbers"),
        ((0.0, -0.1, 0.0), "the time -0.1 is negative"),
        ((0.0, 300.0, 0.0), "300"),
    ]:
        with pytest.raises(palpate.InputError, match=message):
            recognizer.push(touch)
    with pytest.raises(TypeError):
        recognizer.push(("a", 0.0, 0.0))
    assert recognizer.touches == 1


def test_a_touch_that_is_no_evidence_is_not_counted(model: palpate.Model) -> None:
    recognizer = palpate.Recognizer(model)
    verdict = recognizer.push((0.0, 0.1, None))
    assert verdict.refused is not None and verdict.refused.startswith("only the middle and an outer finger touched")
    assert verdict.touches == 0 and not verdict.decided


def test_margins_are_the_ensembles_within_the_stated_bound(
    ensemble: palpate.Ensemble, model: palpate.Model, unseen: palpate.DataSet
) -> None:
    full = ensemble.margins_of(unseen)
    compiled = model.margins(unseen)
    assert full.dtype == np.float32 and compiled.dtype == np.float64 and full.shape == compiled.shape
    assert np.abs(full - compiled).max() <= model.margin_error
    # The same times as an array, in Fortran order, row by row.
    np.testing.assert_array_equal(model.margins(unseen.times), compiled)
    rows = [model.margins(unseen.times[row : row + 1])[0] for row in range(300)]
    np.testing.assert_array_equal(rows, compiled[:300])
    times = unseen.times
    curvature = np.round(1e6 * (times[:, 0] - 2 * times[:, 1] + times[:, 2]))
    slope = np.round(1e6 * np.abs(times[:, 2] - times[:, 0]))
    np.testing.assert_array_equal(ensemble.margins(np.stack([curvature, slope], axis=1)), full)


def test_evidence_is_the_sum_of_margins(model: palpate.Model, unseen: palpate.DataSet) -> None:
    recognizer = palpate.Recognizer(model, error_rate=1e-15, max_touches=10_000)
    touches = unseen.times[unseen.objects == 1][:5]
    for touch in touches:
        recognizer.push(touch)
    evidence = model.margins(touches).sum(axis=0)
    posteriors = np.exp(evidence - evidence.max())
    posteriors /= posteriors.sum()
    np.testing.assert_allclose(list(map(recognizer.posteriors.get, OBJECTS)), posteriors, atol=1e-4)


def test_files_and_pickles_hold_the_same_model(model: palpate.Model, ensemble: palpate.Ensemble, tmp_path: Path) -> None:
    model.save(tmp_path / "model.palpate")
    for again in (palpate.Model.load(tmp_path / "model.palpate"), pickle.loads(pickle.dumps(model))):
        assert again.to_bytes() == model.to_bytes() and again.checksum == model.checksum
    ensemble.save(tmp_path / "ensemble.json")
    assert palpate.compile(tmp_path / "ensemble.json").to_bytes() == model.to_bytes()
    assert model.objects == OBJECTS and model.features == ["curvature", "slope"] and model.descriptor == "curvature"
    assert model.size == len(model.to_bytes())


def test_a_model_fits_where_there_is_room(ensemble: palpate.Ensemble) -> None:
    large = palpate.compile(ensemble, leaf="f32")
    for most in (large.size - 1, large.size // 2):
        small = palpate.compile(ensemble, leaf="f32", max_bytes=most)
        assert small.size <= most and small.leaf != "f32"
    with pytest.raises(palpate.InputError, match="more than the 100 that fit"):
        palpate.compile(ensemble, max_bytes=100)
    for option, value in [("leaf", "f64"), ("priors", [1.0]), ("error_rate", 0.9)]:
        with pytest.raises(palpate.SettingError, match=option):
            palpate.compile(ensemble, **{option: value})


def test_leaves_that_were_rounded_to_a_byte_take_one_unless_told_otherwise(touches: palpate.DataSet) -> None:
    small = palpate.train(touches, preset="small")
    assert [palpate.compile(small, leaf=leaf).leaf for leaf in (None, "i16")] == ["i8", "i16"]
    model = palpate.TouchRecognizer(preset="small").fit(touches.times, touches.objects).model_
    assert model.leaf == "i8"


def test_weights_say_what_may_be_touched(model: palpate.Model, unseen: palpate.DataSet) -> None:
    recognizer = palpate.Recognizer(model)
    recognizer.reset([1, 0, 1])
    for touch in unseen.times[unseen.objects == 1][:50]:
        verdict = recognizer.push(touch)
    assert verdict.object != "fork" and recognizer.posteriors["fork"] == 0.0
    with pytest.raises(palpate.SettingError, match="weights"):
        recognizer.reset([0, 0, 0])


def test_evaluation_and_parity(
    ensemble: palpate.Ensemble, model: palpate.Model, unseen: palpate.DataSet
) -> None:
    found = palpate.evaluate(model, unseen, groups=300)
    assert 0.5 < found.accuracy[5] <= found.accuracy[30] <= 1.0
    assert set(found.per_object) == set(OBJECTS) and found.per_object["bowl"][30] > 0.9
    assert found.sequential.mean > 1.0 and found.approach_sequential is None
    assert found.raw["descriptor"] == "curvature" == found.descriptor
    assert found.accuracy == palpate.evaluate(ensemble, unseen, groups=300).accuracy
    parity = palpate.parity(ensemble, model, unseen, sequences=200)
    assert parity.touches == len(unseen) and parity.verdict_differs == 0
    assert parity.max_margin_error <= parity.stated_bound
    approaches = palpate.capture(OBJECTS, touches=500, approaches=True, seed=3)
    found = palpate.evaluate(model, approaches, groups=100, at=[5, 10], noise="1ms")
    assert found.approach_sequential is not None and found.approach_sequential.mean > found.sequential.mean
    assert set(found.approach_accuracy) == {5, 10}
    with pytest.raises(palpate.InputError, match="clock"):
        clock = palpate.DataSet.from_arrays(unseen.times, unseen.objects, ["bowl", "fork", "clock"])
        palpate.evaluate(model, clock)


def test_the_same_seed_trains_the_same_model(touches: palpate.DataSet) -> None:
    options = {"rounds": 5, "noise": "0..5ms", "timer": "1ms", "seed": 7}
    one, two = (palpate.compile(palpate.train(touches, threads=threads, **options)) for threads in (1, 2))
    assert one.to_bytes() == two.to_bytes()
    other = palpate.compile(palpate.train(touches, **{**options, "seed": 8}))
    assert other.to_bytes() != one.to_bytes()


def test_smaller_presets_make_smaller_models(touches: palpate.DataSet) -> None:
    trained = [palpate.train(touches, preset=preset, min_child_weight=5) for preset in ("compact", "small", "tiny")]
    sizes = [len(palpate.compile(ensemble, leaf="i8").to_bytes()) for ensemble in trained]
    assert sizes[0] > sizes[1] > sizes[2]
    with pytest.raises(palpate.SettingError, match="compact, small, tiny or paper"):
        palpate.train(touches, preset="large")


def test_placements_on_a_table_are_outputs_and_a_verdict_names_one_with_its_share() -> None:
    def touched(seed: int) -> palpate.DataSet:
        return palpate.capture(["bowl", "fork"], touches=4000, seed=seed, approaches=True, pose=True, cone=60.0)

    trained = palpate.train(touched(1), descriptor="gravity", rounds=8)
    assert any(name.startswith("fork/") for name in trained.objects) and len(trained.objects) > 3
    model = palpate.compile(trained)
    recognizer = palpate.Recognizer(model)
    data = touched(2)
    assert data.direction is not None and data.alignment is not None
    fork = data.objects == 1
    one = fork & (data.instances == data.instances[fork][0])
    for touch in np.hstack([data.times, data.direction, data.alignment])[one]:
        verdict = recognizer.push(touch)
        if verdict.decided:
            break
    assert verdict.object is not None and verdict.object.startswith("fork/")
    assert verdict.posterior is not None and verdict.posterior > 0.98
    assert verdict.share is not None and recognizer.posteriors[verdict.object] == pytest.approx(
        verdict.share * verdict.posterior, abs=1e-6
    )
    evaluation = palpate.evaluate(model, data, groups=50)
    assert evaluation.sequential.error < 0.2
    assert palpate.parity(trained, model, data, sequences=50).verdict_differs == 0
    objects = palpate.train(touched(1), descriptor="gravity", rounds=2, outputs="objects")
    assert objects.objects == ["bowl", "fork"]
    with pytest.raises(palpate.SettingError, match="outputs"):
        palpate.train(data, outputs="sides")
    with pytest.raises(palpate.SettingError, match="cone"):
        palpate.capture(["bowl"], touches=10, cone=91.0)
    with pytest.raises(palpate.PalpateError, match="scene"):
        palpate.evaluate(model, palpate.capture(["bowl", "fork"], touches=100, approaches=True, pose=True))
