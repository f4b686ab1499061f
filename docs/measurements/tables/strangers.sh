#!/usr/bin/env bash
# A background, a misfit test, and both: the table of docs/measurements/accuracy.md.
#
#   docs/measurements/tables/strangers.sh PALPATE DIR KNOWN... -- UNKNOWN...
#
# KNOWN and UNKNOWN are meshes. DIR is filled. Three minutes on two cores.
set -euo pipefail
palpate=$1 out=$2
shift 2
known=() unknown=()
while [ "$1" != -- ]; do known+=("$(realpath "$1")"); shift; done
shift
for mesh in "$@"; do unknown+=("$(realpath "$mesh")"); done
mkdir -p "$out"
cd "$out"
quiet() { "$palpate" "$@" --quiet >>log 2>&1; }
[ -d shapes ] || quiet capture background -o shapes --approaches 60000
quiet capture "${known[@]}" -o trained --approaches 100000 --seed 1
quiet capture "${known[@]}" -o fresh --approaches 200000 --seed 3
quiet capture "${known[@]}" -o tested --approaches 200000 --seed 5
quiet capture "${unknown[@]}" -o others --approaches 20000 --seed 6
quiet train trained -o plain.json
quiet train trained -o background.json --background shapes
for model in plain background; do
    quiet export $model.json -o $model.palpate
    for test in "" --detect-unknown; do
        quiet calibrate $model.palpate fresh -o $model$test.palpate $test --sequences 50000
        "$palpate" evaluate $model$test.palpate tested --unknown others --json --quiet >evaluated.json
        python3 - $model "$test" "$(wc -c <$model$test.palpate)" <<'PYTHON'
import json, sys

found = json.load(open("evaluated.json"))
known, unknown = found["sequential"], found["strangers"]
method = {"plain": "", "background": "background"}[sys.argv[1]], "misfit test" if sys.argv[2] else ""
percent = lambda share: f"{100 * share:.1f} %"
cells = [" and ".join(filter(None, method)) or "neither", f"{int(sys.argv[3]):,}", f"{known['mean_touches']:.1f}", percent(known["unknown"]),
         percent(unknown["wrong_name"]), percent(unknown["detected"]["120"])]
print("|", " | ".join(cells), "|")
PYTHON
    done
done
