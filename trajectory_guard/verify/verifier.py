"""The verb: prove again everything that a certificate claims."""

from collections import Counter
from collections.abc import Mapping
import time
from typing import Any

from trajectory_guard.cell.robot import Robot
from trajectory_guard.cell.scene import Scene
from trajectory_guard.errors import TrajectoryGuardError
from trajectory_guard.paths.trajectory import JointState, Trajectory
from trajectory_guard.verify.cell import Cell
from trajectory_guard.verify.cover import by_pair, check_collision, check_free, partition, spans
from trajectory_guard.verify.curve import curve
from trajectory_guard.verify.document import check_shape, parse, text
from trajectory_guard.verify.entries import entries
from trajectory_guard.verify.invalid import invalid
from trajectory_guard.verify.series import precision
from trajectory_guard.verify.verified import Verified


def verify(
    certificate: Mapping[str, Any] | str, robot: Robot, scene: Scene, trajectory: Trajectory
) -> Verified:
    """
    Prove again what a certificate claims about a trajectory.

    :param certificate: its JSON object, or the text of that.
    :param robot: the robot it must be about.
    :param scene: the obstacles it must be about.
    :param trajectory: the trajectory it must be about.
    :raises TrajectoryGuardError: the first thing that does not hold, with reason
        ``certificate_invalid``; or robot or scene cannot be used.
    """
    begin = time.perf_counter()
    certificate = parse(certificate if isinstance(certificate, str) else text(certificate))
    check_shape(certificate)
    _check_subjects(certificate, robot, scene, trajectory)
    with precision():
        start = _start(certificate)
        motion = curve(robot.movable, trajectory, start)
        knots_ns = [knot.time_ns for knot in motion.knots]
        where = spans(certificate['pieces'], knots_ns)
        claims = entries(certificate)
        intervals = partition(
            certificate['intervals'], certificate['duration_ns'], certificate['verdict']
        )
        cell = Cell(certificate, robot, scene, motion)
        bodies = [b for b, link in enumerate(cell.links) if cell.moves(link.name)]
        pairs = [(b, o) for b in bodies for o in range(len(cell.obstacles))]
        if not pairs:
            raise invalid('robot.links: no joint of the trajectory moves one')
        apart = [e for e in claims if e.kind != 'collisions']
        check_free(
            intervals,
            pairs,
            by_pair((e.body, e.obstacle, where[e.piece]) for e in apart),
            (certificate['robot']['links'], certificate['scene']['obstacles']),
        )
        check_collision(intervals, (where[e.piece] for e in claims if e.kind == 'collisions'))
        halvings = cell.prove(claims)
    return Verified(
        name=certificate['trajectory']['name'],
        verdict=certificate['verdict'],
        intervals=tuple(intervals),
        clearance=float(certificate['request']['clearance']),
        tracking_tolerance=dict(certificate['request']['tracking_tolerance']),
        start=None if start is None else _positions(start),
        pairs=len(pairs),
        unmoved=tuple(sorted({link.name for link in cell.links if not cell.moves(link.name)})),
        entries=dict(Counter(entry.kind for entry in claims)),
        halvings=halvings,
        seconds=time.perf_counter() - begin,
    )


def _positions(state: JointState) -> dict[str, float]:
    return dict(zip(state.joint_names, state.positions.tolist(), strict=True))


def _check_subjects(
    certificate: Mapping[str, Any], robot: Robot, scene: Scene, trajectory: Trajectory
) -> None:
    """Refuse a certificate that is about something else."""
    about = certificate['trajectory']
    links = [link for link in robot.collision_links for _ in robot.bodies(link)]
    obstacles = [obstacle.name for obstacle in scene.obstacles for _ in obstacle.bodies]
    movable = {joint.name for joint in robot.movable}
    for where, said, found in (
        ('trajectory.sha256', about['sha256'], trajectory.digest()),
        ('trajectory.joint_names', about['joint_names'], list(trajectory.joint_names)),
        ('robot.sha256', certificate['robot']['sha256'], robot.digest()),
        ('robot.links', certificate['robot']['links'], links),
        ('scene.sha256', certificate['scene']['sha256'], scene.digest),
        ('scene.obstacles', certificate['scene']['obstacles'], obstacles),
        ('duration_ns', certificate['duration_ns'], int(trajectory.times_ns[-1])),
    ):
        if said != found:
            raise invalid(f'{where}: the certificate has {said!r:.100}, given is {found!r:.100}')
    frames = certificate['scene']['frames']
    if len(frames) != len(obstacles) or any(len(frame) != 9 for frame in frames):
        raise invalid('scene.frames: not nine numbers for each obstacle')
    if wrong := movable ^ set(certificate['request']['tracking_tolerance']):
        raise invalid(f'request.tracking_tolerance: joints missing or unknown: {sorted(wrong)}')


def _start(certificate: Mapping[str, Any]) -> JointState | None:
    """Return the start state that the certificate assumes."""
    start = certificate['trajectory']['start']
    if start is None:
        return None
    try:
        return JointState(tuple(start['joint_names']), start['positions'], start['velocities'])
    except TrajectoryGuardError as error:
        raise invalid(f'trajectory.start: {error}') from error
