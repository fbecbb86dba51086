"""Cover a path on the hulls, and again with parts of what the hulls could not decide."""

from collections.abc import Sequence
import time
from typing import NamedTuple

import numpy as np

from trajectory_guard.cell.detail import Detail, Level
from trajectory_guard.kernels.cover import cover_all, Covered, Question
from trajectory_guard.kernels.layout import BY_BUDGET, BY_HULL, BY_STOP
from trajectory_guard.settings import Settings


class Seen(NamedTuple):
    """
    What a cover found.

    :param covered: of the last cover; its time includes the earlier ones and the parts built.
    :param level: the solids that it names.
    """

    covered: Covered
    level: Level


def cover_refined(
    detail: Detail, questions: Sequence[Question], settings: Settings, stop: np.ndarray
) -> list[Seen | None]:
    """
    Cover paths, with parts of the solids built where an answer needs them.

    :param detail: the solids.
    :param questions: what to cover.
    :param settings: what is asked; the budget is one for all covers of a path.
    :param stop: (1,) int64; another thread sets it non-zero to have the rest given up.
    :returns: what was found of each path; None if it is out of range.
    """
    level = detail.level
    found = _cover(level, questions, settings, settings.max_pieces, stop)
    return [
        covered and _refined(detail, question, Seen(covered, level), settings, stop)
        for question, covered in zip(questions, found, strict=True)
    ]


def _cover(
    level: Level, questions: Sequence[Question], settings: Settings, pieces: int, stop: np.ndarray
) -> list[Covered | None]:
    return cover_all(
        level.packed,
        questions,
        settings.tolerance,
        settings.clearance,
        pieces,
        settings.scope,
        settings.want_certificate,
        stop,
        sharpen=settings.refine,
    )


def _refined(
    detail: Detail, question: Question, seen: Seen, settings: Settings, stop: np.ndarray
) -> Seen:
    """Build what is wanted and cover again, until nothing is, or time or budget are spent."""
    covered, level = seen
    if not len(covered.wanted):
        return seen
    begin, left = time.perf_counter(), settings.max_pieces - covered.pieces
    seconds = covered.seconds
    while len(covered.wanted) and left > 0 and not stop[0]:
        level = detail.refine(covered.wanted, stop)
        if stop[0]:
            break
        (again,) = _cover(level, [question], settings, left, stop)
        if again is None:
            break
        left -= again.pieces
        covered, seen = again, Seen(again, level)
    if len(covered.wanted):
        leaves = covered.leaves.copy()
        leaves['reason'][leaves['reason'] == BY_HULL] = BY_STOP if stop[0] else BY_BUDGET
        covered = covered._replace(leaves=leaves)
    seconds += time.perf_counter() - begin
    return Seen(covered._replace(seconds=seconds), seen.level)
