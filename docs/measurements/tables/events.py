"""Events in recordings that are put together from series of aeon's sets: the table of docs/measurements/streams.md.

python events.py [SET ...] [--splits 4]      needs numpy, aeon==1.6.0 and xgboost==3.2.0

Of each set 40 % of the series train XGBoost, 30 % are for choosing a rule's numbers, 30 % for the figures. A recording has one to three
series of the background, one or two of an event's class, and so on, four events in all. A clock of 10 rows per second is assumed; a
grace of 1 s, a hold-off of 2 s. Of each rule those numbers are taken with which it names most events, on recordings of the second
part, at no more than 60 false or repeated verdicts per hour.
"""

import argparse

import numpy as np
from sequences import load, rows
from xgboost import XGBClassifier

# The classes that are the background together.
BACKGROUND = {"JapaneseVowels": 3, "BasicMotions": 1}
RECORDINGS = 400
GRACE, HOLD_OFF = 10, 20


def recordings(all_rows, y, series, seed):
    """For each recording its rows, and a class for each."""
    random = np.random.default_rng(seed)
    of = [[i for i in series if y[i] == kind] for kind in range(y.max() + 1)]
    made = []
    for _ in range(RECORDINGS):
        parts = []
        for _ in range(4):
            event = random.integers(1, len(of))
            for kind, most in ((0, 3), (event, 2)):
                for _ in range(random.integers(1, most + 1)):
                    parts.append((all_rows[random.choice(of[kind])], kind))
        made.append((np.concatenate([x for x, _ in parts]), np.repeat([kind for _, kind in parts], [len(x) for x, _ in parts])))
    return made


def verdicts(said):
    """Rows and classes of verdicts, from the class that is sure after each row, -1 for none: changes of class, with a hold-off."""
    holds, silent, found = None, 0, []
    for row, kind in enumerate(said):
        silent = max(0, silent - 1)
        if kind < 0 or kind == holds or (kind != 0 and silent > 0):
            continue
        holds = kind
        if kind != 0:
            silent = HOLD_OFF
            found.append((row, kind))
    return found


def counted(made, said):
    """The share of events named, the mean delay in seconds, and false or repeated verdicts per hour."""
    events = false = length = 0
    delays = []
    for (_, kinds), said_of in zip(made, said):
        edges = [0, *(np.flatnonzero(np.diff(kinds)) + 1), len(kinds)]
        own = [(start, end, kinds[start]) for start, end in zip(edges, edges[1:]) if kinds[start] != 0]
        open_ones = set(own)
        events, length = events + len(own), length + len(kinds)
        for row, kind in verdicts(said_of):
            counts = [run for run in own if run[2] == kind and run[0] <= row < run[1] + GRACE and run in open_ones]
            if counts:
                open_ones.remove(counts[0])
                delays.append(row + 1 - counts[0][0])
            else:
                false += 1
    return len(delays) / events, np.mean(delays or [0]) / 10, false / (length / 36_000)


def majority(logs, count):
    kinds = logs.argmax(1)
    votes = np.cumsum(np.eye(logs.shape[1], dtype=int)[kinds], 0)
    votes[count:] -= votes[:-count].copy()
    return np.where(2 * votes.max(1) > count, votes.argmax(1), -1)


def debounced(logs, count):
    kinds = logs.argmax(1)
    starts = np.maximum.accumulate(np.where(np.diff(kinds, prepend=-1) != 0, np.arange(len(kinds)), 0))
    return np.where(np.arange(len(kinds)) - starts + 1 >= count, kinds, -1)


def begun_again(logs, nats, most):
    """The class whose lead over all others reaches a number of nats; after it, or after a number of rows, sums begin again."""
    said, sums, count = np.full(len(logs), -1), np.zeros(logs.shape[1]), 0
    for row, own in enumerate(logs):
        sums, count = sums + own, count + 1
        best = sums.argmax()
        others = np.delete(sums, best)
        if sums[best] - others.max() - np.log(np.exp(others - others.max()).sum()) >= nats:
            said[row], count = best, most
        if count >= most:
            sums, count = np.zeros_like(sums), 0
    return said


RULES = {
    "majority": (majority, [(count,) for count in range(1, 61)]),
    "debouncing": (debounced, [(count,) for count in range(1, 61)]),
    "begin again": (begun_again, [(nats, most) for most in (10, 20, 40, 80) for nats in (2, 3, 4, 6, 8, 10, 13, 16, 20, 25, 30)]),
}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sets", nargs="*", default=list(BACKGROUND))
    parser.add_argument("--splits", type=int, default=4)
    arguments = parser.parse_args()
    print("| set | split | rule | its numbers | events named | delay | false or repeated per hour |")
    print("|---|---|---|---|---|---|---|")
    for name in arguments.sets:
        xs, y = load(name)
        y = np.maximum(y - BACKGROUND[name] + 1, 0)
        all_rows = [rows(x, 40) for x in xs]
        for split in range(arguments.splits):
            order = np.random.default_rng(split).permutation(len(y))
            train, chosen, tested = np.split(order, [len(y) * 4 // 10, len(y) * 7 // 10])
            model = XGBClassifier(n_estimators=40, max_depth=3, learning_rate=0.3, n_jobs=1)
            model.fit(np.concatenate([all_rows[i] for i in train]), np.repeat(y[train], [len(all_rows[i]) for i in train]))
            parts = [recordings(all_rows, y, part, 2 * split + at) for at, part in enumerate((chosen, tested))]
            logs = [[np.log(model.predict_proba(x)) for x, _ in made] for made in parts]
            for rule, (says, choices) in RULES.items():
                figures = {own: counted(parts[0], [says(log, *own) for log in logs[0]]) for own in choices}
                kept = [own for own in choices if figures[own][2] <= 60]
                if not kept:
                    print(f"| {name} | {split} | {rule} | none has as few false | | | |", flush=True)
                    continue
                best = max(kept, key=lambda own: figures[own][0])
                named, delay, false = counted(parts[1], [says(log, *best) for log in logs[1]])
                numbers = ", ".join(map(str, best))
                print(f"| {name} | {split} | {rule} | {numbers} | {named:.1%} | {delay:.2f} s | {false:.1f} |", flush=True)


if __name__ == "__main__":
    main()
