"""
G1 by brute force: no configuration in the tube of a free interval comes within the clearance.

The judge is coal on random configurations, near the ends of free intervals and at the corners of
the tracking tolerance on purpose. The normal run takes 10^5 of them; ``-m slow`` takes 10^7 in
two processes, or as many as the environment variable TRAJECTORY_GUARD_SWEEP says.
"""

from concurrent.futures import ProcessPoolExecutor
import dataclasses
import multiprocessing
import os

from bench_data import cases, ROBOTS, SETTINGS, workcell
import numpy as np
import pytest
from random_robot import link_poses, random_path, random_robot
from sweep import Counts, Sweep, swept
from test_certify import random_scene

from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import certify
from trajectory_guard.paths.joint_path import joint_path
from trajectory_guard.request import tracking_slack
from trajectory_guard.settings import Settings

SAMPLES = 100_000
MANY = int(float(os.environ.get('TRAJECTORY_GUARD_SWEEP', '1e7')))
PROCESSES = 2

# Clearance [m] and tracking tolerance [rad or m].
ASKED = [(0.0, 0.0), (0.0, 0.005), (0.01, 0.002), (0.003, 0.02)]
# Robots of the second kind: any tree of joints among hulls, balls and cylinders.
RANDOM_ROBOTS = 12


def moved_links(cell, path):
    """Return the names of the links that a path moves."""
    return {cell.link_names[b] for b in cell.pairs(path.in_path).moving}


def bench(robot, seed, count):
    """Sweep every trajectory of a robot of the bench, each with every request."""
    rng = np.random.default_rng(seed)
    cell = workcell(robot)
    sweep, counts = Sweep(cell), Counts()
    each = 1 + count // (len(cases(robot)) * len(ASKED))
    for trajectory, _, _ in cases(robot):
        path = joint_path(cell.robot.movable, trajectory, None, allow_nonzero_end_velocity=True)
        for clearance, tracking in ASKED:
            settings = dataclasses.replace(
                SETTINGS, clearance=clearance, tracking_tolerance=(tracking,)
            )
            result = certify(cell, path, settings)
            slack = np.full(len(path.joint_names), tracking)
            counts = counts.plus(
                swept(sweep, moved_links(cell, path), path, result, slack, rng, each)
            )
    return counts


def without_jumps(path):
    """Return a path whose segments meet: at a knot it has one position."""
    c = path.coefficients.copy()
    for segment in range(1, len(c)):
        c[segment, :, 0] = c[segment - 1].sum(axis=1)
    return dataclasses.replace(path, coefficients=c)


def anything(seed, count):
    """Sweep random robots among random obstacles."""
    rng = np.random.default_rng(seed)
    counts = Counts()
    each = 1 + count // (RANDOM_ROBOTS * 3 * len(ASKED))
    for _ in range(RANDOM_ROBOTS):
        cell = Workcell(random_robot(rng, int(rng.integers(2, 8))), random_scene(rng, 8))
        sweep = Sweep(cell)
        for spread in (0.1, 0.4, 1.5):
            path = without_jumps(random_path(rng, cell.robot, spread=spread))
            for clearance, tracking in ASKED:
                settings = Settings(
                    tolerance=1e-3,
                    clearance=clearance,
                    tracking_tolerance=(tracking,),
                    max_pieces=3000,
                )
                result = certify(cell, path, settings)
                slack = tracking_slack(cell.robot.movable, path, (), settings)
                counts = counts.plus(
                    swept(sweep, moved_links(cell, path), path, result, slack, rng, each)
                )
    return counts


def everything(seed, count):
    """Sweep both robots of the bench and the random ones; about `count` samples."""
    counts = anything(seed, count // 4)
    for robot in ROBOTS:
        counts = counts.plus(bench(robot, seed, (count - counts.samples) // 2 or 1))
    while counts.samples < count:
        # Some paths have no free interval: their share goes to the bench.
        counts = counts.plus(bench(ROBOTS[seed % 2], seed + 1, count - counts.samples))
    return counts


def assert_sound(counts, least):
    """Check what a sweep saw: nothing wrong, and near misses among it."""
    assert counts.samples >= least
    assert counts.violations == 0, counts
    assert counts.missed == 0, counts
    assert counts.hits > 0.01 * counts.samples
    assert counts.queries > 0.1 * counts.samples
    assert 0.0 <= counts.nearest + 1e-9 < 1e-4, counts


def test_free_is_free():
    """10^5 samples."""
    assert_sound(everything(1, SAMPLES), SAMPLES)


@pytest.mark.slow
def test_free_is_free_many():
    """TRAJECTORY_GUARD_SWEEP samples, by default 10^7, in two processes."""
    share = -(-MANY // PROCESSES)
    # Each round is a new set of random robots and seeds.
    rounds = max(1, round(share / 500_000))
    jobs = [(2 + PROCESSES * k + p, -(-share // rounds)) for k in range(rounds) for p in range(2)]
    counts = Counts()
    with ProcessPoolExecutor(PROCESSES, multiprocessing.get_context('spawn')) as pool:
        for found in pool.map(everything, *zip(*jobs, strict=True)):
            counts = counts.plus(found)
    print(counts)
    assert_sound(counts, MANY)


@pytest.mark.parametrize('robot', ROBOTS)
def test_the_judge_sees_what_the_slow_judge_sees(robot):
    """Spheres and boxes leave nothing out: the distances are those of all pairs, one by one."""
    from coal_judge import Judge

    rng = np.random.default_rng(3)
    cell = workcell(robot)
    sweep, judge = Sweep(cell), Judge(cell)
    path = joint_path(
        cell.robot.movable, cases(robot)[5][0], None, allow_nonzero_end_velocity=True
    )
    q = path.coefficients[0, :, 0] + rng.uniform(-1.5, 1.5, (150, len(path.joint_names)))
    moved = moved_links(cell, path)
    gaps, _ = sweep.gaps(q, moved, 0.02)
    slow = np.array([judge.clearance(row, moved) for row in q])
    np.testing.assert_allclose(gaps[slow < 0.019], slow[slow < 0.019], atol=1e-7)
    assert (gaps[slow > 0.021] > 0.02).all()
    assert 20 < (slow < 0.019).sum() < 140


def test_the_vectorised_poses_are_the_slow_ones():
    """Every joint kind, branches and mimic joints: the same poses as by scipy's rotations."""
    rng = np.random.default_rng(4)
    for _ in range(5):
        cell = Workcell(random_robot(rng, 7), random_scene(rng, 2))
        q = rng.normal(size=(6, len(cell.robot.movable)))
        R, t = Sweep(cell).poses(q)
        for k, row in enumerate(q):
            for link, T in link_poses(cell.robot, row).items():
                np.testing.assert_allclose(R[link][k], T[:3, :3], atol=1e-13)
                np.testing.assert_allclose(t[link][k], T[:3, 3], atol=1e-13)
