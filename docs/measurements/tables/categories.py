"""Prints what splits by categories cost: bytes and instructions of models, and what sets as single splits would take.

    python3.11 docs/measurements/tables/categories.py target/release/palpate

Needs xgboost, lightgbm and numpy.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import lightgbm
import numpy as np
import xgboost

PALPATE = sys.argv[1]
NAMES = ["a", "b", "kind"]


def data(categories, rows=20_000, seed=1):
    """Two numbers and a category; each category has an effect of its own, in no order."""
    random = np.random.default_rng(seed)
    x = random.normal(size=(rows, 3)).astype(np.float32)
    x[:, 2] = random.integers(0, categories, rows)
    effect = random.normal(size=categories)
    y = x[:, 0] + effect[x[:, 2].astype(int)] + 0.5 * x[:, 1] * effect[::-1][x[:, 2].astype(int)] + random.normal(size=rows) > 0
    return x, y


def export(path):
    """The exporter's answer, and the splits of the file."""
    with tempfile.TemporaryDirectory() as place:
        answer = subprocess.run(
            [PALPATE, "export", path, "-o", f"{place}/m.palpate", "--json"], capture_output=True, text=True)
    return json.loads(answer.stdout) if answer.returncode == 0 else answer.stderr.strip().splitlines()[0]


def splits_of(text, kind):
    """Splits of a file, and words of 32 bits in its sets."""
    if kind == "LightGBM":
        lines = text.splitlines()
        splits = sum(int(line.split("=")[1]) - 1 for line in lines if line.startswith("num_leaves="))
        return splits, sum(len(line.split()) for line in lines if line.startswith("cat_threshold="))
    trees = json.loads(text)["learner"]["gradient_booster"]["model"]["trees"]
    splits = sum(left != -1 for tree in trees for left in tree["left_children"])
    words = 0
    for tree in trees:
        for first, size in zip(tree["categories_segments"], tree["categories_sizes"]):
            words += max(tree["categories"][first : first + size]) // 32 + 1
    return splits, words


print("| library | categories | splits in the file | splits | bytes | bytes if each set were one split (estimate) | instructions on a Cortex-M4F |")
print("|---|---|---|---|---|---|---|")
for categories in [5, 20, 100]:
    x, y = data(categories)
    matrix = xgboost.DMatrix(x, y, feature_names=NAMES, feature_types=["q", "q", "c"], enable_categorical=True)
    booster = xgboost.train({"objective": "binary:logistic", "max_depth": 4, "nthread": 2}, matrix, 30)
    lights = lightgbm.train(
        {"objective": "binary", "num_leaves": 15, "verbose": -1, "num_threads": 2, "deterministic": True, "seed": 1},
        lightgbm.Dataset(x, y, feature_name=NAMES, categorical_feature=[2]), 30)
    with tempfile.TemporaryDirectory() as place:
        for kind, name, save in [("XGBoost", "m.json", booster.save_model), ("LightGBM", "m.txt", lights.save_model)]:
            path = Path(place) / name
            save(path)
            splits, words = splits_of(path.read_text(), kind)
            answer = export(path)
            if isinstance(answer, str):
                print(f"| {kind} | {categories} | {splits} | {answer} |")
                continue
            # Compact trees: three bytes for a split, two for a leaf, and two for the number of a set.
            fewer = answer["splits"] - splits
            sets = answer["bytes"] - 5 * fewer + 4 * words + 2 * words
            print(f"| {kind} | {categories} | {splits} | {answer['splits']} | {answer['bytes']} | {sets} | {answer['instructions']['m4f']} |")
