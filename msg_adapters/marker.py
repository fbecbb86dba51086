"""visualization_msgs markers to values."""

from collections.abc import Sequence
import math
from typing import Any

import numpy as np

from trajectory_guard.errors import Reason, SceneError
from trajectory_guard.markers.marker import Key, LISTS, Marker, MarkerKind, refusal, Removal
from trajectory_guard.markers.marker_scene import MarkerLimits

# Actions of visualization_msgs/Marker; MODIFY is ADD.
ADD, DELETE, DELETEALL = 0, 2, 3

TEXT_VIEW_FACING = 9

# Kinds that are neither solids nor surfaces, by number.
OTHER_KINDS = {
    0: 'ARROW',
    4: 'LINE_STRIP',
    5: 'LINE_LIST',
    8: 'POINTS',
    12: 'ARROW_STRIP',
}


def changes_from_message(
    message: Any, limits: MarkerLimits | None = None
) -> tuple[Marker | Removal, ...]:
    """
    Return what an array of markers changes, in its order.

    As in RViz, DELETEALL with a namespace removes that namespace, and a text takes the place of
    what had its namespace and id; it is no obstacle itself.

    :param message: anything with the fields of visualization_msgs/MarkerArray.
    :param limits: the defaults if None.
    :raises SceneError: a marker is malformed, of a kind that is no solid, or there are too many;
        the message names marker, field and value.
    """
    limits = limits or MarkerLimits()
    markers = _markers(message, limits)
    points = sum(len(marker.points) for marker in markers)
    if points > limits.points:
        raise SceneError(
            Reason.TOO_LARGE, f'the array has {points} points, more than {limits.points}'
        )
    return tuple(_change(marker) for marker in markers)


def added_keys(message: Any, limits: MarkerLimits | None = None) -> tuple[Key, ...] | None:
    """
    Return the markers that an array would add, whatever is wrong with them; None: unreadable.

    :param message: anything with the fields of visualization_msgs/MarkerArray.
    :param limits: the defaults if None.
    """
    try:
        markers = _markers(message, limits or MarkerLimits())
        return tuple(_key(m) for m in markers if m.action not in (DELETE, DELETEALL))
    except (SceneError, AttributeError, TypeError, ValueError):
        return None


def _markers(message: Any, limits: MarkerLimits) -> Sequence[Any]:
    markers: Sequence[Any] = message.markers
    if len(markers) > limits.markers:
        raise SceneError(
            Reason.TOO_LARGE, f'the array has {len(markers)} markers, more than {limits.markers}'
        )
    return markers


def _key(message: Any) -> Key:
    return Key(str(message.ns), int(message.id))


def _change(message: Any) -> Marker | Removal:
    key = _key(message)
    pose, scale = message.pose, message.scale
    position = (pose.position.x, pose.position.y, pose.position.z)
    turn = pose.orientation
    quaternion = (turn.x, turn.y, turn.z, turn.w)
    factors = (scale.x, scale.y, scale.z)
    points = np.array([(p.x, p.y, p.z) for p in message.points], np.float64).reshape(-1, 3)
    _check_finite(key, message, position, quaternion, factors, points)
    if message.action == DELETE:
        return Removal(*key)
    if message.action == DELETEALL:
        return Removal(key.namespace)
    if message.action != ADD:
        raise refusal(key, 'action', message.action, words='is none of ADD, DELETE, DELETEALL')
    if message.type == TEXT_VIEW_FACING:
        return Removal(*key)
    kind = _kind(key, message)
    return Marker(
        key=key,
        kind=kind,
        frame=message.header.frame_id,
        position=position,
        quaternion=quaternion,
        scale=factors,
        points=points if kind in LISTS else np.empty((0, 3)),
        mesh=message.mesh_resource if kind is MarkerKind.MESH_RESOURCE else '',
    )


def _kind(key: Key, message: Any) -> MarkerKind:
    try:
        kind = MarkerKind(message.type)
    except ValueError:
        name = OTHER_KINDS.get(message.type, message.type)
        known = ', '.join(known.name for known in MarkerKind)
        raise refusal(
            key, 'type', name, Reason.GEOMETRY_UNSUPPORTED, f'is none of {known}'
        ) from None
    embedded = message.mesh_file
    if kind is MarkerKind.MESH_RESOURCE and (embedded.filename or len(embedded.data)):
        raise refusal(
            key,
            'mesh_file',
            embedded.filename,
            Reason.GEOMETRY_UNSUPPORTED,
            'is embedded; give mesh_resource the URI of a file',
        )
    return kind


def _check_finite(
    key: Key,
    message: Any,
    position: Sequence[float],
    quaternion: Sequence[float],
    factors: Sequence[float],
    points: np.ndarray,
) -> None:
    """Refuse what viewers ignore, whatever its action: numbers that are not finite."""
    color = message.color
    for name, values in (
        ('pose.position', position),
        ('pose.orientation', quaternion),
        ('scale', factors),
        ('color', (color.r, color.g, color.b, color.a)),
    ):
        if not all(map(math.isfinite, values)):
            raise refusal(key, name, list(values), Reason.NOT_FINITE, 'must be finite')
    broken = ~np.isfinite(points).all(axis=1)
    if broken.any():
        i = int(np.argmax(broken))
        raise refusal(key, f'points[{i}]', points[i].tolist(), Reason.NOT_FINITE, 'must be finite')
