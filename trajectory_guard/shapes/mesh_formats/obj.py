"""Wavefront OBJ: polygons; free-form surfaces are refused."""

import numpy as np

from trajectory_guard.shapes.mesh_formats.triangles import fans, Triangles

# Statements that carry no surface: looks, groups, names, and points and lines, which have no area.
IGNORED = frozenset(
    ('vt', 'vn', 'g', 'o', 's', 'mg', 'mtllib', 'usemtl', 'usemap', 'maplib', 'l', 'p')
    + ('lod', 'bevel', 'c_interp', 'd_interp', 'shadow_obj', 'trace_obj')
)


def read_obj(content: bytes) -> Triangles:
    """
    Read an OBJ file; texture, normals, colours and groups are ignored.

    :raises ValueError: a statement that would add a surface is not understood, or a number is
        broken; the message names the line.
    """
    points: list[list[float]] = []
    polygons: list[list[int]] = []
    text = content.decode('utf-8', 'replace').replace('\\\r\n', ' ').replace('\\\n', ' ')
    for number, line in enumerate(text.split('\n'), 1):
        words = line.partition('#')[0].split() if '#' in line else line.split()
        if not words or words[0] in IGNORED:
            continue
        try:
            if words[0] == 'v':
                points.append(_point(words[1:]))
            elif words[0] == 'f':
                polygons.append(_polygon(words[1:], len(points)))
            else:
                raise ValueError('unknown statement')
        except ValueError as error:
            raise ValueError(f'line {number}: {line.strip()[:60]!r}: {error}') from error
    return Triangles(np.array(points, dtype=np.float64).reshape(-1, 3), fans(polygons))


def _point(words: list[str]) -> list[float]:
    """Return x y z of `x y z [w]` or, with colours, `x y z r g b [a]`."""
    values = list(map(float, words))
    if len(values) == 3:
        return values
    if len(values) not in (4, 6, 7):
        raise ValueError(f'a vertex with {len(values)} numbers')
    if len(values) == 4 and values[3] != 1.0:
        raise ValueError(f'a vertex with weight {values[3]}')
    return values[:3]


def _polygon(words: list[str], count: int) -> list[int]:
    """Return the positions of the vertices of a face."""
    try:
        indices = [int(word.partition('/')[0]) for word in words]
        if 1 <= min(indices) and max(indices) <= count:
            return [index - 1 for index in indices]
    except ValueError:
        pass  # The first word that is wrong says why.
    return [_index(word, count) for word in words]


def _index(word: str, count: int) -> int:
    """Return the position of a vertex: counted from 1, or back from the latest by a minus."""
    index = int(word.partition('/')[0])
    if not (1 <= index <= count or -count <= index <= -1):
        raise ValueError(f'vertex {index} of {count}')
    return index - 1 if index > 0 else count + index
