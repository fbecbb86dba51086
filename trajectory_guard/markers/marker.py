"""Markers as values: what a visualization_msgs/Marker said, checked once at the border."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import IntEnum
import hashlib
import json
from typing import NamedTuple

import numpy as np

from trajectory_guard.cell.quaternion import LENGTH_TOLERANCE, quaternion_length, quaternion_pose
from trajectory_guard.errors import Reason, SceneError
from trajectory_guard.shapes.body import LARGEST_COORDINATE, read_only, U

# Half of a diameter is the smallest radius that is a length.
SMALLEST_SCALE = 2.0 * U


class MarkerKind(IntEnum):
    """The kinds of markers that are solids or surfaces, numbered as in visualization_msgs."""

    CUBE = 1
    SPHERE = 2
    CYLINDER = 3
    CUBE_LIST = 6
    SPHERE_LIST = 7
    MESH_RESOURCE = 10
    TRIANGLE_LIST = 11


LISTS = (MarkerKind.CUBE_LIST, MarkerKind.SPHERE_LIST, MarkerKind.TRIANGLE_LIST)


class Key(NamedTuple):
    """
    What names a marker: a later one of the same key replaces it.

    :param namespace: as the publisher chose it.
    :param id: within the namespace.
    """

    namespace: str
    id: int

    @property
    def name(self) -> str:
        """The name of the obstacle; what follows its last slash is the id."""
        return f'{self.namespace}/{self.id}'


@dataclass(frozen=True, slots=True, eq=False)
class Marker:
    """
    A solid or a surface that a viewer shows.

    :param key: namespace and id.
    :param kind: what is drawn.
    :param frame: the frame of the pose.
    :param position: x, y, z of the marker's frame [m].
    :param quaternion: its orientation x, y, z, w; it stands for itself divided by its length.
    :param scale: edges of a cube, diameters of a sphere, diameters and height of a cylinder [m];
        the same of each element of a list; factors of triangles and meshes.
    :param points: (n, 3) in the marker's frame: centres of a list, or corners of triangles [m].
    :param mesh: URI of a mesh.
    :raises SceneError: a value is out of its range; the message names marker, field and value.
    """

    key: Key
    kind: MarkerKind
    frame: str
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    quaternion: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    points: np.ndarray = field(default_factory=lambda: np.empty((0, 3)), repr=False)
    mesh: str = ''

    def __post_init__(self) -> None:
        """Check every value that the kind has a use for, and the pose."""
        object.__setattr__(self, 'points', read_only(self.points).reshape(-1, 3))
        if not self.frame:
            raise self.refusal('header.frame_id', self.frame, Reason.FRAME_UNKNOWN, 'is empty')
        self._check_range('pose.position', self.position)
        length = quaternion_length(self.quaternion)
        if not abs(length - 1.0) <= LENGTH_TOLERANCE:
            raise self.refusal(
                'pose.orientation',
                list(self.quaternion),
                words=f'has the length {length:g}, not 1',
            )
        for name, value in zip('xyz', self.scale, strict=True):
            if not SMALLEST_SCALE < value <= LARGEST_COORDINATE:
                raise self.refusal(
                    f'scale.{name}',
                    value,
                    Reason.NOT_FINITE if value != value else Reason.SCENE_INVALID,
                    f'must lie in ({SMALLEST_SCALE:.1g}, {LARGEST_COORDINATE:g}]',
                )
        if self.kind in LISTS:
            self._check_points()
        if self.kind is MarkerKind.MESH_RESOURCE and not self.mesh:
            raise self.refusal('mesh_resource', self.mesh, Reason.MESH_MISSING, 'is empty')

    def refusal(
        self,
        field: str,
        value: object,
        reason: Reason = Reason.SCENE_INVALID,
        words: str = 'cannot be used',
    ) -> SceneError:
        """Return the error that names this marker, one of its fields and the value."""
        return refusal(self.key, field, value, reason, words)

    @property
    def T_frame_marker(self) -> np.ndarray:
        """The pose, (4, 4), entries of the rotation within 10 * 2^-53 of the exact ones [m]."""
        return quaternion_pose(self.position, self.quaternion)

    def digest(self) -> bytes:
        """Return the SHA-256 of all that shapes and places the marker, but not of mesh files."""
        # Texts as JSON, so that no two lists of them run together; adding 0 makes one zero of two.
        texts = json.dumps([*self.key, int(self.kind), self.frame, self.mesh, len(self.points)])
        digest = hashlib.sha256(texts.encode('utf-8', 'surrogatepass'))
        numbers = np.array([*self.position, *self.quaternion, *self.scale]) + 0.0
        digest.update(numbers.astype('<f8').tobytes())
        digest.update((self.points + 0.0).astype('<f8').tobytes())
        return digest.digest()

    def _check_points(self) -> None:
        broken = ~(np.abs(self.points) <= LARGEST_COORDINATE).all(axis=1)
        if broken.any():
            i = int(np.argmax(broken))
            self._check_range(f'points[{i}]', self.points[i].tolist())
        count = len(self.points)
        if self.kind is MarkerKind.TRIANGLE_LIST and (not count or count % 3):
            raise self.refusal(
                'points', f'{count} points', words='must be three for each triangle'
            )

    def _check_range(self, field: str, values: Sequence[float]) -> None:
        for name, value in zip('xyz', values, strict=True):
            # A NaN fails every comparison.
            if not abs(value) <= LARGEST_COORDINATE:
                raise self.refusal(
                    f'{field}.{name}',
                    value,
                    Reason.NOT_FINITE if value != value else Reason.SCENE_INVALID,
                    f'must lie in [-{LARGEST_COORDINATE:g}, {LARGEST_COORDINATE:g}] m',
                )


class Removal(NamedTuple):
    """
    Markers that are taken away.

    :param namespace: theirs; '' and no id: all namespaces.
    :param id: of the only one; None: the whole namespace.
    """

    namespace: str = ''
    id: int | None = None

    def covers(self, key: Key) -> bool:
        """Tell whether it takes the marker of a key away."""
        if self.id is not None:
            return key == (self.namespace, self.id)
        return self.namespace in ('', key.namespace)


def refusal(
    key: Key,
    field: str,
    value: object,
    reason: Reason = Reason.SCENE_INVALID,
    words: str = 'cannot be used',
) -> SceneError:
    """Return the error that names a marker, one of its fields and the value."""
    return SceneError(reason, f'marker {key.name!r}: {field} {value!r} {words}')
