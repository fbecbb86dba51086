"""The markers that a viewer shows, as obstacles: what is shown is what is checked."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
import hashlib
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np

from trajectory_guard.cell.robot import JointType, Robot
from trajectory_guard.cell.scene import Obstacle, Scene
from trajectory_guard.errors import Reason, SceneError
from trajectory_guard.markers.marker import Key, Marker, Removal
from trajectory_guard.markers.marker_bodies import Solids, solids_of
from trajectory_guard.shapes.resource import MeshLimits

# Poses from a link's parent up to the root link, for the links that no joint moves.
Frames: TypeAlias = Mapping[str, tuple[np.ndarray, ...]]


class MarkerLimits(NamedTuple):
    """
    How much a scene of markers may hold.

    :param markers: in one array, removals included, and in the scene.
    :param points: of all lists of the scene together.
    :param mesh_bytes: of one mesh file.
    :param mesh_roots: folders that mesh files lie in, links resolved; empty: anywhere.
    """

    markers: int = 1_000
    points: int = 10_000
    mesh_bytes: int = 64 * 1024 * 1024
    mesh_roots: tuple[Path, ...] = ()

    @property
    def meshes(self) -> MeshLimits:
        """Which mesh files may be read."""
        return MeshLimits(self.mesh_roots, self.mesh_bytes)


class _Entry(NamedTuple):
    marker: Marker
    digest: bytes
    solids: Solids


@dataclass(frozen=True, slots=True, eq=False)
class MarkerScene:
    """
    The markers that are there; a value that `updated` replaces as a whole.

    The rules are those of RViz (``rviz_default_plugins``, marker displays of Jazzy): a marker
    replaces the one of the same namespace and id, whatever its kind, and stays until it is taken
    away. In three things it errs towards more obstacles: no lifetime ends one, for a motion must
    not rely on what will vanish; one that is transparent, or hidden in the viewer, is one; and
    what a viewer would not draw, because it is malformed, is refused.

    A mesh file is read when its marker comes, not again for the same marker, as viewers do it.

    :param entries: by namespace and id, sorted.
    """

    entries: Mapping[Key, _Entry] = field(default_factory=dict, repr=False)

    def updated(
        self,
        changes: Iterable[Marker | Removal],
        limits: MarkerLimits | None = None,
        frames: Frames | None = None,
    ) -> 'MarkerScene':
        """
        Return the scene after some changes, made one after the other: all of them or none.

        :param changes: of one array of markers.
        :param limits: the defaults if None.
        :param frames: those that markers may be in; None: the robot is not known yet.
        :raises SceneError: a marker cannot be an obstacle, or there would be too many.
        """
        limits = limits or MarkerLimits()
        wanted: dict[Key, Marker] = {key: entry.marker for key, entry in self.entries.items()}
        for change in changes:
            if isinstance(change, Removal):
                wanted = {key: kept for key, kept in wanted.items() if not change.covers(key)}
            else:
                if frames is not None:
                    _chain(change, frames)
                wanted[change.key] = change
        _check_limits(wanted, limits)
        return MarkerScene({key: self._entry(wanted[key], limits) for key in sorted(wanted)})

    def _entry(self, marker: Marker, limits: MarkerLimits) -> _Entry:
        """Return what was made of the same marker before, or make it."""
        old, digest = self.entries.get(marker.key), marker.digest()
        if old is not None and old.digest == digest:
            return old
        return _Entry(marker, digest, solids_of(marker, limits.meshes))

    def obstacles(self, frames: Frames) -> tuple[Obstacle, ...]:
        """
        Return an obstacle for each marker, sorted by namespace and id; a list is one obstacle.

        :param frames: of the robot.
        :raises SceneError: a marker is in a frame that is none of them.
        """
        obstacles = []
        for key, (marker, _, solids) in self.entries.items():
            bodies = solids.bodies
            for T in _chain(marker, frames):
                bodies = tuple(body.moved(T) for body in bodies)
            # A list of no elements is how publishers empty it.
            if bodies:
                obstacles.append(Obstacle(key.name, bodies))
        return tuple(obstacles)

    @property
    def digest(self) -> str:
        """SHA-256 of all geometry, in whatever order it came, in hex; frames by their names."""
        digest = hashlib.sha256()
        for entry in self.entries.values():
            digest.update(entry.digest)
            digest.update(hashlib.sha256(entry.solids.content.encode()).digest())
        return digest.hexdigest()


def fixed_frames(robot: Robot) -> Frames:
    """
    Return the frames that no joint moves: the root link and what is rigidly attached to it.

    :param robot: the robot.
    :returns: for each, the poses to go through, one after the other, so that each rounding is
        counted: of the link in its parent, of that in its own, up to the root link.
    """
    frames: dict[str, tuple[np.ndarray, ...]] = {robot.root: ()}
    for joint in robot.joints:
        if joint.type is JointType.FIXED and joint.parent in frames:
            frames[joint.child] = (joint.T_parent_joint, *frames[joint.parent])
    return frames


def with_markers(files: Scene | None, markers: MarkerScene, frames: Frames) -> Scene:
    """
    Return the scene of some files and some markers together.

    Its digest is one of both; it names the frames of markers, whose poses the robot's digest
    covers.

    :param files: None: there are none.
    :param markers: the markers.
    :param frames: of the robot.
    :raises SceneError: there is no obstacle, two have one name, or a frame is unknown.
    """
    live = markers.obstacles(frames)
    if files is not None and not markers.entries:
        return files
    named = {obstacle.name for obstacle in files.obstacles} if files else set()
    for obstacle in live:
        if obstacle.name in named:
            raise SceneError(
                Reason.DUPLICATE_NAME,
                f'marker {obstacle.name!r}: the files of the scene have an obstacle of that name',
            )
    obstacles = (*(files.obstacles if files else ()), *live)
    if not obstacles:
        raise SceneError(Reason.SCENE_EMPTY, 'the scene has no obstacles')
    both = f'{files.digest if files else ""} {markers.digest}'
    return Scene(obstacles, hashlib.sha256(both.encode()).hexdigest())


def _chain(marker: Marker, frames: Frames) -> tuple[np.ndarray, ...]:
    """Return the poses from a marker's frame to the root link."""
    if marker.frame not in frames:
        raise marker.refusal(
            'header.frame_id',
            marker.frame,
            Reason.FRAME_UNKNOWN,
            f'is none of the links that no joint moves: {", ".join(frames)}',
        )
    return frames[marker.frame]


def _check_limits(markers: Mapping[Key, Marker], limits: MarkerLimits) -> None:
    points = sum(len(marker.points) for marker in markers.values())
    for what, number, most in (
        ('markers', len(markers), limits.markers),
        ('points', points, limits.points),
    ):
        if number > most:
            raise SceneError(
                Reason.TOO_LARGE, f'the markers would be {number} {what}, more than {most}'
            )
