"""A robot in MuJoCo learns the shape of an object that it has no mesh of.

The hand of robot_in_mujoco.py comes straight down on an object that stands still on the table of locate_in_mujoco.py, held there by
putty, each time where `palpate.Shape` proposes. After 50, 100, 200 and 300 approaches a line says how far off the heights are.

    python -m venv env
    env/bin/pip install mujoco==4.0.0 trimesh==5.2.0 ./host/python
    python shape_in_mujoco.py meshes/mouse.obj -o mouse.txt

writes the touches as `palpate maps view`, `palpate data objects` and `palpate train --teach` read them. Options of robot_in_mujoco.py for
the hand, its fingers and switches are taken, too.
"""

import argparse
import math
from pathlib import Path

import locate_in_mujoco as locate
import numpy as np
import palpate
import robot_in_mujoco as robot
import trimesh
from locate_in_mujoco import MM
from robot_in_mujoco import RADIUS, SPACING, SPEED

PUTTY = 1e4  # damping of the object, in each direction: N s/m
POINTS = 4_000_000  # of the mesh, for the heights that are true
BESIDE = 5  # around the object, in which the middle finger goes: mm
REPORTED = (50, 100, 200, 300)


def true_heights(corners, triangles, half):
    """The heights that a fingertip meets, on a grid of 1 mm (mm)."""
    surface = trimesh.Trimesh(corners * MM, triangles, process=False)
    x, y, z = trimesh.sample.sample_surface(surface, POINTS, seed=1)[0].T
    heights = np.zeros((2 * half + 1, 2 * half + 1))
    for by_x, by_y in np.ndindex(5, 5):
        column, row = np.rint(x).astype(int) + by_x - 2, np.rint(y).astype(int) + by_y - 2
        reach = (RADIUS * MM) ** 2 - (x - column) ** 2 - (y - row) ** 2
        met = (reach > 0) & (abs(column) <= half) & (abs(row) <= half)
        top = z[met] + np.sqrt(reach[met]) - RADIUS * MM
        np.maximum.at(heights, (row[met] + half, column[met] + half), top)
    return heights


def line(times, x, y, z, roll):
    """A touch as the program reads it."""
    seconds = " ".join("-" if math.isnan(time) else f"{time:.6f}" for time in times)
    across, along = math.cos(math.radians(roll)), math.sin(math.radians(roll))
    return f"{seconds} 0 0 -1 {across:.6f} {along:.6f} 0 {x:.3f} {y:.3f} {z:.3f}\n"


def main():
    """Explores one object."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("mesh", type=Path, help="file of a mesh, which is scaled to a longest side of 100 mm")
    add("-o", "--output", type=Path, required=True, metavar="FILE", help="file of touches")
    add("--touches", type=robot.count, default=300, metavar="N", help="approaches [300]")
    add("--table-friction", type=robot.amount, default=0.5, metavar="MU", help="of the object on the table [0.5]")
    own, rest = parser.parse_known_args()
    options = robot.arguments().parse_args([str(own.mesh), "-o", ".", "--stroke", "2", *rest])
    options.table_friction = own.table_friction
    table = locate.Table(options, locate.Thing(own.mesh))
    table.drop(np.random.default_rng(options.seed))
    lies = locate.Pose(table.thing, table.state)
    # Its box is about the origin, along x and y.
    back = math.radians(-lies.yaw) / 2
    turned = np.zeros(4)
    locate.mujoco.mju_mulQuat(turned, np.array([math.cos(back), 0, 0, math.sin(back)]), table.state[3:7].copy())
    table.state[:2], table.state[3:7] = 0, turned
    lies = locate.Pose(table.thing, table.state)
    table.state[:2] = -lies.x, -lies.y
    table.model.dof_damping[:6] = PUTTY
    stands, tare = table.state.copy(), locate.tared(table)
    corners = locate.robot_frame(stands, table.thing.corners)
    workspace = float(abs(corners[:, :2]).max() * MM + BESIDE)
    probe = palpate.Probe(radius=RADIUS * MM, spacing=SPACING * MM, speed=SPEED * MM, tilt=0, stroke=options.stroke * 10)
    shape = palpate.Shape(probe, workspace=workspace)
    true, lines = true_heights(corners, table.thing.triangles, math.ceil(workspace) + 2), []
    print(f"{own.mesh.stem}, {lies.placement}, explored within {workspace:.0f} mm of its middle in x and y")
    while shape.touches < own.touches:
        x, y, roll = shape.next()
        table.state = stands.copy()
        heights, lowest = table.press(x / MM, y / MM, roll)
        heights = (heights - tare) * MM
        first = np.nanmax(heights)
        times = (first - heights) / (SPEED * MM)
        lines.append(line(times, x, y, first, roll))
        shape.push([None if math.isnan(time) else time for time in times], (x, y, first), roll)
        if shape.touches in REPORTED:
            guess, half = shape.heights, (len(true) - 1) // 2
            rows, columns = [(count - 1) // 2 for count in guess.shape]
            cut = true[half - rows : half + rows + 1, half - columns : half + columns + 1]
            low, high = shape.bounds
            met, footprint = cut > 0.5, [guess > 1, cut > 1]
            print(
                f"{shape.touches} approaches: {abs(guess - cut)[met].mean():.2f} mm off, footprint's IoU"
                f" {(footprint[0] & footprint[1]).sum() / (footprint[0] | footprint[1]).sum():.2f}, the truth in"
                f" {100 * ((low <= cut) & (cut <= high))[met].mean():.0f} % of the intervals, moved"
                f" {MM * np.linalg.norm(table.state[:3] - stands[:3]):.2f} mm by the last",
                flush=True,
            )
    own.output.write_text("".join(lines))


if __name__ == "__main__":
    main()
