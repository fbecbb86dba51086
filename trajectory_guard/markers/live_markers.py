"""What arrays of markers have said so far, and what of it could not be understood."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from trajectory_guard.errors import TrajectoryGuardError
from trajectory_guard.markers.marker import Key, Marker, Removal
from trajectory_guard.markers.marker_scene import Frames, MarkerLimits, MarkerScene

# Stands for all markers of an array that was not read.
ANY = Removal()


@dataclass(frozen=True, slots=True, eq=False)
class LiveMarkers:
    """
    A scene of markers, and the markers that are missing in it because their array was refused.

    A viewer may show what was refused, so nothing can be said of motions until it has been
    replaced or removed; `error` says so. An array that is good again for all of it heals it, and
    so does one that begins by removing everything.

    :param scene: what is known to be there.
    :param missing: what is not in the scene although it may be shown, and why.
    """

    scene: MarkerScene = field(default_factory=MarkerScene)
    missing: Mapping[Key | Removal, TrajectoryGuardError] = field(default_factory=dict)

    @property
    def error(self) -> TrajectoryGuardError | None:
        """Why the scene is not all that is shown; None: it is."""
        return next(iter(self.missing.values()), None)

    def received(
        self,
        changes: Sequence[Marker | Removal],
        limits: MarkerLimits | None = None,
        frames: Frames | None = None,
    ) -> 'LiveMarkers':
        """
        Return what is known after an array; one that cannot be used changes no obstacle.

        :param changes: of the array, in its order.
        :param limits: as of `MarkerScene.updated`.
        :param frames: likewise.
        """
        try:
            scene = self.scene.updated(changes, limits, frames)
        except TrajectoryGuardError as error:
            added = [change.key for change in changes if isinstance(change, Marker)]
            return self.refused(error, added)
        missing = dict(self.missing)
        for change in changes:
            missing = {what: why for what, why in missing.items() if not _settles(change, what)}
        return LiveMarkers(scene, missing)

    def refused(
        self, error: TrajectoryGuardError, added: Collection[Key] | None = None
    ) -> 'LiveMarkers':
        """
        Return what is known after an array that could not be used.

        :param error: why.
        :param added: the markers it would have added; None: unknown.
        """
        keys: Collection[Key | Removal] = [ANY] if added is None else added
        return LiveMarkers(self.scene, {**self.missing, **dict.fromkeys(keys, error)})


def _settles(change: Marker | Removal, missing: Key | Removal) -> bool:
    """Tell whether after a change a marker is no longer missing."""
    if isinstance(missing, Removal):
        return change == ANY
    if isinstance(change, Marker):
        return change.key == missing
    return change.covers(missing)
