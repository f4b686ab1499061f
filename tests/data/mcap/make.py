"""Makes the logs of this directory with MCAP's own library for Python, as a robot's programs would.

    python3 -m venv venv && venv/bin/pip install mcap==1.6.0 mcap-ros2-support==0.6.0 zstandard lz4
    venv/bin/python make.py

All hold the same 40 touches, 20 of a bowl and 20 of a mug by turns, and a channel of other messages (/joints):

json.mcap       JSON, chunks uncompressed, unit vectors of the pose with every touch
json-lz4.mcap   the same in chunks compressed by LZ4
json-zstd.mcap  and by Zstandard
plain.mcap      JSON without chunks, no object named, in the wrong order of log times, no pose
ros2.mcap       CDR by host/msg, as rosbag2 stores it, in chunks compressed by Zstandard, beside verdicts, which are skipped; the
                one that is here was made by a definition of the touch without a position
"""

import json
import math
from pathlib import Path

from mcap.writer import CompressionType, Writer
from mcap_ros2.writer import Writer as Ros2Writer

HERE = Path(__file__).parent
MSG = HERE.parent.parent.parent / "host" / "msg"
SECOND = 1_000_000_000
START = 1_767_225_600 * SECOND  # 2026


def touches():
    """Times (None for a finger that did not touch), direction, alignment and object."""
    for i in range(40):
        bowl = i % 2 == 0
        late = (0.010 if bowl else 0.060) + i * 1e-4
        times = [0.0, 0.0015 * i, late]
        if i % 10 == 7:
            times[1] = None
        angle = i / 7
        direction = [math.cos(angle), math.sin(angle), 0.0]
        alignment = [-math.sin(angle), math.cos(angle), 0.0]
        yield times, direction, alignment, "bowl" if bowl else "mug"


def written(name, compression, **options):
    writer = Writer(str(HERE / name), compression=compression, chunk_size=2048, **options)
    writer.start(library="make.py")
    joints = writer.register_schema("robot.Joints", "jsonschema", b'{"type": "object"}')
    joints = writer.register_channel("/joints", "json", joints)
    schema = writer.register_schema("palpate.Touch", "jsonschema", b'{"type": "object"}')
    touch = writer.register_channel("/probe/touch", "json", schema)
    return writer, joints, touch


def add(writer, channel, time, message):
    writer.add_message(channel, time, json.dumps(message).encode(), time)


for name, compression in [
    ("json.mcap", CompressionType.NONE),
    ("json-lz4.mcap", CompressionType.LZ4),
    ("json-zstd.mcap", CompressionType.ZSTD),
]:
    writer, joints, touch = written(name, compression)
    for i, (times, direction, alignment, object) in enumerate(touches()):
        time = START + i * SECOND
        add(writer, joints, time, {"q": [0.1 * i] * 6})
        pose = {"direction": direction, "alignment": alignment}
        add(writer, touch, time + 1, {"times": times, "pose": pose, "object": object, "note": "not known to Palpate"})
    writer.finish()

writer, joints, touch = written("plain.mcap", CompressionType.NONE, use_chunking=False, enable_data_crcs=True)
for i, (times, *_) in reversed(list(enumerate(touches()))):
    # On a clock that counts from 1970.
    times = [None if time is None else 1_767_225_600 + i + time for time in times]
    add(writer, touch, START + i * SECOND, {"times": times})
writer.finish()

with open(HERE / "ros2.mcap", "wb") as out:
    writer = Ros2Writer(out, chunk_size=2048)
    touch = writer.register_msgdef("palpate_msgs/msg/Touch", (MSG / "Touch.msg").read_text())
    verdict = writer.register_msgdef("palpate_msgs/msg/Verdict", (MSG / "Verdict.msg").read_text())
    other = writer.register_msgdef("std_msgs/msg/String", "string data")
    for i, (times, direction, alignment, object) in enumerate(touches()):
        time = START + i * SECOND
        writer.write_message("/joints", other, {"data": "x" * i}, time, time)
        times = [math.nan if time is None else time for time in times]
        message = {"times": times, "has_pose": True, "direction": direction, "alignment": alignment, "object": object}
        message |= {"has_position": False, "position": [0.0] * 3}
        writer.write_message("/touch", touch, message, time + 1, time + 1)
        message = {
            "touch": i + 1,
            "verdict": "undecided",
            "object": object,
            "posterior": 0.75,
            "refused": "" if i else "too soon",
            "objects": ["bowl", "mug"],
            "posteriors": [0.75, 0.25] if object == "bowl" else [0.25, 0.75],
        }
        writer.write_message("/verdict", verdict, message, time + 2, time + 2)
    writer.finish()
