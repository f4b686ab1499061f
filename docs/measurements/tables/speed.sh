#!/bin/sh
# Remakes the tables of docs/measurements/speed.md: speed against error, for each precision or approximation that can be chosen.
#
#   docs/measurements/tables/speed.sh DIR         about fifteen minutes; reports are left in DIR
#   docs/measurements/tables/speed.sh             without the reports: about two minutes
#
# The chip's exponentials need qemu-system-arm and the targets thumbv7em-none-eabihf and thumbv6m-none-eabi.
set -eu
cd "$(dirname "$0")/../../.."
cargo run --locked --release --quiet -p palpate-tests --bin speed

if command -v qemu-system-arm >/dev/null; then
    for target in thumbv7em-none-eabihf thumbv6m-none-eabi; do
        printf '\nOn an emulated chip, %s:\n\n' "$target"
        (cd onboard/firmware && cargo run --locked --release --quiet --target "$target" --bin exponential)
    done
else
    echo "SKIPPED: no qemu-system-arm here; on Debian: apt-get install qemu-system-arm"
fi

[ $# -gt 0 ] || exit 0
mkdir -p "$1"
cargo build --locked --release --quiet
printf '\n| report | minutes | what it says |\n|---|---|---|\n'
for kind in quick full; do
    option=--quick
    [ "$kind" = quick ] || option=
    start=$(date +%s)
    # shellcheck disable=SC2086
    said=$(target/release/palpate report $option -o "$1/$kind" --force 2>"$1/$kind.log" | head -1)
    awk -v kind="$kind" -v seconds="$(($(date +%s) - start))" -v said="$said" \
        'BEGIN { printf "| %s | %.1f | %s |\n", kind, seconds / 60, said }'
done
