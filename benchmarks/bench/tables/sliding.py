"""Motions along a face and about an edge, at gaps that a distance bound pays for dearly."""

from collections.abc import Iterator

import numpy as np

from bench.built import box, from_rest_to_rest, one_joint, panda, plate, REACHING
from bench.cases import Bench
from bench.clock import best_ms
from bench.kinematics import placed, turn
from bench.peers import Baseline, Spline, VERDICTS
from trajectory_guard.cell.robot import Robot
from trajectory_guard.cell.scene import Scene
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import certify
from trajectory_guard.paths.joint_path import joint_path
from trajectory_guard.result import Verdict
from trajectory_guard.settings import Settings

GAP = 1e-5
SETTINGS = Settings(tolerance=1e-6)
SWEEP = 2.0
SLIDING_MS, ROLLING_PIECES = 0.2, 100
ROLL = 0.6

# Farther from the axis of joint 1 there is only the hand that low [m].
HAND = 0.35


def sliding(_: list[Bench]) -> Iterator[dict]:
    """Yield a row a motion; all of them are free."""
    robot = one_joint('0 0 1', (0.25, 0.0, 0.025 + GAP), (0.4, 0.1, 0.05))
    below = plate((2.0, 2.0, 0.02), (0.0, 0.0, -0.01))
    row = measured(robot, below, np.array([-SWEEP / 2]), np.array([SWEEP / 2]))
    yield met({'motion': 'a box slides 2 rad along a plate'} | row, 'ms', SLIDING_MS)

    robot, begin, end = panda(), np.array(REACHING), np.array(REACHING)
    begin[0], end[0] = -SWEEP / 2, SWEEP / 2
    points = np.vstack(list(placed(robot, begin).values()))
    lowest = points[np.hypot(points[:, 0], points[:, 1]) > HAND, 2].min()
    below = plate((0.8, 1.6, 0.02), (0.65, 0.0, lowest - GAP - 0.01))
    row = measured(robot, below, begin, end)
    yield met({'motion': 'joint 1 of a Panda slides the hand 2 rad'} | row, 'ms', SLIDING_MS)

    # The lower face passes the axis at the gap; the axis is the upper edge of a box on its edge.
    robot = one_joint('0 1 0', (0.0, 0.0, 0.025 + GAP), (0.4, 0.2, 0.05))
    R = turn(np.array([0.0, 1.0, 0.0]), np.pi / 4)
    wedge = box('edge', (0.1, 0.3, 0.1), np.array([0.0, 0.0, -0.05 * np.sqrt(2.0)]), R)
    row = measured(robot, Scene((wedge,), ''), np.array([-ROLL]), np.array([ROLL]))
    yield met({'motion': 'a face turns 1.2 rad about an edge'} | row, 'pieces', ROLLING_PIECES)


def measured(robot: Robot, scene: Scene, begin: np.ndarray, end: np.ndarray) -> dict:
    """Return a row for a motion from one pose to another."""
    cell = Workcell(robot, scene)
    path = joint_path(robot.movable, from_rest_to_rest(robot, begin, end))
    ms, result = best_ms(lambda: certify(cell, path, SETTINGS))
    baseline, spline = Baseline(cell), Spline.from_path(path)
    ca_ms, ca = best_ms(lambda: baseline.verdict(spline), 1)
    return {
        'gap_mm': 1e3 * GAP,
        'verdict': result.verdict.name.lower(),
        'ms': ms,
        'pieces': result.pieces,
        'ca_verdict': VERDICTS[ca],
        'ca_ms': ca_ms,
    }


def met(row: dict, column: str, most: float) -> dict:
    """Return the row with its target."""
    free = row['verdict'] == Verdict.FREE.name.lower()
    target = {'target': f'{column} <= {most}', 'met': free and row[column] <= most}
    return {'table': 'sliding'} | row | target
