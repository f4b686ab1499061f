#!/bin/sh
# Accuracy on touches of a robot whose hand stops soon after the first contact, for models of fitted probes.
#
#   docs/measurements/tables/stroke.sh MESHES ROBOT DIR [SECONDS]
#
# ROBOT has known/ (recorded touches to fit from) and test/ (touches to test on), of a hand that goes on past the object: contacts
# later than SECONDS (0.3) are made missing. DIR is filled. The program is $PALPATE, or target/release/palpate.
set -eu
meshes=$1
robot=$2
out=$3
seconds=${4:-0.3}
palpate=${PALPATE:-target/release/palpate}

# cut FILE: its contact times, without those that are too late.
cut() {
    awk -v end="$seconds" '{ for (i = 1; i <= 3; i++) if ($i != "-" && $i > end + 1e-9) $i = "-"; print $1, $2, $3 }' "$1"
}
mkdir -p "$out/known" "$out/test"
for file in "$robot"/known/*.txt; do cut "$file" >"$out/known/$(basename "$file")"; done
# Only objects that have a mesh.
for mesh in "$meshes"/*.obj; do
    name=$(basename "$mesh" .obj)
    cut "$robot/test/$name.txt" >"$out/test/$name.txt"
done
printf 'radius = 0.15\nspacing = 1.5\nspeed = 10\n' >"$out/estimated.toml"
{ cat "$out/estimated.toml"; awk -v s="$seconds" 'BEGIN { print "stroke = " 10 * s }'; } >"$out/stated.toml"

for stroke in stated estimated; do
    echo "--- the stroke is $stroke"
    "$palpate" probe fit "$out/known" "$meshes" -o "$out/$stroke.fit.toml" --probe "$out/$stroke.toml" --quiet
    "$palpate" capture "$meshes" -o "$out/$stroke" --probe "$out/$stroke.fit.toml" --approaches 21000 --force --quiet
    "$palpate" train "$out/$stroke" -o "$out/$stroke.json" --trees rounds=40,depth=5 --quiet
    "$palpate" evaluate "$out/$stroke.json" "$out/test" --at 20,60 --quiet
done
