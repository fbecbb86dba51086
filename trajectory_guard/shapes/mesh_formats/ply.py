"""Stanford PLY, text and binary."""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from trajectory_guard.shapes.mesh_formats.triangles import fans, Triangles

TYPES = {
    'char': 'i1', 'int8': 'i1', 'uchar': 'u1', 'uint8': 'u1',
    'short': 'i2', 'int16': 'i2', 'ushort': 'u2', 'uint16': 'u2',
    'int': 'i4', 'int32': 'i4', 'uint': 'u4', 'uint32': 'u4',
    'float': 'f4', 'float32': 'f4', 'double': 'f8', 'float64': 'f8',
}  # fmt: skip
BYTE_ORDERS = {'ascii': '', 'binary_little_endian': '<', 'binary_big_endian': '>'}
CORNERS = ('vertex_indices', 'vertex_index')

# The columns of an element: arrays, or lists where the rows differ in length.
Columns = Mapping[str, Sequence | np.ndarray]


class Property(NamedTuple):
    """A column of an element; `length` is the type of a list's length, '' for a single value."""

    name: str
    type: str
    length: str = ''


class Element(NamedTuple):
    """A table of the file."""

    name: str
    rows: int
    properties: list[Property]


def read_ply(content: bytes) -> Triangles:
    """
    Read the vertices and faces of a PLY file; other columns are skipped.

    :raises ValueError: the header is not understood, or the data do not fill it exactly.
    """
    order, elements, start = _header(content)
    known = {element.name for element in elements}
    if 'tristrips' in known or not {'vertex', 'face'} <= known:
        raise ValueError(f'expected elements vertex and face, got {sorted(known)}')
    if order:
        tables = _binary_tables(content, start, order, elements)
    else:
        tables = _text_tables(content[start:], elements)
    columns = dict(tables)
    vertex, face = columns['vertex'], columns['face']
    if not {'x', 'y', 'z'} <= vertex.keys():
        raise ValueError(f'vertex has no x, y, z: {sorted(vertex)}')
    corners = next((face[name] for name in CORNERS if name in face), None)
    if corners is None:
        raise ValueError(f'face has none of {CORNERS}: {sorted(face)}')
    points = np.array([vertex[axis] for axis in 'xyz'], dtype=np.float64).T
    return Triangles(points, fans([int(index) for index in row] for row in corners))


def _header(content: bytes) -> tuple[str, list[Element], int]:
    """Return the byte order ('' for text), the elements and the offset of the data."""
    end = content.find(b'end_header')
    stop = content.find(b'\n', end)
    if not content.startswith(b'ply') or end < 0 or stop < 0:
        raise ValueError('no PLY header')
    order, elements = None, []
    for line in content[:end].decode('ascii', 'replace').splitlines()[1:]:
        match line.split():
            case [] | ['comment' | 'obj_info', *_]:
                pass
            case ['format', name, '1.0'] if name in BYTE_ORDERS:
                order = BYTE_ORDERS[name]
            case ['element', name, rows] if rows.isdecimal():
                elements.append(Element(name, int(rows), []))
            case ['property', type_, name] if elements and type_ in TYPES:
                elements[-1].properties.append(Property(name, TYPES[type_]))
            case ['property', 'list', length, type_, name] if (
                elements and length in TYPES and type_ in TYPES
            ):
                elements[-1].properties.append(Property(name, TYPES[type_], TYPES[length]))
            case _:
                raise ValueError(f'PLY header: {line.strip()[:60]!r}')
    if order is None:
        raise ValueError('the PLY header names no format')
    return order, elements, stop + 1


def _text_tables(content: bytes, elements: list[Element]) -> Iterator[tuple[str, Columns]]:
    words = content.split()
    position = 0

    def take(count: int, type_: str) -> list:
        nonlocal position
        taken = words[position : position + count]
        if count < 0 or len(taken) != count:
            raise ValueError('the PLY data end early')
        position += count
        return [float(word) if type_[0] == 'f' else int(word) for word in taken]

    for element in elements:
        columns: dict[str, list] = {column.name: [] for column in element.properties}
        for _ in range(element.rows):
            for column in element.properties:
                if column.length:
                    values = take(take(1, column.length)[0], column.type)
                    columns[column.name].append(values)
                else:
                    columns[column.name] += take(1, column.type)
        yield element.name, columns
    if position != len(words):
        raise ValueError(f'{len(words) - position} values after the last element')


def _binary_tables(
    content: bytes, start: int, order: str, elements: list[Element]
) -> Iterator[tuple[str, Columns]]:
    for element in elements:
        columns, start = _binary_table(content, start, order, element)
        yield element.name, columns
    if start != len(content):
        raise ValueError(f'{len(content) - start} bytes after the last element')


def _binary_table(content: bytes, start: int, order: str, element: Element) -> tuple[Columns, int]:
    """Return the columns of an element and the offset behind it."""
    names = [column.name for column in element.properties]
    counts = ['#' + column.name for column in element.properties if column.length]
    if not element.rows or not names:
        return {name: [] for name in names}, start
    dtype = _row_dtype(content, start, order, element)
    end = start + element.rows * dtype.itemsize
    if end <= len(content):
        table = np.frombuffer(content, dtype, element.rows, start)
        if all((table[count] == table[count][0]).all() for count in counts):
            return {name: table[name] for name in names}, end
    if not counts:
        raise ValueError('the PLY data end early')
    columns: dict[str, list] = {name: [] for name in names}
    for _ in range(element.rows):
        dtype = _row_dtype(content, start, order, element)
        row = np.frombuffer(content, dtype, 1, start)[0]
        for name in names:
            columns[name].append(row[name])
        start += dtype.itemsize
    return columns, start


def _row_dtype(content: bytes, start: int, order: str, element: Element) -> np.dtype:
    """Return the layout of the row at an offset, its lists as long as they are there."""
    fields: list[tuple] = []
    offset = start
    for column in element.properties:
        if column.length:
            count_type = np.dtype(order + column.length)
            count = int(np.frombuffer(content, count_type, 1, offset)[0])
            if not 0 <= count <= len(content):
                raise ValueError(f'a list of {count} values')
            fields.append(('#' + column.name, count_type))
            fields.append((column.name, order + column.type, (count,)))
            offset += count_type.itemsize + count * np.dtype(column.type).itemsize
        else:
            fields.append((column.name, order + column.type))
            offset += np.dtype(column.type).itemsize
    return np.dtype(fields)
