#!/bin/sh
# Maps of objects that nobody has a mesh of, measured beside other interpolations of the same samples: shape.sh [PYTHON]
#
# PYTHON has numpy and scipy. The objects are in $PALPATE_SHARED/objects; $SEEDS (1) runs of each. Some minutes of two cores.
set -eu
cd "$(dirname "$0")/../../.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
if [ -n "${SHAPE:-}" ]; then
    "$SHAPE" seeds="${SEEDS:-1}" write="$work"
else
    cargo run --locked --quiet --release -p palpate-tests --bin shape -- seeds="${SEEDS:-1}" write="$work"
fi
"${1:-python3}" docs/measurements/tables/shape.py "$work"
