#!/bin/sh
# Recognition of objects on a table with their place, measured: located.sh [PART...]
#
#   aims      the aims: approaches, wrong names, places, cells of 1 mm and 2 mm, noise of several kinds, aims at random
#   parts     what each part of the likelihood brings: it is left out
#   robot     what a robot may have measured wrong
#
# The objects are in $PALPATE_SHARED/objects. $SEQUENCES (300) sequences in each row, $CALIBRATE (1000) to find its threshold. Some
# minutes of two cores for each part.
set -eu
cd "$(dirname "$0")/../../.."
n=${SEQUENCES:-300}
c=${CALIBRATE:-1000}
located() {
    if [ -n "${LOCATED:-}" ]; then "$LOCATED" "$@"; else cargo run --locked --quiet --release -p palpate-tests --bin located -- "$@"; fi
}

aims() {
    located sequences="$n" calibrate="$c" \
        + row="chosen, 1 mm" v=1 + row="chosen, 2 mm" cell=2 + row="at random, 1 mm" random=1 \
        + row="until the place is sure to 3 mm and 5°" until=3 degrees=5 \
        + row="position noise 1 mm, stated" position=1 + row="drift 1 mm and 1°, stated" drift=1 \
        + row="meshes 3 % larger" size=1.03 \
        + row="fingers bent by 1 mm, 5 % lost, stated as position noise" bent=1 lost=0.05 stated_lost=0.05 stated_position=1
}

parts() {
    located sequences="$n" lost=0.05 stated_lost=0.05 random=1 threshold=0.99 \
        + row="all" + row="no share for lost contacts" stated_lost=0.0001 + row="no outliers" outliers=0.000001 \
        + row="contacts with the table never lost" table_missed=0.0001 + row="noise of .1 mm instead of .5 mm" stated=0.1 \
        + row="all, chosen" random=0 + row="no share for lost contacts, chosen" random=0 stated_lost=0.0001
}

robot() {
    located sequences="$n" calibrate="$c" \
        + row="nothing wrong" \
        + keep=1 row="table .5 mm too high" table=0.5 + keep=1 row="table 1 mm too high" table=1 \
        + keep=1 row="table 2 mm too high" table=2 + keep=1 row="table 1 mm too low" table=-1 \
        + keep=1 row="heights of the tips off by .5 mm" tips=0.5 + keep=1 row="heights of the tips off by 1 mm" tips=1 \
        + keep=1 row="tips aside by .5 mm" bent=0.5 + keep=1 row="tips aside by 1 mm" bent=1 + keep=1 row="tips aside by 2 mm" bent=2 \
        + keep=1 row="hand off by .5 mm in each approach" position=0.5 + keep=1 row="hand off by 1 mm in each approach" position=1 \
        + keep=1 row="row turned by 2°" turned=2 + keep=1 row="row turned by 5°" turned=5 \
        + keep=1 row="5 % of contacts lost" lost=0.05 + keep=1 row="10 % of contacts lost" lost=0.1 \
        + keep=1 row="meshes 3 % too large" size=0.97
}

for part in "${@:-aims}"; do "$part"; done
