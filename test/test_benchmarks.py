"""The benchmark: its baseline is right where the truth is known, and its rows are as promised."""

import json
from pathlib import Path
import subprocess
import sys

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from trajectory_guard.cell.scene import Obstacle, Scene
from trajectory_guard.cell.urdf import robot_from_urdf
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import judge
from trajectory_guard.paths.joint_path import joint_path
from trajectory_guard.paths.trajectory import Point, Trajectory
from trajectory_guard.result import Result, Verdict
from trajectory_guard.shapes.primitive import Cylinder, Sphere

BENCHMARKS = Path(__file__).parent.parent / 'benchmarks'
sys.path.insert(0, str(BENCHMARKS))

from bench import built, cases, peers, show  # noqa: E402
from bench.tables.main import judged  # noqa: E402

# A link of two bodies: a box at the joint, and a finger at the end of a fixed joint with another.
TWO_BODIES = """
<robot name="two">
  <link name="base"/>
  <link name="arm">
    <collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>
    <collision><origin xyz="0.5 0 0"/><geometry><box size="0.2 0.1 0.1"/></geometry></collision>
  </link>
  <link name="finger">
    <collision><geometry><cylinder radius="0.02" length="0.2"/></geometry></collision>
  </link>
  <joint name="turn" type="continuous">
    <parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
  </joint>
  <joint name="mount" type="fixed">
    <parent link="arm"/><child link="finger"/><origin xyz="0.7 0 0"/>
  </joint>
</robot>
"""


@pytest.fixture(scope='module')
def benches():
    """Return some cases of every category."""
    return cases.load(built.DATA, 8)


def test_baseline_agrees_with_the_truth(benches):
    """Verdicts are the known ones, and what is certainly in contact is not called free."""
    for bench in benches:
        assert {case.colliding for case in bench.cases} == {False, True}
        for case in bench.cases:
            assert (bench.baseline.verdict(case.spline) != peers.FREE) == case.colliding
            spans = bench.baseline.intervals(case.spline)
            assert bool(len(spans)) == case.colliding
            for begin, end in case.contact_core:
                inside = np.clip(spans[:, :2], begin, end)
                assert np.diff(inside).sum() == pytest.approx(end - begin, abs=1e-9)
            assert bench.baseline.sample(case.spline, 1e-3).colliding == case.colliding


@pytest.mark.parametrize(('where', 'free'), [(0.75, False), (0.9, True)])
def test_baseline_has_every_body(where, free):
    """A link's further bodies, fixed links, cylinders and spheres count, as they do for us."""
    ball = Sphere(0.05).load().body.moved(built.pose((0.0, where, 0.0)))
    cell = Workcell(robot_from_urdf(TWO_BODIES), Scene((Obstacle('ball', (ball,)),), digest=''))
    turn = Trajectory.from_points(['turn'], [Point(0, [0.0]), Point(10**9, [3.0])])
    baseline = peers.Baseline(cell)
    assert baseline.pairs == 3
    verdict = baseline.verdict(peers.Spline.from_path(joint_path(cell.robot.movable, turn)))
    assert (verdict == peers.FREE) == free
    assert (judge(cell, turn).verdict == Verdict.FREE) == free


@pytest.mark.parametrize('shape', [Cylinder(0.3, 0.5), Sphere(0.2)])
def test_curved_bodies_are_inside_their_polytopes(shape):
    """The baseline's polytope contains the solid, and is not much larger."""
    body = shape.load().body
    hull = ConvexHull(peers.polytope(body))
    n, out = hull.equations[:, :3], -hull.equations[:, 3]
    across = np.linalg.norm(np.cross(n, body.disc_axis), axis=1)
    needed = (n @ body.vertices.T).max(axis=1) + body.disc_radius * across + body.ball
    assert (out >= needed - 1e-12).all()
    assert (out <= 1.05 * needed).all()


def test_what_the_baseline_cannot_do_is_refused():
    """A joint that slides is an error, not another robot."""
    sliding = TWO_BODIES.replace('"continuous">', '"prismatic"><limit lower="0" upper="1"/>')
    ball = Sphere(0.05).load().body
    cell = Workcell(robot_from_urdf(sliding), Scene((Obstacle('ball', (ball,)),), digest=''))
    with pytest.raises(ValueError, match="'turn'"):
        peers.Baseline(cell)


def test_what_counts_as_missed(benches):
    """Free for a collision is missed; not free for something free is a false alarm."""
    for case in benches[0].cases:
        for verdict in (Verdict.FREE, Verdict.SUSPECT, Verdict.COLLISION):
            missed, alarm = judged(case, Result(verdict))
            assert missed == (case.colliding and verdict == Verdict.FREE)
            assert alarm == (not case.colliding and verdict != Verdict.FREE)


def test_json_rows():
    """The command prints objects only, with the keys that others read."""
    command = [sys.executable, str(BENCHMARKS / 'speed.py'), '--json', '--cases', '4']
    done = subprocess.run(
        [*command, '--only', 'main', 'budget'], capture_output=True, text=True, check=True
    )
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    assert {row['table'] for row in rows} > {'main', 'budget'}
    compared = [row for row in rows if row['table'] == 'main']
    assert {(row['robot'], row['method'].split()[0]) for row in compared} == {
        (robot, method)
        for robot in ('panda', 'ur5')
        for method in ('ours', 'conservative', 'sampling')
    }
    for row in compared:
        assert row.keys() > {'missed', 'false_alarms', 'median_ms', 'p90_ms', 'x_ca'}
        if not row['method'].startswith('sampling'):
            assert row['missed'] == row['false_alarms'] == 0


def test_tables_show_every_row(capsys):
    """Rows of one table stand together, and pass on unchanged."""
    rows = [{'table': 'a', 'x': 0.12345}, {'table': 'a', 'y': True}, {'table': 'b', 'z': 'text'}]
    assert list(show.as_tables(rows)) == rows
    out = capsys.readouterr().out
    assert all(word in out for word in ('0.123', 'yes', 'text'))
