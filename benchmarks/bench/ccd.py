"""Continuous collision queries with exact coordinates and known answers, from CSV files."""

from collections.abc import Iterator
import csv
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from trajectory_guard.canny import LinearKind

KINDS = {'vertex-face': LinearKind.VERTEX_FACE, 'edge-edge': LinearKind.EDGE_EDGE}
ROWS = 8  # lines of a query: four points at the start, four at the end
COLUMNS = 7  # numerator and denominator of x, y and z, and the answer


class BadFile(ValueError):
    """A file is not what it should be; the message names file, line and value."""


@dataclass(frozen=True)
class Queries:
    """
    The queries of one file.

    :param name: of the set, the folder that holds the kinds.
    :param kind: which features.
    :param points: (n, 8, 3), exact.
    :param collide: (n,) bool, the known answers.
    """

    name: str
    kind: LinearKind
    points: np.ndarray
    collide: np.ndarray


def load(folder: Path) -> list[Queries]:
    """
    Read all files SET/vertex-face/*.csv and SET/edge-edge/*.csv of a folder.

    :raises BadFile: there is none, or one cannot be read.
    """
    paths = [path for kind in KINDS for path in sorted(folder.glob(f'*/{kind}/*.csv'))]
    if not paths:
        raise BadFile(f'{folder}: no files SET/vertex-face/*.csv or SET/edge-edge/*.csv')
    return [read(path) for path in sorted(paths)]


def read(path: Path) -> Queries:
    """Read one file."""
    with path.open(newline='', encoding='utf-8') as lines:
        rows = [point(path, n, row) for n, row in enumerate(csv.reader(lines), 1)]
    if len(rows) % ROWS:
        raise BadFile(f'{path}: {len(rows)} lines are not {ROWS} for each query')
    answers = [
        answer(path, n, [collide for _, collide in rows[n : n + ROWS]])
        for n in range(0, len(rows), ROWS)
    ]
    points = np.array([x for x, _ in rows], dtype=np.float64).reshape(-1, ROWS, 3)
    return Queries(
        path.parent.parent.name, KINDS[path.parent.name], points, np.array(answers, dtype=bool)
    )


def point(path: Path, n: int, row: list[str]) -> tuple[list[float], bool]:
    """Return the point and the answer of a line."""
    if len(row) != COLUMNS:
        raise BadFile(f'{path}:{n}: {len(row)} columns, not {COLUMNS}')
    if row[-1] not in ('0', '1'):
        raise BadFile(f'{path}:{n}: the answer is {row[-1]!r}, not 0 or 1')
    return [coordinate(path, n, *pair) for pair in pairs(row)], row[-1] == '1'


def pairs(row: list[str]) -> Iterator[tuple[str, str]]:
    """Yield numerators and denominators."""
    return zip(row[:-1:2], row[1:-1:2], strict=True)


def coordinate(path: Path, n: int, numerator: str, denominator: str) -> float:
    """Return a fraction that is a double."""
    try:
        exact = Fraction(int(numerator), int(denominator))
        rounded = float(exact)
    except (ValueError, ZeroDivisionError, OverflowError):
        raise BadFile(f'{path}:{n}: {numerator}/{denominator} is no number') from None
    if Fraction(rounded) != exact:
        raise BadFile(f'{path}:{n}: {numerator}/{denominator} is no double')
    return rounded


def answer(path: Path, n: int, collide: list[bool]) -> bool:
    """Return what the lines of one query say."""
    if len(set(collide)) > 1:
        raise BadFile(f'{path}:{n + 1}: the lines of one query give different answers')
    return collide[0]
