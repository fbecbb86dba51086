"""Markers as bodies that contain what a viewer draws."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from trajectory_guard.errors import Reason, RobotError
from trajectory_guard.markers.marker import Marker, MarkerKind
from trajectory_guard.shapes.body import ConvexBody
from trajectory_guard.shapes.mesh import mesh_body, MeshFile
from trajectory_guard.shapes.mesh_formats import Triangles
from trajectory_guard.shapes.primitive import Box, Cylinder, Sphere
from trajectory_guard.shapes.resource import MeshLimits
from trajectory_guard.shapes.stretched import ellipsoid, elliptic_cylinder


class Solids(NamedTuple):
    """
    What a marker fills.

    :param bodies: their union contains it, in the frame that the marker names [m].
    :param content: SHA-256 of the mesh file it came from, in hex; '' if there is none.
    """

    bodies: tuple[ConvexBody, ...]
    content: str = ''


def solids_of(marker: Marker, limits: MeshLimits) -> Solids:
    """
    Return the bodies of a marker.

    A triangle list and a mesh are what they are in a mesh file: their hull, refined by their
    surface. An ellipsoid and an elliptic cylinder are contained in polyhedra; in a list of spheres
    of unequal diameters each is the ball of the largest.

    :param marker: the marker.
    :param limits: which mesh files may be read.
    :raises SceneError: a mesh is missing, forbidden or unusable, or something is too large.
    """
    try:
        bodies, content = _shapes(marker, limits)
        return Solids(tuple(body.moved(marker.T_frame_marker) for body in bodies), content)
    except RobotError as error:
        raise marker.refusal('mesh_resource', marker.mesh, error.reason, f': {error}') from error
    except ValueError as error:
        raise marker.refusal(
            'scale', list(marker.scale), Reason.SCENE_INVALID, f'and its points: {error}'
        ) from error


def _shapes(marker: Marker, limits: MeshLimits) -> tuple[tuple[ConvexBody, ...], str]:
    """Return the bodies in the marker's own frame, and the hash of their file."""
    match marker.kind:
        case MarkerKind.MESH_RESOURCE:
            loaded = MeshFile(marker.mesh, None, marker.scale, limits).load()
            return (loaded.body,), loaded.content
        case MarkerKind.TRIANGLE_LIST:
            corners = np.arange(len(marker.points)).reshape(-1, 3)
            return (mesh_body(Triangles(marker.points, corners), marker.scale),), ''
        case MarkerKind.CUBE_LIST | MarkerKind.SPHERE_LIST:
            element = _element(marker)
            return tuple(element.moved(_shift(point)) for point in marker.points), ''
    return (_element(marker),), ''


def _element(marker: Marker) -> ConvexBody:
    """Return the body of a shape, or of each element of a list, about its own middle."""
    x, y, z = marker.scale
    match marker.kind:
        case MarkerKind.CUBE | MarkerKind.CUBE_LIST:
            return Box(marker.scale).load().body
        case MarkerKind.CYLINDER:
            if x == y:
                return Cylinder(0.5 * x, z).load().body
            return elliptic_cylinder((x, y), z)
        case MarkerKind.SPHERE if not x == y == z:
            return ellipsoid(marker.scale)
        case MarkerKind.SPHERE | MarkerKind.SPHERE_LIST:
            # Viewers draw the spheres of a list as disks that face the camera: with unequal
            # diameters nothing but the smallest is surely filled.
            outer = Sphere(0.5 * max(marker.scale)).load().body
            inner = Sphere(0.5 * min(marker.scale)).load().body
            return replace(outer, faces=inner.faces, inside=inner.inside)
    raise marker.refusal('type', marker.kind, Reason.GEOMETRY_UNSUPPORTED)


def _shift(point: np.ndarray) -> np.ndarray:
    T = np.eye(4)
    T[:3, 3] = point
    return T
