#!/bin/sh
# Models of a fitted probe that recordings of a robot adjust, promise and test: accuracy, wrong names, false alarms.
#
#   docs/measurements/tables/adjust.sh MESHES ROBOT DIR [LEFT-OUT...]
#
# ROBOT has known/ (recorded touches to fit from), more/ (recorded touches of all objects, which adjust and calibrate) and test/
# (touches to test on; nothing is fitted or chosen on them). DIR is filled. Each of the objects LEFT-OUT is unknown to a model of
# the others. The program is $PALPATE, or target/release/palpate; $ONLY is a list of adjust, promise and strangers.
set -eu
meshes=$1
robot=$2
out=$3
shift 3
palpate=${PALPATE:-target/release/palpate}
only=${ONLY:-adjust promise strangers}

mkdir -p "$out/test"
quiet() { "$palpate" "$@" >/dev/null 2>>"$out/log"; }
# Only objects that have a mesh.
for mesh in "$meshes"/*.obj; do cp "$robot/test/$(basename "$mesh" .obj).txt" "$out/test/"; done
# lines FROM TO DIR: of each object's recording in more/.
lines() {
    rm -rf "$3"
    mkdir -p "$3"
    for file in "$robot"/more/*.txt; do sed -n "$1,$2p" "$file" >"$3/$(basename "$file")"; done
}
# Accuracy after 20 and 60 approaches, the share of wrong names among those given at a requested rate of 1 % or the model's own, of
# undecided sequences, and of known objects called unknown; with strangers, how many are unknown after 60 and 120 approaches.
tested() { # name, model, touches, more options of evaluate
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
line = f"| {sys.argv[1]} | {shares} | {percent(stopped['error'])} | {percent(stopped['undecided'])} | {percent(stopped['unknown'])} |"
if found.get("strangers"):
    line += " " + json.dumps(found["strangers"])
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
recorded=$(wc -l <"$(ls "$robot"/more/*.txt | head -n 1)")
echo "| $(basename "$robot") | correct after 20 / 60 | wrong | undecided | unknown |"
echo "|---|---|---|---|---|"
fitted unseen 9 4000 "$meshes"
tested "fitted, on simulated touches" "$out/fitted.json" "$out/unseen"
tested "fitted" "$out/fitted.json" "$out/test"

case " $only " in *" adjust "*)
    first=1
    while [ $((first + 299)) -le "$recorded" ]; do
        lines $first $((first + 299)) "$out/part"
        quiet train "$out/simulated" --extend "$out/fitted.json" --teach "$out/part" -o "$out/adjusted.json"
        tested "adjusted to approaches $first to $((first + 299))" "$out/adjusted.json" "$out/test"
        first=$((first + 300))
    done
esac

case " $only " in *" promise "*)
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
esac

# A model that tells strangers, calibrated on simulated touches alone and on recorded ones too.
wary() { # name, model, meshes, recorded, more options of evaluate
    title=$1 model=$2 touches=$3 own=$4 test=$5
    shift 5
    for how in certain likely; do
        quiet calibrate "$model" "$touches" --strangers $how -o "$out/wary.palpate"
        tested "$title: $how, simulated" "$out/wary.palpate" "$test" "$@"
        if "$palpate" calibrate "$model" "$touches" --strangers $how --recorded "$own" -o "$out/wary.palpate" \
            >"$out/calibrated.txt" 2>&1; then
            grep -E "rests on|warning: recorded" "$out/calibrated.txt"
            tested "$title: $how, recorded too" "$out/wary.palpate" "$test" "$@"
        else
            cat "$out/calibrated.txt"
        fi
    done
}
case " $only " in *" strangers "*)
    fitted fresh 3 100000 "$meshes"
    wary "strangers" "$out/fitted.palpate" "$out/fresh" "$robot/more" "$out/test"
    for object in "$@"; do
        for set in simulated fresh more test unknown; do
            rm -rf "$out/others/$set"
            mkdir -p "$out/others/$set"
        done
        others=""
        for mesh in "$meshes"/*.obj; do
            name=$(basename "$mesh" .obj)
            if [ "$name" = "$object" ]; then continue; fi
            others="$others $mesh"
            cp "$robot/more/$name.txt" "$out/others/more/"
            cp "$robot/test/$name.txt" "$out/others/test/"
        done
        cp "$robot/test/$object.txt" "$out/others/unknown/"
        # shellcheck disable=SC2086
        fitted others/simulated 1 21000 $others
        # shellcheck disable=SC2086
        fitted others/fresh 3 100000 $others
        train "$out/others/simulated" "$out/others.json"
        quiet export "$out/others.json" -o "$out/others.palpate"
        wary "without $object" "$out/others.palpate" "$out/others/fresh" "$out/others/more" "$out/others/test" \
            --unknown "$out/others/unknown"
    done
esac
