#!/bin/sh
# Remakes the table of docs/measurements/fit.md: models for probes with deviations, trained clean, for noise, on a mixture, for a fitted probe,
# and for the true one. Accuracy after 10 / 30 full touches.
#
#   docs/measurements/tables/fit.sh MESHES DIR [TOUCHES]
#
# MESHES is a directory with the ten meshes, DIR is filled. TOUCHES of each object to train on (21000). The program is
# $PALPATE, or target/release/palpate.
set -eu
meshes=$1
out=$2
touches=${3:-21000}
palpate=${PALPATE:-target/release/palpate}
trees="--trees rounds=40,depth=5 --descriptor curvature"

mkdir -p "$out"
rm -rf "$out"/*
quiet() { "$palpate" "$@" >/dev/null 2>>"$out/log"; }
accuracy() { # ensemble, test touches
    "$palpate" evaluate "$1" "$2" --at 10,30 --json 2>>"$out/log" | tr -d ' \n' |
        sed 's/.*"accuracy":{"10":\([0-9.]*\),"30":\([0-9.]*\)}.*/\1 \2/' | awk '{printf "%.2f / %.2f", $1, $2}'
}
trained() { # touches, test touches, more options
    data=$1 test=$2
    shift 2
    # shellcheck disable=SC2086
    quiet train "$data" -o "$out/model.json" $trees "$@"
    accuracy "$out/model.json" "$test"
}

quiet capture "$meshes" -o "$out/clean" --touches "$touches"
known=""
for name in bowl camera mouse winebottle; do known="$known $meshes/$name.obj"; done

echo "| probe: factor, middle, outer, noise | trained clean | for the noise only | mixture | fitted from 300 touches | from 1,000 | the true probe |"
echo "|---|---|---|---|---|---|---|"
while read -r factor middle outer noise; do
    # Late fingers stand back: 10 units per second.
    awk -v f="$factor" -v m="$middle" -v o="$outer" -v n="$noise" 'BEGIN {
        print "radius = 0.15\nspacing = 1.5\nspeed = 10.0\n[real]"
        printf "speed_factor = %.6f\noffsets = [0.0, %.4f, %.4f]\nnoise = \"%sms\"\ntimer = \"1ms\"\n", 1 / f, -m / 100, -o / 100, n
    }' >"$out/true.toml"
    quiet capture "$meshes" -o "$out/test" --touches 5000 --seed 99 --probe "$out/true.toml" --force
    printf '| %s, %s, %s, %s ms ' "$factor" "$middle" "$outer" "$noise"
    printf '| %s ' "$(trained "$out/clean" "$out/test")"
    printf '| %s ' "$(trained "$out/clean" "$out/test" --real noise="${noise}ms",timer=1ms)"
    printf '| %s ' "$(trained "$out/clean" "$out/test" --real noise=0..6ms,timer=1ms,speed_error=15%)"
    for count in 75 250; do
        # shellcheck disable=SC2086
        quiet capture $known -o "$out/recorded" --touches "$count" --seed 7 --probe "$out/true.toml" --force
        # What a recording does not state.
        rm "$out/recorded/dataset.json"
        # shellcheck disable=SC2086
        quiet probe fit "$out/recorded" $known -o "$out/fitted-$factor-$count.toml"
        quiet capture "$meshes" -o "$out/fitted" --touches "$touches" --probe "$out/fitted-$factor-$count.toml" --force
        printf '| %s ' "$(trained "$out/fitted" "$out/test")"
    done
    quiet capture "$meshes" -o "$out/fitted" --touches "$touches" --probe "$out/true.toml" --force
    printf '| %s |\n' "$(trained "$out/fitted" "$out/test")"
done <<'PROBES'
1.00 0 0 3
0.90 5 0 3
1.10 -5 3 2
0.92 3 -4 5
PROBES
