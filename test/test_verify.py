"""Certificates: true ones hold, whoever made them; whatever is changed in one is found."""

import copy
import json
import math

from bench_data import cases, SETTINGS, workcell
from certificate_maker import Maker, sealed
import numpy as np
import pytest
from random_robot import box_body, Given, pose, random_body, random_robot

from trajectory_guard.cell.robot import Collision, Joint, JointType, Robot
from trajectory_guard.cell.scene import load_scene, Obstacle, Scene
from trajectory_guard.cell.urdf import load_robot
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import judge
from trajectory_guard.errors import Reason, TrajectoryGuardError
from trajectory_guard.paths.joint_path import joint_path
from trajectory_guard.paths.trajectory import JointState, Point, Trajectory
from trajectory_guard.settings import Settings
from trajectory_guard.verify import verify
from trajectory_guard.verify.document import text

SECOND = 10**9

ROBOT = """
<robot name="arm">
  <link name="base"><collision><geometry><sphere radius="0.05"/></geometry></collision></link>
  <link name="upper"><collision><origin xyz="0.25 0 0"/>
    <geometry><box size="0.5 0.05 0.05"/></geometry></collision></link>
  <link name="fore"><collision><origin xyz="0.2 0 0"/>
    <geometry><box size="0.4 0.04 0.04"/></geometry></collision></link>
  <joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/>
    <axis xyz="0 0 1"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/>
    <origin xyz="0.5 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
</robot>
"""
# The straight arm meets the post at a shoulder angle of 90 degrees; the wall is near, all the
# rest is far.
SCENE = """
<robot name="scene">
  <link name="world"/>
  <link name="post"><collision><origin xyz="0 0.8 0"/>
    <geometry><box size="0.1 0.1 0.5"/></geometry></collision></link>
  <link name="wall"><collision><origin xyz="0.4 -0.2 0"/>
    <geometry><box size="1 0.1 0.5"/></geometry></collision></link>
  <link name="ball"><collision><origin xyz="0 0 2"/>
    <geometry><sphere radius="0.3"/></geometry></collision></link>
  <link name="pipe"><collision><origin xyz="1.6 0 0"/>
    <geometry><cylinder radius="0.1" length="1"/></geometry></collision></link>
  <joint name="a" type="fixed"><parent link="world"/><child link="post"/></joint>
  <joint name="b" type="fixed"><parent link="world"/><child link="wall"/></joint>
  <joint name="c" type="fixed"><parent link="world"/><child link="ball"/></joint>
  <joint name="d" type="fixed"><parent link="world"/><child link="pipe"/></joint>
</robot>
"""
START = JointState(('shoulder', 'elbow'), np.array([2.0 * math.pi, 0.1]))


class Case:
    """A certificate and what it is about."""

    def __init__(self, robot, scene, trajectory, certificate):
        self.robot, self.scene, self.trajectory = robot, scene, trajectory
        self.certificate = certificate

    def verify(self, certificate=None):
        """Verify the certificate, or another one against the same."""
        return verify(certificate or self.certificate, self.robot, self.scene, self.trajectory)

    def refuse(self, certificate, said=''):
        """Check that a certificate is refused, and for the stated reason."""
        with pytest.raises(TrajectoryGuardError) as raised:
            self.verify(certificate)
        assert raised.value.reason is Reason.CERTIFICATE_INVALID
        assert said in str(raised.value)


@pytest.fixture(scope='module')
def case(tmp_path_factory):
    """Return a certificate with entries of every kind and intervals of every status."""
    folder = tmp_path_factory.mktemp('cell')
    (folder / 'robot.urdf').write_text(ROBOT)
    (folder / 'scene.urdf').write_text(SCENE)
    robot, scene = load_robot(folder / 'robot.urdf'), load_scene(folder / 'scene.urdf')
    trajectory = Trajectory.from_points(
        ['elbow', 'shoulder'],
        [
            Point(SECOND, [0.0, 0.3], [0.0, 0.0]),
            Point(3 * SECOND, [0.0, 2.3], [0.0, 0.0]),
            Point(4 * SECOND, [0.2, 2.5], [0.0, 0.0]),
        ],
        name='swing',
    )
    path = joint_path(robot.movable, trajectory, START)
    maker = Maker(robot, scene, path, 0.001, 0.001, turning=('wall',))
    return Case(robot, scene, trajectory, maker.certificate(trajectory, START))


def test_a_true_certificate_holds(case):
    """Everything is proved again, and the finding says what."""
    found = case.verify()
    assert set(found.entries) == {'balls', 'planes', 'turning', 'collisions'}
    assert {row[2] for row in found.intervals} == {'free', 'suspect', 'collision'}
    assert found.verdict == 'collision'
    assert found.pairs == 8
    assert found.unmoved == ('base',)
    assert found.start == {'shoulder': 2.0 * math.pi, 'elbow': 0.1}
    assert found.trusted
    assert found.entries['planes'] == len(case.certificate['planes'])
    assert case.verify(json.dumps(case.certificate, indent=1)).intervals == found.intervals


# Anything changed under the seal


def places(value, where=()):
    """Yield the keys that lead to every value in a JSON object, itself left out."""
    inside = value.items() if isinstance(value, dict) else enumerate(value)
    for key, item in inside:
        yield (*where, key)
        if isinstance(item, dict | list):
            yield from places(item, (*where, key))


def changed(value):
    """Return another value of the same type."""
    if isinstance(value, bool | None):
        return 7
    if isinstance(value, str):
        return value[:-1] + ('0' if value[-1:] != '0' else '1')
    if isinstance(value, int):
        return value + 1
    if isinstance(value, float):
        return math.nextafter(value, math.inf)
    return value[1:] if isinstance(value, list) and value else {}


def at(certificate, where):
    """Return the container of a place."""
    for key in where[:-1]:
        certificate = certificate[key]
    return certificate


def test_the_seal_finds_every_change(case):
    """Each value is changed by the smallest step, each item dropped: always refused."""
    every = list(places(case.certificate))
    rng = np.random.default_rng(0)
    some = [every[i] for i in rng.permutation(len(every))[:400]]
    named = [where for where in every if len(where) < 3 or where[0] in ('pieces', 'intervals')]
    assert len({where[0] for where in named}) == len(case.certificate)
    for where in {*some, *named}:
        mutated = copy.deepcopy(case.certificate)
        inside = at(mutated, where)
        inside[where[-1]] = changed(inside[where[-1]])
        if mutated != case.certificate:
            case.refuse(mutated)
        dropped = copy.deepcopy(case.certificate)
        del at(dropped, where)[where[-1]]
        case.refuse(dropped)


# Claims changed to wrong ones, and sealed again


def free_into_suspect(c):
    """Let the first free interval end a millisecond later."""
    i = next(i for i, row in enumerate(c['intervals']) if row[2] == 'free')
    c['intervals'][i][1] += 1_000_000
    c['intervals'][i + 1][0] += 1_000_000


def collision_into_suspect(c):
    """Let a colliding interval begin a millisecond earlier."""
    i = next(i for i, row in enumerate(c['intervals']) if row[2] == 'collision')
    c['intervals'][i][0] -= 1_000_000
    c['intervals'][i - 1][1] -= 1_000_000


def status(old, new):
    """Return a mutation of the first interval with a status."""

    def mutate(c):
        next(row for row in c['intervals'] if row[2] == old)[2] = new
        found = {row[2] for row in c['intervals']}
        c['verdict'] = next(s for s in ('collision', 'suspect', 'free') if s in found)

    mutate.__name__ = f'{old}_to_{new}'
    return mutate


def put(*where, value):
    """Return a mutation that puts a value, or what a function makes of the old one."""

    def mutate(c):
        inside = at(c, where)
        inside[where[-1]] = value(inside[where[-1]]) if callable(value) else value

    mutate.__name__ = '.'.join(map(str, where)) + f'_{value!r:.20}'
    return mutate


def drop(kind):
    """Return a mutation that drops the last entry of a kind."""
    return put(kind, value=lambda rows: rows[:-1])


def first_ball_dropped(c):
    """Drop one obstacle of a ball entry."""
    del c['balls'][0][2][0]


def swapped(*where):
    """Return a mutation that swaps the first two unequal items."""

    def swap(rows):
        i = next(i for i, row in enumerate(rows) if row != rows[0])
        rows[0], rows[i] = rows[i], rows[0]
        return rows

    return put(*where, value=swap)


def other_piece(c):
    """Move the last plane's piece to the other end of its segment."""
    piece = c['pieces'][c['planes'][-1][0]]
    piece[1] = (1 << piece[2]) - 1 - piece[1]


def for_all_time(kind):
    """Return a mutation that claims the entry of the shortest piece for its whole segment."""

    def mutate(c):
        deepest = max((c['pieces'][row[0]] for row in c[kind]), key=lambda piece: piece[2])
        deepest[1:] = [0, 0]

    mutate.__name__ = f'{kind}_for_all_time'
    return mutate


def finer(c):
    """Halve a piece; the other half is not covered."""
    piece = c['pieces'][0]
    piece[1:] = [2 * piece[1], piece[2] + 1]


def later_segment(c):
    """Move the pieces of the first segment to the second."""
    for piece in c['pieces']:
        piece[0] = max(piece[0], 1)


def negated(row):
    """Turn the directions of an entry round."""
    return [*row[:3], *(-x for x in row[3:])]


def duplicated(rows):
    """Repeat the first row."""
    return [rows[0], *rows]


FALSE = [
    free_into_suspect,
    collision_into_suspect,
    status('suspect', 'free'),
    status('suspect', 'collision'),
    status('free', 'collision'),
    status('collision', 'free'),
    put('verdict', value='free'),
    put('verdict', value='suspect'),
    put('intervals', value=duplicated),
    put('intervals', value=lambda rows: rows[1:]),
    put('intervals', value=lambda rows: rows[:-1]),
    put('intervals', value=[]),
    put('intervals', 0, 0, value=1),
    put('intervals', 0, 1, value=lambda end: end - 1),
    put('duration_ns', value=lambda end: end + 1),
    drop('planes'),
    drop('turning'),
    drop('collisions'),
    first_ball_dropped,
    put('balls', value=lambda rows: rows[:-1]),
    put('balls', value=[]),
    put('pieces', value=lambda rows: rows[:-1]),
    other_piece,
    for_all_time('planes'),
    for_all_time('collisions'),
    finer,
    later_segment,
    put('planes', -1, value=negated),
    put('planes', -1, 6, value=lambda d: d + 5.0),
    put('planes', -1, 6, value=lambda d: d - 5.0),
    put('planes', -1, slice(3, 6), value=lambda n: n[1:] + n[:1]),
    put('planes', -1, slice(3, 6), value=[0.0, 0.0, 0.0]),
    put('planes', -1, 1, value=lambda body: 3 - body),
    put('planes', -1, 2, value=lambda obstacle: (obstacle + 1) % 4),
    put('planes', value=lambda rows: [*rows, rows[0]]),
    put('turning', -1, value=negated),
    put('turning', -1, slice(6, 9), value=[3.0, 3.0, 3.0]),
    put('turning', -1, slice(9, 12), value=[-3.0, 3.0, -3.0]),
    put('collisions', -1, slice(3, 6), value=lambda y: [x + 0.5 for x in y]),
    put('collisions', -1, slice(6, 9), value=lambda y: [x - 0.5 for x in y]),
    put('collisions', -1, 2, value=3),
    put('collisions', -1, 1, value=lambda body: 3 - body),
    swapped('robot', 'links'),
    swapped('scene', 'obstacles'),
    swapped('trajectory', 'joint_names'),
    put('trajectory', 'sha256', value=lambda text: text[::-1]),
    put('robot', 'sha256', value=lambda text: text[::-1]),
    put('scene', 'sha256', value=lambda text: text[::-1]),
    put('trajectory', 'start', value=None),
    put('trajectory', 'start', 'positions', value=[2.0, 0.1]),
    put('trajectory', 'start', 'positions', value=[2.0 * math.pi - 1.5, 0.1]),
    put('trajectory', 'start', 'positions', value=[0.3 + math.pi, 0.1]),
    put('trajectory', 'start', 'velocities', value=[20.0, 20.0]),
    put('trajectory', 'start', 'joint_names', value=['shoulder', 'wrist']),
    put('trajectory', 'interpolation', value='splines'),
    put('request', 'clearance', value=0.1),
    put('request', 'tracking_tolerance', 'elbow', value=1.0),
    put('request', 'tracking_tolerance', 'shoulder', value=0.5),
    put('format', value='trajectory_guard/certificate/2'),
]


@pytest.mark.parametrize('mutate', FALSE, ids=lambda mutate: mutate.__name__)
def test_a_wrong_claim_is_refused_even_if_sealed(case, mutate):
    """Only what can be proved is accepted."""
    mutated = copy.deepcopy(case.certificate)
    mutate(mutated)
    assert mutated != case.certificate
    case.refuse(sealed(mutated))


def test_each_entry_of_each_kind_is_needed(case):
    """No proof has entries to spare: dropped one by one, each is missed."""
    rng = np.random.default_rng(1)
    for kind in ('planes', 'turning', 'collisions', 'balls'):
        rows = case.certificate[kind]
        for i in rng.permutation(len(rows))[:6]:
            mutated = {**case.certificate, kind: [*rows[:i], *rows[i + 1 :]]}
            case.refuse(sealed(mutated), 'intervals')


@pytest.mark.parametrize(
    ('where', 'value', 'said'),
    [
        (('planes', 0, 3), 1e13, 'planes[0]'),
        (('planes', 0, 3), True, 'planes[0]'),
        (('planes', 0, 3), '1', 'planes[0]'),
        (('planes', 0, 1), True, 'planes[0], body'),
        (('planes', 0, 1), 1.0, 'planes[0], body'),
        (('planes', 0, 1), 3, 'planes[0], body'),
        (('planes', 0, 2), -1, 'planes[0], obstacle'),
        (('planes', 0, 0), 10**30, 'planes[0], piece'),
        (('planes', 0), [0, 1], 'planes[0]'),
        (('planes', 0), {}, 'planes[0]'),
        (('planes',), {}, 'planes'),
        (('balls', 0, 2), 4, 'balls[0], obstacles'),
        (('balls', 0, 2), [2, 2], 'balls[0]'),
        (('balls', 0, 2), [True], 'balls[0], obstacle'),
        (('pieces', 0), [0, 4, 2], 'pieces[0], numerator'),
        (('pieces', 0), [0, 0, 62], 'pieces[0], level'),
        (('pieces', 0), [3, 0, 0], 'pieces[0], segment'),
        (('pieces', 0), [0, 0], 'pieces[0]'),
        (('pieces', 0), [0, 0, True], 'pieces[0][2]'),
        (('pieces', 0), [0.0, 0, 2], 'pieces[0][0]'),
        (('intervals', 0), [0, 1], 'intervals[0]'),
        (('intervals', 0, 2), 'certain', 'intervals[0]'),
        (('intervals', 0, 0), 0.0, 'intervals[0]'),
        (('duration_ns',), 4e9, 'duration_ns'),
        (('verdict',), 1, 'verdict'),
        (('extra',), 1, "'extra'"),
        (('robot', 'extra'), 1, "robot: fields missing or unknown: ['extra']"),
        (('robot', 'links', 0), 1, 'robot.links[0]'),
        (('scene', 'frames', 0), [1.0], 'scene.frames'),
        (('scene', 'frames'), [], 'scene.frames'),
        (('request', 'clearance'), -1e-9, 'request.clearance'),
        (('request', 'tolerance'), None, 'request.tolerance'),
        (('request', 'tracking_tolerance', 'wrist'), 0.0, "['wrist']"),
        (('request', 'tracking_tolerance', 'elbow'), -1.0, "['elbow']"),
        (('request', 'tracking_tolerance'), {}, 'request.tracking_tolerance'),
        (('trajectory', 'start'), [], 'trajectory.start'),
        (('trajectory', 'start', 'positions'), [0.0], 'trajectory.start'),
        (('trajectory', 'start', 'velocities'), 0, 'trajectory.start.velocities'),
        (('trajectory', 'start', 'joint_names'), ['elbow'] * 2, 'trajectory.start'),
        (('trajectory', 'joint_names'), 'elbow', 'trajectory.joint_names'),
    ],
)
def test_malformed_fields_are_named(case, where, value, said):
    """A field that is not as the format says is named, and the seal does not help."""
    mutated = copy.deepcopy(case.certificate)
    at(mutated, where)[where[-1]] = value
    case.refuse(mutated)
    case.refuse(sealed(mutated), said)


@pytest.mark.parametrize('value', [math.nan, math.inf, -math.inf])
def test_numbers_that_are_none_are_refused(case, value):
    """As values and as text."""
    mutated = copy.deepcopy(case.certificate)
    mutated['planes'][0][3] = value
    case.refuse(mutated, 'not JSON')
    case.refuse(json.dumps(mutated), 'is no number')


@pytest.mark.parametrize(
    'written',
    ['', '[]', '1', 'null', '{"format": 1, "format": 1}', '{}', '[' * 100_000, '{"x": 1e999}'],
)
def test_what_is_no_certificate_is_refused(case, written):
    """Text that is no JSON object, repeats keys or lacks them."""
    with pytest.raises(TrajectoryGuardError) as raised:
        verify(written, case.robot, case.scene, case.trajectory)
    assert raised.value.reason is Reason.CERTIFICATE_INVALID


def test_missing_fields_are_named(case):
    """Each field is needed."""
    for key in case.certificate:
        rest = {k: v for k, v in case.certificate.items() if k != key}
        case.refuse(rest, repr(key))
        if key != 'sha256':
            case.refuse(sealed(rest), repr(key))


def test_other_subjects_are_refused(case):
    """The certificate of one trajectory, robot or scene is none of another."""
    moved = Scene(case.scene.obstacles, 'other')
    shorter = Trajectory.from_points(['elbow', 'shoulder'], [Point(4 * SECOND, [0.2, 2.5])])
    for scene, trajectory, said in (
        (moved, case.trajectory, 'scene.sha256'),
        (case.scene, shorter, 'trajectory.sha256'),
    ):
        with pytest.raises(TrajectoryGuardError, match=said):
            verify(case.certificate, case.robot, scene, trajectory)


# A certificate made by hand


def slide(height):
    """Return robot, scene and a motion that goes up to 0.25 m and back between its two points."""
    axis = np.array([0.0, 0.0, 1.0])
    joint = Joint('lift', JointType.PRISMATIC, 'root', 'tip', np.eye(4), axis, -1.0, 1.0)
    tip = Given(box_body((0.1, 0.1, 0.1)))
    robot = Robot('slide', 'root', (joint,), {'tip': (Collision(np.eye(4), tip),)}, b'')
    lid = box_body((1.0, 1.0, 0.1), (0.0, 0.0, height + 0.05))
    trajectory = Trajectory.from_points(
        ['lift'], [Point(0, [0.0], [1.0]), Point(SECOND, [0.0], [-1.0])]
    )
    return robot, Scene((Obstacle('lid', (lid,)),), 'lid'), trajectory


def by_hand(robot, scene, trajectory, pieces, planes):
    """Return a certificate that says free by planes."""
    return sealed({
        'format': 'trajectory_guard/certificate/1',
        'trajectory': {'name': '', 'sha256': trajectory.digest(), 'start': None,
                       'interpolation': 'joint_trajectory_controller/jazzy',
                       'joint_names': ['lift']},
        'robot': {'sha256': robot.digest(), 'links': ['tip']},
        'scene': {'sha256': scene.digest, 'obstacles': ['lid'],
                  'frames': [np.eye(3).ravel().tolist()]},
        'request': {'tolerance': 1e-4, 'clearance': 0.0, 'tracking_tolerance': {'lift': 0.0}},
        'duration_ns': SECOND, 'verdict': 'free', 'unchecked_pairs': [],
        'intervals': [[0, SECOND, 'free']], 'pieces': pieces,
        'balls': [], 'planes': planes, 'turning': [], 'collisions': [],
    })  # fmt: skip


def test_a_plane_that_holds_only_at_samples_is_refused():
    """The box reaches 0.3 m in the middle, 0.05 m at both ends; a lid at 0.29 m is met."""
    robot, scene, trajectory = slide(0.301)
    down = [[0, 0, 0, 0.0, 0.0, -1.0, -0.3005]]
    made = Case(robot, scene, trajectory, by_hand(robot, scene, trajectory, [[0, 0, 0]], down))
    assert made.verify().verdict == 'free'
    robot, scene, trajectory = slide(0.29)
    for offset in (-0.06, -0.2, -0.2899):
        plane = [[0, 0, 0, 0.0, 0.0, -1.0, offset]]
        made.scene = scene
        made.refuse(by_hand(robot, scene, trajectory, [[0, 0, 0]], plane), 'planes[0]')
    ends = [[0, 0, 0, 0.0, 0.0, -1.0, -0.2899], [1, 0, 0, 0.0, 0.0, -1.0, -0.2899]]
    quarters = [[0, 0, 2], [0, 3, 2]]
    made.refuse(by_hand(robot, scene, trajectory, quarters, ends), 'intervals')


def test_an_entry_that_needs_smaller_pieces_is_halved():
    """What is true but not seen at once on the whole piece is proved on its parts."""
    robot, scene, trajectory = slide(0.3 + 1e-9)
    plane = [[0, 0, 0, 0.0, 0.0, -1.0, -0.3 - 5e-10]]
    found = verify(by_hand(robot, scene, trajectory, [[0, 0, 0]], plane), robot, scene, trajectory)
    assert found.halvings > 0


def test_sliding_at_ten_micrometres_is_proved_again():
    """A box that turns two radians right above a plate; where it touches, nothing is proved."""
    axis = np.array([0.0, 0.0, 1.0])
    joint = Joint('turn', JointType.REVOLUTE, 'root', 'tip', np.eye(4), axis, -9.0, 9.0)
    trajectory = Trajectory.from_points(['turn'], [Point(0, [-1.0]), Point(SECOND, [1.0])])
    box = Given(box_body((0.8, 0.1, 0.1), (0.4, 0.0, 0.05)))
    robot = Robot('turn', 'root', (joint,), {'tip': (Collision(np.eye(4), box),)}, b'')
    for gap, status in ((1e-5, 'free'), (0.0, 'suspect')):
        plate = box_body((4.0, 4.0, 0.1), (0.0, 0.0, -0.05 - gap))
        scene = Scene((Obstacle('plate', (plate,)),), 'plate')
        settings = Settings(tolerance=1e-6, want_certificate=True, max_pieces=500)
        result = judge(Workcell(robot, scene), trajectory, None, settings)
        found = verify(result.certificate, robot, scene, trajectory)
        assert found.verdict == result.verdict.name.lower() == status
    lower = {**result.certificate, 'verdict': 'free', 'intervals': [[0, SECOND, 'free']]}
    Case(robot, scene, trajectory, None).refuse(sealed(lower), 'no entries cover')


def test_a_digest_is_that_of_the_curve():
    """Every value that shapes the curve counts; the label and values not carried do not."""

    def made(**changes):
        fields = {
            'joint_names': ('a', 'b'),
            'times_ns': np.array([0, 5]),
            'positions': np.array([[0.0, 1.0], [2.0, 3.0]]),
            'velocities': np.array([[0.0, 1.0], [2.0, 3.0]]),
            'has_velocities': np.array([True, False]),
            'accelerations': np.zeros((2, 2)),
            'has_accelerations': np.array([True, False]),
        }
        return Trajectory(**{**fields, **changes}).digest()

    assert made() == made(name='other')
    assert made() == made(velocities=np.array([[-0.0, 1.0], [7.0, np.nan]]))
    others = [
        made(joint_names=('b', 'a')),
        made(joint_names=('a', 'c')),
        made(times_ns=np.array([0, 6])),
        made(positions=np.array([[0.0, 1.0], [2.0, math.nextafter(3.0, 4.0)]])),
        made(velocities=np.array([[0.0, 1.1], [2.0, 3.0]])),
        made(has_velocities=np.array([True, True])),
        made(accelerations=np.array([[0.0, 1.1], [2.0, 3.0]])),
        made(has_accelerations=np.array([False, False])),
    ]
    assert len({made(), *others}) == len(others) + 1


# Certificates of random cells, made plainly and by the certifier


def random_case(seed):
    """Return a random robot, scene and trajectory with its start."""
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, 5)
    scene = Scene(
        tuple(
            Obstacle(f'o{k}', (random_body(rng, 0.1).moved(pose(rng.normal(size=3) * 0.9)),))
            for k in range(4)
        ),
        'random',
    )
    named = [joint.name for joint in robot.movable if joint.mimic is None]
    held = named.pop() if len(named) > 1 and named[-1] != 'j0' else None
    points = [Point(k * SECOND, *rng.normal(size=(2, len(named))) * 0.6) for k in range(3)]
    start = JointState(('j', *([held] if held else [])), rng.normal(size=2 if held else 1))
    return robot, scene, Trajectory.from_points(named, points), start


@pytest.mark.parametrize('seed', range(4))
def test_certificates_of_random_cells_hold(seed):
    """Plainly made ones of robots with slides, mimics, branches, and all kinds of bodies."""
    robot, scene, trajectory, start = random_case(seed)
    path = joint_path(robot.movable, trajectory, start, allow_nonzero_end_velocity=True)
    maker = Maker(robot, scene, path, tolerance=0.001, deepest=5, turning=('o0', 'o1'))
    found = verify(maker.certificate(trajectory, start), robot, scene, trajectory)
    assert found.entries


@pytest.mark.parametrize('seed', range(12))
def test_the_certifiers_certificates_hold(seed):
    """Whatever the certifier proves about random cells is proved again."""
    robot, scene, trajectory, start = random_case(seed)
    settings = Settings(
        clearance=0.001 * (seed % 3),
        tracking_tolerance=(0.002 * (seed % 4),),
        allow_nonzero_end_velocity=True,
        want_certificate=True,
        max_pieces=4000,
    )
    result = judge(Workcell(robot, scene), trajectory, start, settings)
    assert result.certificate is not None, result.message
    found = verify(result.certificate, robot, scene, trajectory)
    assert [list(row) for row in found.intervals] == [
        [row.start_ns, row.end_ns, row.status.name.lower()] for row in result.intervals
    ]


def check_bench(robot, chosen):
    """Verify the certifier's certificates of trajectories of the benchmark."""
    cell = workcell(robot)
    settings = Settings(
        tolerance=SETTINGS.tolerance, allow_nonzero_end_velocity=True, want_certificate=True
    )
    for trajectory, truth, _ in chosen:
        result = judge(cell, trajectory, None, settings)
        found = verify(text(result.certificate), cell.robot, cell.scene, trajectory)
        assert found.verdict == result.verdict.name.lower()
        assert found.verdict != 'free' or not truth['colliding']
        assert found.seconds < 10.0


@pytest.mark.parametrize('robot', ['panda', 'ur5'])
def test_certificates_of_real_robots_hold(robot):
    """One trajectory of each category."""
    check_bench(robot, cases(robot)[1::14])


@pytest.mark.slow
@pytest.mark.parametrize('robot', ['panda', 'ur5'])
def test_all_certificates_of_real_robots_hold(robot):
    """Every trajectory of the benchmark."""
    check_bench(robot, cases(robot))
