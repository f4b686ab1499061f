"""What the number of the row, as a feature, saves: small sets that the package aeon ships, promised 10 %, over several splits.

    pip install ./host/python xgboost aeon==1.6.0 && python docs/measurements/tables/row_number.py

A row has the last value, and mean, spread and change of the last few. Of the sequences 60 % are fitted and calibrated on.
"""

import numpy as np
import palpate
from aeon.datasets import load_classification
from xgboost import XGBClassifier

RATE = 0.1
SPLITS = 10
LONGEST = 40


def rows(series: np.ndarray, numbered: bool) -> np.ndarray:
    """Rows of one series of several channels, at most `LONGEST` of them."""
    length = series.shape[1]
    ends = np.unique(np.linspace(0, length, min(length, LONGEST) + 1).astype(int)[1:])
    window = max(3, 2 * length // LONGEST)
    made = []
    for end in ends:
        part = series[:, max(0, end - window) : end]
        made.append(np.concatenate([part[:, -1], part.mean(1), part.std(1), part[:, -1] - part[:, 0], [end] * numbered]))
    return np.array(made)


def measured(name: str, numbered: bool) -> str:
    parts = [load_classification(name, split=part) for part in ("train", "test")]
    series = [np.asarray(one, float) for X, _ in parts for one in X]
    classes = np.unique(np.concatenate([y for _, y in parts]), return_inverse=True)[1]
    made = [rows(one, numbered) for one in series]
    right, wrong, used, named, refused = [], [], [], [], 0
    for split in range(SPLITS):
        order = np.random.default_rng(split).permutation(len(made))
        own, others = order[: len(made) * 6 // 10], order[len(made) * 6 // 10 :]

        def flat(of: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            lengths = [len(made[at]) for at in of]
            return np.concatenate([made[at] for at in of]), np.repeat(classes[of], lengths), np.repeat(of, lengths)

        X, y, ids = flat(own)
        estimator = XGBClassifier(n_estimators=40, max_depth=3, learning_rate=0.3, n_jobs=1)
        recognizer = palpate.SequenceRecognizer(estimator, error_rate=RATE, train_share=0.4)
        try:
            recognizer.fit(X, y, sequence=ids)
        except palpate.InputError:
            refused += 1
            continue
        X, _, ids = flat(others)
        found = recognizer.predict(X, sequence=ids)
        verdicts = recognizer.verdicts(X, sequence=ids)
        is_named = np.array([one is not None for one in found])
        is_right = np.array([one == truth for one, truth in zip(found, classes[others])])
        right.append(is_right.mean())
        named.append(is_named.mean())
        wrong.append(1 - is_right[is_named].mean() if is_named.any() else 0)
        used.append(np.mean([verdict.touches / len(made[at]) for verdict, at in zip(verdicts, others)]))
    figures = [f"{100 * np.mean(of):.1f} %" if of else "–" for of in (right, wrong, named, used)]
    return f"| {name} | {'with' if numbered else 'without'} | {refused} of {SPLITS} | {' | '.join(figures)} |"


print("| set | row number | refused | right of all | wrong of names | named | of the rows used |\n|---|---|---|---|---|---|---|")
for name in ("ItalyPowerDemand", "GunPoint"):
    for numbered in (False, True):
        print(measured(name, numbered), flush=True)
