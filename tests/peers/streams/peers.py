"""Early verdicts on six data sets that packages ship, against early classifiers of aeon: a table in Markdown.

python -m venv peers && peers/bin/pip install -r requirements.txt PALPATE_WHEEL
peers/bin/python peers.py [SET ...] [--splits 4] [--rate 0.1] [--program palpate]

Of each set 60 % of the series are for fitting and 40 % for the figures. Features are those of a window of two
twenty-fifths of the series: its last value, mean, deviation and change. A series without a verdict counts as wrong in
the accuracy, and as used up in the earliness. Figures are means over the splits in which a model was made; a refused
one counts in its own column, and so do names that are wrong more often than the rate that was promised.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import palpate
from aeon.classification.early_classification import TEASER, ProbabilityThresholdEarlyClassifier
from aeon.classification.interval_based import TimeSeriesForestClassifier
from aeon.datasets import load_classification, load_japanese_vowels
from sklearn.ensemble import RandomForestClassifier
from xgboost import XGBClassifier

SETS = ["JapaneseVowels", "ItalyPowerDemand", "GunPoint", "OSULeaf", "BasicMotions", "wrist"]
# Rows of a series, and the most series of a set.
ROWS, SERIES = 25, 500


def series(name: str) -> tuple[list[np.ndarray], np.ndarray]:
    """Series of channels by times, and their classes."""
    if name == "wrist":
        from seglearn.datasets import load_watch

        watch = load_watch()
        return [np.asarray(x, float).T for x in watch["X"]], np.asarray(watch["y"])
    xs: list[np.ndarray] = []
    ys: list[Any] = []
    for part in ("train", "test"):
        x, y = load_japanese_vowels(split=part) if name == "JapaneseVowels" else load_classification(name, split=part)
        xs += [np.asarray(one, float) for one in x]
        ys += list(y)
    chosen = np.random.default_rng(0).permutation(len(ys))[:SERIES]
    return [xs[at] for at in chosen], np.unique(np.array(ys)[chosen], return_inverse=True)[1]


def windows(x: np.ndarray, longest: int) -> tuple[np.ndarray, np.ndarray]:
    """The rows of a series, and the share of it that is over at each."""
    length = x.shape[1]
    is_short = longest <= 40
    ends = np.arange(1, length + 1) if is_short else np.unique(np.linspace(length / ROWS, length, ROWS).astype(int))
    width = 3 if is_short else max(2, 2 * length // ROWS)
    rows = []
    for end in ends:
        part = x[:, max(0, end - width) : end]
        rows.append(np.concatenate([x[:, end - 1], part.mean(1), part.std(1), part[:, -1] - part[:, 0]]))
    return np.array(rows), ends / length


def figures(names: list[int | None], used: list[float], truth: np.ndarray, rate: float) -> dict[str, float]:
    found = np.array([-1 if name is None else name for name in names])
    accuracy, earliness = float(np.mean(found == truth)), float(np.mean(used))
    named = found >= 0
    wrong = float(np.mean(found[named] != truth[named])) if named.any() else 0.0
    harmonic = 2 * accuracy * (1 - earliness) / max(1e-9, accuracy + 1 - earliness)
    return {
        "accuracy": accuracy,
        "earliness": earliness,
        "harmonic": harmonic,
        "wrong": wrong,
        "above": float(wrong > rate),
        "undecided": float(np.mean(~named)),
    }


def instructions(model: Any, program: str) -> float:
    """Instructions of a row on a Cortex-M4F, as `palpate inspect` estimates them."""
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "model.palpate"
        model.save(path)
        try:
            said = subprocess.run([program, "inspect", path, "--json"], capture_output=True, check=True, text=True).stdout
        except FileNotFoundError:
            return float("nan")
    return float(json.loads(said)["instructions"]["m4f"])


def ours(classifier: Any, options: dict[str, Any], data: Any, fit: np.ndarray, test: np.ndarray, arguments: Any) -> Any:
    rows, y = data
    take = lambda ids: (  # noqa: E731
        np.concatenate([rows[at][0] for at in ids]),
        np.repeat(y[ids], [len(rows[at][0]) for at in ids]),
        np.repeat(ids, [len(rows[at][0]) for at in ids]),
    )
    X, labels, sequence = take(fit)
    recognizer = palpate.SequenceRecognizer(classifier, error_rate=arguments.rate, max_rows=200, train_share=0.4, **options)
    try:
        recognizer.fit(X, labels, sequence=sequence)
    except palpate.InputError as error:
        return str(error)
    verdicts = recognizer.verdicts(take(test)[0], sequence=take(test)[2])
    names = [None if verdict.object is None else int(verdict.object) for verdict in verdicts]
    model = palpate.Recognizer(recognizer.model_)
    used = []
    for at in test:
        model.reset()
        count = next((n for n, row in enumerate(rows[at][0]) if model.push_row(row).decided), len(rows[at][0]) - 1)
        used.append(float(rows[at][1][count]))
    found = figures(names, used, y[test], arguments.rate)
    return found | {"bytes": recognizer.model_.size, "instructions": instructions(recognizer.model_, arguments.program)}


def theirs(kind: Any, xs: list[np.ndarray], y: np.ndarray, fit: np.ndarray, test: np.ndarray, rate: float) -> Any:
    longest = xs[0].shape[1]
    points = sorted(set(np.linspace(max(3, longest // 6), longest, 6).astype(int).tolist()))
    estimator = TimeSeriesForestClassifier(n_estimators=10, random_state=1)
    early = kind(estimator=estimator, classification_points=points, random_state=1)
    stacked = np.stack(xs)
    early.fit(stacked[fit], y[fit])
    names = early.predict(stacked[test])[0]
    used = np.array([points[int(at)] for at in early.get_state_info()[:, 0]]) / longest
    return figures([int(name) for name in names], list(used), y[test], rate)


def methods() -> dict[str, Any]:
    boosted = XGBClassifier(n_estimators=40, max_depth=3, learning_rate=0.3, n_jobs=1)
    forest = RandomForestClassifier(n_estimators=40, max_depth=6, random_state=1, n_jobs=1)
    number, folds = {"position": True}, {"position": True, "folds": 5}
    return {
        "Palpate, XGBoost": (boosted, {}),
        "Palpate, XGBoost, row number": (boosted, number),
        "Palpate, XGBoost, row number, folds": (boosted, folds),
        "Palpate, XGBoost, row number, folds, guard": (boosted, folds | {"guard": True}),
        "Palpate, XGBoost, row number, estimate only": (boosted, folds | {"promise": False}),
        "Palpate, forest, row number, folds": (forest, folds),
        "TEASER": TEASER,
        "probability threshold": ProbabilityThresholdEarlyClassifier,
    }


def main() -> None:
    warnings.filterwarnings("ignore")
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sets", nargs="*", metavar="SET", help=f"of {', '.join(SETS)}; all by default")
    parser.add_argument("--splits", type=int, default=4)
    parser.add_argument("--rate", type=float, default=0.1)
    parser.add_argument("--program", default="palpate", help="the program palpate, for instructions")
    arguments = parser.parse_args()
    if unknown := set(arguments.sets) - set(SETS):
        parser.error(f"{', '.join(sorted(unknown))}: not one of {', '.join(SETS)}")
    columns = ["accuracy", "earliness", "harmonic", "wrong", "undecided", "bytes", "instructions"]
    print(f"| set | method | {' | '.join(columns)} | above {arguments.rate:.0%} | refused |")
    print("|---|---|" + "---|" * (len(columns) + 2))
    for name in arguments.sets or SETS:
        xs, y = series(name)
        longest = max(x.shape[1] for x in xs)
        data = ([windows(x, longest) for x in xs], y)
        for label, method in methods().items():
            results: list[Any] = []
            if not isinstance(method, tuple) and len({x.shape[1] for x in xs}) > 1:
                print(f"| {name} | {label} | takes no series of unequal length{' |' * (len(columns) + 2)}", flush=True)
                continue
            for split in range(arguments.splits):
                order = np.random.default_rng(split).permutation(len(y))
                fit, test = order[: len(y) * 6 // 10], order[len(y) * 6 // 10 :]
                if isinstance(method, tuple):
                    results.append(ours(*method, data, fit, test, arguments))
                else:
                    results.append(theirs(method, xs, y, fit, test, arguments.rate))
            made = [result for result in results if isinstance(result, dict)]
            cells = []
            for column in columns:
                values = [result[column] for result in made if column in result]
                digits = 0 if column in ("bytes", "instructions") else 3
                cells.append(f"{np.mean(values):.{digits}f}" if values else "–")
            above = f"{sum(result['above'] for result in made):.0f} of {len(made)}"
            refused = f"{len(results) - len(made)} of {len(results)}"
            print(f"| {name} | {label} | {' | '.join(cells)} | {above} | {refused} |", flush=True)
            for why in sorted({result for result in results if isinstance(result, str)}):
                print(f"{name}, {label}: {why}", file=sys.stderr)


if __name__ == "__main__":
    main()
