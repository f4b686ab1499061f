"""Definitions of host/msg as Cyclone DDS knows them, and the names that ROS 2 gives topics and types over DDS."""

from dataclasses import dataclass, field

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float64, int8, int32, int64, sequence, uint8, uint16, uint32, uint64

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
    has_position: bool = False
    position: array[float64, 3] = field(default_factory=zeros)


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
class String(IdlStruct, typename="std_msgs::msg::dds_::String_"):
    data: str


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class Point(IdlStruct, typename="geometry_msgs::msg::dds_::Point_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Pose(IdlStruct, typename="geometry_msgs::msg::dds_::Pose_"):
    position: Point
    orientation: Quaternion


@dataclass
class PoseStamped(IdlStruct, typename="geometry_msgs::msg::dds_::PoseStamped_"):
    header: Header
    pose: Pose


@dataclass
class PoseWithCovariance(IdlStruct, typename="geometry_msgs::msg::dds_::PoseWithCovariance_"):
    pose: Pose
    covariance: array[float64, 36]


@dataclass
class PoseWithCovarianceStamped(IdlStruct, typename="geometry_msgs::msg::dds_::PoseWithCovarianceStamped_"):
    header: Header
    pose: PoseWithCovariance


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


@dataclass
class RequestHeader(IdlStruct, typename="palpate_test::RequestHeader"):
    """Header that rmw_cyclonedds_cpp puts before requests and responses, to say which belong together."""

    client: uint64
    number: int64


@dataclass
class ResetRequest(IdlStruct, typename="palpate_msgs::srv::dds_::Reset_Request_"):
    objects: sequence[str] = field(default_factory=list)
    weights: sequence[uint32] = field(default_factory=list)


@dataclass
class ResetResponse(IdlStruct, typename="palpate_msgs::srv::dds_::Reset_Response_"):
    success: bool
    message: str


@dataclass
class NumberedResetRequest(IdlStruct, typename="palpate_msgs::srv::dds_::Reset_Request_"):
    header: RequestHeader
    objects: sequence[str] = field(default_factory=list)
    weights: sequence[uint32] = field(default_factory=list)


@dataclass
class NumberedResetResponse(IdlStruct, typename="palpate_msgs::srv::dds_::Reset_Response_"):
    header: RequestHeader
    success: bool
    message: str


@dataclass
class GoalId(IdlStruct, typename="unique_identifier_msgs::msg::dds_::UUID_"):
    uuid: array[uint8, 16]


@dataclass
class Goal(IdlStruct, typename="palpate_msgs::action::dds_::Recognize_Goal_"):
    objects: sequence[str] = field(default_factory=list)
    weights: sequence[uint32] = field(default_factory=list)


@dataclass
class Recognized(IdlStruct, typename="palpate_msgs::action::dds_::Recognize_Result_"):
    verdict: Verdict


@dataclass
class SendGoalRequest(IdlStruct, typename="palpate_msgs::action::dds_::Recognize_SendGoal_Request_"):
    goal_id: GoalId
    goal: Goal


@dataclass
class SendGoalResponse(IdlStruct, typename="palpate_msgs::action::dds_::Recognize_SendGoal_Response_"):
    accepted: bool
    stamp: Time


@dataclass
class GetResultRequest(IdlStruct, typename="palpate_msgs::action::dds_::Recognize_GetResult_Request_"):
    goal_id: GoalId


@dataclass
class GetResultResponse(IdlStruct, typename="palpate_msgs::action::dds_::Recognize_GetResult_Response_"):
    status: int8
    result: Recognized


@dataclass
class Feedback(IdlStruct, typename="palpate_msgs::action::dds_::Recognize_FeedbackMessage_"):
    goal_id: GoalId
    feedback: Recognized


@dataclass
class GoalInfo(IdlStruct, typename="action_msgs::msg::dds_::GoalInfo_"):
    goal_id: GoalId
    stamp: Time


@dataclass
class CancelRequest(IdlStruct, typename="action_msgs::srv::dds_::CancelGoal_Request_"):
    goal_info: GoalInfo


@dataclass
class CancelResponse(IdlStruct, typename="action_msgs::srv::dds_::CancelGoal_Response_"):
    return_code: int8
    goals_canceling: sequence[GoalInfo]


@dataclass
class ParameterValue(IdlStruct, typename="rcl_interfaces::msg::dds_::ParameterValue_"):
    type: uint8
    bool_value: bool = False
    integer_value: int64 = 0
    double_value: float64 = 0.0
    string_value: str = ""
    byte_array_value: sequence[uint8] = field(default_factory=list)
    bool_array_value: sequence[bool] = field(default_factory=list)
    integer_array_value: sequence[int64] = field(default_factory=list)
    double_array_value: sequence[float64] = field(default_factory=list)
    string_array_value: sequence[str] = field(default_factory=list)


@dataclass
class Parameter(IdlStruct, typename="rcl_interfaces::msg::dds_::Parameter_"):
    name: str
    value: ParameterValue


@dataclass
class SetParametersRequest(IdlStruct, typename="rcl_interfaces::srv::dds_::SetParameters_Request_"):
    parameters: sequence[Parameter]


@dataclass
class SetParametersResult(IdlStruct, typename="rcl_interfaces::msg::dds_::SetParametersResult_"):
    successful: bool
    reason: str


@dataclass
class SetParametersResponse(IdlStruct, typename="rcl_interfaces::srv::dds_::SetParameters_Response_"):
    results: sequence[SetParametersResult]


@dataclass
class OtherTouch(IdlStruct, typename="palpate_msgs::msg::dds_::Touch_"):
    """Not the definition of host/msg."""

    seconds: float64
