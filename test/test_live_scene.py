"""Markers over real DDS: what is published becomes obstacles, and moments are seen."""

from collections.abc import Callable, Iterator
import threading
import time
from types import SimpleNamespace

from guard_process import ARM, PATIENCE, ros_context, SCENE, spinning
from marker_messages import array, BASE, delete_all, marker
import pytest
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from visualization_msgs.msg import Marker, MarkerArray

from trajectory_guard.cell.scene import load_scene
from trajectory_guard.cell.urdf import robot_from_urdf
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import judge
from trajectory_guard.errors import Reason
from trajectory_guard.paths.trajectory import Point, Trajectory
from trajectory_guard.ros.live_scene import LiveScene, MARKERS
from trajectory_guard.ros.moments import LATCHED, MomentsPublisher

FRAMES = {BASE: ()}


@pytest.fixture
def node() -> Iterator[Node]:
    with ros_context() as context:
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node := Node('someone', context=context))
        with spinning(executor):
            yield node


def until(true: Callable[[], bool]) -> None:
    """Wait for what another thread brings about."""
    end = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < end, 'it does not come'
        time.sleep(0.005)


def test_what_was_published_before_is_there_and_what_comes_later_too(node: Node) -> None:
    publisher = node.create_publisher(MarkerArray, 'shown', MARKERS)
    publisher.publish(array(marker(number=1), marker(Marker.SPHERE, 2)))
    changes: list[int] = []
    begin = time.monotonic_ns()
    live = LiveScene(node, 'shown', lambda: changes.append(1), frames=lambda: FRAMES)
    until(lambda: len(changes) == 1)
    assert live.topic == '/shown'
    assert live.received_ns is not None and begin <= live.received_ns <= time.monotonic_ns()
    assert [o.name for o in live.state.scene.obstacles(FRAMES)] == ['ns/1', 'ns/2']
    publisher.publish(array(delete_all('ns'), marker(number=3)))
    until(lambda: len(changes) == 2)
    assert [o.name for o in live.state.scene.obstacles(FRAMES)] == ['ns/3']
    assert live.state.error is None
    publisher.publish(array(marker(number=4, frame='map')))
    until(lambda: len(changes) == 3)
    assert live.state.error is not None and live.state.error.reason is Reason.FRAME_UNKNOWN
    assert [o.name for o in live.state.scene.obstacles(FRAMES)] == ['ns/3']
    publisher.publish(array(marker(Marker.ARROW, 5), delete_all()))
    until(lambda: len(changes) == 4)
    publisher.publish(array(delete_all()))
    until(lambda: len(changes) == 5)
    assert live.state.error is None and not live.state.scene.entries


def test_no_array_falls_out_of_a_queue(node: Node) -> None:
    """Taking an array can take longer than publishing many."""
    seen: list[int] = []

    def slowly() -> None:
        seen.append(len(live.state.scene.entries))
        time.sleep(0.3 if len(seen) == 1 else 0.0)

    live = LiveScene(node, 'burst', slowly)
    publisher = node.create_publisher(MarkerArray, 'burst', MARKERS)
    until(lambda: publisher.get_subscription_count() == 1)
    for k in range(50):
        publisher.publish(array(marker(number=k)))
    until(lambda: len(seen) == 50)
    assert seen == [*range(1, 51)]


def test_an_array_that_waited_is_as_old_as_it_is(node: Node) -> None:
    """The age counts from when it came, not from when there was time for it."""
    going = threading.Event()
    seen: list[int] = []

    def slowly() -> None:
        seen.append(live.received_ns or 0)
        going.wait(PATIENCE)

    live = LiveScene(node, 'waiting', slowly)
    publisher = node.create_publisher(MarkerArray, 'waiting', MARKERS)
    until(lambda: publisher.get_subscription_count() == 1)
    publisher.publish(array(marker(number=1)))
    until(lambda: len(seen) == 1)
    publisher.publish(array(marker(number=2)))
    time.sleep(0.5)
    taken_ns = time.monotonic_ns()
    going.set()
    until(lambda: len(seen) == 2)
    assert seen[0] < seen[1] < taken_ns


def test_a_lost_array_is_an_error_until_a_new_beginning(node: Node) -> None:
    changes: list[int] = []
    live = LiveScene(node, 'lossy', lambda: changes.append(1))
    # The middleware reports it so; it cannot be made to lose one.
    live._lost(SimpleNamespace(total_count=3, total_count_change=1))
    assert changes and '3 arrays were lost' in str(live.state.error)
    publisher = node.create_publisher(MarkerArray, 'lossy', MARKERS)
    publisher.publish(array(marker()))
    until(lambda: len(changes) == 2)
    assert live.state.error is not None
    publisher.publish(array(delete_all(), marker()))
    until(lambda: len(changes) == 3)
    assert live.state.error is None


def test_nothing_has_come_yet(node: Node) -> None:
    live = LiveScene(node, 'silent', lambda: None)
    assert live.received_ns is None and live.state.error is None
    assert not live.state.scene.entries


@pytest.mark.parametrize(
    'unheard',
    [
        QoSProfile(depth=10),
        QoSProfile(
            depth=10,
            reliability=ReliabilityPolicy.BEST_EFFORT,
            durability=DurabilityPolicy.TRANSIENT_LOCAL,
        ),
    ],
    ids=['volatile', 'best effort'],
)
def test_a_publisher_that_is_not_heard_is_an_error(node: Node, unheard: QoSProfile) -> None:
    changes: list[int] = []
    live = LiveScene(node, 'unheard', lambda: changes.append(1))
    node.create_publisher(MarkerArray, 'unheard', unheard)
    until(lambda: bool(changes))
    assert live.state.error is not None
    assert live.received_ns is None
    assert '/unheard' in str(live.state.error) and 'not heard' in str(live.state.error)


def test_an_error_of_ours_is_an_error_not_the_end(node: Node) -> None:
    def frames() -> None:
        raise RuntimeError('broken')

    publisher = node.create_publisher(MarkerArray, 'shown', MARKERS)
    changes: list[int] = []
    live = LiveScene(node, 'shown', lambda: changes.append(1), frames=frames)
    publisher.publish(array(marker()))
    until(lambda: bool(changes))
    assert live.state.error is not None and live.state.error.reason is Reason.INTERNAL_ERROR


def test_moments_are_drawn_for_whoever_looks_and_whenever(node: Node, tmp_path) -> None:
    (tmp_path / 'scene.urdf').write_text(SCENE)
    cell = Workcell(robot_from_urdf(ARM), load_scene(tmp_path / 'scene.urdf'))

    def swing(end: float) -> Trajectory:
        points = [Point(0, (0.0, 0.0)), Point(10**9, (end, 0.0))]
        return Trajectory.from_points(('shoulder', 'elbow'), points)

    hit, free = swing(1.6), swing(0.5)
    publisher = MomentsPublisher(node)
    publisher.publish(judge(cell, hit), cell, hit)
    seen: list[MarkerArray] = []
    late: list[MarkerArray] = []
    node.create_subscription(MarkerArray, '/someone/moments', seen.append, LATCHED)
    until(lambda: len(seen) == 1)
    namespaces = {m.ns for m in seen[0].markers}
    assert {'', 'trajectory_guard/collision', 'trajectory_guard/collision/text'} <= namespaces
    now = node.get_clock().now().nanoseconds
    for m in seen[0].markers:
        stamp = m.header.stamp.sec * 10**9 + m.header.stamp.nanosec
        assert 0 <= now - stamp < 60 * 10**9
    publisher.publish(judge(cell, free), cell, free)
    until(lambda: len(seen) == 2)
    assert [m.action for m in seen[1].markers] == [Marker.DELETEALL]
    node.create_subscription(MarkerArray, '/someone/moments', late.append, LATCHED)
    until(lambda: len(late) == 1)
    assert [m.action for m in late[0].markers] == [Marker.DELETEALL]
