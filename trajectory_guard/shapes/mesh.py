"""Mesh files as convex bodies."""

from dataclasses import dataclass
from functools import lru_cache
import hashlib
from pathlib import Path

import numpy as np

from trajectory_guard.cell.robot import Loaded
from trajectory_guard.errors import Reason, RobotError
from trajectory_guard.shapes.body import ConvexBody, LARGEST_COORDINATE, U
from trajectory_guard.shapes.mesh_formats import READERS, Triangles
from trajectory_guard.shapes.resource import ANY_MESH, MeshLimits, places
from trajectory_guard.shapes.unique_rows import unique_rows

# A hull that exceeds its mesh by no more than this fraction of the size is the mesh: single
# precision in a file makes a convex surface that uneven.
TIGHT = 2.0**-20

# A live scene tells the same meshes again wherever they move: the bodies of so many files up to
# that size are kept [bytes].
KEPT, SMALL = 64, 2**20


@dataclass(frozen=True, slots=True)
class MeshFile:
    """
    A mesh as a description names it; the file is found and read when it is loaded.

    :param uri: package URI, file URI or path.
    :param folder: where relative paths start.
    :param scale: factor along x, y, z; negative ones mirror.
    :param limits: which files may be read.
    """

    uri: str
    folder: Path | None = None
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    limits: MeshLimits = ANY_MESH

    def load(self) -> Loaded:
        """
        Return the hull of the mesh, and the hash of the file it was built from.

        :raises RobotError: MESH_MISSING names the places looked at, MESH_INVALID what is wrong;
            MESH_FORBIDDEN, TOO_LARGE.
        """
        path = self._find()
        if path.suffix.lower() not in READERS:
            raise RobotError(
                Reason.MESH_INVALID, f'mesh {self.uri!r} is not one of {", ".join(READERS)}'
            )
        try:
            content = self.limits.read(path)
            make = _kept_body if len(content) <= SMALL else _body
            body = make(path.suffix.lower(), content, self.scale)
        except (OSError, ValueError) as error:
            raise RobotError(
                Reason.MESH_INVALID, f'mesh {self.uri!r} ({path}): {error}'
            ) from error
        return Loaded(body, hashlib.sha256(content).hexdigest())

    def _find(self) -> Path:
        looked = list(dict.fromkeys(places(self.uri, self.folder)))
        for path in looked:
            if path.is_file():
                return path
        where = ', '.join(map(str, looked)) or 'nowhere: the URI names no place on this machine'
        raise RobotError(Reason.MESH_MISSING, f'mesh {self.uri!r} not found; looked at {where}')


def _body(suffix: str, content: bytes, scale: tuple[float, float, float]) -> ConvexBody:
    """Return the body of what a file contains."""
    return mesh_body(READERS[suffix](content), scale)


_kept_body = lru_cache(KEPT)(_body)


def mesh_body(mesh: Triangles, scale: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> ConvexBody:
    """
    Return the convex hull of a mesh, and an inscribed polytope if the mesh is a convex solid.

    If the hull is more than the mesh, the body knows the mesh's surface.

    :param mesh: the surface; its corners may be off by its rounding.
    :param scale: factor along x, y, z.
    :raises ValueError: a scaled coordinate is too large.
    """
    # Brings scipy, half of the time that the whole package takes to import.
    from trajectory_guard.shapes.hull import convex_hull
    from trajectory_guard.shapes.inscribed import inscribed_polytope
    from trajectory_guard.shapes.surface import Surface

    scaled = mesh.points * scale + 0.0
    if not np.abs(scaled).max() <= LARGEST_COORDINATE:
        raise ValueError(f'a coordinate exceeds {LARGEST_COORDINATE:g} m')
    points, inverse = unique_rows(scaled)
    triangles = inverse[mesh.triangles]
    # The file's rounding grows with the scale; scaling rounds each coordinate by U.
    rounding = 2.0 * mesh.rounding * max(map(abs, scale))
    if scale != (1.0, 1.0, 1.0):
        rounding += 2.0 * U * np.abs(points).max()
    hull = convex_hull(points)
    faces = inscribed_polytope(points, triangles, hull, rounding)
    surface = None
    if len(triangles) > 1 and not _fills(faces, hull.vertices):
        surface = Surface(points, triangles, rounding)
    ball = (hull.ball + rounding) * (1.0 + 4.0 * U)
    return ConvexBody(hull.vertices, ball=ball, faces=faces, surface=surface)


def _fills(faces: np.ndarray, vertices: np.ndarray) -> bool:
    """Tell whether an inscribed polytope is as good as the hull of the vertices."""
    if not len(faces):
        return False
    excess = (vertices @ faces[:, :3].T).max(axis=0) - faces[:, 3]
    return bool(excess.max() <= TIGHT * np.ptp(vertices, axis=0).max())
