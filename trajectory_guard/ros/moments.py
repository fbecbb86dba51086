"""
The moments of the last motion that was judged, for RViz.

A node makes one `MomentsPublisher` and tells it every result, from any thread::

    moments = MomentsPublisher(node)
    moments.publish(result, workcell, trajectory, start)

Each call replaces what was shown. Nothing is drawn while nobody looks: the last result is drawn
when somebody comes.
"""

import threading
from typing import NamedTuple

from rclpy.event_handler import PublisherEventCallbacks, QoSPublisherMatchedInfo
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from visualization_msgs.msg import MarkerArray

from msg_adapters.moment_markers import moments_to_message
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.markers.moments import moments, MOST
from trajectory_guard.paths.multi_dof import MultiDofTrajectory
from trajectory_guard.paths.trajectory import JointState, Trajectory
from trajectory_guard.result import Result

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class _Judged(NamedTuple):
    result: Result
    workcell: Workcell
    trajectory: Trajectory | MultiDofTrajectory
    start: JointState | None


class MomentsPublisher:
    """
    Publishes markers of the last result.

    :param node: gets the publisher; its clock gives the stamps.
    :param topic: visualization_msgs/MarkerArray, transient local.
    :param most: how many moments are shown, the first in time.
    """

    def __init__(self, node: Node, topic: str = '~/moments', most: int = MOST) -> None:
        self._node = node
        self._most = most
        self._lock = threading.Lock()
        self._undrawn: _Judged | None = None
        self._publisher = node.create_publisher(
            MarkerArray,
            topic,
            LATCHED,
            event_callbacks=PublisherEventCallbacks(matched=self._joined),
        )

    def publish(
        self,
        result: Result,
        workcell: Workcell,
        trajectory: Trajectory | MultiDofTrajectory,
        start: JointState | None = None,
    ) -> None:
        """
        Show a result, now or as soon as somebody looks.

        :param result: what `judge` said of the others.
        :param workcell: robot and scene.
        :param trajectory: the motion.
        :param start: where the robot is at time 0.
        """
        with self._lock:
            self._undrawn = _Judged(result, workcell, trajectory, start)
            if self._publisher.get_subscription_count():
                self._draw()

    def _joined(self, event: QoSPublisherMatchedInfo) -> None:
        with self._lock:
            if event.current_count:
                self._draw()

    def _draw(self) -> None:
        """Publish what has not been drawn; a picture must never be the end of the node."""
        if self._undrawn is None:
            return
        judged, self._undrawn = self._undrawn, None
        try:
            stamp = self._node.get_clock().now().to_msg()
            message = moments_to_message(moments(*judged, self._most), stamp)
            self._publisher.publish(message)
        except Exception as error:
            self._node.get_logger().error(f'the moments of a result cannot be shown: {error!r}')
