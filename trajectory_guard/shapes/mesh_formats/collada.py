"""COLLADA (DAE): the triangles of the scene, in metres."""

from collections.abc import Iterator
import math
from xml.etree import ElementTree

import numpy as np

from trajectory_guard.shapes.body import U
from trajectory_guard.shapes.mesh_formats.triangles import fans, Triangles

# A scene deeper than this is a node that instances itself.
DEEPEST_NODE = 256

# Children of a node or of a mesh that carry no surface.
NO_SURFACE = frozenset(
    ('asset', 'extra', 'instance_camera', 'instance_light', 'source', 'vertices', 'lines')
    + ('linestrips',)
)


def read_collada(content: bytes) -> Triangles:
    """
    Read what the file's scene instances, and scale it by the file's unit.

    The up axis is not applied: in robot descriptions meshes are drawn in the axes of the file.

    :raises ValueError: the XML is broken, a reference leads nowhere, or the scene holds a surface
        that is not understood (skins, splines, polygons with holes).
    """
    try:
        root = ElementTree.fromstring(content)
    except ElementTree.ParseError as error:
        raise ValueError(f'broken XML: {error}') from error
    for element in root.iter():
        element.tag = element.tag.rpartition('}')[2]
    return _Reader(root).read()


class _Reader:
    """The elements by id, and the pieces found so far."""

    def __init__(self, root: ElementTree.Element) -> None:
        self.root = root
        self.by_id: dict[tuple[str, str], list[ElementTree.Element]] = {}
        for element in root.iter():
            self.by_id.setdefault((element.tag, element.get('id', '')), []).append(element)
        self.points: list[np.ndarray] = []
        self.triangles: list[np.ndarray] = []
        self.rounding = 0.0

    def read(self) -> Triangles:
        unit = self.root.find('asset/unit')
        meter = float(unit.get('meter', '1')) if unit is not None else 1.0
        if not 0.0 < meter < math.inf:
            raise ValueError(f'unit of {meter} m')
        scene = self.root.find('scene/instance_visual_scene')
        if scene is None:
            raise ValueError('the file has no scene')
        scale = np.diag([meter, meter, meter, 1.0])
        for node in self._target(scene, 'visual_scene'):
            if node.tag == 'node':
                self._add_node(node, scale, scale, 1)
        if not self.points:
            raise ValueError('the scene of the file has no triangles')
        offsets = np.cumsum([0] + [len(points) for points in self.points])
        return Triangles(
            np.concatenate(self.points),
            np.concatenate([t + o for t, o in zip(self.triangles, offsets, strict=False)]),
            self.rounding,
        )

    def _add_node(
        self, node: ElementTree.Element, T: np.ndarray, size: np.ndarray, depth: int
    ) -> None:
        """
        Add what hangs below a node.

        :param T: computed product of the transforms above.
        :param size: the same product of bounds on the entries' absolute values. A product of two
            matrices errs by 4 U of it and a rotation's own entries by 30 U, entry by entry, so
            that a point errs by sqrt(3) * 34 U < 64 U for each factor.
        :param depth: number of factors, or more.
        """
        if depth > DEEPEST_NODE:
            raise ValueError('nodes are nested too deep, or in themselves')
        for child in node:
            if child.tag in TRANSFORMS:
                matrix = TRANSFORMS[child.tag](_floats(child))
                # The cosine of a right angle is 0, give or take more than its computed value.
                entries = (matrix != 0.0) if child.tag == 'rotate' else np.abs(matrix)
                T, size, depth = T @ matrix, size @ np.maximum(entries, np.abs(matrix)), depth + 1
            elif child.tag == 'node':
                self._add_node(child, T, size, depth + 1)
            elif child.tag == 'instance_node':
                self._add_node(self._target(child, 'node'), T, size, depth + 1)
            elif child.tag == 'instance_geometry':
                points, triangles = self._mesh(self._target(child, 'geometry'))
                self.points.append(points @ T[:3, :3].T + T[:3, 3])
                self.triangles.append(triangles)
                reach = np.append(np.abs(points).max(axis=0, initial=0.0), 1.0)
                error = 64.0 * U * (depth + 1) * float((size @ reach)[:3].max())
                self.rounding = max(self.rounding, error)
            elif child.tag not in NO_SURFACE:
                raise ValueError(f'node {node.get("id")!r}: {child.tag} is not supported')

    def _target(self, instance: ElementTree.Element, tag: str) -> ElementTree.Element:
        url = instance.get('url', instance.get('source', ''))
        targets = self.by_id.get((tag, url[1:]), []) if url.startswith('#') else []
        if len(targets) != 1:
            raise ValueError(f'{instance.tag} {url!r} names {len(targets)} {tag} of this file')
        return targets[0]

    def _mesh(self, geometry: ElementTree.Element) -> tuple[np.ndarray, np.ndarray]:
        mesh = geometry.find('mesh')
        if mesh is None:
            raise ValueError(f'geometry {geometry.get("id")!r} is not a mesh')
        points: list[np.ndarray] = [np.empty((0, 3))]
        triangles: list[np.ndarray] = [np.empty((0, 3), dtype=np.int64)]
        count = 0
        for primitive in mesh:
            if primitive.tag in NO_SURFACE:
                continue
            if primitive.tag not in POLYGONS:
                raise ValueError(f'{primitive.tag} is not supported')
            inputs = primitive.findall('input')
            stride = 1 + max((int(i.get('offset', '0')) for i in inputs), default=0)
            vertex = next((i for i in inputs if i.get('semantic') == 'VERTEX'), None)
            if vertex is None:
                raise ValueError(f'{primitive.tag} has no VERTEX input')
            rows = [
                _integers(p, stride)[:, int(vertex.get('offset', '0'))]
                for p in primitive.findall('p')
            ]
            corners = fans(POLYGONS[primitive.tag](primitive, rows))
            positions = self._positions(vertex)
            if len(corners) and not 0 <= corners.min() <= corners.max() < len(positions):
                raise ValueError(f'{primitive.tag} names a vertex outside 0..{len(positions) - 1}')
            points.append(positions)
            triangles.append(corners + count)
            count += len(positions)
        return np.concatenate(points), np.concatenate(triangles)

    def _positions(self, vertex: ElementTree.Element) -> np.ndarray:
        position = self._target(vertex, 'vertices').find("input[@semantic='POSITION']")
        if position is None:
            raise ValueError('vertices without POSITION')
        source = self._target(position, 'source')
        accessor, array = source.find('technique_common/accessor'), source.find('float_array')
        if accessor is None or array is None:
            raise ValueError(f'source {source.get("id")!r} has no accessor or no float_array')
        values = _floats(array)
        names = [param.get('name', axis) for param, axis in zip(accessor, 'XYZ', strict=False)]
        count, stride, offset = (
            int(accessor.get(name, default))
            for name, default in (('count', '0'), ('stride', '1'), ('offset', '0'))
        )
        if names != ['X', 'Y', 'Z'] or stride < 3 or min(count, offset) < 0:
            raise ValueError(f'positions of {names} with stride {stride}')
        if len(values) < offset + count * stride or len(values) != int(array.get('count', '-1')):
            raise ValueError(f'source {source.get("id")!r} does not hold the numbers it announces')
        return values[offset : offset + count * stride].reshape(count, stride)[:, :3]


def _floats(element: ElementTree.Element) -> np.ndarray:
    values = np.array((element.text or '').split(), dtype=np.float64)
    if not np.isfinite(values).all():
        raise ValueError(f'{element.tag} holds a number that is not finite')
    return values


def _integers(element: ElementTree.Element, stride: int) -> np.ndarray:
    values = np.array((element.text or '').split(), dtype=np.int64)
    if len(values) % stride:
        raise ValueError(f'{len(values)} indices do not fill rows of {stride}')
    return values.reshape(-1, stride)


def _matrix(values: np.ndarray) -> np.ndarray:
    if values.shape != (16,) or not (values[12:] == (0.0, 0.0, 0.0, 1.0)).all():
        raise ValueError(f'matrix {values.tolist()}')
    return values.reshape(4, 4)


def _translate(values: np.ndarray) -> np.ndarray:
    T = np.eye(4)
    T[:3, 3] = _three(values)
    return T


def _scale(values: np.ndarray) -> np.ndarray:
    return np.diag([*_three(values), 1.0])


def _rotate(values: np.ndarray) -> np.ndarray:
    """Return the rotation by an angle [deg] about an axis (Rodrigues)."""
    if values.shape != (4,) or not np.linalg.norm(values[:3]) > 0.0:
        raise ValueError(f'rotate {values.tolist()}')
    x, y, z = values[:3] / np.linalg.norm(values[:3])
    angle = math.radians(math.fmod(values[3], 360.0))
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    T = np.eye(4)
    T[:3, :3] += math.sin(angle) * K + (1.0 - math.cos(angle)) * (K @ K)
    return T


def _three(values: np.ndarray) -> np.ndarray:
    if values.shape != (3,):
        raise ValueError(f'expected three numbers, got {values.tolist()}')
    return values


TRANSFORMS = {'matrix': _matrix, 'translate': _translate, 'rotate': _rotate, 'scale': _scale}


def _of_triangles(primitive: ElementTree.Element, rows: list[np.ndarray]) -> Iterator[list[int]]:
    _check_count(primitive, sum(len(row) for row in rows), 3)
    for row in rows:
        yield from row.reshape(-1, 3).tolist()


def _of_polylist(primitive: ElementTree.Element, rows: list[np.ndarray]) -> Iterator[list[int]]:
    counts = primitive.find('vcount')
    sizes = np.array((counts.text or '').split() if counts is not None else [], dtype=np.int64)
    flat = [index for row in rows for index in row.tolist()]
    _check_count(primitive, len(sizes), 1)
    if sizes.sum() != len(flat):
        raise ValueError(f'polylist: vcount adds up to {sizes.sum()}, p holds {len(flat)}')
    ends = np.cumsum(sizes).tolist()
    yield from (flat[end - size : end] for size, end in zip(sizes.tolist(), ends, strict=True))


def _of_polygons(primitive: ElementTree.Element, rows: list[np.ndarray]) -> Iterator[list[int]]:
    if primitive.find('ph') is not None:
        raise ValueError('polygons with holes are not supported')
    _check_count(primitive, len(rows), 1)
    yield from (row.tolist() for row in rows)


def _of_strips(primitive: ElementTree.Element, rows: list[np.ndarray]) -> Iterator[list[int]]:
    """Yield the triangles of strips, every second one turned."""
    _check_count(primitive, len(rows), 1)
    for row in rows:
        for k, (a, b, c) in enumerate(zip(row, row[1:], row[2:], strict=False)):
            yield [int(b), int(a), int(c)] if k % 2 else [int(a), int(b), int(c)]


def _check_count(primitive: ElementTree.Element, found: int, corners: int) -> None:
    announced = int(primitive.get('count', '-1'))
    if found != announced * corners:
        raise ValueError(f'{primitive.tag}: announces {announced}, holds {found / corners:g}')


POLYGONS = {
    'triangles': _of_triangles,
    'polylist': _of_polylist,
    'polygons': _of_polygons,
    'trifans': _of_polygons,
    'tristrips': _of_strips,
}
