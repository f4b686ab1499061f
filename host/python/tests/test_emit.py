"""Models as source code, against the estimators that they are made from."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from typing import Any

import catboost
import lightgbm
import numpy as np
import palpate
import pytest
import xgboost
from sklearn import calibration, ensemble
from test_import import TEST, TRAIN, labels

CC = shutil.which("cc")

ROWS = np.ascontiguousarray(TEST[:200])
"""Rows that a program in C has with it."""

FITTED = {
    "xgboost": xgboost.XGBClassifier(n_estimators=12, max_depth=4),
    "lightgbm": lightgbm.LGBMClassifier(n_estimators=8, num_leaves=9, verbose=-1),
    "lightgbm ova": lightgbm.LGBMClassifier(n_estimators=8, num_leaves=9, objective="multiclassova", verbose=-1),
    "catboost": catboost.CatBoostClassifier(iterations=10, depth=4, verbose=False, allow_writing_files=False),
    "histogram": ensemble.HistGradientBoostingClassifier(max_iter=8),
    "forest": ensemble.RandomForestClassifier(n_estimators=15, max_depth=6, random_state=1),
}
"""Classifiers of every rule from margins to probabilities."""


def compiled(name: str) -> tuple[Any, palpate.Model]:
    estimator = FITTED[name].fit(TRAIN, labels(TRAIN, 3))
    return estimator, palpate.compile(estimator)


def said(directory: Path, lines: str, sources: tuple[str, ...] = ()) -> list[list[float]]:
    """The numbers that a program prints of each row."""
    rows = ",\n".join("{" + ",".join("NAN" if np.isnan(value) else f"{value!r}f" for value in row) + "}" for row in ROWS.tolist())
    text = (
        '#include "model.h"\n#include <math.h>\n#include <stdio.h>\n'
        "static const float rows[][6] = {" + rows + "};\nint main(void)\n{\n    float p[3];\n    unsigned i;\n"
        "    for (i = 0; i < sizeof rows / sizeof *rows; i++) {\n" + lines + "    }\n    return 0;\n}\n"
    )
    (directory / "main.c").write_text(text)
    command = [CC or "cc", "-std=c99", "-Wall", "-Wextra", "-Werror", "main.c", *sources, "-o", "main"]
    subprocess.run(command, cwd=directory, check=True)
    printed = subprocess.run(["./main"], cwd=directory, check=True, capture_output=True, text=True).stdout
    return [[float(number) for number in line.split()] for line in printed.splitlines()]


@pytest.mark.skipif(CC is None, reason="there is no C compiler")
@pytest.mark.parametrize("form", [None, "c-code"])
@pytest.mark.parametrize("name", FITTED)
def test_a_classifier_becomes_a_header_whose_calls_give_its_classes_and_probabilities(
    tmp_path: Path, name: str, form: str | None
) -> None:
    estimator, model = compiled(name)
    written = model.emit(tmp_path / "model.h", form=form)
    assert [Path(path).name for path in written] == ["model.h"]
    lines = '        model_posteriors(rows[i], p);\n        printf("%d %.9g %.9g %.9g\\n", (int)model_labels[model_predict(rows[i])], p[0], p[1], p[2]);\n'
    found = np.array(said(tmp_path, lines))
    np.testing.assert_array_equal(found[:, 0], np.array(model.predict(ROWS), dtype=float))
    bound = float((tmp_path / "model.h").read_text().split("probabilities, within ")[1].split()[0])
    assert bound < 2e-2
    np.testing.assert_allclose(found[:, 1:], estimator.predict_proba(ROWS), rtol=0, atol=bound)


@pytest.mark.parametrize("name", FITTED)
def test_probabilities_are_those_of_the_library(name: str) -> None:
    estimator, model = compiled(name)
    found = model.predict_proba(TEST)
    np.testing.assert_allclose(found, estimator.predict_proba(TEST), rtol=0, atol=model.margin_error + 1e-6)
    loaded = palpate.Model(model.to_bytes())
    with pytest.raises(palpate.InputError, match="do not say how"):
        loaded.predict_proba(TEST)


def test_where_margins_determine_no_probabilities_there_are_none(tmp_path: Path) -> None:
    forest = ensemble.RandomForestClassifier(n_estimators=5, max_depth=3, random_state=1)
    estimator = calibration.CalibratedClassifierCV(forest, ensemble=False, cv=2).fit(TRAIN, labels(TRAIN, 3))
    model = palpate.compile(estimator)
    with pytest.raises(palpate.InputError, match="do not determine"):
        model.predict_proba(TEST)
    model.emit(tmp_path / "model.h")
    assert "model_posteriors" not in (tmp_path / "model.h").read_text()


def test_every_form_is_written_and_what_there_is_no_form_for_is_refused_by_name(tmp_path: Path) -> None:
    _, model = compiled("xgboost")
    for form, files in [("c", ["m.h"]), ("rust", ["m.rs"]), ("rust-code", ["m.rs", "m.palpate"])]:
        assert sorted(Path(path).name for path in model.emit(tmp_path / "m", form=form)) == sorted(files)
    assert (tmp_path / "palpate.h").exists()
    loaded = palpate.Model(model.to_bytes())
    assert [Path(path).name for path in loaded.emit(tmp_path / "loaded.h")] == ["loaded.h"]
    for emitted, path, form in [(model, "m", None), (model, "m.h", "c++"), (loaded, "m.h", "c-code")]:
        with pytest.raises(palpate.SettingError, match="form"):
            emitted.emit(tmp_path / path, form=form)
    (tmp_path / "own.h").write_text("int own;\n")
    model.emit(tmp_path / "own.h")
    assert not (tmp_path / "own.h").read_text().startswith("int own;")
