#!/usr/bin/env bash
# The tables of docs/measurements/table.md: table.sh PALPATE OBJECTS DIRECTORY [CONE [TREES]], with a built program, meshes (a
# directory, or `builtin`), where to work, and, for one model with `gravity` and an output for each placement alone, the cone in
# degrees and its number of trees. Some ten minutes on two cores.
set -euo pipefail
palpate=$1 objects=$2 cone=${4:-60}
mkdir -p "$3"
cd "$3"
noise=noise=0..5ms,timer=1ms
capture() {
    "$palpate" capture "$objects" -o "$1" --scene table --cone "$cone" --approaches "$2" --pose --seed "$3" >"$1.log" 2>&1
}
capture trained 60000 1
capture calibrated 200000 2
capture tested 60000 3
one() { # one NAME "options of train" "options of export"
    # shellcheck disable=SC2086
    "$palpate" train trained -o "$1.json" $2 --evidence all --real "$noise" >"$1.log" 2>&1
    # shellcheck disable=SC2086
    "$palpate" export "$1.json" -o "$1.palpate" $3 >>"$1.log" 2>&1
    if ! "$palpate" calibrate "$1.palpate" calibrated -o "$1.kept" --error-rate 0.01 --max-touches 200 --sequences 20000 \
        --real "$noise" >>"$1.log" 2>&1; then
        tail -1 "$1.log"
        cp "$1.palpate" "$1.kept"
    fi
    echo "$1: $(wc -c <"$1.kept") bytes"
    "$palpate" evaluate "$1.kept" tested --sequences 2000 --real "$noise"
}
trees="leaf_bits=16,rounds=${5:-25}"
one gravity-placements "--descriptor gravity --trees $trees" "--leaf i8"
[ $# -le 3 ] || exit 0
one gravity-placements-small "--descriptor gravity --trees rounds=20,depth=5,leaf_bits=8" "--leaf i8"
one curvature-placements "--descriptor curvature --trees rounds=25" "--leaf i8"
one gravity-objects "--descriptor gravity --outputs objects --trees rounds=30,leaf_bits=16" "--leaf i16"
one curvature-objects "--descriptor curvature --outputs objects" "--leaf i16"
