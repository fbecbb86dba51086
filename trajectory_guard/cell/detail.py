"""The solids of a workcell, and as many parts of them as queries have needed so far."""

from collections.abc import Sequence
import threading
from typing import NamedTuple

import numpy as np

from trajectory_guard.kernels.layout import (
    Boxes,
    BUILT,
    Chain,
    CHILD,
    Extents,
    FACE_FIRST,
    FIRST,
    NODE,
    Packed,
    PARTS,
    Solids,
    UNBUILT,
    WHOLE,
)
from trajectory_guard.shapes.parts import Clusters
from trajectory_guard.shapes.surface import Surface


class Level(NamedTuple):
    """
    A workcell packed with some parts; never changed.

    :param packed: what the kernels take.
    :param links: wholes, then parts.
    :param obstacles: likewise.
    """

    packed: Packed
    links: Solids
    obstacles: Solids

    def wholes(self, leaves: np.ndarray) -> np.ndarray:
        """Return leaves that name wholes instead of their parts."""
        named = leaves['body'] >= 0
        out = leaves.copy()
        out['body'][named] = self.links.ranges[leaves['body'][named], WHOLE]
        out['obstacle'][named] = self.obstacles.ranges[leaves['obstacle'][named], WHOLE]
        return out


class Detail:
    """
    The levels of a workcell, each finer than the one before; any number of threads may refine it.

    A part is built once and kept. The tree of a solid's parts is fixed, so that an answer does not
    depend on how many of them have been built already.

    :param chain: joints.
    :param boxes: boxes of the obstacles.
    :param extents: how far the links reach, surfaces included.
    :param sides: the wholes among the links, and among the obstacles.
    :param surfaces: for each whole of each side the surface that refines it; None: nothing does.
    """

    def __init__(
        self,
        chain: Chain,
        boxes: Boxes,
        extents: Extents,
        sides: tuple[Solids, Solids],
        surfaces: tuple[Sequence[Surface | None], Sequence[Surface | None]],
    ) -> None:
        self.surfaces = surfaces
        self._fixed = chain, boxes, extents
        self._lock = threading.Lock()
        self._clusters: dict[tuple[int, int], Clusters] = {}
        self._spans = [
            np.array([(0, len(surface.triangles) if surface else 0) for surface in side])
            for side in surfaces
        ]
        self.level = self._packed(*sides)

    def refine(self, wanted: np.ndarray, stop: np.ndarray) -> Level:
        """
        Build the parts of some solids, unless that has been done.

        :param wanted: (W,) WANTED; solids of this level or an earlier one.
        :param stop: (1,) int64; once it is not zero nothing more is built.
        """
        with self._lock:
            sides = [self.level.links, self.level.obstacles]
            for side in (0, 1):
                solids = np.unique(wanted['solid'][wanted['side'] == side])
                for whole in np.unique(sides[side].ranges[solids, WHOLE]).tolist():
                    ranges = sides[side].ranges[solids]
                    missing = (ranges[:, WHOLE] == whole) & (ranges[:, PARTS] == UNBUILT)
                    if not stop[0] and missing.any():
                        sides[side] = self._with_parts(side, whole, sides[side], solids[missing])
            if sides[0] is not self.level.links or sides[1] is not self.level.obstacles:
                self.level = self._packed(*sides)
            return self.level

    def _with_parts(self, side: int, whole: int, solids: Solids, parents: np.ndarray) -> Solids:
        """Return the solids with parts below some that belong to one whole."""
        clusters = self._clusters.get((side, whole))
        if clusters is None:
            surface = self.surfaces[side][whole]
            if surface is None:
                raise ValueError(f'solid {whole} of side {side} has no surface')
            clusters = self._clusters[side, whole] = Clusters(surface)
        parts, spans = clusters.below(self._spans[side][parents])
        self._spans[side] = np.concatenate((self._spans[side], spans))
        ranges, count = solids.ranges.copy(), len(solids.ranges)
        ranges[parents, PARTS] = BUILT
        ranges[parents, CHILD] = count + 2 * np.arange(len(parents))
        rows = parts.ranges
        rows[:, FIRST:FACE_FIRST] += solids.vertices.shape[1]
        rows[:, [NODE, WHOLE]] = ranges[whole, [NODE, WHOLE]]
        rows[rows[:, PARTS] == BUILT, CHILD] += count
        return Solids(
            ranges=np.concatenate((ranges, rows)),
            size=np.concatenate((solids.size, parts.size)),
            place=np.concatenate((solids.place, parts.place)),
            vertices=np.concatenate((solids.vertices, parts.vertices), axis=1),
            faces=solids.faces,
        )

    def _packed(self, links: Solids, obstacles: Solids) -> Level:
        chain, boxes, extents = self._fixed
        return Level(Packed(chain, links, obstacles, boxes, extents), links, obstacles)
