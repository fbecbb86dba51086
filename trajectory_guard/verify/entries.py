"""The claims of a certificate as values."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from trajectory_guard.verify.invalid import invalid
from trajectory_guard.verify.numbers import integer, number

# Numbers behind piece, body and obstacle; balls have none, but a list of obstacles.
_NUMBERS = {'balls': 0, 'planes': 4, 'turning': 9, 'collisions': 6}


class Entry(NamedTuple):
    """
    One claim about a body and an obstacle during a piece.

    :param kind: list of the certificate it comes from.
    :param row: its place there.
    :param numbers: what proves it.
    """

    kind: str
    row: int
    piece: int
    body: int
    obstacle: int
    numbers: tuple[float, ...]


def entries(certificate: Mapping[str, Any]) -> list[Entry]:
    """
    Return every claim of a certificate, those of one piece together; indices are in range.

    :param certificate: one of the right shape.
    """
    pieces = len(certificate['pieces'])
    bodies = len(certificate['robot']['links'])
    obstacles = len(certificate['scene']['obstacles'])
    found, seen = [], set()
    for kind, size in _NUMBERS.items():
        for i, row in enumerate(certificate[kind]):
            where = f'{kind}[{i}]'
            if len(row) != 3 + size:
                raise invalid(f'{where}: has {len(row)} values, not {3 + size}')
            piece = integer(row[0], f'{where}, piece', pieces - 1)
            body = integer(row[1], f'{where}, body', bodies - 1)
            numbers = tuple(number(x, where) for x in row[3:])
            if size == 0 and not isinstance(row[2], list):
                raise invalid(f'{where}, obstacles: {row[2]!r:.40} is no list')
            for value in [row[2]] if size else row[2]:
                obstacle = integer(value, f'{where}, obstacle', obstacles - 1)
                if (key := (kind, piece, body, obstacle)) in seen:
                    raise invalid(f'{where}: a second one of {list(key[1:])}')
                seen.add(key)
                found.append(Entry(kind, i, piece, body, obstacle, numbers))
    return sorted(found, key=lambda entry: certificate['pieces'][entry.piece])
