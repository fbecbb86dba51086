"""
Verdicts and times on the benchmark trajectories, against their certified truth.

One thread, warm; the best of several runs per trajectory, then median and 90th percentile.
"""

import argparse
import collections
import json
from pathlib import Path
import statistics
import sys
import time

from rich.console import Console
from rich.table import Table

from trajectory_guard.certify import certify
from trajectory_guard.joint_path import joint_path
from trajectory_guard.result import Status, Verdict
from trajectory_guard.scene import load_scene
from trajectory_guard.settings import Settings
from trajectory_guard.trajectory import Point, Trajectory
from trajectory_guard.urdf import load_robot
from trajectory_guard.workcell import Workcell

DATA = Path(__file__).parent.parent / 'test' / 'data' / 'bench'
RUNS = 5


def trajectory(names: list[str], case: dict) -> Trajectory:
    """Return a case of the set as a trajectory."""
    return Trajectory.from_points(
        names,
        [
            Point(round(1e9 * t), p, v)
            for t, p, v in zip(case['times'], case['positions'], case['velocities'], strict=True)
        ],
    )


def percentile(values: list[float], share: float) -> float:
    """Return the value below which a share of the values lies."""
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def measure(folder: Path, robot: str, data: dict, tolerance: float) -> list[dict]:
    """Return one row per category of a robot, and one for all."""
    cell = Workcell(load_robot(folder / f'{robot}.urdf'), load_scene([folder / 'scene.urdf']))
    settings = Settings(tolerance=tolerance, allow_nonzero_end_velocity=True)
    groups = collections.defaultdict(list)
    for case in data['trajectories']:
        message = trajectory(data['joint_names'], case)
        path = joint_path(cell.robot.movable, message, None, allow_nonzero_end_velocity=True)
        seconds = []
        for _ in range(RUNS + 1):
            begin = time.perf_counter()
            result = certify(cell, path, settings)
            seconds.append(time.perf_counter() - begin)
        truth = case['truth']
        free = [row for row in result.intervals if row.status == Status.FREE]
        row = {
            'ms': 1e3 * min(seconds[1:]),
            'pieces': result.pieces,
            'missed': truth['colliding'] and result.verdict == Verdict.FREE,
            'false alarm': not truth['colliding'] and result.verdict != Verdict.FREE,
            'free in contact': sum(
                row.start_ns < 1e9 * b and 1e9 * a < row.end_ns
                for row in free
                for a, b in truth['contact_core']
            ),
        }
        groups[case['category']].append(row)
        groups['all'].append(row)
    return [
        {
            'robot': robot,
            'category': category,
            'trajectories': len(rows),
            'missed': sum(row['missed'] for row in rows),
            'false alarms': sum(row['false alarm'] for row in rows),
            'free in contact': sum(row['free in contact'] for row in rows),
            'pieces': statistics.median(row['pieces'] for row in rows),
            'median ms': statistics.median(row['ms'] for row in rows),
            'p90 ms': percentile([row['ms'] for row in rows], 0.9),
        }
        for category, rows in groups.items()
    ]


def main() -> int:
    """Measure and print; exit 1 if anything colliding was called free."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--data', type=Path, default=DATA, help='folder with trajectories.json')
    parser.add_argument('--tolerance', type=float, default=1e-4, help='[m]')
    parser.add_argument('--json', action='store_true', help='one object a row')
    arguments = parser.parse_args()
    robots = json.loads((arguments.data / 'trajectories.json').read_text())['robots']
    rows = [
        row
        for robot, data in robots.items()
        for row in measure(arguments.data, robot, data, arguments.tolerance)
    ]
    if arguments.json:
        for row in rows:
            print(json.dumps(row))
    else:
        table = Table(*rows[0])
        for row in rows:
            table.add_row(*(f'{v:.2f}' if isinstance(v, float) else str(v) for v in row.values()))
        Console().print(table)
    return int(any(row['missed'] or row['free in contact'] for row in rows))


if __name__ == '__main__':
    sys.exit(main())
