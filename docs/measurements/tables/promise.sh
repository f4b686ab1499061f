#!/bin/sh
# Promises of models of a fitted probe, tested on recordings of a robot.
#
#   docs/measurements/tables/promise.sh MESHES ROBOT DIR
#
# ROBOT has known/ (recorded touches to fit from), more/ (recorded touches of all objects, which calibrate) and test/ (touches to
# test on; nothing is fitted or chosen on them). DIR is filled. The program is $PALPATE, or target/release/palpate.
set -eu
meshes=$1
robot=$2
out=$3
palpate=${PALPATE:-target/release/palpate}

mkdir -p "$out/test"
quiet() { "$palpate" "$@" >/dev/null 2>>"$out/log"; }
# Only objects that have a mesh.
for mesh in "$meshes"/*.obj; do cp "$robot/test/$(basename "$mesh" .obj).txt" "$out/test/"; done
# Accuracy after 20 and 60 approaches, the share of wrong names among those given at a requested rate of 1 % or the model's own, and
# of undecided sequences.
tested() { # name, model, touches
    row=$1
    shift
    "$palpate" evaluate "$@" --at 20,60 --json 2>>"$out/log" >"$out/evaluated.json"
    python3 - "$row" "$out/evaluated.json" <<'PYTHON'
import json, sys

found = json.load(open(sys.argv[2]))
part = found["approaches"]
stopped = part["sequential"]
percent = lambda share: f"{100 * share:.1f}"
shares = " / ".join(percent(share) for share in part["accuracy"].values())
line = f"| {sys.argv[1]} | {shares} | {percent(stopped['error'])} | {percent(stopped['undecided'])} |"
print(line, flush=True)
PYTHON
}
fitted() { # name, seed, approaches, options of capture
    name=$1 seed=$2 count=$3
    shift 3
    [ -e "$out/$name/dataset.json" ] || quiet capture "$@" -o "$out/$name" --probe "$out/fit.toml" --approaches "$count" --seed "$seed" --force
}

[ -e "$out/fit.toml" ] || quiet probe fit "$robot/known" "$meshes" -o "$out/fit.toml"
fitted simulated 1 21000 "$meshes"
train() { # touches, ensemble
    quiet train "$1" -o "$2" --trees rounds=40,depth=5
}
train "$out/simulated" "$out/fitted.json"
quiet export "$out/fitted.json" -o "$out/fitted.palpate"
echo "| $(basename "$robot") | correct after 20 / 60 | wrong | undecided |"
echo "|---|---|---|---|"
fitted unseen 9 4000 "$meshes"
tested "fitted, on simulated touches" "$out/fitted.json" "$out/unseen"
tested "fitted" "$out/fitted.json" "$out/test"

fitted fresh 3 100000 "$meshes"
quiet calibrate "$out/fitted.palpate" "$out/fresh" -o "$out/promised.palpate"
tested "1 % promised for simulated touches" "$out/promised.palpate" "$out/test"
for rate in 1 3 6 10 15; do
    if "$palpate" calibrate "$out/fitted.palpate" "$out/fresh" --recorded "$robot/more" --error-rate $rate% \
        -o "$out/promised.palpate" >"$out/calibrated.txt" 2>&1; then
        sed -n 2,3p "$out/calibrated.txt"
        tested "$rate % promised for recorded touches" "$out/promised.palpate" "$out/test"
    else
        cat "$out/calibrated.txt"
    fi
done
