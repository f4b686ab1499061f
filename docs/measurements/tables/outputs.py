"""Instructions of outputs that belong together, on emulated chips: outputs.py MODEL TOUCHES

MODEL has an output for each placement, TOUCHES is a directory of captured text files (`gravity-placements.kept` and
`tested` of table.sh). Needs qemu-system-arm and the firmware's image `cost`, built with and without the feature:

    cd onboard/firmware
    for features in strangers,outputs strangers; do
        for target in thumbv7em-none-eabihf thumbv6m-none-eabi; do
            cargo build --release --bin cost --no-default-features --target $target \
                --features compact,wide,i8-leaves,i16-leaves,f32-leaves,shared-leaves,$features
            cp target/$target/release/cost cost-$features-$target
        done
    done
"""

import struct
import subprocess
import sys
import tempfile
import zlib
from pathlib import Path

FIRMWARE = Path(__file__).resolve().parents[3] / "onboard/firmware"
MACHINES = {"thumbv7em-none-eabihf": "mps2-an386", "thumbv6m-none-eabi": "mps2-an385"}
OUTPUTS = 18
HEADER = 96
TOUCHES = 64


def without_outputs(model: bytes) -> bytes:
    """The same model without the section, as shared/FORMAT.md says."""
    text, length = (struct.unpack_from("<I", model, at)[0] for at in (68, 92))
    start = HEADER + text
    kept, at = b"", start
    while at < start + length:
        tag, content = struct.unpack_from("<H", model, at)[0] & 0x7FFF, struct.unpack_from("<I", model, at + 4)[0]
        end = at + 8 + (content + 3) // 4 * 4
        kept += b"" if tag == OUTPUTS else model[at:end]
        at = end
    assert len(kept) < length, "the model has no outputs that belong together"
    rest = bytearray(model[:start] + kept + model[start + length : -4])
    struct.pack_into("<I", rest, 8, len(rest) + 4)
    struct.pack_into("<I", rest, 92, len(kept))
    return bytes(rest) + struct.pack("<I", zlib.crc32(rest))


def frame(line: str) -> bytes:
    """A touch as the image reads it."""
    numbers = [None if word == "-" else float(word) for word in line.split()]
    times = b"".join(struct.pack("<I", 0xFFFFFFFF if time is None else round(time * 1e6)) for time in numbers[:3])
    return times + b"".join(struct.pack("<h", round(cosine * 32767)) for cosine in numbers[3:9])


def measured(image: Path, machine: str, model: bytes, touches: list[bytes]) -> str:
    with tempfile.NamedTemporaryFile() as loaded:
        loaded.write(struct.pack("<II", len(model), len(touches)) + model + b"".join(touches))
        loaded.flush()
        command = ["qemu-system-arm", "-machine", machine, "-display", "none", "-serial", "none", "-monitor", "none"]
        command += ["-icount", "shift=0", "-semihosting-config", "enable=on,target=native", "-kernel", str(image)]
        command += ["-device", f"loader,file={loaded.name},addr=0x21000000,force-raw=on"]
        return subprocess.run(command, capture_output=True, text=True, timeout=100).stdout.strip()


def main() -> None:
    model, directory = Path(sys.argv[1]).read_bytes(), Path(sys.argv[2])
    files = [path.read_text().splitlines() for path in sorted(directory.glob("*.txt"))]
    # Several objects stay likely where touches are of all objects in turn; one is soon far ahead where all are of it.
    mixed = [frame(lines[2 * turn]) for turn in range(TOUCHES) for lines in files][:TOUCHES]
    one = [frame(line) for line in files[0][: 2 * TOUCHES : 2]]
    for name, touches in (("contested", mixed), ("clear", one)):
        for target, machine in MACHINES.items():
            for features, own in (
                ("strangers,outputs", model),
                ("strangers,outputs", without_outputs(model)),
                ("strangers", without_outputs(model)),
            ):
                found = measured(FIRMWARE / f"cost-{features}-{target}", machine, own, touches)
                print(f"{name}, {target}, {features}, {len(own)} bytes: {found}")


main()
