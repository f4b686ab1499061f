"""A compliant three-fingered robot in MuJoCo that touches meshes and writes recordings.

For users without a robot: docs/guide/robot-in-mujoco.md goes through the guide for a real probe with it. It shares no code
with Palpate's simulator, which knows no forces. Here fingers are sprung, rub, bend aside and press on switches, a hand is
faster or slower than it should be, and objects give way.

    pip install mujoco==4.0.0 trimesh==5.2.0
    python robot_in_mujoco.py meshes/*.obj --output robot --approaches 300 --plate 60

writes robot/NAME.txt for each mesh, an approach per line: the time of each finger's contact in seconds after the first one,
`-` for a finger that did not touch; and robot/plate.txt, presses on a flat plate.

Objects are 10 cm long. A unit of Palpate's, a tenth of that, is a centimeter, so the published probe has fingers of 1.5 mm
radius, 15 mm apart, and moves at 100 mm per second.
"""

import argparse
import itertools
import math
import sys
import zlib
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import trimesh

RADIUS, SPACING, SPEED, TILT = 0.0015, 0.015, 0.1, 10.0  # the published probe: m, m, m/s, degrees
LENGTH, CLEARANCE = 0.1, 0.05  # of an object's longest side; between its sphere and the start of an approach: m
FINGER, OBJECT = 0.003, 0.2  # masses: kg
PRESCRIBED = 1e6  # inertia of a joint whose velocity is set at each step: no force changes it
AT_ONCE = 64  # approaches in one world: they do not feel each other, and the object's triangles are shared
BEFORE, AFTER = 0.002, 0.006  # simulated before a finger reaches the object's box, and after it has left it: m


@dataclass
class Approach:
    """Start of the middle finger, unit vectors along the motion and the row, and where contacts are possible: m."""

    start: np.ndarray
    direction: np.ndarray
    alignment: np.ndarray
    begin: float
    end: float


def read_mesh(path):
    """Corners and triangles, scaled to a longest side of LENGTH about the origin."""
    mesh = trimesh.load(path, force="mesh", process=False)
    triangles = np.asarray(mesh.faces, dtype=np.int32)
    if len(triangles) == 0:
        raise ValueError("no triangles")
    used, triangles = np.unique(triangles, return_inverse=True)
    corners = np.asarray(mesh.vertices, dtype=float)[used]
    low, high = corners.min(axis=0), corners.max(axis=0)
    corners = (corners - (low + high) / 2) * (LENGTH / (high - low).max())
    return corners, triangles.reshape(-1, 3).astype(np.int32)


def direction(rng):
    """A uniform direction."""
    vector = rng.normal(size=3)
    return vector / np.linalg.norm(vector)


def draw(rng, half):
    """An approach to a box with these half sides: its start is uniform in direction, at half the box's diagonal plus CLEARANCE
    from the center, its aim is uniform in the box; the row is perpendicular to the motion, rolled uniformly about it, then
    tilted in the plane of row and motion by up to TILT degrees to either side."""
    start = direction(rng) * (np.linalg.norm(half) + CLEARANCE)
    motion = rng.uniform(-half, half) - start
    motion /= np.linalg.norm(motion)
    row = np.cross(motion, direction(rng))
    row /= np.linalg.norm(row)
    tilt = math.radians(rng.uniform(-TILT, TILT))
    alignment = row * math.cos(tilt) + motion * math.sin(tilt)
    # Parts of the fingers' paths inside the box, grown by a finger.
    grown = half + RADIUS + 1e-4
    begin, end = math.inf, -math.inf
    for place in (-SPACING, 0, SPACING):
        with np.errstate(divide="ignore"):
            ends = (np.array([-grown, grown]) - start - alignment * place) / motion
        enters, leaves = ends.min(axis=0).max(), ends.max(axis=0).min()
        if enters < leaves:
            begin, end = min(begin, enters), max(end, leaves)
    return Approach(start, motion, alignment, begin - BEFORE, end + AFTER)


def world(options, surface):
    """An empty world with the surface that is touched: a plate, or an object as a rigid flex of its triangles, since a mesh
    would collide as its convex hull."""
    spec = mujoco.MjSpec()
    spec.option.timestep = options.poll / 1000 / math.ceil(options.poll)
    spec.option.gravity = [0, 0, 0]
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    common = {
        "contype": 2,
        "conaffinity": 1,
        "condim": 3,
        "friction": [options.friction, 0, 0],
        "solref": [2 * spec.option.timestep, 1],
    }
    if surface is None:
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1, 1, 1], **common)
    else:
        corners, triangles = surface
        spec.add_flex(
            name="object",
            dim=2,
            radius=1e-6,
            vert=corners.ravel(),
            elem=triangles.ravel(),
            vertbody=["world"],
            selfcollide=mujoco.mjtFlexSelf.mjFLEXSELF_NONE,
            rgba=[0.6, 0.6, 0.7, 1],
            **common,
        )
    return spec


def add_robot(spec, options, approach):
    """The joints of one robot, from the ground to its fingertips: the mount of a loose object, the hand, and three fingers
    that can be pushed back and bent aside.

    An object on a soft mount stands still here and the robot moves instead, with the mass of the object: only their motion
    relative to each other counts, and so every approach touches the same triangles."""
    slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
    ground = spec.worldbody
    if options.loose:
        stiffness, size = options.mount_stiffness * 1000, LENGTH / 3
        ground = ground.add_body(mass=OBJECT, inertia=[OBJECT * size**2] * 3, explicitinertial=True)
        for kind, arm in ((slide, 1), (hinge, size)):
            for axis in np.eye(3):
                ground.add_joint(
                    type=kind,
                    axis=axis,
                    stiffness=stiffness * arm**2,
                    damping=0.6 * math.sqrt(stiffness * OBJECT) * arm**2,
                    frictionloss=options.mount_friction * arm,
                )
    hand = ground.add_body(pos=approach.start + approach.direction * approach.begin)
    hand.mass, hand.inertia, hand.explicitinertial = 1e-6, [1e-9] * 3, True
    hand.add_joint(name=f"hand {len(spec.bodies)}", type=slide, axis=approach.direction, armature=PRESCRIBED)
    across = np.cross(approach.direction, approach.alignment)
    across /= np.linalg.norm(across)
    back = np.cross(across, approach.alignment)  # fingers are perpendicular to the row
    stiffness, sideways = options.stiffness * 1000, options.sideways * 1000
    for place in (-1, 0, 1):
        finger = hand.add_body(pos=approach.alignment * SPACING * place)
        finger.add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[RADIUS, 0, 0],
            mass=FINGER,
            contype=1,
            conaffinity=2,
            condim=3,
            friction=[options.friction, 0, 0],
            solref=[2 * spec.option.timestep, 1],
            rgba=[0.9, 0.4, 0.2, 1],
        )
        finger.add_joint(
            type=slide,
            axis=back,
            stiffness=stiffness,
            springref=-options.preload / stiffness,
            damping=0.5 * math.sqrt(stiffness * FINGER),
            frictionloss=options.drag,
            limited=True,
            range=[0, options.stroke * LENGTH / 10 + AFTER],
            solref_limit=[2 * spec.option.timestep, 1],
        )
        for axis in (approach.alignment, across):
            finger.add_joint(type=slide, axis=axis, stiffness=sideways, damping=0.3 * math.sqrt(sideways * FINGER))


class Batch:
    """Approaches in one world, stepped until each has ended."""

    def __init__(self, options, surface, approaches, rng):
        """A world with a robot for each approach."""
        self.options, self.approaches = options, approaches
        spec = world(options, surface)
        for approach in approaches:
            add_robot(spec, options, approach)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        joints = range(self.model.njnt)
        hands = [j for j in joints if self.model.joint(j).name.startswith("hand")]
        # The joints of a robot after its hand's: back, and aside twice, of each finger.
        self.hands = self.model.jnt_dofadr[hands]
        self.backs = self.hands[:, None] + np.array([1, 4, 7])
        self.tips = np.arange(self.model.ngeom - 3 * len(approaches), self.model.ngeom).reshape(-1, 3)
        self.phase = rng.uniform(0, 2 * math.pi, len(approaches))

    def lift(self, tips):
        """Takes fingers away from the object: what is lifted touches nothing more."""
        self.model.geom_contype[self.tips[tips]] = 0
        self.model.geom_conaffinity[self.tips[tips]] = 0

    def run(self):
        """Times of contact in seconds, one row per approach; infinite for a finger that did not touch.

        A finger touches when its switch closes and stays closed for some polls in a row; the first of them is the time. The
        hand ends an approach when it has gone on by the stroke after the first contact, or has passed the object."""
        options, step = self.options, self.model.opt.timestep
        every = math.ceil(options.poll)
        count = len(self.approaches)
        travel = np.array(options.switch_travel) / 1000
        way = np.array([approach.end - approach.begin for approach in self.approaches])
        stroke = options.stroke * LENGTH / 10
        closed = np.zeros((count, 3), dtype=bool)
        since = np.full((count, 3), np.inf)  # the poll at which a switch was first found closed
        times = np.full((count, 3), np.inf)
        gone, running, first = np.zeros(count), np.ones(count, dtype=bool), np.full(count, np.inf)
        speed = SPEED * (1 + options.speed_error / 100)
        for poll in itertools.count():
            for _ in range(every):
                wave = np.sin(self.phase + 2 * math.pi * options.ripple_frequency * self.data.time)
                velocity = np.where(running, speed * (1 + options.ripple / 100 * wave), 0)
                self.data.qvel[self.hands] = velocity
                mujoco.mj_step(self.model, self.data)
                gone += velocity * step
            pushed = self.data.qpos[self.backs]
            closed = (pushed >= travel) | (closed & (pushed > travel - options.hysteresis / 1000))
            since = np.where(closed, np.minimum(since, poll), np.inf)
            touched = running[:, None] & np.isinf(times) & (poll - since >= options.debounce - 1)
            times[touched] = since[touched]
            first = np.where(np.isinf(first) & touched.any(axis=1), gone, first)
            if options.after == "lift":
                self.lift(touched)
            ended = running & ((gone >= way) | (gone >= first + stroke) | np.isfinite(times).all(axis=1))
            self.lift(ended)
            running &= ~ended
            if not running.any():
                break
        if self.data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number:
            raise ValueError("the physics did not stay stable: less stiffness, or a shorter --poll")
        return times * (step * every)


def touch(options, surface, approaches, rng):
    """Times of contact of these approaches, in their order; some of equal length at a time."""
    times = np.full((len(approaches), 3), np.inf)
    near = [number for number, approach in enumerate(approaches) if approach.begin < approach.end]
    near.sort(key=lambda number: approaches[number].end - approaches[number].begin)
    for begin in range(0, len(near), AT_ONCE):
        batch = near[begin : begin + AT_ONCE]
        times[batch] = Batch(options, surface, [approaches[number] for number in batch], rng).run()
        if sys.stderr.isatty():
            print(f"\r{min(begin + AT_ONCE, len(near))} of {len(near)} approaches", end="\033[K\r", file=sys.stderr)
    return times


def seeded(options, name):
    """A generator for an object's approaches: the same regardless of other objects."""
    return np.random.default_rng([options.seed, zlib.crc32(name.encode())])


def record(options, path):
    """Lines of the recording of a mesh."""
    surface = read_mesh(path)
    rng = seeded(options, path.stem)
    half = surface[0].max(axis=0)
    approaches = [draw(rng, half) for _ in range(options.approaches)]
    return lines(options, approaches, touch(options, surface, approaches, rng))


def press(options):
    """Lines of presses on a flat plate that is a little off square, each after half a turn."""
    rng = seeded(options, "plate")
    tilt, around = math.radians(options.plate_tilt), rng.uniform(0, 2 * math.pi)
    down = -np.array([math.sin(tilt) * math.cos(around), math.sin(tilt) * math.sin(around), math.cos(tilt)])
    row = np.cross(down, [0, 1, 0])
    row /= np.linalg.norm(row)
    presses = []
    for number in range(options.plate):
        start = -down * (LENGTH / 2 + rng.uniform(0, SPEED / 100))
        alignment = row if number % 2 == 0 else -row
        presses.append(Approach(start, down, alignment, LENGTH / 2 - 0.005, LENGTH / 2 + 0.01))
    return lines(options, presses, touch(options, None, presses, rng))


def lines(options, approaches, times):
    """A line of text per approach: three times after the first contact, and the pose if it is asked for."""
    text = []
    for approach, row in zip(approaches, times, strict=True):
        fields = [f"{time - row.min():.4f}" if np.isfinite(time) else "-" for time in row]
        if options.pose:
            fields += [f"{cosine:.4f}" for cosine in (*approach.direction, *approach.alignment)]
        text.append(" ".join(fields))
    return text


def count(text):
    """A whole number above 0."""
    if (number := int(text)) < 1:
        raise ValueError
    return number


def amount(text):
    """A number of 0 or more."""
    if not 0 <= (number := float(text)) < math.inf:
        raise ValueError
    return number


def positive(text):
    """A number above 0."""
    if (number := amount(text)) == 0:
        raise ValueError
    return number


def arguments():
    """The options; in brackets what they are by default."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshes", nargs="*", type=Path, help="files of meshes: OBJ, STL, PLY, GLB")
    add = parser.add_argument
    add("-o", "--output", type=Path, required=True, metavar="DIR", help="directory for the recordings")
    add("-n", "--approaches", type=count, default=300, metavar="N", help="approaches to each object [300]")
    add("--plate", type=count, metavar="N", help="also press N times on a flat plate, into DIR/plate.txt")
    add("--plate-tilt", type=amount, default=0.8, metavar="DEGREES", help="how far it is off square [0.8]")
    add("--pose", action="store_true", help="append the probe's direction and alignment to each line")
    add("--seed", type=int, default=1, metavar="N", help="of the approaches and the hand's ripple [1]")
    hand = parser.add_argument_group("hand").add_argument
    hand("--speed-error", type=float, default=4, metavar="PERCENT", help="faster than it is set to [4]")
    hand("--ripple", type=amount, default=1, metavar="PERCENT", help="of the speed, as a wave [1]")
    hand("--ripple-frequency", type=amount, default=12, metavar="HZ", help="of that wave [12]")
    hand("--stroke", type=positive, default=10, metavar="UNITS", help="goes on so far after the first contact [10]")
    hand(
        "--after", choices=("lift", "give"), default="lift", help="a finger that touched is lifted, or gives way [lift]"
    )
    finger = parser.add_argument_group("fingers").add_argument
    finger(
        "--preload", type=amount, default=0.15, metavar="N", help="force at which a finger begins to give way [0.15]"
    )
    finger("--stiffness", type=positive, default=0.1, metavar="N/MM", help="of its spring [0.1]")
    finger("--sideways", type=positive, default=0.4, metavar="N/MM", help="stiffness against bending aside [0.4]")
    finger("--drag", type=amount, default=0.03, metavar="N", help="dry friction in its guide [0.03]")
    finger("--friction", type=amount, default=0.4, metavar="MU", help="of its tip on the object [0.4]")
    switch = parser.add_argument_group("switches").add_argument
    switch("--switch-travel", type=amount, nargs=3, default=(0.3, 0.7, 0.4), metavar="MM", help="to close [.3 .7 .4]")
    switch("--hysteresis", type=amount, default=0.1, metavar="MM", help="less travel than that to open again [0.1]")
    switch("--poll", type=positive, default=1, metavar="MS", help="interval at which switches are read [1]")
    switch("--debounce", type=count, default=3, metavar="N", help="readings in a row that make a contact [3]")
    mount = parser.add_argument_group("objects").add_argument
    mount("--loose", action="store_true", help="on a soft mount, where they give way; otherwise they are fixed")
    mount("--mount-stiffness", type=positive, default=0.5, metavar="N/MM", help="of the mount [0.5]")
    mount("--mount-friction", type=amount, default=0.05, metavar="N", help="dry friction of the mount [0.05]")
    return parser


def main():
    """Touches what the options name, one recording after the other."""
    parser = arguments()
    options = parser.parse_args()
    if not options.meshes and not options.plate:
        parser.error("give a mesh to touch, or --plate N")
    if options.speed_error <= -100:
        parser.error("--speed-error: the hand would not move forward")
    names = [path.stem for path in options.meshes] + ["plate"] * bool(options.plate)
    for name in names:
        if names.count(name) > 1:
            parser.error(f"two recordings would be called {name}")
    options.output.mkdir(parents=True, exist_ok=True)
    for path in options.meshes:
        try:
            write(options, path.stem, record(options, path))
        except (OSError, ValueError, LookupError, NotImplementedError) as error:
            sys.exit(f"{path}: {error}")
    if options.plate:
        write(options, "plate", press(options))


def write(options, name, recording):
    """Writes a recording as a whole, and says so."""
    path = options.output / f"{name}.txt"
    part = path.with_suffix(".part")
    part.write_text("\n".join(recording) + "\n")
    part.replace(path)
    touched = sum(not line.startswith("- - -") for line in recording)
    print(f"{path}: {len(recording)} approaches, {touched} with a contact", flush=True)


if __name__ == "__main__":
    main()
