#!/usr/bin/env bash
# Rates promised on average, per name and per object: the table of docs/measurements/accuracy.md.
#
#   docs/measurements/tables/per.sh PALPATE MESHES DIR
#
# DIR is filled. Two minutes on two cores.
set -euo pipefail
palpate=$1 meshes=$2 out=$3
mkdir -p "$out"
meshes=$(realpath "$meshes")
cd "$out"
quiet() { "$palpate" "$@" --quiet >>log 2>&1; }
quiet capture "$meshes" -o trained --approaches 21000
quiet capture "$meshes" -o fresh --approaches 400000 --seed 3
quiet capture "$meshes" -o tested --approaches 400000 --seed 5
quiet train trained -o model.json
quiet export model.json -o model.palpate
for rate in 1% 5%; do
    for per in average name object; do
        if ! quiet calibrate model.palpate fresh -o kept.palpate --per $per --error-rate $rate --force; then
            echo "| $rate | $per | refused: $(tail -1 log | sed 's/^[^:]*: //') |"
            continue
        fi
        "$palpate" evaluate kept.palpate tested --json --quiet >evaluated.json
        python3 - $rate $per <<'PYTHON'
import json, sys

found = json.load(open("evaluated.json"))["sequential"]
percent = lambda share: f"{100 * share:.1f} %"
worst = [max(found[of].values()) for of in ("error_per_name", "error_of_given_per_object")]
cells = [*sys.argv[1:], f"{found['mean_touches']:.1f}", percent(found["error_of_given"]), *map(percent, worst), percent(found["undecided"])]
print("|", " | ".join(cells), "|")
PYTHON
    done
done
