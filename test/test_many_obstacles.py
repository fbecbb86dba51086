"""The tree of boxes: thousands of obstacles give the answer of the few that matter."""

from bench_data import cases, SETTINGS, workcell
import coal
from coal_judge import shape
import kernel_calls
import numpy as np
import pytest
from random_robot import box_body, hull_body, link_poses, pose, random_body
from scipy.spatial.transform import Rotation

from trajectory_guard.cell.pack import boxes, solids
from trajectory_guard.cell.scene import Obstacle, Scene
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import certify
from trajectory_guard.kernels import layout
from trajectory_guard.kernels.cover import cover
from trajectory_guard.kernels.link_motion import link_motion
from trajectory_guard.paths.joint_path import joint_path
from trajectory_guard.request import motion_path
from trajectory_guard.settings import Scope
from trajectory_guard.shapes.body import ConvexBody

COUNT = 3000
CLEARANCE = 0.003


def clutter(rng, count=COUNT):
    """Return small turned boxes in a room, most of them out of the way, as a warehouse has."""
    bodies = []
    for _ in range(count):
        wide = 1.2 if rng.random() < 0.15 else 7.0
        xyz = rng.uniform([-wide, -wide, -0.5], [wide, wide, 2.5])
        if np.linalg.norm(xyz - [0.0, 0.0, 0.4]) < 0.75:
            xyz[:2] += np.sign(xyz[:2]) * 0.75
        size = rng.uniform(0.01, 0.12, 3)
        turned = pose(xyz, Rotation.random(random_state=rng))
        bodies.append(Obstacle(f'o{len(bodies)}', (box_body(size).moved(turned),)))
    return tuple(bodies)


def covered(cell, path):
    """Return leaves and proof of a path."""
    return cover(
        cell.packed,
        motion_path(cell, path, np.zeros(len(path.joint_names))),
        cell.pairs(path.in_path).moving,
        SETTINGS.tolerance,
        CLEARANCE,
        SETTINGS.max_pieces,
        Scope.ALL,
        True,
        np.zeros(1, np.int64),
    )


def near_some_segment(cell, path):
    """Return the obstacles that the scan of some whole segment does not close for some body."""
    near = set()
    motion = motion_path(cell, path, np.zeros(len(path.joint_names)))
    for segment in range(len(path.coefficients)):
        for body in cell.pairs(path.in_path).moving:
            piece = (int(body), segment, 0, 0)
            built = kernel_calls.motion(cell.packed, motion, *piece, False)
            sweep = link_motion(cell.packed, motion, *piece, layout.ECONOMISED)[4]
            centre = cell.links.place[body, layout.CENTRE : layout.HALF]
            place = built.centre.reshape(3, 4) @ [*centre, 1.0]
            near |= {
                *kernel_calls.scan(
                    cell.links,
                    body,
                    cell.packed,
                    CLEARANCE,
                    place,
                    built.reach,
                    0.0,
                    sweep,
                    built.fuzz,
                )
            }
    return sorted(near)


def test_many_give_the_answer_of_the_few_that_matter():
    """A scene of thousands and its part that no whole segment's scan closes: equal intervals."""
    rng = np.random.default_rng(0)
    robot = workcell('panda').robot
    everything = clutter(rng)
    cell = Workcell(robot, Scene(everything, 'all'))
    judged = hits = 0
    for trajectory, _, _ in cases('panda')[::9]:
        path = joint_path(robot.movable, trajectory, None, allow_nonzero_end_velocity=True)
        whole = covered(cell, path)
        keep = near_some_segment(cell, path)
        assert 0 < len(keep) < COUNT / 2
        few = Workcell(robot, Scene(tuple(everything[o] for o in keep), 'few'))
        same = covered(few, path)
        for field in ('segment', 'start', 'end', 'level', 'status', 'reason'):
            np.testing.assert_array_equal(whole.leaves[field], same.leaves[field])
        assert whole.pieces == same.pieces
        a, b = certify(cell, path, SETTINGS), certify(few, path, SETTINGS)
        assert [(r.start_ns, r.end_ns, r.status) for r in a.intervals] == [
            (r.start_ns, r.end_ns, r.status) for r in b.intervals
        ]
        judged += 1
        hits += len(a.intervals) > 1
    assert judged == 7
    assert hits > 0


def test_what_a_scan_closes_is_apart():
    """Coal and the numbers agree that no link comes near what the whole segment's scan closed."""
    rng = np.random.default_rng(1)
    robot = workcell('panda').robot
    cell = Workcell(robot, Scene(clutter(rng), 'all'))
    request, checked = coal.DistanceRequest(), 0
    links = [(name, shape(b)) for name in robot.collision_links for b in robot.bodies(name)]
    obstacles = [shape(o.bodies[0]) for o in cell.scene.obstacles]
    for trajectory, _, _ in cases('panda')[::12]:
        path = joint_path(robot.movable, trajectory, None, allow_nonzero_end_velocity=True)
        found = covered(cell, path)
        balls = found.entries[found.entries['kind'] == layout.BALLS_APART]
        # The nearest of those closed are the ones that a wrong bound would show in.
        for row in rng.permutation(balls)[:400]:
            piece = found.proved_on[row['piece']]
            s = (piece['numerator'] + rng.uniform()) / 2.0 ** piece['level']
            q = path.coefficients[piece['segment']] @ s ** np.arange(6)
            name, (first, shift, ball) = links[row['body']]
            T = link_poses(robot, q)[name] @ shift
            second, other, margin = obstacles[row['obstacle']]
            d = coal.distance(
                first,
                coal.Transform3s(T[:3, :3], T[:3, 3]),
                second,
                coal.Transform3s(other[:3, :3], other[:3, 3]),
                request,
                coal.DistanceResult(),
            )
            assert d - ball - margin > CLEARANCE - 1e-9
            checked += 1
    assert checked > 2000


@pytest.mark.parametrize('scale', [1e-4, 1.0, 1e4])
@pytest.mark.parametrize('count', [1, 7, 8, 9, 16, 17, 500])
def test_the_scan_keeps_exactly_what_is_near(count, scale):
    """Brute force over the boxes finds what the tree finds; none is lost or repeated."""
    rng = np.random.default_rng(count)
    bodies = [
        random_body(rng, 0.1 * scale).moved(pose(rng.normal(size=3) * scale)) for _ in range(count)
    ]
    if count >= 16:  # many at one place, and one that swallows all the others
        bodies[3:9] = [bodies[2]] * 6
        bodies[10] = ConvexBody(np.zeros((1, 3)), ball=0.3 * scale)
    link = hull_body(rng.normal(size=(9, 3)) * 0.1 * scale)
    links, obstacles = solids([link], [0]), solids(bodies, [-1] * count)
    packed = packed_scene(links, obstacles)
    half, pose_ = obstacles.place[:, layout.HALF : layout.BOX], obstacles.place[:, layout.BOX :]
    frame = pose_.reshape(-1, 3, 4)
    seen = set()
    for _ in range(60):
        place = rng.normal(size=3) * scale
        sweep = rng.uniform(0.0, 1.0) * scale
        open_ = kernel_calls.scan(links, 0, packed, 0.0, place, 2.0 * scale, sweep=sweep)
        local = np.einsum('nrc,nr->nc', frame[:, :, :3], place - frame[:, :, 3])
        outside = np.maximum(np.abs(local) - half, 0.0)
        apart = np.linalg.norm(outside, axis=1) - obstacles.size[:, layout.BALL]
        near = apart - links.size[0, [layout.BALL, layout.CORE]].sum() - sweep
        assert len(set(open_)) == len(open_)
        # Never closed when it is near, and closed when it is farther than rounding.
        assert set(np.flatnonzero(near <= 0.0)) <= set(open_)
        assert set(open_) <= set(np.flatnonzero(near <= 1e-12 * scale))
        seen |= set(open_)
    assert len(seen) > 0.8 * count


def packed_scene(links, obstacles):
    """Return links and obstacles packed for the kernels, without a robot."""
    chain = layout.Chain(
        np.array([-1]), np.array([layout.REVOLUTE]), np.eye(4)[None, :3].reshape(1, 12), np.ones(1)
    )
    chain = chain._replace(depth=chain.depth.astype(np.int64))
    zeros = np.zeros(len(links.ranges))
    return layout.Packed(
        chain, links, obstacles, boxes(obstacles), layout.Extents(zeros, zeros, zeros)
    )


def test_every_obstacle_hangs_on_the_tree_once():
    """Each lane's obstacle is there once, below bounds that contain its box and its ball."""
    rng = np.random.default_rng(2)
    for count in (1, 2, 8, 9, 63, 64, 65, 1000):
        obstacles = solids(
            [random_body(rng).moved(pose(rng.normal(size=3))) for _ in range(count)], [-1] * count
        )
        tree = boxes(obstacles)
        assert sorted(tree.obstacle[tree.obstacle >= 0]) == list(range(count))
        assert len(tree.box) <= count / 8 + 1 + count / 32

        def contents(node, tree=tree):
            left, right = tree.branch[node]
            if left < 0:
                return [o for o in tree.obstacle[right] if o >= 0]
            return contents(left) + contents(right)

        for node, bounds in enumerate(tree.bounds):
            for o in contents(node)[:: 1 + count // 100]:
                half = obstacles.place[o, layout.HALF : layout.BOX]
                frame = obstacles.place[o, layout.BOX :].reshape(3, 4)
                for corner in np.ndindex(2, 2, 2):
                    x = frame[:, :3] @ (half * (2 * np.array(corner) - 1)) + frame[:, 3]
                    ball = obstacles.size[o, layout.BALL]
                    assert (bounds[:3] <= x - ball).all() and (x + ball <= bounds[3:]).all()
        assert sorted(contents(0)) == list(range(count))
