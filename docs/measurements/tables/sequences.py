"""What a row's number and a guard do on sets that aeon ships: the tables of docs/measurements/streams.md.

python sequences.py PALPATE [SET ...] [--splits 10]      needs numpy, aeon==1.6.0, xgboost==3.2.0 and the program palpate

Of each set 60 % of the series are for fitting: 40 % of these train XGBoost, 60 % calibrate, at a promised 10 %. The rest is
evaluated, also with a first feature that is missing, at a rail (ten ranges beyond its largest value) or stuck from the second row.
"""

import argparse
import csv
import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from aeon.datasets import load_classification, load_japanese_vowels
from xgboost import XGBClassifier


def load(name):
    xs, ys = [], []
    for part in ("train", "test"):
        x, y = load_japanese_vowels(split=part) if name == "JapaneseVowels" else load_classification(name, split=part)
        xs += [np.asarray(one, float) for one in x]
        ys += list(y)
    chosen = np.random.default_rng(0).permutation(len(ys))[:500]
    return [xs[at] for at in chosen], np.unique(np.array(ys)[chosen], return_inverse=True)[1]


def rows(x, longest):
    length = x.shape[1]
    ends = np.arange(1, length + 1) if longest <= 40 else np.unique(np.linspace(length / 25, length, 25).astype(int))
    width = 3 if longest <= 40 else max(2, 2 * length // 25)
    parts = [x[:, max(0, end - width) : end] for end in ends]
    return np.array([np.concatenate([p[:, -1], p.mean(1), p.std(1), p[:, -1] - p[:, 0]]) for p in parts])


def write(path, sequences, labels, ids):
    with open(path, "w", newline="") as file:
        out = csv.writer(file)
        out.writerow(["id", "kind", *(f"x{at}" for at in range(sequences[0].shape[1]))])
        for number, label, sequence in zip(ids, labels, sequences):
            out.writerows([number, label, *("" if v != v else repr(float(v)) for v in row)] for row in sequence)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("palpate")
    parser.add_argument("sets", nargs="*", default=["ItalyPowerDemand", "GunPoint", "JapaneseVowels"])
    parser.add_argument("--splits", type=int, default=10)
    arguments = parser.parse_args()
    directory = Path(tempfile.mkdtemp())

    def run(*words):
        done = subprocess.run([arguments.palpate, *map(str, words), "--json", "--quiet"], capture_output=True, text=True)
        return json.loads(done.stdout) if done.returncode == 0 else None

    columns = ["--label", "kind", "--sequence-column", "id"]
    print("| set | model | accuracy | rows | wrong | undecided | refused calibrations | good rows refused | missing, rail, stuck |")
    print("|---|---|---|---|---|---|---|---|---|")
    for name in arguments.sets:
        xs, y = load(name)
        longest = max(x.shape[1] for x in xs)
        all_rows = [rows(x, longest) for x in xs]
        for label, numbered, guard in [("", False, False), ("row number", True, False), ("row number, guard", True, True)]:
            found, refused, good, bad = [], 0, [0, 0], {"missing": [0, 0], "rail": [0, 0], "stuck": [0, 0]}
            for split in range(arguments.splits):
                order = np.random.default_rng(split).permutation(len(y))
                fit, test = order[: len(y) * 6 // 10], order[len(y) * 6 // 10 :]
                train, calibrated = fit[: len(fit) * 4 // 10], fit[len(fit) * 4 // 10 :]
                X = np.concatenate([np.column_stack([all_rows[i], np.arange(1, len(all_rows[i]) + 1)]) for i in train])
                names = [*(f"x{at}" for at in range(all_rows[0].shape[1])), "number"]
                labels = np.repeat(y[train], [len(all_rows[i]) for i in train])
                model = XGBClassifier(n_estimators=40, max_depth=3, learning_rate=0.3, n_jobs=1)
                model.fit(X if numbered else X[:, :-1], labels)
                booster = model.get_booster()
                booster.feature_names = names if numbered else names[:-1]
                booster.save_model(directory / "model.json")
                write(directory / "calibrate.csv", [all_rows[i] for i in calibrated], y[calibrated], calibrated)
                write(directory / "test.csv", [all_rows[i] for i in test], y[test], test)
                position = ["--row-number", "number"] if numbered else []
                run("export", directory / "model.json", "-o", directory / "model.palpate", *position)
                options = [*columns, "--error-rate", "10%", *(["--guard"] if guard else [])]
                sure = directory / "sure.palpate"
                if run("rows", "calibrate", directory / "model.palpate", directory / "calibrate.csv", "-o", sure, *options) is None:
                    refused += 1
                    continue
                found.append(run("rows", "evaluate", sure, directory / "test.csv", *columns))
                if not guard:
                    continue
                good = [good[0] + found[-1]["refused"], good[1] + sum(len(all_rows[i]) for i in test)]
                top = np.max(np.concatenate(all_rows)[:, 0]) + 10 * np.ptp(np.concatenate(all_rows)[:, 0])
                for kind in bad:
                    broken = [all_rows[i].copy() for i in test]
                    for sequence in broken:
                        sequence[1:, 0] = {"missing": np.nan, "rail": top, "stuck": sequence[0, 0]}[kind]
                    write(directory / "broken.csv", broken, y[test], test)
                    ends = run("rows", "evaluate", sure, directory / "broken.csv", *columns)
                    rows_after = sum(len(sequence) - 1 for sequence in broken)
                    bad[kind] = [bad[kind][0] + ends["refused"], bad[kind][1] + rows_after]
            share = lambda pair: f"{pair[0] / pair[1]:.2%}" if pair[1] else "–"  # noqa: E731
            if found:
                mean = lambda key: float(np.mean([one[key] for one in found]))  # noqa: E731
                accuracy = np.mean([1 - one["wrong"] - one["undecided"] for one in found])
                figures = f"{accuracy:.3f} | {mean('mean_rows'):.1f} | {mean('error'):.1%} | {mean('undecided'):.0%}"
            else:
                figures = "– | – | – | –"
            dead = ", ".join(share(pair) for pair in bad.values())
            print(f"| {name} | {label or 'window'} | {figures} | {refused} of {arguments.splits} | {share(good)} | {dead} |", flush=True)


if __name__ == "__main__":
    main()
