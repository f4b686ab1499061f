"""Reads a UF2 file back and compares it with the bytes that were linked: uf2.py FILE.uf2 FILE.bin ADDRESS FAMILY"""

import struct
import sys
from pathlib import Path

uf2, linked = Path(sys.argv[1]).read_bytes(), Path(sys.argv[2]).read_bytes()
start, family = int(sys.argv[3], 0), int(sys.argv[4], 0)
if not uf2 or len(uf2) % 512:
    sys.exit(f"{sys.argv[1]}: {len(uf2)} bytes are no whole number of blocks of 512")
flash = {}
blocks = len(uf2) // 512
for number in range(blocks):
    block = uf2[512 * number : 512 * number + 512]
    first, second, flags, address, size, index, total, block_family = struct.unpack("<8I", block[:32])
    (last,) = struct.unpack("<I", block[508:])
    wanted = (0x0A324655, 0x9E5D5157, 0x0AB16F30, 0x2000, 256, number, blocks, family, 0)
    found = (first, second, last, flags, size, index, total, block_family, address % 256)
    if found != wanted:
        sys.exit(f"{sys.argv[1]}: block {number} is {found}, not {wanted}")
    if address in flash:
        sys.exit(f"{sys.argv[1]}: block {number} writes {address:#x} again")
    flash[address] = block[32 : 32 + size]
for address in range(start, start + len(linked), 256):
    part = linked[address - start : address - start + 256]
    # Flash that was erased and not written reads 0xff, and where nothing is linked objcopy fills in zeros.
    written = flash.pop(address, b"\0" * 256)
    if written[: len(part)] != part or any(written[len(part) :]):
        sys.exit(f"{sys.argv[1]}: the 256 bytes at {address:#x} are not what was linked")
if flash:
    sys.exit(f"{sys.argv[1]}: bytes at {min(flash):#x} are linked nowhere")
print(f"{sys.argv[1]}: {blocks} blocks, {len(linked)} bytes at {start:#x}, as linked")
