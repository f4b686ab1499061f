"""Events in recordings that are put together from series of aeon's sets: the table of docs/measurements/streams.md.

python events.py PALPATE [SET ...] [--splits 4]      needs numpy, aeon==1.6.0, xgboost==3.2.0 and the program palpate

Of each set 40 % of the series train XGBoost, 30 % are for calibration, 30 % for evaluation. A recording has one to three series of
the background, one or two of an event's class, and so on, four events in all. Series are drawn with replacement, so that recordings
of one part share some: the promise is for recordings of the same series, and the evaluation is on others. A clock of 10 rows per
second is assumed; a grace of 1 s, a hold-off of 2 s.
"""

import argparse
import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from sequences import load, rows, write
from xgboost import XGBClassifier

# The classes that are the background together.
BACKGROUND = {"JapaneseVowels": 3, "BasicMotions": 1}
RECORDINGS = 400


def recordings(all_rows, y, series, seed):
    """Rows, labels and recordings."""
    random = np.random.default_rng(seed)
    of = [[i for i in series if y[i] == kind] for kind in range(y.max() + 1)]
    made, labels, ids = [], [], []
    for recording in range(RECORDINGS):
        for _ in range(4):
            event = random.integers(1, len(of))
            for kind, most in ((0, 3), (event, 2)):
                for _ in range(random.integers(1, most + 1)):
                    made.append(all_rows[random.choice(of[kind])])
                    labels.append(kind)
                    ids.append(recording)
    return made, labels, ids


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("palpate")
    parser.add_argument("sets", nargs="*", default=list(BACKGROUND))
    parser.add_argument("--splits", type=int, default=4)
    parser.add_argument("--false-per-hour", type=float, default=60.0)
    arguments = parser.parse_args()
    directory = Path(tempfile.mkdtemp())

    def run(*words):
        done = subprocess.run([arguments.palpate, *map(str, words), "--json", "--quiet"], capture_output=True, text=True)
        if done.returncode:
            print(done.stderr)
        return json.loads(done.stdout) if done.returncode == 0 else None

    columns = ["--label", "kind", "--sequence-column", "id"]
    options = ["--events", "0", "--rows-per-second", "10", "--false-per-hour", arguments.false_per_hour]
    print("| set | split | rule | events named | delay | false or repeated per hour |")
    print("|---|---|---|---|---|---|")
    for name in arguments.sets:
        xs, y = load(name)
        y = np.maximum(y - BACKGROUND[name] + 1, 0)
        all_rows = [rows(x, 40) for x in xs]
        for split in range(arguments.splits):
            order = np.random.default_rng(split).permutation(len(y))
            train, calibrated, tested = np.split(order, [len(y) * 4 // 10, len(y) * 7 // 10])
            model = XGBClassifier(n_estimators=40, max_depth=3, learning_rate=0.3, n_jobs=1)
            model.fit(np.concatenate([all_rows[i] for i in train]), np.repeat(y[train], [len(all_rows[i]) for i in train]))
            booster = model.get_booster()
            booster.feature_names = [f"x{at}" for at in range(all_rows[0].shape[1])]
            booster.save_model(directory / "model.json")
            write(directory / "calibrate.csv", *recordings(all_rows, y, calibrated, 2 * split))
            write(directory / "test.csv", *recordings(all_rows, y, tested, 2 * split + 1))
            run("export", directory / "model.json", "-o", directory / "model.palpate")
            sure = directory / "sure.palpate"
            if run("calibrate", directory / "model.palpate", directory / "calibrate.csv", "-o", sure, *columns, *options) is None:
                print(f"| {name} | {split} | refused | | | |", flush=True)
                continue
            found = run("evaluate", sure, directory / "test.csv", *columns)
            rules = [("promised", found), ("majority", found["majority"]), ("debouncing", found["debounced"])]
            for rule, one in rules:
                if one is None:
                    print(f"| {name} | {split} | {rule} | no number of rows has as few false | | |", flush=True)
                    continue
                of = f" of {one['rows']} rows" if "rows" in one else ""
                named = f"{one['named'] / one['events']:.1%}"
                print(f"| {name} | {split} | {rule}{of} | {named} | {one['mean_delay']:.1f} s | {one['false_per_hour']:.1f} |", flush=True)


if __name__ == "__main__":
    main()
