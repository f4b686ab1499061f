#!/bin/sh
# Intervals of `palpate probe fit` that hold the truth: fits to simulated recordings of a probe that is known.
#
#   docs/measurements/tables/coverage.sh MESHES PROBE FITS DIR
#
# PROBE is a probe file with what the probe adds under [real], such as one that was fitted to a robot; it makes 75 approaches
# to each of four objects, FITS times, with the seeds from 1001 ($SEED + 1) on. DIR is filled. The program is $PALPATE, or
# target/release/palpate.
# docs/reference/fit.md has the output of 30 fits with SEED=3000, FIT='--approaches 50000', and this under [real]:
#   speed_factor = 0.9723, offsets = [0, -0.04, 0.01], noise = "1.5ms", missed = ["0.5%", "1%", "1%"],
#   grazing = { angle = "15deg", bend = 0.08 }; and timer = "1ms"
set -eu
meshes=$1
probe=$2
fits=$3
out=$4
palpate=${PALPATE:-target/release/palpate}

mkdir -p "$out"
known=""
for name in bowl camera mouse winebottle; do known="$known $meshes/$name.obj"; done
number() { sed -n "s/^$1 = \[*\([0-9., -]*\).*/\1/p" "$probe" | tail -n 1; }
speed=$(number speed)
factor=$(number speed_factor)
offsets=$(number offsets)
: >"$out/fits"
run=1
while [ "$run" -le "$fits" ]; do
    # shellcheck disable=SC2086
    "$palpate" capture $known -o "$out/recorded" --approaches 75 --seed $((${SEED:-1000} + run)) --probe "$probe" --force \
        >/dev/null 2>>"$out/log"
    # What a recording does not state.
    rm "$out/recorded/dataset.json"
    # shellcheck disable=SC2086
    "$palpate" probe fit "$out/recorded" $known -o "$out/fitted.toml" --json ${FIT:-} 2>>"$out/log" | tr -d ' \n' |
        sed 's/.*"speed_factor":{\([^}]*\)}.*"late":\[{\([^}]*\)},{\([^}]*\)}.*/\1;\2;\3\n/' >>"$out/fits"
    run=$((run + 1))
done
awk -F '[;,:]' -v speed="$speed" -v factor="$factor" -v offsets="$offsets" '
    function holds(low, high, truth) { return (low == "null" || low <= truth) && (high == "null" || truth <= high) }
    BEGIN { split(offsets, offset, ",") }
    {
        held[1] += holds($4 == "null" ? $4 : $4 + 0, $6 == "null" ? $6 : $6 + 0, factor)
        held[2] += holds($10 == "null" ? $10 : $10 + 0, $12 == "null" ? $12 : $12 + 0, -1e3 * (offset[2] - offset[1]) / speed)
        held[3] += holds($16 == "null" ? $16 : $16 + 0, $18 == "null" ? $18 : $18 + 0, -1e3 * (offset[3] - offset[1]) / speed)
    }
    END { printf "of %d fits hold the truth: speed %d, second finger %d, third finger %d\n", NR, held[1], held[2], held[3] }
' "$out/fits"
