"""Mesh readers return the whole surface or raise; an independent writer makes the files."""

from collections.abc import Callable
from itertools import product
import struct

import numpy as np
import pytest
import trimesh

from trajectory_guard.shapes.mesh_formats import (
    read_collada,
    read_obj,
    read_ply,
    read_stl,
    READERS,
)
from trajectory_guard.shapes.mesh_formats.triangles import fans, Triangles

Reader = Callable[[bytes], Triangles]
SPHERE = trimesh.creation.icosphere(subdivisions=1)

# A tetrahedron whose coordinates are exact in single precision and in decimals.
POINTS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, -0.25]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])

OBJ = """# comment
mtllib none.mtl
o part
v 0 0 0
v 1 0 0 # to the right
v 0 0.5 0 1.0
v 0 0 -0.25 0.1 0.2 0.3
vt 0 0
vn 0 0 1
usemtl red
s off
f 1 3 2
f 1/1 2/1 4/1
f 2//1 3//1 \\
 4//1
f -2/1/1 -4/1/1 -1/1/1
"""

PLY = """ply
format ascii 1.0
comment made by hand
obj_info none
element vertex 4
property float x
property uchar red
property float y
property float z
element extra 2
property list int short junk
element face 4
property list uchar int vertex_indices
property float quality
end_header
0 9 0 0
1 9 0 0
0 9 0.5 0
0 9 0 -0.25
3 1 2 3
0
3 0 2 1 0.5
3 0 1 3 0.5
3 1 2 3 0.5
3 2 0 3 0.5
"""

STL = (
    'solid part one\n'
    + '\n'.join(
        'facet normal 0 0 0\nOuter Loop\n'
        + '\n'.join(f'  VERTEX {x} {y} {z}' for x, y, z in POINTS[face])
        + '\nendloop\nendfacet'
        for face in FACES
    )
    + '\nendsolid part one\n'
)

DAE = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><unit name="x" meter="{unit}"/><up_axis>Y_UP</up_axis></asset>
  <library_geometries><geometry id="g"><mesh>
    <source id="s"><float_array id="a" count="12">0 0 0 1 0 0 0 0.5 0 0 0 -0.25</float_array>
      <technique_common><accessor source="#a" count="4" stride="3">
        <param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
      </accessor></technique_common></source>
    <vertices id="v"><input semantic="POSITION" source="#s"/></vertices>
    <lines count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1</p></lines>
    {primitives}
  </mesh></geometry></library_geometries>
  <library_nodes><node id="n">{node}<instance_geometry url="#g"/></node></library_nodes>
  <library_visual_scenes><visual_scene id="vs">
    <node><instance_camera url="#c"/></node><node>{scene}</node>
  </visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#vs"/></scene>
</COLLADA>
"""
INPUT = '<input semantic="VERTEX" source="#v" offset="1"/><input semantic="NORMAL" offset="0"/>'
TRIANGLES = (
    f'<triangles count="4">{INPUT}<p>9 0 9 2 9 1 9 0 9 1 9 3 9 1 9 2 9 3 '
    '9 2 9 0 9 3</p></triangles>'
)


def collada(**parts: str) -> bytes:
    values = {
        'unit': '1',
        'primitives': TRIANGLES,
        'node': '',
        'scene': '<instance_node url="#n"/>',
        **parts,
    }
    return DAE.format(**values).encode()


def corners(mesh: Triangles) -> np.ndarray:
    """Return the corners of all triangles as sorted rows, (3 m, 3)."""
    rows = mesh.points[mesh.triangles].reshape(-1, 3) + 0.0
    return rows[np.lexsort(rows.T)]


def assert_is_tetrahedron(mesh: Triangles, points: np.ndarray = POINTS) -> None:
    assert np.array_equal(corners(mesh), corners(Triangles(points, FACES)))


@pytest.mark.parametrize(
    ('suffix', 'options'),
    [
        ('.stl', {'file_type': 'stl'}),
        ('.stl', {'file_type': 'stl_ascii'}),
        ('.obj', {'file_type': 'obj', 'digits': 17}),
        ('.ply', {'file_type': 'ply', 'encoding': 'binary'}),
        ('.ply', {'file_type': 'ply', 'encoding': 'ascii'}),
    ],
)
def test_reads_what_another_program_writes(suffix: str, options: dict) -> None:
    content = SPHERE.export(**options)
    mesh = READERS[suffix](content.encode() if isinstance(content, str) else content)
    expected = corners(Triangles(SPHERE.vertices, SPHERE.faces))
    assert np.abs(corners(mesh) - expected).max() < 1e-6
    assert len(mesh.triangles) == len(SPHERE.faces)


@pytest.mark.parametrize('end', ['\n', '\r\n'])
def test_every_line_of_the_text_formats_counts(end: str) -> None:
    assert_is_tetrahedron(read_obj(OBJ.replace('\n', end).encode()))
    assert_is_tetrahedron(read_ply(PLY.replace('\n', end).encode()))
    assert_is_tetrahedron(read_stl(STL.replace('\n', end).encode()))
    assert_is_tetrahedron(read_collada(collada()))


def test_polygons_of_any_size() -> None:
    quad = read_obj(b'v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 9 9 9\nf 1 2 3 4\nf 3 2 1\n')
    assert len(quad.triangles) == 3
    assert quad.points.max() == 1.0  # The vertex that no face uses is no part of the surface.
    assert fans([[4, 5, 6, 7, 8]]).tolist() == [[4, 5, 6], [4, 6, 7], [4, 7, 8]]


def binary_ply(order: str, lists: list[tuple[int, ...]]) -> bytes:
    name = {'<': 'little', '>': 'big'}[order]
    header = (
        f'ply\nformat binary_{name}_endian 1.0\nelement vertex 4\nproperty double x\n'
        f'property double y\nproperty short flag\nproperty double z\n'
        f'element face {len(lists)}\nproperty uchar tag\nproperty list ushort uint vertex_index\n'
        'end_header\n'
    )
    rows = b''.join(struct.pack(order + 'ddhd', x, y, -1, z) for x, y, z in POINTS)
    faces = b''.join(struct.pack(f'{order}BH{len(f)}I', 7, len(f), *f) for f in lists)
    return header.encode() + rows + faces


@pytest.mark.parametrize('order', ['<', '>'])
def test_binary_ply_of_either_byte_order(order: str) -> None:
    assert_is_tetrahedron(read_ply(binary_ply(order, [tuple(face) for face in FACES.tolist()])))
    ragged = read_ply(binary_ply(order, [(0, 2, 1), (0, 1, 3, 2), (1, 2, 3)]))
    assert ragged.triangles.tolist() == [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]


BINARIES = [SPHERE.export(file_type='stl')[: 84 + 50 * 4], binary_ply('<', [(0, 1, 2), (0, 1, 3)])]
BINARIES[0] = BINARIES[0][:80] + struct.pack('<I', 4) + BINARIES[0][84:]


@pytest.mark.parametrize(('content', 'read'), [(BINARIES[0], read_stl), (BINARIES[1], read_ply)])
def test_no_part_of_a_binary_file_is_a_file(content: bytes, read: Reader) -> None:
    read(content)
    for end in range(len(content)):
        with pytest.raises(ValueError, match=r'.'):
            read(content[:end])
    with pytest.raises(ValueError, match='bytes'):
        read(content + b'\0')


@pytest.mark.parametrize(
    ('text', 'read'),
    [(STL, read_stl), (PLY, read_ply), (collada().decode(), read_collada)],
    ids=['stl', 'ply', 'dae'],
)
def test_no_part_of_a_text_file_is_a_file(text: str, read: Reader) -> None:
    lines = text.rstrip().splitlines()
    read('\n'.join(lines).encode())
    for end in range(len(lines)):
        with pytest.raises(ValueError, match=r'.'):
            read('\n'.join(lines[:end]).encode())


@pytest.mark.parametrize(('old', 'new'), [('-0.25', 'nan'), ('0.5', '0.5x'), ('0.5', '1e999')])
@pytest.mark.parametrize(
    ('text', 'read'),
    [(STL, read_stl), (PLY, read_ply), (OBJ, read_obj), (collada().decode(), read_collada)],
    ids=['stl', 'ply', 'obj', 'dae'],
)
def test_broken_numbers_are_refused(text: str, read: Reader, old: str, new: str) -> None:
    with pytest.raises(ValueError, match=r'finite|could not convert'):
        read(text.replace(old, new).encode())


@pytest.mark.parametrize(
    ('read', 'content', 'named'),
    [
        (read_stl, b'', '0 bytes'),
        (read_stl, b'solid\nendsolid\n', 'no triangles'),
        (read_stl, b'solid\nvertex 0 0 0\nendsolid\n', 'line 2'),
        (read_stl, b'solid\nendsolid\nfacet normal 0 0 0\n', 'line 3'),
        (read_stl, STL.encode() * 2 + b'solid\n', 'inside a solid'),
        (read_obj, b'v 0 0 0\nv 1 0 0\nv 0 1 0\n', 'no triangles'),
        (read_obj, b'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n', 'vertex 4 of 3'),
        (read_obj, b'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0\n', 'vertex 0 of 3'),
        (read_obj, b'v 0 0 0\nf -1 -1 -2\n', 'vertex -2 of 1'),
        (read_obj, b'v 0 0 0\nv 1 0 0\nf 1 2\n', '2 corners'),
        (read_obj, b'v 0 0\n', '2 numbers'),
        (read_obj, b'v 0 0 0 2\n', 'weight 2'),
        (read_obj, b'curv 0 1\n', "'curv 0 1'"),
        (read_ply, b'solid\n', 'header'),
        (read_ply, PLY.replace('1.0', '2.0').encode(), 'format ascii 2.0'),
        (read_ply, PLY.replace('float z', 'half z').encode(), 'half'),
        (read_ply, PLY.replace('float z', 'float w').encode(), 'no x, y, z'),
        (read_ply, PLY.replace('vertex_indices', 'corners').encode(), 'corners'),
        (read_ply, PLY.replace('element face', 'element tristrips').encode(), 'tristrips'),
        (read_ply, (PLY + '1').encode(), '1 values after'),
        (read_ply, PLY.replace('3 0 2 1', '3 0 2 4').encode(), 'outside'),
        (read_collada, collada(unit='0'), 'unit'),
        (read_collada, collada().replace(b'<node>', b'<node id="n">'), "names 3 node"),
        (read_collada, collada(scene=''), 'no triangles'),
        (read_collada, collada(scene='<instance_node url="#g"/>'), 'names 0 node'),
        (read_collada, collada(scene='<instance_node url="other.dae#n"/>'), 'other.dae'),
        (read_collada, collada(scene='<instance_controller url="#g"/>'), 'controller'),
        (read_collada, collada(node='<instance_node url="#n"/>'), 'deep'),
        (read_collada, collada(node='<matrix>1 2 3</matrix>'), 'matrix'),
        (read_collada, collada(node='<lookat>1 2 3</lookat>'), 'lookat'),
        (read_collada, collada(node='<rotate>0 0 0 5</rotate>'), 'rotate'),
        (read_collada, collada(node='<scale>1 2</scale>'), 'three numbers'),
        (read_collada, collada(primitives='<spline/>'), 'spline'),
        (read_collada, collada(primitives=TRIANGLES.replace('"4"', '"5"')), 'announces 5'),
        (read_collada, collada(primitives=TRIANGLES.replace('9 3<', '9 4<')), 'outside'),
        (read_collada, collada(primitives=TRIANGLES.replace('9 3<', '9<')), 'fill rows'),
        (read_collada, collada(primitives=TRIANGLES.replace('VERTEX', 'COLOR')), 'no VERTEX'),
        (read_collada, collada().replace(b'count="12"', b'count="15"'), 'announces'),
        (read_collada, collada().replace(b'name="Z"', b'name="W"'), 'W'),
        (read_collada, collada().replace(b'<scene>', b'<extra>').replace(b'</scene>', b'</extra>'),
         'no scene'),
    ],
)  # fmt: skip
def test_what_is_not_understood_is_refused(read: Reader, content: bytes, named: str) -> None:
    with pytest.raises(ValueError, match=named):
        read(content)


@pytest.mark.parametrize(
    'primitives',
    [
        (
            f'<polylist count="4">{INPUT}<vcount>3 3 3 3</vcount>'
            '<p>0 0 0 2 0 1 0 0 0 1 0 3 0 1 0 2 0 3 0 2 0 0 0 3</p></polylist>'
        ),
        (
            f'<polygons count="4">{INPUT}<p>0 0 0 2 0 1</p><p>0 0 0 1 0 3</p><p>0 1 0 2 0 3</p>'
            '<p>0 2 0 0 0 3</p></polygons>'
        ),
        f'<tristrips count="1">{INPUT}<p>0 1 0 0 0 2 0 3 0 1 0 0</p></tristrips>',
        f'<trifans count="2">{INPUT}<p>0 3 0 0 0 1 0 2 0 0</p><p>0 0 0 2 0 1</p></trifans>',
    ],
    ids=['polylist', 'polygons', 'tristrips', 'trifans'],
)
def test_every_kind_of_collada_polygon(primitives: str) -> None:
    mesh = read_collada(collada(primitives=primitives))
    assert_is_tetrahedron(mesh)
    edges = mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).tolist()
    assert sorted(edges) == sorted(edge[::-1] for edge in edges)


def test_collada_nodes_are_multiplied_in_order_and_scaled_by_the_unit() -> None:
    mesh = read_collada(
        collada(
            unit='0.01',
            scene='<translate>10 0 0</translate><rotate>0 0 2 90</rotate>'
            '<node><scale>2 2 -3</scale><instance_node url="#n"/></node>',
            node='<matrix>1 0 0 5  0 1 0 0  0 0 1 0  0 0 0 1</matrix>',
        )
    )
    x, y, z = POINTS.T
    expected = np.column_stack((10 - 2 * y, 2 * (x + 5), -3 * z)) * 0.01
    rows = mesh.points[np.lexsort(mesh.points.T)]
    error = np.abs(rows - expected[np.lexsort(expected.T)]).max()
    assert error <= mesh.rounding < 1e-13


def test_collada_draws_each_instance() -> None:
    twice = '<instance_node url="#n"/><translate>5 0 0</translate><instance_geometry url="#g"/>'
    mesh = read_collada(collada(scene=twice))
    assert len(mesh.triangles) == 8
    assert sorted(set(mesh.points[:, 0])) == [0.0, 1.0, 5.0, 6.0]


def test_binary_stl_may_begin_like_a_text() -> None:
    content = bytearray(SPHERE.export(file_type='stl'))
    content[:5] = b'solid'
    assert len(read_stl(bytes(content)).triangles) == len(SPHERE.faces)


@pytest.mark.parametrize(('row', 'column'), [*product(range(2), range(3))])
def test_triangles_refuse_what_is_not_finite(row: int, column: int) -> None:
    points = POINTS.copy()
    points[row, column] = np.inf
    with pytest.raises(ValueError, match='not finite'):
        Triangles(points, FACES)
