#!/bin/sh
# One object taught among nine simulated ones: how many of its groups of 60 approaches are recognized, and how many of the
# others'. The taught object is touched by the same simulated probe, with other seeds: what teaching alone costs.
#
#   docs/measurements/tables/teach.sh MESHES DIR [OBJECT...]
#
# MESHES is a directory with meshes, DIR is filled. The program is $PALPATE, or target/release/palpate; $APPROACHES are those
# of each simulated object (30000).
set -eu
meshes=$1
out=$2
shift 2
palpate=${PALPATE:-target/release/palpate}
approaches=${APPROACHES:-30000}
[ $# -gt 0 ] || set -- bowl fork hammer mouse spoon wristwatch

mkdir -p "$out"
quiet() { "$palpate" "$@" >/dev/null 2>>"$out/log"; }
# Of the table in approaches the percent after 60: of the taught object, and on average of the others.
recall() { # ensemble, taught object
    "$palpate" evaluate "$1" "$out/test" --at 60 2>>"$out/log" | awk -v taught="$2" '
        $1 == "approaches" { on = 1; next }
        on && $1 == "all" { printf " %.1f / %.1f |", own, sum / count; exit }
        on && $1 == taught { own = $2; next }
        on && NF > 3 { sum += $2; count++ }'
}

[ -e "$out/test/dataset.json" ] || quiet capture "$meshes" -o "$out/test" --approaches 6000 --pose --seed 9
echo "| taught | no pose: 300 approaches | 1,000 | all simulated | oriented: 300 | 1,000 | all simulated |"
echo "|---|---|---|---|---|---|---|"
quiet capture "$meshes" -o "$out/all" --approaches "$approaches" --pose --force
for object; do
    others=""
    for mesh in "$meshes"/*.obj; do [ "$(basename "$mesh" .obj)" = "$object" ] || others="$others $mesh"; done
    # shellcheck disable=SC2086
    quiet capture $others -o "$out/others" --approaches "$approaches" --pose --force
    quiet capture "$meshes/$object.obj" -o "$out/recorded" --approaches 1000 --pose --seed 77 --force
    printf '| %s |' "$object"
    for descriptor in contacts-curvature oriented; do
        for count in 300 1000; do
            head -n $count "$out/recorded/$object.txt" >"$out/$object.txt"
            quiet train "$out/others" -o "$out/taught.json" --descriptor $descriptor --teach "$out/$object.txt"
            recall "$out/taught.json" "$object"
        done
        [ -e "$out/all-$descriptor.json" ] || quiet train "$out/all" -o "$out/all-$descriptor.json" --descriptor $descriptor
        recall "$out/all-$descriptor.json" "$object"
    done
    echo
done
