"""Opens with XGBoost what `palpate export --emit json` made of this directory's models, and compares the margins.

    mkdir again && for model in *.json *.ubj *.txt *.onnx; do
        missing=; [[ $model = *-missing-0.json ]] && missing="--missing 0"
        palpate export $model -o again/${model%.*}.palpate --emit json $missing
    done
    xgboost-3.2/bin/python reopen.py again

Prints for each model the rows whose margins differ from those of the library that trained it: none in any bit where that
is XGBoost, none by more than 1e-5 of 1 or the largest otherwise. The attribute `palpate_prediction` has the factor that makes
shares of a forest's votes, and the number that stands for a missing value. Seconds that f32 does not hold differ. Versions before 3.1 know no intercepts that differ, before 2.0 no leaves
with a value for each class; models with these are skipped. `make.py` says how the environments are made.
"""

import json
import sys
from pathlib import Path

import numpy as np
import xgboost

HERE = Path(__file__).parent
VERSION = tuple(int(part) for part in xgboost.__version__.split(".")[:2])


def columns(path, wanted):
    """The numbers in the columns with these names."""
    head, *lines = (line.split(",") for line in path.read_text().splitlines())
    own = [at for at, name in enumerate(head) if wanted(name)]
    return np.array([[float(line[at] or "nan") for at in own] for line in lines])


wrong = compared = 0
for path in sorted(Path(sys.argv[1]).glob("*.json")):
    learner = json.loads(path.read_text())["learner"]
    vectors = learner["gradient_booster"]["model"]["trees"][0]["tree_param"]["size_leaf_vector"] != "1"
    if VERSION < (3, 1) and learner["learner_model_param"]["base_score"].startswith("[") or VERSION < (2, 0) and vectors:
        print(f"{path.stem}: not for XGBoost {xgboost.__version__}")
        continue
    booster = xgboost.Booster(model_file=path)
    table = HERE / f"{path.stem}.csv"
    rows = columns(table, lambda name: not name.startswith(("margin", "prediction", "probability"))).astype(np.float32)
    stated = json.loads(learner["attributes"].get("palpate_prediction", "{}"))
    low, high = (float(end) for end in stated.get("sentinel", ["nan", "nan"]))
    # XGBoost takes no infinities.
    finite = ~np.isinf(rows).any(axis=1)
    rows = rows[finite]
    rows[(low <= rows) & (rows <= high)] = np.nan
    matrix = xgboost.DMatrix(rows, feature_names=booster.feature_names)
    own = booster.predict(matrix, output_margin=True).reshape(len(rows), -1) * np.float32(stated.get("scale", 1))
    expected = columns(table, lambda name: name.startswith("margin"))[finite]
    if own.shape[1] == 2 and expected.shape[1] == 1:
        own = own[:, 1:]
    exact = path.stem.startswith("xgboost")
    same = own == expected.astype(np.float32) if exact else np.abs(own - expected) <= 1e-5 * max(1, np.abs(expected).max())
    different = int((~same.all(axis=1)).sum())
    objective = learner["objective"]["name"]
    print(f"{path.stem}: {objective}, {len(rows)} rows, {different} differ")
    compared += 1
    wrong += different > 0
print(f"XGBoost {xgboost.__version__}: {compared} models, {wrong} with differences")
sys.exit(wrong > 0 or compared == 0)
