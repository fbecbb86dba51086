"""STL, binary and text."""

import numpy as np

from trajectory_guard.shapes.mesh_formats.triangles import Triangles

HEADER = 80
COUNT = np.dtype('<u4')
FACET = np.dtype([('normal', '<f4', 3), ('corners', '<f4', (3, 3)), ('attribute', '<u2')])

# The lines of one facet; a text file is a number of these between solid and endsolid.
FACET_LINES = ('facet', 'outer', 'vertex', 'vertex', 'vertex', 'endloop', 'endfacet')


def read_stl(content: bytes) -> Triangles:
    """
    Read an STL file.

    A file whose length fits its binary header is binary, whatever its first word: many binary
    files begin with `solid`.

    :raises ValueError: neither binary nor text, or not complete.
    """
    start = HEADER + COUNT.itemsize
    if len(content) >= start:
        count = int(np.frombuffer(content, COUNT, 1, HEADER)[0])
        if len(content) == start + count * FACET.itemsize:
            corners = np.frombuffer(content, FACET, count, start)['corners']
            return _soup(corners.reshape(-1, 3))
    if content.lstrip()[:5].lower() != b'solid':
        raise ValueError(f'neither text nor a binary STL of {len(content)} bytes')
    return _soup(_text_corners(content))


def _soup(corners: np.ndarray) -> Triangles:
    return Triangles(corners.astype(np.float64), np.arange(len(corners)).reshape(-1, 3))


def _text_corners(content: bytes) -> np.ndarray:
    corners: list[list[float]] = []
    expected = 0
    closed = True
    for number, line in enumerate(content.decode('utf-8', 'replace').splitlines(), 1):
        words = line.split()
        word = words[0].lower() if words else ''
        if not words:
            continue
        if word in ('solid', 'endsolid') and expected == 0 and closed == (word == 'solid'):
            closed = not closed
        elif not closed and word == FACET_LINES[expected]:
            if word == 'vertex':
                if len(words) != 4:
                    raise ValueError(f'line {number}: expected three coordinates: {line!r}')
                corners.append([float(value) for value in words[1:]])
            expected = (expected + 1) % len(FACET_LINES)
        else:
            raise ValueError(f'line {number}: unexpected {line.strip()[:60]!r}')
    if not closed:
        raise ValueError('the file ends inside a solid')
    return np.array(corners, dtype=np.float64).reshape(-1, 3)
