"""Messages of these tests, against the definitions in host/msg."""

from pathlib import Path

import messages
import numpy
import pytest
from cyclonedds.idl import IdlStruct
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from messages import *

DEFINITIONS = Path(__file__).parents[2] / "msg"
VERDICT = Verdict(7, "recognized", "bowl", 0.995, "", ["bowl", "mug"], [0.995, 0.005])
# The definition, its part between lines of dashes, and a message.
EXAMPLES = [
    ("Touch.msg", 0, Touch([0.0, 0.155, NAN], True, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], "bowl")),
    ("Verdict.msg", 0, VERDICT),
    ("Evidence.msg", 0, Evidence(7, ["bowl", "mug"], [0.0, -5.3])),
    ("Approach.msg", 0, Approach(7, 103, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 0.25)),
    ("Reset.srv", 0, ResetRequest(["bowl"], [3])),
    ("Reset.srv", 1, ResetResponse(False, "no such object")),
    ("Recognize.action", 0, Goal(["bowl"], [3])),
    ("Recognize.action", 1, Recognized(VERDICT)),
    ("Recognize.action", 2, Recognized(VERDICT)),
]


def values(message):
    """Fields as rosbags takes them: also of messages in messages, numbers in arrays."""

    def one(value):
        if isinstance(value, IdlStruct):
            return values(value)
        if isinstance(value, list) and not isinstance(value[0], str):
            return numpy.array(value, dtype=numpy.uint32 if isinstance(value[0], int) else numpy.float64)
        return value

    return {name: one(getattr(message, name)) for name in message.__dataclass_fields__}


@pytest.mark.parametrize("file, part, message", EXAMPLES)
def test_a_definition_gives_the_same_bytes(file, part, message):
    """Another implementation of ROS 2's definitions and CDR (rosbags), beside that of Cyclone DDS."""
    store = get_typestore(Stores.ROS2_JAZZY)
    store.register(get_types_from_msg((DEFINITIONS / "Verdict.msg").read_text(), "palpate_msgs/msg/Verdict"))
    name = f"palpate_msgs/msg/Test{part}"
    store.register(get_types_from_msg((DEFINITIONS / file).read_text().split("---")[part], name))

    def made(of, fields):
        kind = store.types[of]
        if set(fields) == {"verdict"} and isinstance(fields["verdict"], dict):
            fields = {"verdict": made("palpate_msgs/msg/Verdict", fields["verdict"])}
        return kind(**fields)

    assert bytes(store.serialize_cdr(made(name, values(message)), name)) == message.serialize()


@pytest.mark.parametrize("name", ["PoseStamped", "PoseWithCovarianceStamped"])
def test_a_pose_gives_the_same_bytes(name):
    store = get_typestore(Stores.ROS2_JAZZY)
    packages = {"Time": "builtin_interfaces", "Header": "std_msgs"}
    theirs = lambda kind: store.types[f"{packages.get(kind, 'geometry_msgs')}/msg/{kind}"]

    def made(of, numbers):
        pose = of("Pose")(of("Point")(2.0, -0.5, 0.0), of("Quaternion")(0.0, 0.0, 1.0, 0.0))
        pose = of("PoseWithCovariance")(pose, numbers) if "Covariance" in name else pose
        return of(name)(of("Header")(of("Time")(7, 9), "table"), pose)

    covariance = numpy.arange(36.0)
    mine = made(lambda kind: getattr(messages, kind), covariance.tolist())
    serialized = store.serialize_cdr(made(theirs, covariance), f"geometry_msgs/msg/{name}")
    assert bytes(serialized) == mine.serialize()


def test_every_definition_has_an_example():
    assert {file for file, _, _ in EXAMPLES} == {path.name for path in DEFINITIONS.iterdir()}
