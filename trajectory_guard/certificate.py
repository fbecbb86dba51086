"""
Certificates: what proves an answer, as a JSON object that anyone can check without the kernels.

Times are exact dyadic parts of segments, numbers are the doubles that were compared. What the
claims mean is said, and proved again, by ``trajectory_guard.verify``, which shares no code with
what made them.
"""

import hashlib
from itertools import groupby
import json

import numpy as np

from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.kernels import layout
from trajectory_guard.kernels.cover import Covered
from trajectory_guard.paths.joint_path import INTERPOLATION, JointPath
from trajectory_guard.paths.trajectory import JointState, Trajectory
from trajectory_guard.result import Result

FORMAT = 'trajectory_guard/certificate/1'


def certificate(
    workcell: Workcell,
    trajectory: Trajectory,
    start: JointState | None,
    path: JointPath,
    slack: np.ndarray,
    result: Result,
    leaves: np.ndarray,
    covered: Covered,
) -> dict:
    """
    Write down what proves a result.

    :param workcell: robot and scene.
    :param trajectory: the message.
    :param start: where the robot was said to be at time 0.
    :param path: the curve that was judged.
    :param slack: (n,) tracking tolerance per movable joint [rad or m].
    :param result: the answer.
    :param leaves: (L,) LEAF that the answer's intervals were made of.
    :param covered: what the cover proved.
    :returns: a JSON object, sealed with the SHA-256 of itself.
    """
    pieces = covered.proved_on.tolist()
    body = {
        'format': FORMAT,
        'trajectory': {
            'name': trajectory.name,
            'sha256': trajectory.digest(),
            'interpolation': INTERPOLATION,
            'joint_names': list(trajectory.joint_names),
            'start': None if start is None else _state(start),
        },
        'robot': {'sha256': workcell.robot_hash, 'links': list(workcell.link_names)},
        'scene': {
            'sha256': workcell.scene_hash,
            'obstacles': list(workcell.obstacle_names),
            'frames': _frames(workcell),
        },
        'request': {
            'tolerance': result.tolerance,
            'clearance': result.clearance,
            'tracking_tolerance': dict(zip(path.joint_names, slack.tolist(), strict=True)),
        },
        'duration_ns': result.duration_ns,
        'verdict': result.verdict.name.lower(),
        'unchecked_pairs': list(result.unchecked_pairs),
        'intervals': [
            [row.start_ns, row.end_ns, row.status.name.lower()] for row in result.intervals
        ],
        'pieces': pieces,
        **_apart(covered.entries),
        'collisions': _collisions(workcell, leaves, pieces),
    }
    return {**body, 'sha256': seal(body)}


def seal(body: dict) -> str:
    """Return the SHA-256 of a certificate without its seal, in hex."""
    return hashlib.sha256(
        json.dumps(body, sort_keys=True, separators=(',', ':'), allow_nan=False).encode()
    ).hexdigest()


def text(certificate: dict) -> str:
    """Return a certificate as a file has it."""
    return json.dumps(certificate, separators=(',', ':'), allow_nan=False) + '\n'


def _state(start: JointState) -> dict:
    return {
        'joint_names': list(start.joint_names),
        'positions': start.positions.tolist(),
        'velocities': None if start.velocities is None else start.velocities.tolist(),
    }


def _frames(workcell: Workcell) -> list[list[float]]:
    """Return the rotation of each obstacle's box, row by row."""
    pose = workcell.obstacles.place[:, layout.BOX :].reshape(-1, 3, 4)
    frames: list[list[float]] = pose[:, :, :3].reshape(-1, 9).tolist()
    return frames


def _apart(entries: np.ndarray) -> dict:
    """Return the entries that keep pairs apart, by kind."""
    balls = []
    some = entries[entries['kind'] == layout.BALLS_APART]
    columns = [some[name].tolist() for name in ('piece', 'body', 'obstacle')]
    rows = sorted(zip(*columns, strict=True))
    for (piece, body), group in groupby(rows, key=lambda row: row[:2]):
        balls.append([piece, body, [obstacle for _, _, obstacle in group]])
    return {
        'balls': balls,
        'planes': _rows(entries, layout.PLANE_BETWEEN, ('n', 'offset')),
        'turning': _rows(entries, layout.PLANE_TURNING, ('n', 'm', 'k')),
    }


def _rows(entries: np.ndarray, kind: int, numbers: tuple[str, ...]) -> list[list]:
    """Return the entries of a kind: piece, body, obstacle, and some of their numbers."""
    some = entries[entries['kind'] == kind]
    pairs = np.column_stack([some[name] for name in ('piece', 'body', 'obstacle')]).tolist()
    values = np.column_stack([some[name] for name in numbers]).tolist()
    return [pair + value for pair, value in zip(pairs, values, strict=True)]


def _collisions(workcell: Workcell, leaves: np.ndarray, pieces: list) -> list[list]:
    """Return the moving witnesses in the links' own frames; their pieces are appended."""
    rows: list[list] = []
    for leaf in leaves[leaves['status'] == layout.COLLISION]:
        link = workcell.link_names[leaf['body']]
        T = workcell.tree.link_pose[link]
        ends = [((leaf[name] - T[:3, 3]) @ T[:3, :3]).tolist() for name in ('y0', 'y1')]
        for numerator in range(int(leaf['start']), int(leaf['end'])):
            pieces.append((int(leaf['segment']), numerator, int(leaf['level'])))
            rows.append(
                [len(pieces) - 1, int(leaf['body']), int(leaf['obstacle']), *ends[0], *ends[1]]
            )
    return rows
