#!/bin/sh
# The table of docs/measurements/small.md: models of 5.7 KB and 3 KB, trained and chosen on some touches, tested on others.
#
#   docs/measurements/tables/small.sh DIR
#
# The meshes are those of $PALPATE_SHARED/objects (../shared/objects), DIR is filled. The program is $PALPATE, or
# target/release/palpate. Training has 210,000 touches of each object ($TOUCHES) with seed 1; tuning the first 21,000 of them
# ($TUNE), of which it holds some out; the test has 21,000 with seed 3. The two trainings' settings were chosen on seed 2.
set -eu
[ $# -eq 1 ] || { sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$0" >&2; exit 2; }
out=$1
meshes=${PALPATE_SHARED:-../shared}/objects
palpate=${PALPATE:-target/release/palpate}

mkdir -p "$out"
quiet() { "$palpate" "$@" >/dev/null 2>>"$out/log"; }
row() { # how, touches, model
    bytes=$(wc -c <"$3")
    instructions=$("$palpate" inspect "$3" | awk '$1 == "instructions" { print $2 }')
    "$palpate" evaluate "$3" "$out/test" --at 10 --sequences 10000 2>>"$out/log" |
        awk -v how="$1" -v touches="$2" -v bytes="$bytes" -v instructions="$instructions" '
            $1 == "all" { right = $2; stops = $4; wrong = $5 }
            $1 == "±" {
                printf "| %s | %d | %d | %d | %s ± %s %% | %s | %s %% |\n", how, touches, bytes, instructions, right, $2, stops, wrong
                exit
            }'
}
small() { # bytes allowed, how trees are grown
    limit=$1
    shift
    quiet train "$out/train" -o "$out/$limit.json" --trees "leaf_bits=8,bins=512,eta=0.3,$1"
    quiet export "$out/$limit.json" -o "$out/$limit.palpate" --leaf i8 --layout size
    row "train --trees $1" "${TOUCHES:-210000}" "$out/$limit.palpate"
}

quiet capture "$meshes" -o "$out/train" --touches "${TOUCHES:-210000}" --seed 1 --format parquet
quiet capture "$meshes" -o "$out/tune" --touches "${TUNE:-21000}" --seed 1
quiet capture "$meshes" -o "$out/test" --seed 3
echo "| how | touches of an object | bytes | instructions, M4F | right after 10 touches | touches to stop | wrong |"
echo "|---|---|---|---|---|---|---|"
small 5700 rounds=15,depth=6,different_leaves=160,threshold_cost=2.4e-5
small 3072 rounds=16,depth=5,different_leaves=56,threshold_cost=3.6e-5
for limit in 5700 3072; do
    quiet tune "$out/tune" --seed 2 --max-bytes $limit -o "$out/tuned-$limit.palpate"
    row "tune --max-bytes $limit" "${TUNE:-21000}" "$out/tuned-$limit.palpate"
done
