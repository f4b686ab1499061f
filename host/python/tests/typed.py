"""Expectations of a type checker about the package: `mypy --strict tests/typed.py`."""

from __future__ import annotations

from typing import Any, assert_type

import numpy as np
import numpy.typing as npt
import palpate
import pandas

data = palpate.capture(["bowl", "mouse"], touches=100, probe=palpate.Probe(), progress=lambda stage, done, total: None)
assert_type(data, palpate.DataSet)
assert_type(data.times, npt.NDArray[np.float64])
assert_type(data.objects, npt.NDArray[np.int16])
assert_type(data.direction, npt.NDArray[np.float32] | None)
assert_type(data.names, list[str])
assert_type(data.probe, palpate.Probe | None)
assert_type(data.approaches, list[int] | None)
assert_type(data.split(), tuple[palpate.DataSet, palpate.DataSet])
assert_type(data.to_pandas(), pandas.DataFrame)
assert_type(palpate.DataSet.read("data"), palpate.DataSet)
assert_type(len(data), int)

ensemble = palpate.train(data, rounds=3, background=None)
assert_type(ensemble, palpate.Ensemble)
assert_type(ensemble.margins([[0.0, 0.0]]), npt.NDArray[np.float32])
assert_type(ensemble.descriptor, str | None)

model = palpate.compile(ensemble, max_bytes=None, all_trees=True)
assert_type(model, palpate.Model)
assert_type(model.margins(data), npt.NDArray[np.float64])
assert_type(model.margins([[0.0, 0.1, 0.2]]), npt.NDArray[np.float64])
assert_type(model.predict([[0.0, 0.1]]), npt.NDArray[Any])
assert_type(model.to_bytes(), bytes)
assert_type(model.margin_error, float)

recognizer = palpate.Recognizer(model, error_rate=0.05)
assert_type(recognizer.push((0.0, None, 0.1)), palpate.Verdict)
assert_type(recognizer.push(data.times[0]), palpate.Verdict)
assert_type(recognizer.verdict.object, str | None)
assert_type(recognizer.posteriors, dict[str, float])

assert_type(palpate.evaluate(model, data), palpate.Evaluation)
assert_type(palpate.evaluate(ensemble, data).accuracy, dict[int, float])
assert_type(palpate.parity(ensemble, model, data).verdict_differs, int)

surface = palpate.Surface(np.zeros((3, 3)), [[0, 1, 2]])
assert_type(surface.first_contact([[0.0, 0.0, 1.0]], [[0.0, 0.0, -1.0]], 0.1), npt.NDArray[np.float64])
assert_type(surface.bounds, tuple[list[float], list[float]])

maps = palpate.Maps.of_meshes(["bowl"], probe=palpate.Probe(stroke=20.0), millimeters=10.0, real=palpate.Real())
assert_type(maps, palpate.Maps)
assert_type(maps.calibrate(["bowl"]).maps, palpate.Maps)
assert_type(maps.evaluate(["bowl"], aimed="random").error, float)
locator = palpate.Locator(maps)
assert_type(locator.next(), tuple[float, float, float])
assert_type(locator.push((0.0, None, 0.1), (1.0, 2.0, 3.0), 30.0), palpate.Located)
assert_type(locator.push_heights((3.0, None, 0.1), 1.0, 2.0, np.array([1.0, 0.0, 0.0])).object, str | None)
assert_type(data.position, npt.NDArray[np.float64] | None)

palpate.capture(1)  # type: ignore[arg-type]
model.margins(data, 3)  # type: ignore[call-arg]
recognizer.push("touch")  # type: ignore[arg-type]
recognizer.push((0.0, 0.0, 0.0)).nothing  # type: ignore[attr-defined]
