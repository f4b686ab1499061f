#!/bin/sh
# Models of a probe that is fitted to four disjoint parts of a robot's recordings, without a plate and with one.
#
#   docs/measurements/tables/plate.sh MESHES ROBOT DIR
#
# ROBOT has known/ (300 recorded approaches to each of some objects), plate.txt (presses) and test/ (touches to test on; nothing
# is fitted or chosen on them). Each part has 75 approaches to each object and 20 presses. DIR is filled. The program is
# $PALPATE, or target/release/palpate.
set -eu
meshes=$1
robot=$2
out=$3
palpate=${PALPATE:-target/release/palpate}

mkdir -p "$out/test"
quiet() { "$palpate" "$@" >/dev/null 2>>"$out/log"; }
# Only objects that have a mesh.
for mesh in "$meshes"/*.obj; do cp "$robot/test/$(basename "$mesh" .obj).txt" "$out/test/"; done
row() { # name, part, options of the fit: correct after 20 and 60 approaches, wrong at a requested 1 %
    name=$1 part=$2
    shift 2
    [ -e "$out/$name.toml" ] || quiet probe fit "$out/part$part" "$meshes" -o "$out/$name.toml" "$@"
    quiet capture "$meshes" -o "$out/simulated" --probe "$out/$name.toml" --approaches 21000 --seed "$part" --force
    quiet train "$out/simulated" -o "$out/$name.json" --trees rounds=40,depth=5
    "$palpate" evaluate "$out/$name.json" "$out/test" --at 20,60 --json 2>>"$out/log" >"$out/$name.evaluated.json"
}
for part in 1 2 3 4; do
    rm -rf "$out/part$part"
    mkdir -p "$out/part$part"
    for file in "$robot"/known/*.txt; do
        sed -n "$((75 * part - 74)),$((75 * part))p" "$file" >"$out/part$part/$(basename "$file")"
    done
    sed -n "$((20 * part - 19)),$((20 * part))p" "$robot/plate.txt" >"$out/plate$part.txt"
    row "without-$part" $part
    row "with-$part" $part --plate "$out/plate$part.txt"
done
python3 - "$(basename "$robot")" "$out" <<'PYTHON'
import json, statistics, sys

robot, out = sys.argv[1:]
print(f"| {robot} | correct after 20 / 60, four fits | mean | wrong |\n|---|---|---|---|")
for kind in ["without", "with"]:
    rows = []
    for part in range(1, 5):
        found = json.load(open(f"{out}/{kind}-{part}.evaluated.json"))["approaches"]
        rows.append([100 * share for share in found["accuracy"].values()] + [100 * found["sequential"]["error"]])
    each = ", ".join(f"{row[0]:.1f} / {row[1]:.1f}" for row in rows)
    means = [statistics.mean(column) for column in zip(*rows)]
    print(f"| {kind} the plate | {each} | {means[0]:.1f} / {means[1]:.1f} | {means[2]:.1f} |")
PYTHON
