#!/bin/sh
# Maps of objects that nobody has a mesh of, measured beside other interpolations of the same samples: shape.sh [PYTHON [FIGURE]]
#
# PYTHON has numpy and scipy. FIGURE is where the figure of the guide goes, an SVG file. The objects are in $PALPATE_SHARED/objects; $SEEDS (1) runs of each. Some minutes of two cores.
set -eu
cd "$(dirname "$0")/../../.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
if [ -z "${SHAPE:-}" ]; then
    cargo build --locked --quiet --release -p palpate-tests --bin shape
    SHAPE=target/release/shape
fi
"$SHAPE" seeds="${SEEDS:-1}" write="$work" >"$work/ours"
cat "$work/ours"
"${1:-python3}" docs/measurements/tables/shape.py "$work" ${2:+"$2"}
