"""NaN and infinity in any array that a kernel reads: never free, never a crash."""

import math

import numpy as np
import pytest
from random_robot import box_body, Given, link_poses, pose
from scipy.spatial.transform import Rotation

from trajectory_guard.cell.robot import Collision, Joint, JointType, Robot
from trajectory_guard.cell.scene import Obstacle, Scene
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.kernels import layout
from trajectory_guard.kernels.cover import cover, Covered
from trajectory_guard.settings import Scope
from trajectory_guard.shapes.body import ConvexBody

PARTS = ('chain', 'links', 'obstacles', 'boxes', 'extents')
# Lengths are never negative, so only a NaN or a large one is nonsense that can come.
LENGTHS = {('links', 'size'), ('obstacles', 'size')} | {
    (part, field)
    for part, fields in {
        'extents': layout.Extents._fields,
        'path': ('rounding', 'slack'),
    }.items()
    for field in fields
}

# What the inequalities read, by array: columns, or everything. Of the boxes' tree and of the rows
# of a pose a proof may need only some.
EVERYTHING = slice(None)
MOTION = {
    ('path', 'coefficients'): EVERYTHING,
    ('path', 'rounding'): EVERYTHING,
    ('path', 'slack'): EVERYTHING,
    ('extents', 'extent'): EVERYTHING,
    ('extents', 'perpendicular'): EVERYTHING,
    ('extents', 'offsets'): EVERYTHING,
}
READ = {
    'plane': {
        **MOTION,
        ('chain', 'transform'): EVERYTHING,
        ('links', 'size'): [layout.BALL, layout.DISC, layout.CORE],
        ('links', 'place'): range(layout.HALF),
        ('links', 'vertices'): EVERYTHING,
        ('obstacles', 'size'): [layout.BALL, layout.DISC, layout.FAR],
        ('obstacles', 'place'): range(layout.CENTRE),
        ('obstacles', 'vertices'): EVERYTHING,
    },
    'ball': {
        **MOTION,
        ('links', 'size'): [layout.BALL, layout.CORE],
        ('links', 'place'): range(layout.CENTRE, layout.HALF),
    },
}


def solid(size, center=(0.0, 0.0, 0.0)):
    """Return a box with a disc and a ball around it: every term of the inequalities counts."""
    box = box_body(np.array(size), center)
    axis = np.array([0.6, 0.0, 0.8])
    return ConvexBody(box.vertices, 0.003, 0.004, axis, box.faces)


def arm():
    """Return a robot with two turns and a slide between them; its hand is a plate."""
    turned = [Rotation.from_rotvec(v) for v in ([0.3, -0.2, 0.1], [0.1, 0.4, 0.2], [0.2, 0.1, 0])]
    joints = [
        (JointType.REVOLUTE, [0.1, 0.2, 0.3], [0.0, 0.0, 1.0]),
        (JointType.PRISMATIC, [0.05, 0.1, -0.07], [0.6, 0.0, 0.8]),
        (JointType.REVOLUTE, [0.02, -0.05, 0.1], [0.8, 0.6, 0.0]),
    ]
    return Robot(
        'arm',
        'l0',
        tuple(
            Joint(
                f'j{j}',
                kind,
                f'l{j}',
                f'l{j + 1}',
                pose(xyz, turned[j]),
                np.array(axis),
                -math.inf,
                math.inf,
            )
            for j, (kind, xyz, axis) in enumerate(joints)
        ),
        {'l3': (Collision(np.eye(4), Given(solid((1.0, 1.0, 0.1)))),)},
        b'',
    )


def case(distance, speed):
    """Return arrays by name: the plate moves near a wall that is parallel to it at the start."""
    robot = arm()
    wall = solid((2.0, 2.0, 0.1), (0.0, 0.0, -distance)).moved(
        link_poses(robot, np.zeros(3))['l3']
    )
    cell = Workcell(robot, Scene((Obstacle('wall', (wall,)),), ''))
    coefficients = speed * np.array(
        [
            [
                [-0.02, 0.03, 0.01, -0.004, 0.002, 0.001],
                [-0.01, 0.02, 0.01, -0.02, 0.01, 0.003],
                [-0.01, 0.03, -0.01, 0.01, 0.01, -0.003],
            ]
        ]
    )
    path = layout.Path(coefficients, np.full((1, 3), 1e-15), np.full(3, 1e-3))
    chain, links, obstacles, boxes, extents = (
        type(part)(*(np.array(field) for field in part))
        for part in (cell.tree.chain, cell.links, cell.obstacles, *cell.packed._held[3:])
    )
    return {
        'chain': chain,
        'links': links,
        'obstacles': obstacles,
        'boxes': boxes,
        'extents': extents,
        'path': path,
    }


def leaves(parts, packed):
    """
    Return leaves and proof of a case whose arrays may have changed after they were packed.

    A path that the kernels refuse is suspect as a whole.
    """
    try:
        return cover(
            packed,
            parts['path'],
            np.array([0]),
            1e-4,
            1e-3,
            200,
            Scope.ALL,
            True,
            np.zeros(1, np.int64),
        )
    except layout.KernelRefused:
        refused = np.zeros(1, layout.LEAF)
        refused['end'], refused['status'] = 1, layout.SUSPECT
        kinds = (layout.ENTRY, layout.PIECE, layout.OPENED, layout.WANTED)
        return Covered(refused, 0, 0.0, *(np.zeros(0, kind) for kind in kinds))


def spans(rows, status):
    """Return (start, end) in [0, 1] of the leaves of a status."""
    return [
        (row['start'] / 2.0 ** row['level'], row['end'] / 2.0 ** row['level'])
        for row in rows
        if row['status'] == status
    ]


def poisoned(parts, bad):
    """Yield (part, field, index) with that entry replaced in place, one after the other."""
    for part, value in parts.items():
        for field in value._fields:
            array = getattr(value, field)
            if (
                array is None
                or array.dtype != np.float64
                or (bad == -math.inf and (part, field) in LENGTHS)
            ):
                continue
            if math.isinf(bad) and field == 'vertices':  # a corner at infinity is another solid
                continue
            for index in np.ndindex(array.shape):
                good = array[index]
                array[index] = bad
                yield part, field, index
                array[index] = good


def was_read(name, part, field, index):
    """Say whether the proof of a case needs an entry."""
    columns = READ[name].get((part, field), ())
    return columns == EVERYTHING or index[-1] in columns


@pytest.mark.parametrize(
    ('name', 'distance', 'kind'),
    [('plane', 0.3, layout.PLANE_BETWEEN), ('ball', 3.0, layout.BALLS_APART)],
)
def test_a_nan_that_a_proof_reads_undoes_it(name, distance, kind):
    """A free motion, closed by one kind of inequality, is not free with any number of it lost."""
    parts = case(distance, 1.0)
    packed = layout.Packed(*(parts[part] for part in PARTS))
    clean = leaves(parts, packed)
    assert (clean.leaves['status'] == layout.FREE).all()
    assert (clean.entries['kind'] == kind).all()
    count = 0
    for part, field, index in poisoned(parts, math.nan):
        rows = leaves(parts, packed).leaves
        if was_read(name, part, field, index):
            assert not (rows['status'] == layout.FREE).any(), (part, field, index)
            count += 1
    assert count > 30
    np.testing.assert_array_equal(leaves(parts, packed).leaves, clean.leaves)


@pytest.mark.parametrize('bad', [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(('distance', 'speed'), [(0.05, 1.0), (0.2, 12.0)])
def test_nothing_that_is_no_number_frees_a_collision(distance, speed, bad):
    """Whatever single entry is lost, no instant that is proved to collide becomes free."""
    parts = case(distance, speed)
    packed = layout.Packed(*(parts[part] for part in PARTS))
    clean = leaves(parts, packed).leaves
    hits = spans(clean, layout.COLLISION)
    assert hits
    freed = []
    for entry in poisoned(parts, bad):
        rows = leaves(parts, packed).leaves
        assert rows['start'][0] == 0
        assert rows['end'][-1] == 1 << int(rows['level'][-1])
        free = spans(rows, layout.FREE)
        if any(a < end and start < b for a, b in hits for start, end in free):
            freed.append(entry)
    assert not freed
    np.testing.assert_array_equal(leaves(parts, packed).leaves, clean)


@pytest.mark.parametrize('bad', [math.nan, math.inf])
def test_a_whole_array_of_nonsense_is_never_free(bad):
    """Every array filled with what is no number, one array at a time."""
    for distance in (0.05, 0.3):
        parts = case(distance, 1.0)
        packed = layout.Packed(*(parts[part] for part in PARTS))
        for part, field in READ['plane']:
            array = getattr(parts[part], field)
            good = array.copy()
            array[...] = bad
            rows = leaves(parts, packed).leaves
            array[...] = good
            assert not (rows['status'] == layout.FREE).any(), (part, field)


@pytest.mark.parametrize('field', ['faces', 'vertices', 'size'])
def test_no_collision_is_claimed_from_a_nan(field):
    """Where the faces of either solid are lost, nothing is known to be inside."""
    parts = case(0.05, 1.0)
    packed = layout.Packed(*(parts[part] for part in PARTS))
    for part in ('links', 'obstacles'):
        array = getattr(parts[part], field)
        good = array.copy()
        array[...] = math.nan
        rows = leaves(parts, packed).leaves
        array[...] = good
        assert not (rows['status'] == layout.FREE).any()
        if field == 'faces':
            assert not (rows['status'] == layout.COLLISION).any()
