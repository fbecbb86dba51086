"""
Types of the guard's interfaces for another vendor's DDS, written by hand from their definitions.

Nothing generated from those definitions is used: what fits here fits what they say.
"""

from dataclasses import dataclass, field

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import float32, float64, int32, sequence, uint8, uint32

REQUEST = 'trajectory_guard_interfaces.srv.dds_.CertifyTrajectory_Request_'


@dataclass
@final
class String(IdlStruct, typename='std_msgs.msg.dds_.String_'):
    data: str


@dataclass
@final
class Time(IdlStruct, typename='builtin_interfaces.msg.dds_.Time_'):
    sec: int32 = 0
    nanosec: uint32 = 0


@dataclass
@final
class Duration(IdlStruct, typename='builtin_interfaces.msg.dds_.Duration_'):
    sec: int32 = 0
    nanosec: uint32 = 0


@dataclass
@final
class Header(IdlStruct, typename='std_msgs.msg.dds_.Header_'):
    stamp: Time = field(default_factory=Time)
    frame_id: str = ''


@dataclass
@final
class JointTrajectoryPoint(IdlStruct, typename='trajectory_msgs.msg.dds_.JointTrajectoryPoint_'):
    positions: sequence[float64] = ()
    velocities: sequence[float64] = ()
    accelerations: sequence[float64] = ()
    effort: sequence[float64] = ()
    time_from_start: Duration = field(default_factory=Duration)


@dataclass
@final
class JointTrajectory(IdlStruct, typename='trajectory_msgs.msg.dds_.JointTrajectory_'):
    header: Header = field(default_factory=Header)
    joint_names: sequence[str] = ()
    points: sequence[JointTrajectoryPoint] = ()


@dataclass
@final
class JointState(IdlStruct, typename='sensor_msgs.msg.dds_.JointState_'):
    header: Header = field(default_factory=Header)
    name: sequence[str] = ()
    position: sequence[float64] = ()
    velocity: sequence[float64] = ()
    effort: sequence[float64] = ()


@dataclass
@final
class Request(IdlStruct, typename=REQUEST):
    trajectory: JointTrajectory = field(default_factory=JointTrajectory)
    start_state: JointState = field(default_factory=JointState)
    tolerance: float64 = 0.0
    clearance: float64 = 0.0
    tracking_tolerance: sequence[float64] = ()
    deadline: Duration = field(default_factory=Duration)
    scope: uint8 = 0
    refine: uint8 = 0
    want_certificate: bool = False


@dataclass
@final
class Garbage(IdlStruct, typename=REQUEST):
    """Claims to be a request; its bytes are read as one, the count as the seconds of its stamp."""

    body: sequence[uint8]


@dataclass
@final
class Point(IdlStruct, typename='geometry_msgs.msg.dds_.Point_'):
    x: float64
    y: float64
    z: float64


@dataclass
@final
class TimeInterval(IdlStruct, typename='trajectory_guard_interfaces.msg.dds_.TimeInterval_'):
    status: uint8
    reason: str
    start: Duration
    end: Duration
    body: str
    obstacle: str
    at: Duration
    location: Point
    gap_lower: float64
    gap_upper: float64


@dataclass
@final
class CertificationResult(
    IdlStruct, typename='trajectory_guard_interfaces.msg.dds_.CertificationResult_'
):
    verdict: uint8
    reason_code: str
    message: str
    intervals: sequence[TimeInterval]
    tolerance: float64
    clearance: float64
    interpolation: str
    robot_hash: str
    scene_hash: str
    compute_time: float64
    pieces: uint32
    pairs_checked: uint32
    unchecked_pairs: sequence[str]
    warnings: sequence[str]
    duration: Duration


@dataclass
@final
class Response(
    IdlStruct, typename='trajectory_guard_interfaces.srv.dds_.CertifyTrajectory_Response_'
):
    result: CertificationResult
    certificate: str


@dataclass
@final
class GuardStatus(IdlStruct, typename='trajectory_guard_interfaces.msg.dds_.GuardStatus_'):
    stamp: Time
    ready: bool
    reason_code: str
    message: str
    robot_hash: str
    scene_hash: str


@dataclass
@final
class Quaternion(IdlStruct, typename='geometry_msgs.msg.dds_.Quaternion_'):
    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0
    w: float64 = 1.0


@dataclass
@final
class Pose(IdlStruct, typename='geometry_msgs.msg.dds_.Pose_'):
    position: Point
    orientation: Quaternion = field(default_factory=Quaternion)


@dataclass
@final
class Vector3(IdlStruct, typename='geometry_msgs.msg.dds_.Vector3_'):
    x: float64
    y: float64
    z: float64


@dataclass
@final
class ColorRGBA(IdlStruct, typename='std_msgs.msg.dds_.ColorRGBA_'):
    r: float32 = 0.5
    g: float32 = 0.5
    b: float32 = 0.5
    a: float32 = 1.0


@dataclass
@final
class UVCoordinate(IdlStruct, typename='visualization_msgs.msg.dds_.UVCoordinate_'):
    u: float32
    v: float32


@dataclass
@final
class CompressedImage(IdlStruct, typename='sensor_msgs.msg.dds_.CompressedImage_'):
    header: Header = field(default_factory=Header)
    format: str = ''
    data: sequence[uint8] = ()


@dataclass
@final
class MeshFile(IdlStruct, typename='visualization_msgs.msg.dds_.MeshFile_'):
    filename: str = ''
    data: sequence[uint8] = ()


@dataclass
@final
class Marker(IdlStruct, typename='visualization_msgs.msg.dds_.Marker_'):
    header: Header
    ns: str
    id: int32
    type: int32
    action: int32
    pose: Pose
    scale: Vector3
    color: ColorRGBA = field(default_factory=ColorRGBA)
    lifetime: Duration = field(default_factory=Duration)
    frame_locked: bool = False
    points: sequence[Point] = ()
    colors: sequence[ColorRGBA] = ()
    texture_resource: str = ''
    texture: CompressedImage = field(default_factory=CompressedImage)
    uv_coordinates: sequence[UVCoordinate] = ()
    text: str = ''
    mesh_resource: str = ''
    mesh_file: MeshFile = field(default_factory=MeshFile)
    mesh_use_embedded_materials: bool = False


@dataclass
@final
class MarkerArray(IdlStruct, typename='visualization_msgs.msg.dds_.MarkerArray_'):
    markers: sequence[Marker]
