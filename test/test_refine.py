"""Meshes that are not convex: free through their openings, never free through their walls."""

from concurrent.futures import ThreadPoolExecutor
import dataclasses

import coal
from meshes import (
    box,
    box_tool,
    cell,
    extruded,
    gantry,
    joined,
    L,
    mesh_tool,
    move,
    ring,
    U,
    without,
    write,
)
import numpy as np
import pytest
from random_robot import link_poses
from scipy.spatial.transform import Rotation

from trajectory_guard.cell.scene import load_scene
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import judge
from trajectory_guard.paths.joint_path import joint_path
from trajectory_guard.result import Status, Verdict
from trajectory_guard.settings import Scope, Settings
from trajectory_guard.shapes import parts
from trajectory_guard.shapes.mesh_formats import Triangles

PEG = box_tool(0.15, 0.15, 0.05)
PEBBLE = box_tool(0.02, 0.02, 0.02)
IN = ((0, 0.5, 0), (0, 0, 0))  # into the opening of the U


def counts(workcell):
    """Return how many solids are packed on both sides."""
    level = workcell.detail.level
    return len(level.links.ranges), len(level.obstacles.ranges)


def same(a, b):
    """Say whether two results agree, but for the time they took."""
    return dataclasses.replace(a, compute_time=0.0) == dataclasses.replace(b, compute_time=0.0)


def test_a_peg_goes_into_the_opening(tmp_path):
    """Free by the mesh, suspect by its hull, which a certificate asks for and the answer says."""
    workcell = cell(PEG, extruded(U), tmp_path)
    assert judge(workcell, move(*IN)).verdict is Verdict.FREE
    hulls = judge(workcell, move(*IN), settings=Settings(want_certificate=True))
    assert hulls.verdict is Verdict.SUSPECT
    assert hulls.warnings[-1].endswith('a certificate speaks of hulls: bin')


@pytest.mark.parametrize(
    ('mesh', 'places'),
    [
        (extruded(L), ((0.5, 0.5, 0), (0.2, 0.2, 0))),
        (ring(0.2, 0.05), ((0, 0, 0.4), (0, 0, -0.4))),
        (joined(extruded(U), box((0.5, 0.5, 0.5), (0.6, 0.6, 0.6))), IN),
    ],
    ids=['L', 'ring', 'two pieces'],
)
def test_other_openings(mesh, places, tmp_path):
    """Through a ring, into a corner, between two solids of one file."""
    workcell = cell(PEG, mesh, tmp_path)
    assert judge(workcell, move(*places)).verdict is Verdict.FREE


@pytest.mark.parametrize('clearance', [0.0, 0.01])
@pytest.mark.parametrize(('gap', 'verdict'), [(1e-3, Verdict.FREE), (-1e-3, Verdict.SUSPECT)])
def test_the_inner_wall_counts_to_the_tolerance(gap, verdict, clearance, tmp_path):
    """The peg's side stops a millimetre before the wall and its clearance, or behind them."""
    workcell = cell(PEG, extruded(U), tmp_path)
    settings = Settings(clearance=clearance)
    result = judge(
        workcell, move((0, 0.1, 0), (0.1 - 0.075 - clearance - gap, 0.1, 0)), settings=settings
    )
    if clearance == 0.0 and gap < 0.0:
        verdict = Verdict.COLLISION
    assert result.verdict is verdict
    if verdict is not Verdict.FREE:
        assert result.intervals[-1].body == 'tool' and result.intervals[-1].obstacle == 'bin'


def test_tracking_counts_for_parts(tmp_path):
    """The opening leaves 25 mm on each side; the peg may stray by less, not by more."""
    workcell = cell(PEG, extruded(U), tmp_path)
    near = Settings(tracking_tolerance=(0.02, 0.0, 0.0, 0.0))
    far = Settings(tracking_tolerance=(0.03, 0.0, 0.0, 0.0))
    assert judge(workcell, move(*IN), settings=near).verdict is Verdict.FREE
    assert judge(workcell, move(*IN), settings=far).verdict is Verdict.SUSPECT


def test_collisions_are_proved_on_the_faces(tmp_path):
    """The link crosses both arms of the U; in between it is free."""
    workcell = cell(PEG, extruded(U), tmp_path)
    result = judge(workcell, move((0.6, 0.1, 0), (-0.6, 0.1, 0)))
    assert [row.status for row in result.intervals if row.status is not Status.SUSPECT] == [
        Status.FREE,
        Status.COLLISION,
        Status.FREE,
        Status.COLLISION,
        Status.FREE,
    ]
    suspect = sum(r.end_ns - r.start_ns for r in result.intervals if r.status is Status.SUSPECT)
    assert suspect < 1e-3 * result.duration_ns


SHELL = joined(box((-0.2,) * 3, (0.2,) * 3), box((-0.15,) * 3, (0.15,) * 3, inward=True))
TURNED = Triangles(SHELL.points, SHELL.triangles[:, ::-1])
CAVITY = ((0, 0, 0), (0.05, 0.1, 0.02))
MATERIAL = ((0.175, 0, 0), (0.175, 0.1, 0.02))


@pytest.mark.parametrize('swapped', [False, True])
@pytest.mark.parametrize(
    ('mesh', 'places', 'free'),
    [
        (extruded(U, 3), ((0, 0.05, 0), (0.05, 0.1, 0.02)), True),
        (extruded(U, 3), ((0.15, 0.05, 0), (0.15, 0.1, 0.02)), False),
        (SHELL, CAVITY, True),
        (SHELL, MATERIAL, False),
        (joined(SHELL, TURNED), CAVITY, True),
        (joined(SHELL, TURNED), MATERIAL, False),
        (without(SHELL, 0), CAVITY, True),
        (without(SHELL, 0), MATERIAL, True),
    ],
    ids=[
        'beside U',
        'in U',
        'cavity',
        'in the shell',
        'two-sided, cavity',
        'two-sided, in the shell',
        'open',
        'open, inside',
    ],
)
def test_what_lies_inside_is_not_free(mesh, places, free, swapped, tmp_path):
    """A pebble inside a solid touches no face of it; the mesh is the obstacle, or the link."""
    if swapped:
        tool = mesh_tool(write(mesh, tmp_path / 'tool.stl'))
        workcell = cell(tool, box((-0.01,) * 3, (0.01,) * 3), tmp_path)
        places = [[-x for x in place] for place in places]
    else:
        workcell = cell(PEBBLE, mesh, tmp_path)
    result = judge(workcell, move(*places))
    assert (result.verdict is Verdict.FREE) == free
    if not free:
        assert result.verdict is Verdict.SUSPECT
        assert [row.reason for row in result.intervals] == ['enclosure']
        assert (result.intervals[0].body, result.intervals[0].obstacle) == ('tool', 'bin')
    opened = any('open meshes' in warning for warning in result.warnings)
    assert opened == (len(mesh.triangles) == len(SHELL.triangles) - 1)


def test_a_mesh_inside_a_mesh(tmp_path):
    """Both have parts; one point of each connected piece is asked for, whichever is inside."""
    tool = mesh_tool(write(ring(0.03, 0.005, 16, 8), tmp_path / 'tool.stl'))
    workcell = cell(tool, SHELL, tmp_path)
    assert judge(workcell, move(*CAVITY)).verdict is Verdict.FREE
    inside = judge(workcell, move((0, 0, 0.175), (0, 0.05, 0.175)))
    assert inside.verdict is Verdict.SUSPECT and inside.reason_code == 'enclosure'
    pair = joined(ring(0.03, 0.005, 16, 8), box((0.8, 0, 0), (0.82, 0.02, 0.02)))
    tool = mesh_tool(write(pair, tmp_path / 'pair.stl'))
    workcell = cell(tool, SHELL, tmp_path)
    assert judge(workcell, move((-0.85, 0, 0), (-0.85, 0.01, 0))).verdict is Verdict.FREE
    assert judge(workcell, move((-0.635, 0, 0), (-0.635, 0.01, 0))).reason_code == 'enclosure'


def test_each_free_run_is_asked_by_itself(tmp_path):
    """Free outside, then through the wall, then inside of it: the last run is not free."""
    workcell = cell(PEBBLE, extruded(U, 3), tmp_path)
    result = judge(workcell, move((0, 0.05, 0), (0.15, 0.05, 0)))
    assert result.intervals[0].status is Status.FREE
    assert result.intervals[-1].reason == 'enclosure'
    assert result.verdict is Verdict.COLLISION


def test_nothing_is_built_before_it_is_needed(tmp_path, monkeypatch):
    """Hulls that suffice stay alone; what was built once is not built again."""
    workcell = cell(PEG, extruded(U), tmp_path)
    built = []
    real = parts.Clusters.below
    monkeypatch.setattr(parts.Clusters, 'below', lambda *a: built.append(1) or real(*a))
    level = workcell.detail.level
    assert judge(workcell, move((0, 0.6, 0), (0.3, 0.6, 0))).verdict is Verdict.FREE
    judge(workcell, move(*IN), settings=Settings(want_certificate=True))
    assert workcell.detail.level is level and not built
    first = judge(workcell, move(*IN))
    assert len(built) == 1 and counts(workcell) == (1, 55)
    level = workcell.detail.level
    again = judge(workcell, move(*IN))
    assert same(again, first)
    assert workcell.detail.level is level and len(built) == 1


def test_large_meshes_are_built_where_they_are_met(tmp_path):
    """A place on a fine ring costs a tenth of its 40,000 clusters, and nothing the next time."""
    workcell = cell(PEBBLE, ring(0.2, 0.05, 128, 80), tmp_path)
    places = ((0.2, 0, 0.2), (0.2, 0, 0))
    first = judge(workcell, move(*places))
    assert first.verdict is Verdict.COLLISION
    size = counts(workcell)[1]
    assert 2047 <= size < 4000
    assert same(judge(workcell, move(*places)), first)
    assert counts(workcell)[1] == size


def ring_in_ring(folder):
    """Return a workcell of two rings."""
    tool = mesh_tool(write(ring(0.1, 0.02, 24, 12), folder / 'tool.stl'))
    return cell(tool, ring(0.2, 0.05, 40, 20), folder)


RIDES = [
    ((0, 0, 0.3), (0, 0, -0.3)),
    ((0.2, 0, 0.3), (0.2, 0, -0.3)),
    ((0.1, 0, 0.3), (0.1, 0.1, 0, 1.0), (0, 0, -0.3)),
    ((0.4, 0, 0.0), (0.0, 0, 0)),
]


@pytest.mark.parametrize('scope', Scope)
def test_answers_do_not_depend_on_what_is_built(scope, tmp_path):
    """In any order and on many threads at once, the answers are the same."""
    settings = Settings(scope=scope, tracking_tolerance=(0.001,))
    alone = [judge(ring_in_ring(tmp_path), move(*ride), settings=settings) for ride in RIDES]
    assert len({result.verdict for result in alone}) > 1
    workcell = ring_in_ring(tmp_path)
    with ThreadPoolExecutor(8) as threads:
        jobs = [
            (k, threads.submit(judge, workcell, move(*RIDES[k]), settings=settings))
            for k in [0, 1, 2, 3] * 4
        ]
        for k, job in jobs:
            assert same(job.result(), alone[k])


def test_budget_and_deadline_hold_for_all_covers(tmp_path):
    """What is not decided by then is suspect, for the right reason."""
    for settings, reason in (
        (Settings(max_pieces=4), 'budget'),
        (Settings(deadline_ns=0), 'deadline'),
    ):
        workcell = cell(PEG, extruded(U), tmp_path)
        result = judge(workcell, move(*IN), settings=settings)
        assert result.verdict is Verdict.SUSPECT
        assert {row.reason for row in result.intervals if row.reason} == {reason}
        assert result.pieces <= settings.max_pieces


def test_one_piece_may_spend_the_budget(tmp_path):
    """Two equal meshes in one place touch everywhere: no piece is looked at to the end."""
    mesh = ring(0.2, 0.05, 64, 32)
    workcell = cell(mesh_tool(write(mesh, tmp_path / 'tool.stl')), mesh, tmp_path)
    result = judge(workcell, move((0, 0, 0), (0, 0, 1e-3)), settings=Settings(max_pieces=20))
    assert result.verdict is Verdict.SUSPECT and result.reason_code == 'budget'
    assert result.pieces <= 20
    assert len(result.intervals) == 1


def test_a_deadline_between_two_covers(tmp_path, monkeypatch):
    """Parts that come too late leave the answer of the hulls, and its free intervals."""
    workcell = cell(PEG, extruded(U), tmp_path)
    real = workcell.detail.refine

    def late(wanted, stop):
        stop[0] = 1
        return real(wanted, stop)

    monkeypatch.setattr(workcell.detail, 'refine', late)
    result = judge(workcell, move(*IN))
    assert [row.status for row in result.intervals] == [Status.FREE, Status.SUSPECT]
    assert result.reason_code == 'deadline'
    assert counts(workcell) == (1, 1)


def test_several_bodies_of_a_link_and_scenes_with_poses(tmp_path):
    """Each mesh of the scene is refined by itself, wherever it was put."""
    write(extruded(U), tmp_path / 'bin.stl')
    turn = Rotation.from_euler('z', 0.7).as_matrix()
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, (0.3, -0.2, 0.1)
    scene = load_scene([tmp_path / 'bin.stl'], pose)
    workcell = Workcell(gantry(PEG), scene)
    places = [[*(turn @ place + pose[:3, 3]), 0.7] for place in np.array(IN, float)]
    assert judge(workcell, move(*places)).verdict is Verdict.FREE
    places[1][:3] = turn @ (0.0, -0.05, 0.0) + pose[:3, 3]
    assert judge(workcell, move(*places)).verdict is Verdict.COLLISION


def random_mesh(rng, size):
    """Return a mesh of some kind, turned and scaled at random."""
    kind = rng.integers(5)
    if kind == 0:
        mesh = extruded(U, rng.uniform(0.5, 3), 0.05)
    elif kind == 1:
        mesh = extruded(L, rng.uniform(0.5, 3), 0.05)
    elif kind == 2:
        mesh = ring(0.1, 0.03, rng.integers(5, 30), rng.integers(4, 15))
    elif kind == 3:
        holes = rng.choice(12, rng.integers(1, 4), replace=False)
        mesh = without(box((-0.1,) * 3, (0.1,) * 3), *holes)
    else:
        mesh = joined(box((-0.1,) * 3, (0, 0, 0)), box((0.05, 0.02, -0.05), (0.1, 0.1, 0.1)))
    turn = Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix()
    return Triangles(mesh.points @ turn.T * size * rng.uniform(0.7, 1.4), mesh.triangles)


def bvh(surface):
    """Return coal's own tree of a surface."""
    points = surface.placed.points
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(surface.triangles), 3 * len(surface.triangles))
    for triangle in points[surface.triangles]:
        model.addTriangle(*triangle)
    model.endModel()
    return model


def judged(workcell, trajectory, settings, rng, samples):
    """Compare an answer with coal's distances of the surfaces; returns the answer."""
    result = judge(workcell, trajectory, settings=settings)
    tool = bvh(workcell.robot.bodies('tool')[0].surface)
    other = bvh(workcell.scene.obstacles[0].bodies[0].surface)
    path = joint_path(workcell.robot.movable, trajectory)
    there = coal.Transform3s.Identity()
    for row in result.intervals:
        span = row.end_ns - row.start_ns
        for ns in np.linspace(row.start_ns, row.end_ns, 2 + samples * span // path.duration_ns):
            k = np.searchsorted(path.knots_ns[1:-1], ns, side='right')
            s = (ns - path.knots_ns[k]) / (path.knots_ns[k + 1] - path.knots_ns[k])
            q = path.coefficients[k] @ s ** np.arange(6)
            if row.status is Status.FREE:
                q += rng.choice([-1, 1], 4) * settings.tracking_tolerance[0]
            T = link_poses(workcell.robot, q)['tool']
            here = coal.Transform3s(T[:3, :3], T[:3, 3])
            distance = coal.distance(
                tool, here, other, there, coal.DistanceRequest(), coal.DistanceResult()
            )
            if row.status is Status.FREE:
                assert distance > settings.clearance - 1e-9
            elif row.status is Status.COLLISION:
                assert distance < 1e-9
            elif row.reason == 'tolerance' and settings.tracking_tolerance == (0.0,):
                # The ends of a suspect piece lie within another tolerance of its middle.
                assert distance < settings.clearance + 3.0 * settings.tolerance
    return result


def sweep(folder, seed, count, samples):
    """Judge random meshes on random rides; returns the verdicts."""
    rng = np.random.default_rng(seed)
    verdicts = []
    for n in range(count):
        tool = mesh_tool(write(random_mesh(rng, 1.0), folder / f'tool{n}.stl'))
        workcell = cell(tool, random_mesh(rng, 1.5), folder, f'bin{n}')
        places = [(*rng.uniform(-0.3, 0.3, 3), rng.uniform(-3, 3)) for _ in range(3)]
        settings = Settings(
            clearance=float(rng.choice([0.0, 0.005])),
            tracking_tolerance=(float(rng.choice([0.0, 0.003])),),
        )
        verdicts.append(judged(workcell, move(*places), settings, rng, samples).verdict)
    return verdicts


def test_random_meshes_are_judged_as_coal_does(tmp_path):
    """No free instant in contact, no collision apart, nothing suspect that is clear."""
    verdicts = sweep(tmp_path, seed=0, count=25, samples=60)
    assert {Verdict.FREE, Verdict.COLLISION} <= set(verdicts)


@pytest.mark.slow
def test_many_random_meshes(tmp_path):
    """The same, three hundred times as many samples."""
    sweep(tmp_path, seed=1, count=300, samples=1500)
