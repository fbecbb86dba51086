"""Moments to visualization_msgs markers."""

from collections.abc import Sequence
import math
from typing import Any, NamedTuple

import numpy as np

from msg_adapters.marker import ADD, DELETEALL, TEXT_VIEW_FACING
from trajectory_guard.cell.quaternion import quaternion_of
from trajectory_guard.markers.drawing import Drawing
from trajectory_guard.markers.marker import MarkerKind
from trajectory_guard.markers.moments import Moment, Moments
from trajectory_guard.result import NANOSECONDS, Status

NAMESPACE = 'trajectory_guard'

# Red, green, blue, alpha of what has this status.
COLORS = {
    Status.COLLISION: (0.9, 0.1, 0.1, 0.5),
    Status.SUSPECT: (1.0, 0.75, 0.0, 0.5),
}
OPAQUE = 1.0

# Diameter of the ball at a place, and height of a letter [m].
PLACE_DIAMETER = 0.02
LETTER_HEIGHT = 0.04

# How far above its place a text stands: most collisions begin and end with a suspect instant [m].
TEXT_ABOVE = {Status.COLLISION: 0.15, Status.SUSPECT: -0.15}

MILLIMETRES = 1e3


class MarkerTypes(NamedTuple):
    """
    The message classes that markers are made of.

    :param MarkerArray: visualization_msgs/msg/MarkerArray.
    :param Marker: visualization_msgs/msg/Marker.
    :param Point: geometry_msgs/msg/Point.
    """

    MarkerArray: type
    Marker: type
    Point: type


def ros_marker_types() -> MarkerTypes:
    """Return the classes of the ROS installation."""
    from geometry_msgs.msg import Point
    from visualization_msgs.msg import Marker, MarkerArray

    return MarkerTypes(MarkerArray, Marker, Point)


def moments_to_message(moments: Moments, stamp: Any, types: MarkerTypes | None = None) -> Any:
    """
    Return markers that replace all that were shown before.

    For each moment a ghost of the link's collision geometry, red for a collision and amber for a
    suspect interval, a ball at the place, and a text: pair, instant, gap, reason. Namespaces are
    ``trajectory_guard/STATUS``, and ``.../place`` and ``.../text`` below it.

    :param moments: what there is to see.
    :param stamp: builtin_interfaces/Time of the headers.
    :param types: message classes; None: those of the ROS installation.
    """
    writer = _Writer(types or ros_marker_types(), moments.frame, stamp)
    for number, moment in enumerate(moments.shown):
        last = number + 1 == len(moments.shown)
        writer.add(moment, moments.left_out if last else 0)
    return writer.message


class _Writer:
    """An array of markers that grows; each has an id of its own."""

    def __init__(self, types: MarkerTypes, frame: str, stamp: Any) -> None:
        self._types, self._frame, self._stamp = types, frame, stamp
        # Ghosts of one link share their corners.
        self._corners: dict[int, list[Any]] = {}
        self.message = types.MarkerArray()
        self._marker('', DELETEALL)

    def add(self, moment: Moment, left_out: int) -> None:
        """Append the markers of a moment, its text naming how many were left out after it."""
        row = moment.interval
        namespace = f'{NAMESPACE}/{row.status.name.lower()}'
        color = COLORS[row.status]
        for drawing in moment.ghost:
            self._draw(self._marker(namespace), drawing, color)
        at = np.zeros(3)
        if row.location is not None and all(map(math.isfinite, row.location)):
            at = np.array(row.location)
            place = self._marker(f'{namespace}/place')
            scale = (PLACE_DIAMETER,) * 3
            drawing = Drawing(MarkerKind.SPHERE, _shift(at), scale)
            self._draw(place, drawing, (*color[:3], OPAQUE))
        elif moment.ghost:
            at = moment.ghost[0].T[:3, 3]
        text = self._marker(f'{namespace}/text')
        text.type = TEXT_VIEW_FACING
        text.text = _text(moment, left_out)
        above = at + [0.0, 0.0, TEXT_ABOVE[row.status]]
        _place(text, _shift(above), (LETTER_HEIGHT,) * 3, (*color[:3], OPAQUE))

    def _marker(self, namespace: str, action: int = ADD) -> Any:
        marker = self._types.Marker()
        marker.header.frame_id = self._frame
        marker.header.stamp = self._stamp
        marker.ns, marker.id, marker.action = namespace, len(self.message.markers), action
        self.message.markers.append(marker)
        return marker

    def _draw(self, marker: Any, drawing: Drawing, color: Sequence[float]) -> None:
        marker.type = int(drawing.kind)
        _place(marker, drawing.T, drawing.scale, color)
        if drawing.kind is MarkerKind.TRIANGLE_LIST:
            points = drawing.points
            if id(points) not in self._corners:
                self._corners[id(points)] = [
                    self._types.Point(x=x, y=y, z=z) for x, y, z in points.tolist()
                ]
            marker.points = self._corners[id(points)]


def _place(marker: Any, T: np.ndarray, scale: Sequence[float], color: Sequence[float]) -> None:
    position, turn = marker.pose.position, marker.pose.orientation
    position.x, position.y, position.z = T[:3, 3].tolist()
    turn.x, turn.y, turn.z, turn.w = quaternion_of(T[:3, :3])
    marker.scale.x, marker.scale.y, marker.scale.z = scale
    marker.color.r, marker.color.g, marker.color.b, marker.color.a = color


def _shift(position: np.ndarray) -> np.ndarray:
    T = np.eye(4)
    T[:3, 3] = position
    return T


def _text(moment: Moment, left_out: int) -> str:
    """Return what a moment says to people."""
    row = moment.interval
    span = f'{row.start_ns / NANOSECONDS:.3f} to {row.end_ns / NANOSECONDS:.3f} s'
    lines = [f'{row.status.name.lower()} {span}']
    if row.body:
        lines.insert(0, f'{row.body} and {row.obstacle}')
    if row.at_ns is not None:
        lines.append(f'seen at {row.at_ns / NANOSECONDS:.3f} s')
    if row.gap_lower is not None or row.gap_upper is not None:
        lines.append(f'gap {_millimetres(row.gap_lower)} to {_millimetres(row.gap_upper)} mm')
    if row.reason:
        lines.append(row.reason)
    if left_out:
        lines.append(f'{left_out} more after it are not shown')
    return '\n'.join(lines)


def _millimetres(gap: float | None) -> str:
    return '?' if gap is None else f'{gap * MILLIMETRES:.3f}'
