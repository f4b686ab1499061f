#!/usr/bin/env bash
# The tables and figures of the guides, made again: guides.sh [--check] PALPATE DIRECTORY [PART...]
#
# PALPATE is a built program, DIRECTORY is where to work. Each line is printed as it stands in its document, ready to paste,
# with the document's name and the seconds that the part took. --check also fails if a document has another line.
#
#   part       seconds of two cores, and documents
#   run        60, or 1 with the output of `palpate run` in $RUN: README.md, docs/measurements/accuracy.md, models/household.md
#   scenes     15: docs/guide/scenes.md
#   plan       60: docs/guide/plan.md, docs/guide/first-model.md
#   strangers  60: docs/guide/strangers.md
#
# Without a PART all of them. `.ci/run` checks run and scenes.
set -euo pipefail
check=0
[ "${1:-}" != --check ] || { check=1; shift; }
[ $# -ge 2 ] || { sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$0" >&2; exit 2; }
palpate=$(realpath "$1")
documents=$(realpath "$(dirname "$0")/../../..")
mkdir -p "$2"
[ -z "${RUN:-}" ] || RUN=$(realpath "$RUN")
cd "$2"
shift 2
failed=0

quiet() { "$palpate" "$@" >>log 2>&1; }
# stated DOCUMENT LINE: prints it; with --check it must be in the document, whose lines may be wrapped.
stated() {
    printf '%s: %s\n' "$1" "$2"
    [ $check = 0 ] && return
    tr '\n' ' ' <"$documents/$1" | tr -s ' ' | grep -qF -- "$2" || { echo "$1: does not say: $2" >&2; failed=1; }
}
# field FILE PATH...: a number of a JSON file.
field() {
    python3 -c 'import json, sys
value = json.load(open(sys.argv[1]))
for key in sys.argv[2:]:
    value = value[key]
print(value)' "$@"
}
size() { wc -c <"$1" | sed ':a; s/\([0-9]\)\([0-9]\{3\}\)\($\|,\)/\1,\2\3/; ta'; }

part_run() { # every line of the output that states no time
    local output=${RUN:-run.txt}
    [ -n "${RUN:-}" ] || "$palpate" run -o run >run.txt
    # Spaces of any kind are as good as each other.
    sed 's/\xc2\xa0/ /g' "$output" >plain.txt
    # Lines of figures between the fences of a document must be in the output.
    for document in README.md docs/measurements/accuracy.md; do
        sed 's/\xc2\xa0/ /g' "$documents/$document" |
            awk '/^```/ { inside = !inside; next } inside && /± [0-9.]+( %)?$| %$|, a fixed number|^model bytes|^trees|nats|verdicts that|recognized after/' |
            grep -v 'seconds\|per second\| s in all' >lines.txt
        while IFS= read -r line; do
            grep -qxF -- "$line" plain.txt || { echo "$document: the output has no line: $line" >&2; failed=1; }
        done <lines.txt
        echo "$document: $(wc -l <lines.txt) lines compared with the output"
    done
    local figures
    figures=$(python3 - "$output" <<'PYTHON'
import re, sys

rows = [re.split(r"\s{2,}", line.strip()) for line in open(sys.argv[1]) if re.search(r"\S\s{2,}\S", line)]


def row(name, occurrence=0):
    """The published method's and our figure, without spread and unit."""
    found = [row for row in rows if row[0] == name][occurrence]
    return [re.sub(r" ±.*|\s%", "", cell.replace("\u00a0", " ")) for cell in (found[1], found[3])]


(theirs, ours), (late, later) = row("approaches to a 1 % error rate, stopping when sure"), row("undecided when touches ran out")
print(f"| approaches to name one of ten objects, at most 1 % of names wrong | {ours} ({later} % undecided) | published method: {theirs} ({late} % undecided) |")
theirs, ours = row("accuracy after 20 approaches")
print(f"| correct after 20 approaches | {ours} % | published method: {theirs} % |")
theirs, ours = row("model bytes")
print(f"| bytes of that model | {ours} | published method: {theirs} |")
_, wrong = row("wrong verdicts")
print(f"With this threshold, {wrong} % of sequences end with a wrong name and {later} % stay undecided.")
PYTHON
)
    while IFS= read -r line; do
        case $line in
        "|"*) stated README.md "$line" ;;
        *) stated models/household.md "$line" ;;
        esac
    done <<<"$figures"
}

part_scenes() { # placements of the bowl; shares of approaches that touch, floating and on a table
    local placements
    placements=$("$palpate" capture bowl -o bowl --scene table --approaches 100 --force 2>>log |
        sed -n '/^bowl: [0-9]/ { s/; left out.*//; s/[.] The center.*//; p }')
    stated docs/guide/scenes.md "$placements"
    touching() { # of all, and of the flat ones: options of capture
        "$palpate" capture meshes -o touched --approaches 6000 --force "$@" 2>>log |
            awk '$1 == "all" { all = $4 } /^(fork|spoon|scissors|paperclip) / { flat += $4; count++ }
                END { printf "%.0f %.0f\n", all, flat / count }'
    }
    # Once, since that takes longer than to touch them.
    [ -e meshes/bowl.obj ] || quiet data objects -o meshes
    local floating table30 table60 table90
    floating=$(touching)
    table30=$(touching --scene table --cone 30)
    table60=$(touching --scene table --cone 60)
    table90=$(touching --scene table --cone 90)
    stated docs/guide/scenes.md "${floating% *} % of the approaches touch something if the objects float, and ${table30% *}, ${table60% *} and ${table90% *} % on a table"
    stated docs/guide/scenes.md "fall from ${floating#* } % to ${table30#* }, ${table60#* } and ${table90#* } %"
}

part_plan() { # approaches at random and planned
    local seed=0 data
    for data in train fresh unseen; do
        seed=$((seed + 1))
        [ -e "$data/dataset.json" ] || quiet capture builtin -o "$data" --approaches 60000 --pose --seed $seed
    done
    quiet train train -o oriented.json --descriptor oriented --evidence all --trees leaf_bits=8
    quiet export oriented.json -o oriented.palpate --leaf i8
    quiet plan oriented.palpate fresh -o direction.palpate --rolls 1
    quiet plan oriented.palpate fresh -o planned.palpate
    row() { # name, model, threshold, how to write the first number, the last command, options of evaluate
        local name=$1 model=$2 rate=$3 bold=$4 command=$5
        shift 5
        "$palpate" evaluate "$model" unseen --sequences 2000 --error-rate "$rate" --json "$@" >evaluated.json 2>>log
        stated docs/guide/plan.md "$(python3 - "$name" "$(size "$model")" "$bold" "$command" <<'PYTHON'
import json, sys

name, size, bold, command = sys.argv[1:]
found = json.load(open("evaluated.json"))["approaches"]["sequential"]
approaches = f"{found['mean_approaches']:.1f} ± {found['mean_approaches_standard_error']:.1f}"
failed = 100 * (found["error"] + found["undecided"])
print(f"| {name} | {bold}{approaches}{bold} | {failed:.1f} % | {size} | {command} |")
PYTHON
)"
    }
    row "at random" oriented.palpate 0.02 "" '`evaluate oriented.palpate unseen --sequences 2000 --error-rate 0.02`'
    random=$(field evaluated.json approaches sequential mean_approaches)
    row "planned, direction" direction.palpate 0.03 "" '`plan … --rolls 1`, then `… --active --error-rate 0.03`' --active
    row "planned, direction and roll" planned.palpate 0.03 '**' '`plan …`, then `… --active --error-rate 0.03`' --active
    planned=$(field evaluated.json approaches sequential mean_approaches)
    stated docs/guide/first-model.md "$(printf '%.1f approaches instead of %.1f' "$planned" "$random")"
}

part_strangers() { # bytes that a misfit test takes
    quiet capture builtin -o touches --approaches 20000 --force
    quiet train touches -o ensemble.json --real noise=0..5ms,timer=1ms
    quiet export ensemble.json -o model.palpate
    quiet capture builtin -o again --approaches 60000 --seed 3 --force
    quiet calibrate model.palpate again -o strict.palpate --detect-unknown --real noise=0..5ms,timer=1ms
    quiet calibrate model.palpate again -o sure.palpate --real noise=0..5ms,timer=1ms
    local bytes
    bytes=$((($(wc -c <strict.palpate) - $(wc -c <sure.palpate) + 5) / 10))
    stated docs/guide/strangers.md "$bytes bytes per object"
}

[ $# -gt 0 ] || set -- run scenes plan strangers
for part; do
    began=$SECONDS
    "part_$part"
    echo "--- $part took $((SECONDS - began)) s"
done
exit $failed
