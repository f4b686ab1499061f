#!/bin/sh
# Accuracy on touches of real robots (or such as stand for them), for models trained clean, on a mixture, and for fitted
# probes.
#
#   docs/measurements/tables/robots.sh MESHES ROBOT DIR
#
# ROBOT has known/ (recorded touches to fit from), plate.txt and test/ (touches to test on), DIR is filled. The program is
# $PALPATE, or target/release/palpate; $TOUCHES and $APPROACHES are those of each object to train on.
set -eu
meshes=$1
robot=$2
out=$3
palpate=${PALPATE:-target/release/palpate}
touches=${TOUCHES:-21000}
approaches=${APPROACHES:-60000}

mkdir -p "$out/test"
quiet() { "$palpate" "$@" >/dev/null 2>>"$out/log"; }
known=""
for file in "$robot"/known/*.txt; do known="$known $meshes/$(basename "$file" .txt).obj"; done
# Only objects that have a mesh.
for mesh in "$meshes"/*.obj; do cp "$robot/test/$(basename "$mesh" .obj).txt" "$out/test/"; done

row() { # name, full touches, approaches, more options of train
    name=$1 full=$2 all=$3
    shift 3
    quiet train "$full" -o "$out/full.json" "$@"
    quiet train "$all" -o "$out/contacts.json" "$@"
    printf '| %s' "$name"
    for model in full contacts; do
        # Of one table (touches, or approaches) the row of all objects. Thin objects have few full touches.
        if [ $model = full ]; then at=10,30 want=touches; else at=10,30,60 want=approaches; fi
        "$palpate" evaluate "$out/$model.json" "$out/test" --at $at 2>>"$out/log" |
            awk -v want=$want '
                $1 == want { on = 1; for (i = 1; i <= NF; i++) if ($i == "to") stop = i }
                on && $1 == "all" {
                    printf " |"
                    for (i = 2; i < 2 * stop - 2; i += 2) printf "%s %s", (i > 2 ? " /" : ""), $i
                    printf " | %s", $(2 * stop - 1)
                    exit
                }'
    done
    echo " |"
}

if [ ! -e "$out/../clean-all/dataset.json" ]; then
    quiet capture "$meshes" -o "$out/../clean" --touches "$touches" --force
    quiet capture "$meshes" -o "$out/../clean-all" --approaches "$approaches" --force
fi
echo "| $(basename "$robot") | full touches: correct after 10 / 30 | wrong | every contact: after 10 / 30 / 60 approaches | wrong |"
echo "|---|---|---|---|---|"
row "trained clean" "$out/../clean" "$out/../clean-all"
row "mixture" "$out/../clean" "$out/../clean-all" --real noise=0..6ms,timer=1ms,speed_error=15%,missed=2%

fitted() { # name, recorded touches, more options of fit
    name=$1 recorded=$2
    shift 2
    # shellcheck disable=SC2086
    "$palpate" probe fit "$recorded" $known -o "$out/probe.toml" "$@" >"$out/fit.txt"
    quiet capture "$meshes" -o "$out/fitted" --touches "$touches" --probe "$out/probe.toml" --force
    quiet capture "$meshes" -o "$out/fitted-all" --approaches "$approaches" --probe "$out/probe.toml" --force
    row "$name" "$out/fitted" "$out/fitted-all"
    sed -n '/interval/,/^timer/p' "$out/fit.txt" >"$out/$name.txt"
}

mkdir -p "$out/part"
for file in "$robot"/known/*.txt; do head -n 75 "$file" >"$out/part/$(basename "$file")"; done
fitted "fitted from 300 approaches" "$out/part"
fitted "fitted from all approaches" "$robot/known"
fitted "fitted from all approaches and the plate" "$robot/known" --plate "$robot/plate.txt"
echo
for name in "$out"/fitted*.txt; do
    basename "$name" .txt
    cat "$name"
done
