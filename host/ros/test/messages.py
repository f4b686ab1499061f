"""Definitions of host/msg as Cyclone DDS knows them, and the names that ROS 2 gives topics and types over DDS."""

from dataclasses import dataclass, field

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float64, int32, int64, sequence, uint8, uint16, uint32

NAN = float("nan")


def zeros():
    return [0.0, 0.0, 0.0]


@dataclass
class Touch(IdlStruct, typename="palpate_msgs::msg::dds_::Touch_"):
    times: array[float64, 3]
    has_pose: bool = False
    direction: array[float64, 3] = field(default_factory=zeros)
    alignment: array[float64, 3] = field(default_factory=zeros)
    object: str = ""


@dataclass
class Verdict(IdlStruct, typename="palpate_msgs::msg::dds_::Verdict_"):
    touch: uint32
    verdict: str
    object: str
    posterior: float64
    refused: str
    objects: sequence[str]
    posteriors: sequence[float64]


@dataclass
class Evidence(IdlStruct, typename="palpate_msgs::msg::dds_::Evidence_"):
    touch: uint32
    objects: sequence[str]
    nats: sequence[float64]


@dataclass
class Approach(IdlStruct, typename="palpate_msgs::msg::dds_::Approach_"):
    touch: uint32
    pose: uint16
    direction: array[float64, 3]
    alignment: array[float64, 3]
    score: float64


@dataclass
class Bool(IdlStruct, typename="std_msgs::msg::dds_::Bool_"):
    data: bool


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class KeyValue(IdlStruct, typename="diagnostic_msgs::msg::dds_::KeyValue_"):
    key: str
    value: str


@dataclass
class DiagnosticStatus(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticStatus_"):
    level: uint8
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValue]


@dataclass
class DiagnosticArray(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticArray_"):
    header: Header
    status: sequence[DiagnosticStatus]
