"""Free runs in which one solid may lie inside the other; surfaces do not tell (trusted)."""

from collections.abc import Iterator
from itertools import groupby, product
from typing import NamedTuple

import numpy as np

from trajectory_guard.cell.detail import Detail, Level
from trajectory_guard.kernels.layout import (
    BALL,
    BY_ENCLOSURE,
    ECONOMISED,
    FIRST,
    FREE,
    Path,
    Solids,
    SUSPECT,
)
from trajectory_guard.kernels.link_motion import link_motion
from trajectory_guard.paths.jumps import jumps
from trajectory_guard.refine import Seen
from trajectory_guard.shapes.containment import may_contain
from trajectory_guard.shapes.surface import Surface

# A run's pairs are looked at in a piece of this level or so, where the motion's error is small.
SHORT = 12
DEEPEST = 48


class _Probe(NamedTuple):
    """
    One solid at an instant.

    :param places: (k, 3) a point of each of its connected pieces [m].
    :param doubt: how far these and the corners may be off [m].
    :param points: (n, 3) corners of its surface [m].
    :param surface: its surface; None if nothing can be inside, or it is convex.
    """

    places: np.ndarray
    doubt: float
    points: np.ndarray
    surface: Surface | None


def without_enclosures(detail: Detail, seen: Seen, path: Path) -> np.ndarray:
    """
    Return leaves among which no pair of solids that was taken apart overlaps in a free run.

    Where the pairs of parts are closed, the two surfaces keep apart, or a surface from a convex
    solid. On a connected run of such pieces, with all of the tracking tubes, nothing then enters
    or leaves: if the solids are disjoint at one instant of the nominal path, they are so at every
    one, up to where segments do not join: there the path may leap inside, and a run begins anew.

    Let A and B be solids whose surfaces are disjoint and which have a common point. The part
    of their intersection around it is bounded, so it has a boundary point, of the surface of A,
    say, and inside B; the whole connected piece of that surface then is inside B. So one point of
    each connected piece of either's surface is enough, and any point of a convex solid. Nothing is
    inside an open surface.

    :param detail: the solids and their surfaces.
    :param seen: what a cover found.
    :param path: the joint path.
    :returns: (L,) LEAF that name wholes.
    """
    covered, level = seen
    leaps = jumps(path)
    leaves = _cut(level.wholes(covered.leaves), leaps)
    stretch = np.searchsorted(leaps, leaves['segment'], side='right')
    first = 0
    for (free, _), run in groupby(zip(leaves['status'] == FREE, stretch, strict=True)):
        last = first + len(list(run))
        if free:
            begin, stop = _begins(leaves[first]), _ends(leaves, last)
            for body, obstacle in _opened_in(covered.opened, begin, stop):
                place = _shared(detail, level, path, leaves[first], body, obstacle)
                if place is not None:
                    _give_up(leaves[first:last], body, obstacle, place)
                    break
        first = last
    return leaves


def _cut(leaves: np.ndarray, leaps: np.ndarray) -> np.ndarray:
    """Return leaves of which one begins at each jump within a free run: it may be left out."""
    known = leaves['segment'][leaves['start'] == 0]
    missing = np.setdiff1d(leaps, known)
    at = np.searchsorted(leaves['segment'], missing)
    inner = (at > 0) & (at < len(leaves))
    missing, at = missing[inner], at[inner]
    free = leaves['status'][at] == FREE
    added = leaves[at[free]]
    added['segment'] = missing[free]
    added['start'], added['end'], added['level'] = 0, 1, DEEPEST
    return np.insert(leaves, at[free], added)


def _begins(leaf: np.void) -> float:
    return float(_fraction(leaf['segment'], leaf['start'], leaf['level']))


def _ends(leaves: np.ndarray, last: int) -> float:
    """Return where a run ends, up to its end leaves may be left out: where the next one begins."""
    if last < len(leaves):
        return _begins(leaves[last])
    leaf = leaves[last - 1]
    return float(_fraction(leaf['segment'], leaf['end'], leaf['level']))


def _opened_in(opened: np.ndarray, begin: float, stop: float) -> Iterator[tuple[int, int]]:
    """Yield the pairs that were taken apart on a piece that meets a span, each once."""
    low = _fraction(opened['segment'], opened['numerator'], opened['level'])
    high = _fraction(opened['segment'], opened['numerator'] + 1, opened['level'])
    # Rounding to a double may only join what does not meet.
    meets = (low <= stop) & (high >= begin)
    pairs = np.unique(np.column_stack((opened['body'], opened['obstacle']))[meets], axis=0)
    yield from map(tuple, pairs.tolist())


def _fraction(segment: np.ndarray, numerator: np.ndarray, level: np.ndarray) -> np.ndarray:
    """Return times in segments, rounded monotonically."""
    return segment + np.ldexp(np.asarray(numerator, float), -np.asarray(level, np.int32))


def _shared(
    detail: Detail, level: Level, path: Path, leaf: np.void, body: int, obstacle: int
) -> np.ndarray | None:
    """Return a place at an instant of a leaf that may be inside both solids, None if none is."""
    link = _probe(detail, level.links, 0, body)
    other = _probe(detail, level.obstacles, 1, obstacle)
    more = max(0, min(SHORT, DEEPEST - int(leaf['level'])))
    matrices, _, error, _, _, sound = link_motion(
        level.packed,
        path,
        body,
        int(leaf['segment']),
        int(leaf['start']) << more,
        int(leaf['level']) + more,
        ECONOMISED,
    )
    # The first control point is where the piece begins.
    pose = matrices[0].reshape(3, 4)
    R, t = pose[:, :3], pose[:, 3]
    link = link._replace(places=link.places @ R.T + t, points=link.points @ R.T + t)
    doubt = link.doubt + error + other.doubt if sound else np.inf
    for inner, outer in ((link, other), (other, link)):
        if outer.surface is None:
            continue
        for shell, place in product(outer.surface.shells, inner.places):
            if may_contain(outer.points, shell.triangles, shell.wound, place, doubt):
                return place
    return None


def _probe(detail: Detail, solids: Solids, side: int, solid: int) -> _Probe:
    surface = detail.surfaces[side][solid]
    if surface is None:
        point = solids.vertices[:, solids.ranges[solid, FIRST]][None]
        return _Probe(point, float(solids.size[solid, BALL]), point, None)
    points, ball, _ = surface.placed
    closed = surface if surface.is_watertight else None
    return _Probe(points[surface.pieces], ball, points, closed)


def _give_up(leaves: np.ndarray, body: int, obstacle: int, place: np.ndarray) -> None:
    leaves['status'] = SUSPECT
    leaves['reason'] = BY_ENCLOSURE
    leaves['body'], leaves['obstacle'] = body, obstacle
    leaves['place'] = place
    leaves['lower'], leaves['upper'] = -np.inf, np.inf
    leaves['witness'] = 0
