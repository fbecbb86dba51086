"""Requests that nobody should send: sound ones, and what can go wrong with them; seeded."""

from collections.abc import Callable
import math
import random

from builtin_interfaces.msg import Duration, Time
from sensor_msgs.msg import JointState
from trajectory_guard_interfaces.srv import CertifyTrajectory
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

# What is commanded, and between which positions: most of them free, some in the post [rad or m].
RANGES = {'shoulder': (-0.9, 1.6), 'elbow': (-1.5, 1.5), 'slide': (0.0, 0.3)}

URDF = """
<robot name="arm">
  <link name="base"/>
  <link name="upper">
    <collision><origin xyz="0.5 0 0"/><geometry><box size="1 0.1 0.1"/></geometry></collision>
  </link>
  <link name="lower">
    <collision>
      <origin xyz="0.3 0 0" rpy="0 1.5707963 0"/>
      <geometry><cylinder radius="0.05" length="0.6"/></geometry>
    </collision>
  </link>
  <link name="hand">
    <collision><geometry><sphere radius="0.06"/></geometry></collision>
  </link>
  <link name="finger">
    <collision><geometry><box size="0.02 0.02 0.1"/></geometry></collision>
  </link>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/>
  </joint>
  <joint name="elbow" type="continuous">
    <parent link="upper"/><child link="lower"/><origin xyz="1 0 0"/><axis xyz="0 0 1"/>
  </joint>
  <joint name="slide" type="prismatic">
    <parent link="lower"/><child link="hand"/><origin xyz="0.6 0 0"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.4" effort="1" velocity="1"/>
  </joint>
  <joint name="grip" type="prismatic">
    <parent link="hand"/><child link="finger"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/>
    <mimic joint="slide" multiplier="-0.5" offset="0.1"/>
  </joint>
</robot>
"""

NUMBERS = (
    *(math.nan, math.inf, -math.inf, 1.7976931348623157e308, -1e300, 1e155, 1e17, 1e9, -1e6, 1e3),
    *(5e-324, -5e-324, 2.2250738585072014e-308, 1e-200, 1e-9, -0.0, 0.0, 2 * math.pi, -math.pi),
)
NAMES = (
    *('', ' ', 'Shoulder', 'shoulder ', 'shoulder\u200b', '\u0161houlder', '\u202eredluohs'),
    *('grip', 'base', '/shoulder', '../../etc/passwd', '%s%n{0}', 'a' * 70_000, '\U0001f9be'),
)
# What cannot travel as it is: it is cut, or not sent at all.
UNSENDABLE_NAMES = ('\ud800', 'shoulder\0', '\0')
SECONDS = (0, 1, -1, 2**31 - 1, -(2**31), 2**30, 86_400)
NANOSECONDS = (0, 1, 10**9 - 1, 10**9, 2**31, 2**32 - 1)

Mutation = Callable[[random.Random, CertifyTrajectory.Request], None]


def sound(rng: random.Random) -> CertifyTrajectory.Request:
    """Return a request that the guard should judge, free more often than not."""
    joints = rng.sample([*RANGES], rng.randint(1, len(RANGES)))
    ranges = [RANGES[joint] for joint in joints]
    size, order = rng.randint(1, 6), rng.randint(0, 2)
    reach = 10.0 ** rng.uniform(-2.0, 0.0)
    here = [rng.uniform(*some) for some in ranges]
    time_ns = rng.choice((0, 10**6, 10**9))
    points = []
    for i in range(size):
        rest = i in (0, size - 1) or rng.random() < 0.3
        point = JointTrajectoryPoint(positions=here, time_from_start=span(time_ns))
        if order > 0:
            point.velocities = [0.0 if rest else rng.gauss(0.0, 0.2) for _ in joints]
        if order > 1 or (order > 0 and rng.random() < 0.2):
            point.accelerations = [0.0 if rest else rng.gauss(0.0, 0.5) for _ in joints]
        points.append(point)
        time_ns += rng.choice((1, 10**5, 10**9, rng.randrange(1, 3 * 10**9)))
        here = [
            min(max(q + reach * rng.uniform(-0.5, 0.5), low), high)
            for q, (low, high) in zip(here, ranges, strict=True)
        ]
    request = CertifyTrajectory.Request(
        trajectory=JointTrajectory(joint_names=joints, points=points),
        tracking_tolerance=rng.choice(([], [0.0], [1e-3], [0.01] * len(joints))),
        tolerance=rng.choice((0.0, 0.0, 1e-3, 1e-6)),
        clearance=rng.choice((0.0, 0.0, 0.01, 0.1)),
        want_certificate=rng.random() < 0.05,
    )
    if len(joints) < len(RANGES) or rng.random() < 0.8:
        first = dict(zip(joints, points[0].positions, strict=True))
        approached = span_ns(points[0].time_from_start) > 0
        request.start_state = JointState(
            name=[*RANGES, 'gripper'],
            position=[
                first.get(joint, sum(some) / 2) + (rng.gauss(0.0, 0.1) if approached else 0.0)
                for joint, some in RANGES.items()
            ]
            + [7.0],
            velocity=rng.choice(([], [0.0] * 4, [rng.gauss(0.0, 0.1) for _ in range(4)])),
        )
    return request


def hostile(rng: random.Random, sendable: bool = False) -> CertifyTrajectory.Request:
    """
    Return a request with up to four things wrong with it.

    :param rng: where the choices come from.
    :param sendable: keep to what arrives as it was sent.
    """
    request = sound(rng)
    for _ in range(rng.choice((0, 1, 1, 1, 2, 4))):
        rng.choice(MUTATIONS)(rng, request)
    if not sendable and rng.random() < 0.02:
        _put_name(rng, request.trajectory.joint_names, UNSENDABLE_NAMES)
    return request


def span(time_ns: int) -> Duration:
    """Return nanoseconds as a message."""
    return Duration(sec=time_ns // 10**9, nanosec=time_ns % 10**9)


def span_ns(duration: Duration) -> int:
    """Return a message as nanoseconds."""
    return duration.sec * 10**9 + duration.nanosec


def _number(rng: random.Random) -> float:
    if rng.random() < 0.3:
        return rng.choice((-1.0, 1.0)) * 10.0 ** rng.uniform(-20.0, 20.0)
    return rng.choice(NUMBERS)


def _put_name(rng: random.Random, names: list[str], choice: tuple[str, ...]) -> None:
    if names:
        names[rng.randrange(len(names))] = rng.choice((*choice, rng.choice(names)))


def _some_values(rng: random.Random, request: CertifyTrajectory.Request) -> list[float] | None:
    """Return one of the lists of numbers of a request."""
    state = request.start_state
    lists = [state.position, state.velocity, state.effort, request.tracking_tolerance]
    if request.trajectory.points and rng.random() < 0.7:
        point = rng.choice(request.trajectory.points)
        lists = [point.positions, point.velocities, point.accelerations, point.effort]
    return rng.choice(lists)


def odd_number(rng: random.Random, request: CertifyTrajectory.Request) -> None:
    values = _some_values(rng, request)
    if len(values):
        values[rng.randrange(len(values))] = _number(rng)


def next_number(rng: random.Random, request: CertifyTrajectory.Request) -> None:
    values = _some_values(rng, request)
    if len(values):
        i = rng.randrange(len(values))
        values[i] = math.nextafter(values[i], rng.choice((-math.inf, math.inf)))


def whole_turns(rng: random.Random, request: CertifyTrajectory.Request) -> None:
    values = _some_values(rng, request)
    if len(values):
        values[rng.randrange(len(values))] += 2 * math.pi * rng.choice((-1000, -1, 1, 3, 10**6))


def other_size(rng: random.Random, request: CertifyTrajectory.Request) -> None:
    values = _some_values(rng, request)
    how = rng.randrange(3)
    if how == 0:
        del values[:]
    elif how == 1 and len(values):
        values.pop()
    else:
        values.extend([0.0] * rng.choice((1, 1, 300)))


def odd_name(rng: random.Random, request: CertifyTrajectory.Request) -> None:
    names = rng.choice((request.trajectory.joint_names, request.start_state.name))
    _put_name(rng, names, NAMES)


def other_names(rng: random.Random, request: CertifyTrajectory.Request) -> None:
    names = rng.choice((request.trajectory.joint_names, request.start_state.name))
    how = rng.randrange(4)
    if how == 0:
        names.clear()
    elif how == 1:
        rng.shuffle(names)
    elif how == 2:
        names.append(rng.choice((*RANGES, *NAMES)))
    elif names:
        names.pop()


def odd_time(rng: random.Random, request: CertifyTrajectory.Request) -> None:
    if request.trajectory.points:
        rng.choice(request.trajectory.points).time_from_start = Duration(
            sec=rng.choice(SECONDS), nanosec=rng.choice(NANOSECONDS)
        )


def other_points(rng: random.Random, request: CertifyTrajectory.Request) -> None:
    points = request.trajectory.points
    how = rng.randrange(5)
    if how == 0:
        points.clear()
    elif how == 1:
        rng.shuffle(points)
    elif how == 2 and points:
        points.append(points[rng.randrange(len(points))])
    elif how == 3 and points:
        points.pop(rng.randrange(len(points)))
    else:
        points.extend([JointTrajectoryPoint()] * rng.choice((1, 100)))


def odd_header(rng: random.Random, request: CertifyTrajectory.Request) -> None:
    header = rng.choice((request.trajectory.header, request.start_state.header))
    header.stamp = Time(sec=rng.choice(SECONDS), nanosec=rng.choice(NANOSECONDS))
    header.frame_id = rng.choice(NAMES)


def odd_setting(rng: random.Random, request: CertifyTrajectory.Request) -> None:
    how = rng.randrange(6)
    if how == 0:
        request.tolerance = _number(rng)
    elif how == 1:
        request.clearance = _number(rng)
    elif how == 2:
        size = rng.choice((1, 1, len(request.trajectory.joint_names), 20))
        request.tracking_tolerance = [abs(_number(rng)) for _ in range(size)]
    elif how == 3:
        request.deadline = Duration(sec=rng.choice(SECONDS), nanosec=rng.choice(NANOSECONDS))
    elif how == 4:
        request.scope = rng.choice((1, 2, 3, 255))
    else:
        request.refine = rng.choice((1, 2, 3, 255))


MUTATIONS: tuple[Mutation, ...] = (
    *(odd_number, next_number, whole_turns, other_size, odd_name, other_names, odd_time),
    *(other_points, odd_header, odd_setting),
)
