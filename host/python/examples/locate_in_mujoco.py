"""An object is dropped on a table in MuJoCo, and a compliant hand recognizes what it is and where it lies.

For users without a robot: docs/guide/locate.md. The hand of robot_in_mujoco.py comes straight down where `palpate.Locator` says.
Its fingers give way, bend aside and press on switches; the object lies free on the table, and may slide, turn and tilt.

    pip install mujoco==4.0.0 trimesh==5.2.0 ./host/python
    python locate_in_mujoco.py meshes/*.obj --drops 20

prints a line for each drop, with the truth beside it, and last how many objects were named, how many of the names were wrong,
and how far off the places were. Options of robot_in_mujoco.py for the hand, its fingers and switches are taken, too.
"""

import argparse
import math
from pathlib import Path

import mujoco
import numpy as np
import palpate
import robot_in_mujoco as robot
import trimesh
from robot_in_mujoco import AFTER, LENGTH, OBJECT, RADIUS, SPACING, SPEED

RANGE = 0.028  # of an object's place, to each side: m
ABOVE = 0.004  # between fingertips and the highest point below them before they move: m
FAR = 0.5  # from the object, where the table is bare: m
MM = 1000


class Thing:
    """A mesh as a solid body."""

    def __init__(self, path):
        """Its center of mass is the one that `palpate capture` takes."""
        self.name = path.stem
        self.corners, self.triangles = robot.read_mesh(path)
        solid = trimesh.Trimesh(self.corners, self.triangles)
        self.hull = solid.convex_hull
        whole = solid if solid.is_watertight and 0 < solid.volume <= self.hull.volume else self.hull
        self.center, self.inertia = whole.center_mass, whole.moment_inertia * OBJECT / whole.volume


class Pose:
    """Pose of an object: its direction that points up, the middle of its box (m) and its yaw (degrees)."""

    def __init__(self, thing, state):
        """The pose of a body, in the frame that a placement of `palpate capture` has."""
        matrix = np.zeros(9)
        mujoco.mju_quat2Mat(matrix, state[3:7])
        rotation = matrix.reshape(3, 3)
        self.up = rotation[2]
        # Up points up, and the most level axis along x.
        axis = np.eye(3)[np.argmin(np.round(np.abs(self.up) * 1e6))]
        x = axis - self.up * (axis @ self.up)
        x /= np.linalg.norm(x)
        level = np.stack([x, np.cross(self.up, x), self.up])
        turned = rotation @ level.T
        self.yaw = math.degrees(math.atan2(turned[1, 0], turned[0, 0])) % 360
        placed = thing.corners @ level.T
        self.x, self.y, _ = turned @ (placed.min(axis=0) + placed.max(axis=0)) / 2 + state[:3]

    @property
    def placement(self):
        """The nearest axis or diagonal that points up, in words."""
        signs = np.array(np.meshgrid(*[[-1, 0, 1]] * 3)).T.reshape(-1, 3)
        lengths = np.maximum(np.linalg.norm(signs, axis=1), 1e-9)
        nearest = signs[np.argmax(signs @ self.up / lengths)]
        return "".join(("-" if sign < 0 else "+") + axis for sign, axis in zip(nearest, "xyz", strict=True) if sign)


class Table:
    """A table with an object on it, and a hand above."""

    def __init__(self, options, thing):
        """The object is anywhere yet."""
        spec = mujoco.MjSpec()
        spec.option.timestep = options.poll / 1000 / math.ceil(options.poll)
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        rough = {"condim": 6, "friction": [options.table_friction, 0.005, 0.0005]}
        stiff = {"solref": [2 * spec.option.timestep, 1]}
        # Fingers (type 1) touch the table and the object's triangles; the object stands on its convex hull.
        table = {"type": mujoco.mjtGeom.mjGEOM_PLANE, "size": [1, 1, 1], "contype": 10, "conaffinity": 5}
        spec.worldbody.add_geom(name="table", **table, **rough, **stiff)
        body = spec.worldbody.add_body(name="object")
        body.add_freejoint()
        body.mass, body.ipos, body.explicitinertial = OBJECT, thing.center, True
        body.fullinertia = thing.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        spec.add_mesh(name="hull", uservert=thing.hull.vertices.ravel(), userface=thing.hull.faces.ravel())
        hull = {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": "hull", "mass": 0, "contype": 4, "conaffinity": 8}
        body.add_geom(name="hull", **hull, **rough, **stiff)
        spec.add_flex(
            name="surface",
            dim=2,
            radius=1e-6,
            vert=thing.corners.ravel(),
            elem=thing.triangles.ravel(),
            vertbody=["object"],
            selfcollide=mujoco.mjtFlexSelf.mjFLEXSELF_NONE,
            contype=2,
            conaffinity=1,
            condim=3,
            friction=[options.friction, 0, 0],
            **stiff,
        )
        begin, down, row = np.array([0, 0, 1.0]), np.array([0, 0, -1.0]), np.array([1.0, 0, 0])
        robot.add_robot(spec, options, robot.Approach(begin, down, row, 0.0, 0.0))
        self.options, self.thing, self.model = options, thing, spec.compile()
        self.data = mujoco.MjData(self.model)
        hand = next(j for j in range(self.model.njnt) if self.model.joint(j).name.startswith("hand"))
        self.hand, self.body = self.model.jnt_dofadr[hand], self.model.jnt_bodyid[hand]
        self.backs = self.model.jnt_qposadr[hand] + np.array([1, 4, 7])
        self.tips = np.arange(self.model.ngeom - 3, self.model.ngeom)
        self.state = self.data.qpos[:7].copy()

    def drop(self, rng):
        """Drops the object until it rests, and puts it at a random place with a random yaw."""
        model, data = self.model, self.data
        mujoco.mj_resetData(model, data)
        model.body_pos[self.body] = [0, 0, 1]
        turn = rng.normal(size=4)
        data.qpos[:7] = [0, 0, LENGTH * 0.8, *(turn / np.linalg.norm(turn))]
        for step in range(10_000):
            mujoco.mj_step(model, data)
            data.qvel[:6] *= 1 - 3 * model.opt.timestep  # as on a cloth: round things stop
            if step > 300 and np.abs(data.qvel[:6]).max() < 1e-3:
                break
        yaw, place = rng.uniform(0, 2 * math.pi), rng.uniform(-RANGE, RANGE, 2)
        turned = np.zeros(4)
        mujoco.mju_mulQuat(turned, np.array([math.cos(yaw / 2), 0, 0, math.sin(yaw / 2)]), data.qpos[3:7])
        self.state = np.concatenate([[0, 0], data.qpos[2:3], turned])
        lies = Pose(self.thing, self.state)
        self.state[:2] = place - [lies.x, lies.y]

    def press(self, x, y, roll):
        """Comes straight down with the middle finger at x and y (m) and the row turned by roll (degrees): the height of the hand
        when each finger's switch closed, NaN for one that did not, and when it ended (m)."""
        options, model, data = self.options, self.model, self.data
        corners = robot_frame(self.state, self.thing.corners)
        near = np.hypot(*(corners[:, :2] - [x, y]).T) < SPACING + 0.03
        top = max(corners[near, 2].max() if near.any() else 0, 0) + ABOVE
        model.body_pos[self.body] = [x, y, top + RADIUS]
        half = math.radians(roll) / 2
        model.body_quat[self.body] = [math.cos(half), 0, 0, math.sin(half)]
        model.geom_contype[self.tips], model.geom_conaffinity[self.tips] = 1, 2
        mujoco.mj_resetData(model, data)
        data.qpos[:7] = self.state
        data.qpos[self.backs] = 0
        travel, speed = np.array(options.switch_travel) / MM, SPEED * (1 + options.speed_error / 100)
        closed, since, heights = np.zeros(3, dtype=bool), np.full(3, np.inf), np.full(3, np.nan)
        trace, limit = [], -AFTER
        while True:
            for _ in range(math.ceil(options.poll)):
                wave = math.sin(2 * math.pi * options.ripple_frequency * data.time)
                data.qvel[self.hand] = speed * (1 + options.ripple / 100 * wave)
                mujoco.mj_step(model, data)
            trace.append(top - data.qpos[self.backs[0] - 1])
            pushed = data.qpos[self.backs]
            closed = (pushed >= travel) | (closed & (pushed > travel - options.hysteresis / MM))
            since = np.where(closed, np.minimum(since, len(trace) - 1), np.inf)
            touched = np.isnan(heights) & (len(trace) - 1 - since >= options.debounce - 1)
            heights[touched] = [trace[int(poll)] for poll in since[touched]]
            if options.after == "lift":
                model.geom_contype[self.tips[touched]] = model.geom_conaffinity[self.tips[touched]] = 0
            if np.isfinite(heights).any():
                limit = max(limit, np.nanmax(heights) - options.stroke * LENGTH / 10)
            if np.isfinite(heights).all() or trace[-1] <= limit:
                break
        # The fingers leave, and what is left standing falls over or comes to rest.
        model.geom_contype[self.tips] = model.geom_conaffinity[self.tips] = 0
        for _ in range(200):
            data.qvel[self.hand] = 0
            mujoco.mj_step(model, data)
        self.state = data.qpos[:7].copy()
        return heights, trace[-1]


def robot_frame(state, corners):
    """An object's corners where it lies."""
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, state[3:7])
    return corners @ matrix.reshape(3, 3).T + state[:3]


def tared(table):
    """How much lower than its fingertips the hand is when each switch closes: from presses on the bare table."""
    presses = [table.press(FAR, 0, roll)[0] for roll in (0, 90, 180, 270)]
    return np.mean(presses, axis=0)


def find(options, maps, table, rng):
    """Approaches until the object is named and placed, or to the limit: what was said, and after how many it was named."""
    locator = palpate.Locator(maps, max_touches=options.touches, seed=int(rng.integers(1 << 31)))
    tare, named, located = tared(table), None, locator.located
    while locator.touches < options.touches and not located.is_placed(options.millimeters, options.degrees):
        if options.aims == "chosen":
            x, y, roll = locator.next()
        else:
            about = located.placed if locator.touches else None
            x, y = rng.uniform(-45, 45, 2) + ((about.x, about.y) if about else (0, 0))
            roll = rng.uniform(0, 360)
        heights, lowest = table.press(x / MM, y / MM, roll)
        located = locator.push_heights((heights - tare) * MM, x, y, roll, lowest=(lowest - tare.mean()) * MM)
        named = named or (locator.touches if located.object else None)
        if located.state == "unknown" or (located.object and options.name_only):
            break
    return located, named


def main():
    """Drops the objects one after the other."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("meshes", nargs="+", type=Path, help="files of meshes, each scaled to a longest side of 100 mm")
    add("--maps", type=Path, metavar="FILE", help="maps of these meshes at that size [made of them]")
    add("--drops", type=robot.count, default=20, metavar="N", help="objects dropped, in turn [20]")
    add("--aims", choices=("chosen", "random"), default="chosen", help="where the hand goes [chosen]")
    add("--touches", type=robot.count, default=24, metavar="N", help="approaches at most [24]")
    add("--name-only", action="store_true", help="end when the object is named, regardless of its place")
    add("--millimeters", type=robot.positive, default=3, help="half of the place's 95 %% interval to end at [3]")
    add("--degrees", type=robot.positive, default=5, help="half of the yaw's [5]")
    add("--table-friction", type=robot.amount, default=0.5, metavar="MU", help="of the object on the table [0.5]")
    own, rest = parser.parse_known_args()
    # The maps expect contacts that a robot's fingers lose at slopes and edges.
    real = palpate.Real(height=0.6, lost=0.05, position=0.7, drift=0.3, drift_yaw=0.3)
    meshes = own.meshes  # the robot's own arguments have meshes, too
    options = robot.arguments().parse_args(["-o", ".", "--stroke", "2", *rest], namespace=own)
    del own
    things = [Thing(path) for path in meshes]
    if options.maps:
        maps = palpate.Maps.load(options.maps)
    else:
        probe = palpate.Probe(radius=RADIUS * MM, spacing=SPACING * MM, speed=SPEED * MM, tilt=0, stroke=options.stroke * 10)
        sized = {thing.name: (thing.corners * MM, thing.triangles) for thing in things}
        maps = palpate.Maps.of_meshes(sized, probe=probe, millimeters=1, real=real)
    tables = [Table(options, thing) for thing in things]
    named, wrong, off, turned, within = [], 0, [], [], 0
    for drop in range(options.drops):
        rng = np.random.default_rng([options.seed, drop])
        table = tables[drop % len(tables)]
        table.drop(rng)
        located, after = find(options, maps, table, rng)
        true = Pose(table.thing, table.state)
        print(
            f"{located} after {located.touches} approaches, named after {after};"
            f" true: {table.thing.name}, {true.placement}, {true.x * MM:.1f}, {true.y * MM:.1f} mm, {true.yaw:.0f}°",
            flush=True,
        )
        if located.object is None:
            continue
        named.append(after)
        if located.object != table.thing.name:
            wrong += 1
            continue
        mode = located.placed
        off.append(math.hypot(mode.x - true.x * MM, mode.y - true.y * MM))
        within += abs(mode.x - true.x * MM) <= mode.x_within and abs(mode.y - true.y * MM) <= mode.y_within
        if mode.placement == true.placement and mode.yaw is not None:
            turned.append(abs((mode.yaw - true.yaw + 180) % 360 - 180))
    print(f"{len(named)} of {options.drops} named, after {np.mean(named) if named else math.nan:.1f} approaches; {wrong} wrong")
    if off:
        print(
            f"place: median {np.median(off):.1f} mm off, 95 % within {np.quantile(off, 0.95):.1f} mm; {within} of {len(off)} in their"
            f" intervals; yaw, in placements that are their own: median {np.median(turned) if turned else math.nan:.1f}°"
        )


if __name__ == "__main__":
    main()
