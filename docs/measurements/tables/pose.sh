#!/usr/bin/env bash
# What the default trees of descriptors with a pose take: pose.sh PALPATE OBJECTS DIRECTORY, with a built program, meshes (a
# directory, or `builtin`) that float, and where to work. Some ten minutes on two cores.
set -euo pipefail
palpate=$1 objects=$2
mkdir -p "$3"
cd "$3"
noise=noise=0..5ms,timer=1ms
capture() { "$palpate" capture "$objects" -o "$1" --approaches "$2" --pose --seed "$3" >"$1.log" 2>&1; }
capture trained 60000 1
capture calibrated 120000 2
capture tested 60000 3
for descriptor in oriented gravity; do
    for trees in rounds=30,depth=6,leaf_bits=16 rounds=60,depth=6,leaf_bits=8 rounds=40,depth=7,leaf_bits=8; do
        "$palpate" train trained -o model.json --descriptor "$descriptor" --trees "$trees" --evidence all --real "$noise" >train.log 2>&1
        "$palpate" export model.json -o model.palpate >export.log 2>&1
        "$palpate" calibrate model.palpate calibrated -o kept.palpate --error-rate 0.01 --max-touches 200 --sequences 20000 \
            --real "$noise" >calibrate.log 2>&1
        echo "$descriptor, $trees: $(wc -c <kept.palpate) bytes"
        grep Instructions export.log
        "$palpate" evaluate kept.palpate tested --sequences 2000 --real "$noise" | grep -E "^(all|Promised)" | tail -n 2
    done
done
