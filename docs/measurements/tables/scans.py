"""Prints what surfaces of scans are worth: their distance from the true meshes, and recognition by models trained on them.

    python3.11 docs/measurements/tables/scans.py target/release/palpate OBJECTS DIRECTORY

OBJECTS is a directory of meshes; scans, touches and models are written to DIRECTORY. Each object is scaled to 100 mm and seen
by eight cameras, at the corners of a cube, that each measure 2,500 points; the points get 1 mm of Gaussian noise along each
axis (NOISE), or along the ray alone (ALONG=ray). Seeds are fixed (SEED, of scans). Some three minutes on two cores.
"""

import json
import math
import os
import random
import re
import subprocess
import sys
import time
from pathlib import Path

PALPATE, OBJECTS, PLACE = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
NOISE, ALONG, SEED = float(os.environ.get("NOISE", 1)), os.environ.get("ALONG", "axes"), os.environ.get("SEED", "1")
REAL = "noise=0..5ms,timer=1ms"
SIZE, FAR, RADIUS = 100, 500, 0.001


def palpate(*arguments):
    done = subprocess.run([PALPATE, *map(str, arguments)], capture_output=True, text=True)
    if done.returncode:
        sys.exit(done.stderr)
    return done


def unit(vector):
    length = math.hypot(*vector)
    return [x / length for x in vector]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def seen(mesh, views, wanted, generator, name):
    """What cameras at these sides see of a mesh: points, each with the camera's place and the direction to it."""
    found = []
    for number, side in enumerate(views):
        eye = [FAR * x for x in unit(side)]
        right = unit(cross(side, [0.3, 0.5, 0.8]))
        up = unit(cross(right, side))
        own = []
        while len(own) < wanted:
            casts = []
            for _ in range(20_000):
                a, b = generator.uniform(-90, 90), generator.uniform(-90, 90)
                casts.append((eye, unit([a * r + b * u - e for r, u, e in zip(right, up, eye)])))
            path = PLACE / f"{name}.csv"
            lines = (f"{number}," + ",".join(f"{x:.9g}" for x in [*origin, *direction]) for origin, direction in casts)
            path.write_text("\n".join(lines) + "\n")
            answers = palpate("data", "cast", mesh, path, "--length", SIZE, "--radius", RADIUS).stdout.splitlines()
            for answer, (origin, direction) in zip(answers, casts):
                time_of = answer.rsplit(",", 1)[1]
                if time_of != "miss":
                    own.append(([o + float(time_of) * d for o, d in zip(origin, direction)], eye, direction))
        found += own[:wanted]
    return found


CUBE = [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
names = sorted(path.stem for path in OBJECTS.glob("*.obj"))
(PLACE / "scans").mkdir(parents=True, exist_ok=True)
for name in names:
    path = PLACE / "scans" / f"{name}.ply"
    generator = random.Random(f"{SEED} {name}")
    rows = []
    for place, eye, ray in seen(OBJECTS / f"{name}.obj", CUBE, 2_500, generator, name):
        along = generator.gauss(0, NOISE)
        moved = [p + (along * r if ALONG == "ray" else generator.gauss(0, NOISE)) for p, r in zip(place, ray)]
        rows.append(" ".join(f"{x:.4f}" for x in [*moved, *eye]))
    properties = "".join(f"property float {axis}\n" for axis in ["x", "y", "z", "vp_x", "vp_y", "vp_z"])
    path.write_text(f"ply\nformat ascii 1.0\nelement vertex {len(rows)}\n{properties}end_header\n" + "\n".join(rows) + "\n")

palpate("capture", OBJECTS, "-o", PLACE / "tested", "--approaches", 20_000, "--seed", 3, "--force")
right = {}
for kind, source in [("meshes", OBJECTS), ("scans", PLACE / "scans")]:
    start = time.time()
    palpate("capture", source, "-o", PLACE / kind, "--approaches", 30_000, "--seed", 1, "--force")
    print(f"{kind}: captured in {time.time() - start:.0f} s", file=sys.stderr)
    model = PLACE / f"{kind}.json"
    palpate("train", PLACE / kind, "-o", model, "--evidence", "contacts", "--real", REAL)
    answer = json.loads(palpate(
        "evaluate", model, PLACE / "tested", "--at", 60, "--sequences", 2_000, "--real", REAL, "--json").stdout)["approaches"]
    right[kind] = {name: answer["per_object"][name]["60"] for name in names} | {"mean": answer["accuracy"]["60"]}

print("| object | noise found | triangles | largest closed hole | trained on the mesh | trained on the scan | points |")
print("|---|---|---|---|---|---|---|")
for name in names + ["mean"]:
    said = palpate("view", PLACE / "scans" / f"{name}.ply", "-o", PLACE / "page.html").stderr if name != "mean" else ""
    found = [re.search(pattern, said) for pattern in [r"noise of ([\d.]+)", r"surface of (\d+) triangles", r"area of .*?, ([\d.]+ %)"]]
    noise, triangles, hole = (match[1] if match else "–" for match in found)
    mesh, scan = 100 * right["meshes"][name], 100 * right["scans"][name]
    print(f"| {name} | {noise} | {triangles} | {hole} | {mesh:.1f} % | {scan:.1f} % | {scan - mesh:+.1f} |")
