"""Marker messages for tests, and what a viewer draws for them."""

from collections.abc import Sequence
from typing import Any

from geometry_msgs.msg import Point
import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation
from visualization_msgs.msg import Marker, MarkerArray

BASE = 'base'
TURNED = (0.1, -0.2, 0.3, 0.9)
UNIT = tuple((np.array(TURNED) / np.linalg.norm(TURNED)).tolist())


def marker(
    kind: int = Marker.CUBE,
    number: int = 0,
    ns: str = 'ns',
    *,
    scale: Sequence[float] = (0.2, 0.3, 0.4),
    position: Sequence[float] = (0.5, -1.0, 2.0),
    quaternion: Sequence[float] = UNIT,
    points: Sequence[Sequence[float]] = (),
    frame: str = BASE,
    **fields: Any,
) -> Marker:
    """Return a marker message; `fields` are its other fields."""
    message = Marker(type=kind, id=number, ns=ns, **fields)
    message.header.frame_id = frame
    place, turn = message.pose.position, message.pose.orientation
    place.x, place.y, place.z = map(float, position)
    turn.x, turn.y, turn.z, turn.w = map(float, quaternion)
    message.scale.x, message.scale.y, message.scale.z = map(float, scale)
    message.points = [Point(x=float(x), y=float(y), z=float(z)) for x, y, z in points]
    message.color.a = 1.0
    return message


def array(*markers: Marker) -> MarkerArray:
    """Return markers as one message."""
    return MarkerArray(markers=list(markers))


def delete(number: int = 0, ns: str = 'ns') -> Marker:
    """Return what takes a marker away."""
    return Marker(action=Marker.DELETE, id=number, ns=ns)


def delete_all(ns: str = '') -> Marker:
    """Return what takes all away, or those of a namespace."""
    return Marker(action=Marker.DELETEALL, ns=ns)


def drawn(message: Marker, rng: np.random.Generator, count: int = 200) -> np.ndarray:
    """Return points of what a viewer draws, (n, 3) in the frame of the header."""
    scale = np.array([message.scale.x, message.scale.y, message.scale.z])
    listed = np.array([(p.x, p.y, p.z) for p in message.points]).reshape(-1, 3)
    ball = rng.normal(size=(count, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    cube = rng.choice([-1.0, 0.3, 1.0], size=(count, 3))
    rim = np.column_stack((ball[:, :2], cube[:, 2]))
    rim[:, :2] /= np.linalg.norm(rim[:, :2], axis=1, keepdims=True)
    about = {
        Marker.CUBE: cube * scale / 2,
        Marker.SPHERE: ball * scale / 2,
        Marker.CYLINDER: rim * scale / 2,
        Marker.CUBE_LIST: cube * scale / 2,
        Marker.SPHERE_LIST: ball * scale / 2,
    }
    if message.type == Marker.TRIANGLE_LIST:
        weights = rng.dirichlet(np.ones(3), size=count)
        corners = listed.reshape(-1, 3, 3)[rng.integers(len(listed) // 3, size=count)]
        local = np.einsum('nk,nki->ni', weights, corners) * scale
    elif message.type in (Marker.CUBE_LIST, Marker.SPHERE_LIST):
        local = (about[message.type][:, None] + listed).reshape(-1, 3)
    else:
        local = about[message.type]
    place, turn = message.pose.position, message.pose.orientation
    R = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_matrix()
    return local @ R.T + [place.x, place.y, place.z]


def outside(body: Any, points: np.ndarray) -> np.ndarray:
    """Return how far points are outside of a body at least, (n,); negative: inside."""
    if body.disc_radius:
        a, b = body.vertices
        off = points - 0.5 * (a + b)
        height = off @ body.disc_axis
        across = np.linalg.norm(off - np.outer(height, body.disc_axis), axis=1)
        beyond = np.abs(height) - 0.5 * np.linalg.norm(b - a)
        return np.maximum(across - body.disc_radius, beyond) - body.ball
    if len(body.vertices) == 1:
        return np.linalg.norm(points - body.vertices[0], axis=1) - body.ball
    planes = ConvexHull(body.vertices).equations
    return (points @ planes[:, :3].T + planes[:, 3]).max(axis=1) - body.ball
