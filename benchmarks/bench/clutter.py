"""Boxes strewn around a motion of a Panda, none closer to it than a distance."""

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree, ConvexHull

from bench.built import box, from_rest_to_rest, panda
from bench.kinematics import placed
from trajectory_guard.cell.robot import Robot
from trajectory_guard.cell.scene import Obstacle
from trajectory_guard.paths.joint_path import joint_path, JointPath

CLEARANCE = 0.05
SEED = 1

# Where the boxes lie, and how long their edges are [m].
LOW, HIGH = np.array([-1.3, -1.3, -0.4]), np.array([1.3, 1.3, 1.5])
EDGES = (0.02, 0.12)

WAYPOINTS = (
    (-1.2, 0.1, 0.3, -2.2, 0.0, 2.3, 0.8),
    (-0.4, 0.5, -0.2, -1.6, 0.4, 2.0, 0.2),
    (0.5, 0.2, 0.2, -2.0, -0.3, 2.4, 1.2),
    (1.3, 0.4, -0.3, -1.8, 0.2, 2.1, 0.6),
)

# The links are looked at this often, their surfaces at points so far apart, one point kept for
# each cell of such a width [m].
STEPS = 300
SPACING = 0.02
CELL = 0.015

# What may lie between the points that are kept; the certifier has the last word [m].
COARSE = 0.025

# Cells along one direction, and the number of the one at the origin.
SIDE = 1024
MIDDLE = SIDE // 2


def strewn(most: int) -> tuple[Robot, JointPath, list[Obstacle]]:
    """Return the robot, its motion and boxes; fewer boxes are the first ones of more."""
    robot = panda()
    path = joint_path(robot.movable, from_rest_to_rest(robot, *map(np.array, WAYPOINTS)))
    swept = cKDTree(swept_points(robot, path))
    rng = np.random.default_rng(SEED)
    boxes: list[Obstacle] = []
    while len(boxes) < most:
        size, center = rng.uniform(*EDGES, 3), rng.uniform(LOW, HIGH)
        R = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        R[:, 2] *= np.sign(np.linalg.det(R))
        near = swept.query_ball_point(center, np.linalg.norm(size) / 2 + CLEARANCE + COARSE)
        outside = np.abs((swept.data[near] - center) @ R) - size / 2
        gaps = np.linalg.norm(np.maximum(outside, 0.0), axis=1)
        if gaps.min(initial=np.inf) > CLEARANCE + COARSE:
            boxes.append(box(f'box{len(boxes)}', size, center, R))
    return robot, path, boxes


def swept_points(robot: Robot, path: JointPath) -> np.ndarray:
    """Return points of the surface that the moving links pass, one a cell."""
    spread = {link: surface(points) for link, points in placed(robot, path.position(0)).items()}
    seen = [
        np.unique(numbers(spread[link] @ points))
        for t in np.linspace(0, path.duration_ns, STEPS)
        for link, points in placed(robot, path.position(round(t))).items()
    ]
    found = np.unique(np.concatenate(seen))
    cells = np.column_stack([found // SIDE**2, found // SIDE % SIDE, found % SIDE])
    return CELL * (cells - MIDDLE)


def numbers(points: np.ndarray) -> np.ndarray:
    """Return the number of the cell that each point is in."""
    cells = np.round(points / CELL).astype(np.int64) + MIDDLE
    return cells @ np.array([SIDE**2, SIDE, 1])


def surface(vertices: np.ndarray) -> csr_array:
    """Return weights, a row a point, that spread points over the hull, from its vertices."""
    corners, weights = [], []
    for triangle in ConvexHull(vertices).simplices:
        a, b, c = vertices[triangle]
        longest = max(np.linalg.norm(a - b), np.linalg.norm(b - c), np.linalg.norm(c - a))
        parts = max(1, int(np.ceil(longest / SPACING)))
        for i in range(parts + 1):
            for j in range(parts + 1 - i):
                corners.append(triangle)
                weights.append((i / parts, j / parts, (parts - i - j) / parts))
    ends = np.arange(0, 3 * len(weights) + 1, 3)
    return csr_array((np.ravel(weights), np.ravel(corners), ends), (len(weights), len(vertices)))
