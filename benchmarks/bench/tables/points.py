"""Cost against the number of points, and of a first contact early in a long trajectory."""

from collections.abc import Iterator

import numpy as np

from bench.built import panda, SCENE
from bench.cases import Bench
from bench.clock import interleaved
from trajectory_guard.cell.scene import load_scene
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import certify, judge
from trajectory_guard.paths.joint_path import joint_path
from trajectory_guard.paths.trajectory import Trajectory
from trajectory_guard.result import NANOSECONDS, Status
from trajectory_guard.settings import Scope, Settings

COUNTS = (10, 100, 1000, 10_000)

# Linear: a point costs no more than so many times the least of the shorter ones.
MOST_OF_LEAST = 1.5

# The wiggle: a pose well clear of the scene, how far each joint swings [rad], a point every 0.1 s.
CENTER = np.array([0.0, -0.6, 0.0, -2.2, 0.0, 1.7, 0.785])
SWING = 0.12
SPACING_NS = NANOSECONDS // 10
SEED = 2

# From this point on for so many points the arm reaches into the shelf.
DIVE, DIVE_POINTS = 20, 10
DEEP = np.array([0.0, 1.2, 0.0, -1.0, 0.0, 2.2, 0.785])


def points(_: list[Bench]) -> Iterator[dict]:
    """Yield a row a count, and rows for the first contact."""
    cell = Workcell(panda(), load_scene(SCENE))
    yield from linear(cell)
    yield from first_contact(cell)


def wiggle(cell: Workcell, count: int, dive: bool = False) -> Trajectory:
    """Return a long motion; a shorter one is the beginning of a longer one, but for its end."""
    rng = np.random.default_rng(SEED)
    rate, phase = rng.uniform(1.0, 3.0, 7), rng.uniform(0.0, 2.0 * np.pi, 7)
    times_ns = SPACING_NS * np.arange(count, dtype=np.int64)
    angle = np.outer(times_ns / NANOSECONDS, rate) + phase
    positions = CENTER + SWING * np.sin(angle)
    velocities = SWING * rate * np.cos(angle)
    velocities[[0, -1]] = 0.0
    if dive:
        positions[DIVE : DIVE + DIVE_POINTS] = DEEP
        velocities[DIVE - 1 : DIVE + DIVE_POINTS + 1] = 0.0
    return Trajectory(
        joint_names=tuple(joint.name for joint in cell.robot.movable),
        times_ns=times_ns,
        positions=positions,
        velocities=velocities,
        has_velocities=np.ones(count, bool),
        accelerations=np.zeros_like(positions),
        has_accelerations=np.zeros(count, bool),
    )


def linear(cell: Workcell) -> Iterator[dict]:
    """Yield the cost of all intervals of a free motion."""
    least = None
    for count in COUNTS:
        trajectory = wiggle(cell, count)
        path = joint_path(cell.robot.movable, trajectory)
        best = interleaved(
            {
                'certify': lambda path=path: certify(cell, path, Settings()),
                'judge': lambda trajectory=trajectory: judge(cell, trajectory),
            },
        )
        ms, result = 1e3 * best['certify'][0], best['certify'][1]
        row = {
            'table': 'points',
            'points': count,
            'verdict': result.verdict.name.lower(),
            'pieces': result.pieces,
            'ms': ms,
            'with_reading_ms': 1e3 * best['judge'][0],
            'us_a_point': 1e3 * ms / count,
        }
        if least is not None:
            row['target'] = f'us a point <= {MOST_OF_LEAST:g} x the least above'
            row['met'] = row['us_a_point'] <= MOST_OF_LEAST * least
        least = min(least or row['us_a_point'], row['us_a_point'])
        yield row


def first_contact(cell: Workcell) -> Iterator[dict]:
    """Yield the cost of a first contact early in a short and in a long trajectory."""
    first, nothing = Settings(scope=Scope.FIRST), Settings(scope=Scope.FIRST, max_pieces=0)
    search = {}
    for count in (COUNTS[1], COUNTS[-1]):
        path = joint_path(cell.robot.movable, wiggle(cell, count, dive=True), None)
        best = interleaved(
            {
                'first': lambda path=path: certify(cell, path, first),
                'reading': lambda path=path: certify(cell, path, nothing),
            }
        )
        ms, reading = 1e3 * best['first'][0], 1e3 * best['reading'][0]
        search[count] = max(ms - reading, 0.0)
        result = best['first'][1]
        hits = [row for row in result.intervals if row.status != Status.FREE]
        row = {
            'table': 'early',
            'points': count,
            'verdict': result.verdict.name.lower(),
            'not_free_from_s': hits[0].start_ns / NANOSECONDS if hits else None,
            'pieces': result.pieces,
            'ms': ms,
            'reading_ms': reading,
            'search_ms': search[count],
        }
        if len(search) > 1:
            row['target'] = f'search_ms <= {MOST_OF_LEAST:g} x that of {COUNTS[1]}'
            row['met'] = search[count] <= MOST_OF_LEAST * search[COUNTS[1]]
        yield row
