"""
A client of the guard that shares nothing with it: another vendor's DDS, hand-written types.

A program. It plays the robot's description to the guard's topic, then answers each line of JSON on
its input by one on its output:

    {"points": [[seconds, [shoulder, elbow]], ...]}    what the guard says to that trajectory
    {"garbage": ["...", ...]}    how many payloads it sent to the guard in place of requests
    {"markers": [[id, type, position, scale], ...]}    the guard's status with that scene
    {"moments": true}    how many markers the guard drew of what is not free
"""

from collections.abc import Callable
from dataclasses import asdict
import json
import sys
import time
from typing import Any

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from foreign_types import (
    CertificationResult,
    Duration,
    Garbage,
    GuardStatus,
    Header,
    JointTrajectory,
    JointTrajectoryPoint,
    Marker,
    MarkerArray,
    Point,
    Pose,
    Request,
    Response,
    String,
    Vector3,
)

PATIENCE = 60.0  # s

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
        node = f'rt/{namespace}/guard'
        self._scene = DataWriter(us, Topic(us, f'{node}/scene', MarkerArray), qos=LATCHED)
        self._status = DataReader(us, Topic(us, f'{node}/status', GuardStatus), qos=LATCHED)
        self._moments = DataReader(us, Topic(us, f'{node}/moments', MarkerArray), qos=QUEUE)
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

    def show(self, markers: list[tuple[int, int, list[float], list[float]]]) -> GuardStatus:
        """Publish a scene in the robot's root link, and return the status once it is ready."""
        self._scene.write(
            MarkerArray(
                [
                    Marker(
                        header=Header(frame_id='base'),
                        ns='seen',
                        id=number,
                        type=kind,
                        action=0,
                        pose=Pose(Point(*position)),
                        scale=Vector3(*scale),
                    )
                    for number, kind, position, scale in markers
                ]
            )
        )
        return self._first(self._status, lambda status: status.ready)

    def moments(self) -> int:
        """Return how many markers the guard draws in the first message that adds any."""
        drawn = self._first(self._moments, lambda array: any(m.action == 0 for m in array.markers))
        return len(drawn.markers)

    def _first(self, reader: DataReader, wanted: Callable[[Any], bool]) -> Any:
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            for sample in reader.take(100):
                if wanted(sample):
                    return sample
            time.sleep(0.01)
        raise TimeoutError(f'nothing wanted on {reader.topic.name}')

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
        ((task, value),) = json.loads(line).items()
        if task == 'points':
            answer = asdict(client.ask(value))
        elif task == 'garbage':
            answer = client.send(value)
        elif task == 'markers':
            answer = asdict(client.show(value))
        else:
            answer = client.moments()
        print(json.dumps(answer), flush=True)


if __name__ == '__main__':
    main()
