"""
A client of the guard that shares nothing with it: another vendor's DDS, types written by hand.

A program. It plays the robot's description to the guard's topic, then answers each line of JSON on
its input by one on its output: {"points": ...} by what the guard says to that trajectory,
{"garbage": [...]} by how many payloads it sent to the guard in place of requests.
"""

from dataclasses import asdict, dataclass, field
import json
import sys
import time

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import float64, int32, sequence, uint8, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

PATIENCE = 60.0  # s
REQUEST = 'trajectory_guard_interfaces.srv.dds_.CertifyTrajectory_Request_'

# This machine only.
NETWORK = """
<CycloneDDS>
  <Domain>
    <General>
      <Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces>
    </General>
    <Discovery>
      <ParticipantIndex>auto</ParticipantIndex>
      <MaxAutoParticipantIndex>40</MaxAutoParticipantIndex>
      <Peers><Peer Address="127.0.0.1"/></Peers>
    </Discovery>
  </Domain>
</CycloneDDS>
"""


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


# ROS 2 writes version 1 of the encoding. Every garbage is to arrive, as fast as it is taken.
PLAIN = (
    Policy.Reliability.Reliable(duration(seconds=10)),
    Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False),
)
QUEUE = Qos(*PLAIN, Policy.History.KeepAll)
LATCHED = Qos(*PLAIN, Policy.History.KeepLast(1), Policy.Durability.TransientLocal)


class Client:
    """
    Asks one guard.

    :param domain: number of the DDS domain.
    :param namespace: where the guard's node lives.
    :param urdf: the robot, for the guard's topic.
    """

    def __init__(self, domain: int, namespace: str, urdf: str) -> None:
        self._domain = Domain(domain, NETWORK)
        us = DomainParticipant(domain)
        topic = Topic(us, f'rt/{namespace}/robot_description', String, qos=LATCHED)
        self._robot = DataWriter(us, topic, qos=LATCHED)
        self._robot.write(String(urdf))
        name = f'{namespace}/guard/certify'
        self._request = DataWriter(us, Topic(us, f'rq/{name}Request', Request), qos=QUEUE)
        self._reply = DataReader(us, Topic(us, f'rr/{name}Reply', Response), qos=QUEUE)
        other = DomainParticipant(domain)
        self._garbage = DataWriter(other, Topic(other, f'rq/{name}Request', Garbage), qos=QUEUE)
        self._asked = 0

    def ask(self, points: list[tuple[int, list[float]]]) -> CertificationResult:
        """
        Return what the guard says to a trajectory of shoulder and elbow.

        The answer's tolerance says which question it answers: what ROS 2 tells answers apart by
        is not in this vendor's interface. An answer is lost if the guard has not found its reader
        yet, so the question is put again.
        """
        self._asked += 1
        request = Request(
            trajectory=JointTrajectory(
                joint_names=['shoulder', 'elbow'],
                points=[
                    JointTrajectoryPoint(positions=q, time_from_start=Duration(sec=sec))
                    for sec, q in points
                ],
            ),
            tolerance=1e-4 + self._asked * 2.0**-30,
        )
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            self._request.write(request)
            again = time.monotonic() + 1.0
            while time.monotonic() < again:
                for response in self._reply.take(100):
                    if response.result.tolerance == request.tolerance:
                        return response.result
                time.sleep(0.01)
        raise TimeoutError(f'no answer to {request}')

    def send(self, payloads: list[str]) -> int:
        """Send payloads, in hexadecimal, and return how many."""
        end = time.monotonic() + PATIENCE
        while not self._garbage.get_matched_subscriptions():
            assert time.monotonic() < end, 'the guard does not see the writer'
            time.sleep(0.01)
        for payload in payloads:
            self._garbage.write(Garbage(list(bytes.fromhex(payload))))
        assert self._garbage.wait_for_acks(duration(seconds=PATIENCE))
        return len(payloads)


def main() -> None:
    """Serve standard input until it ends."""
    client = Client(int(sys.argv[1]), sys.argv[2], sys.argv[3])
    for line in sys.stdin:
        task = json.loads(line)
        answer = (
            client.send(task['garbage'])
            if 'garbage' in task
            else asdict(client.ask(task['points']))
        )
        print(json.dumps(answer), flush=True)


if __name__ == '__main__':
    main()
