"""Certificates on the command line to what they prove, and that to text."""

from collections.abc import Iterator, Sequence
import json
from pathlib import Path
import sys
from typing import Any, NamedTuple

from trajectory_guard.cell.pose import pose_matrix
from trajectory_guard.cell.robot import Robot
from trajectory_guard.cell.scene import load_scene, Scene
from trajectory_guard.cell.urdf import load_robot
from trajectory_guard.command_line.exit_code import ExitCode
from trajectory_guard.command_line.printable import printable
from trajectory_guard.command_line.request import Verification
from trajectory_guard.command_line.sources import Selection, sources
from trajectory_guard.errors import Reason, TrajectoryError, TrajectoryGuardError
from trajectory_guard.paths.trajectory import Trajectory
from trajectory_guard.result import NANOSECONDS
from trajectory_guard.verify import Verified, verify
from trajectory_guard.verify.document import parse
from trajectory_guard.verify.verified import TRUSTED

# A certificate is about 10 kB; larger than this is none [bytes].
LARGEST_FILE = 1 << 28

# More intervals than this nobody reads; --json has them all.
MAX_ROWS = 20

_WORDS = {
    'balls': 'spheres apart',
    'planes': 'planes between',
    'turning': 'turning planes between',
    'collisions': 'overlaps',
}


class Finding(NamedTuple):
    """
    What became of one certificate.

    :param path: its file.
    :param verified: what it proves, or why it does not.
    :param code: exit code.
    """

    path: Path
    verified: Verified | TrajectoryGuardError
    code: ExitCode

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object of the finding, times in seconds."""
        row: dict[str, Any] = {'certificate': str(self.path)}
        if not isinstance(self.verified, Verified):
            error = self.verified
            return {**row, 'holds': False, 'reason_code': str(error.reason), 'message': str(error)}
        return {**row, 'holds': True, 'reason_code': '', 'message': '', **_proved(self.verified)}


def verify_all(verification: Verification, as_json: bool) -> ExitCode:
    """
    Verify, print each finding as it comes, and return the exit code.

    :param verification: what to verify, against what.
    :param as_json: one JSON object a line, and nothing else on stdout.
    :raises TrajectoryGuardError: robot, scene or trajectories cannot be used, so nothing can.
    """
    robot = load_robot(verification.urdf)
    pose = verification.scene_pose
    scene = load_scene(
        verification.scenes, None if pose is None else pose_matrix(pose.xyz, pose.rpy)
    )
    trajectories = _trajectories(verification.trajectories)
    code = ExitCode.ALL_PROVED
    for path in _files(verification.certificates):
        finding = _finding(path, robot, scene, trajectories)
        for line in [json.dumps(finding.to_dict())] if as_json else _lines(finding):
            print(line if as_json else printable(line), flush=True)
        if as_json and isinstance(finding.verified, TrajectoryGuardError):
            print(printable(f'error: {path}: {finding.verified}'), file=sys.stderr, flush=True)
        code = max(code, finding.code)
    if not as_json:
        print('taken for granted: ' + '; '.join(TRUSTED))
    return code


def _files(paths: Sequence[Path]) -> Iterator[Path]:
    for path in paths:
        if not path.is_dir():
            yield path
            continue
        inside = sorted(path.glob('*.json'))
        if not inside:
            raise TrajectoryGuardError(
                Reason.CERTIFICATE_INVALID, f'{path}: no certificate (*.json) in it'
            )
        yield from inside


def _trajectories(paths: Sequence[Path]) -> dict[str, Trajectory]:
    """Return what the files hold by its digest; what is unreadable beside others is left out."""
    found = {}
    error: TrajectoryError | None = None
    for path in paths:
        for source in sources(path, Selection()):
            if isinstance(source.trajectory, TrajectoryError):
                error = error or source.trajectory
            elif isinstance(source.trajectory, Trajectory):
                # Certificates are written of no others.
                found[source.trajectory.digest()] = source.trajectory
    if error is not None and not found:
        raise error
    return found


def _finding(
    path: Path, robot: Robot, scene: Scene, trajectories: dict[str, Trajectory]
) -> Finding:
    try:
        certificate = parse(_text(path))
    except TrajectoryGuardError as error:
        return Finding(path, error, ExitCode.BAD_INPUT)
    about = certificate.get('trajectory')
    digest = about.get('sha256') if isinstance(about, dict) else None
    # Of another trajectory the verifier itself says that it is not the one.
    other = next(iter(trajectories.values()))
    trajectory = trajectories.get(digest, other) if isinstance(digest, str) else other
    try:
        return Finding(path, verify(certificate, robot, scene, trajectory), ExitCode.ALL_PROVED)
    except TrajectoryGuardError as error:
        invalid = error.reason is Reason.CERTIFICATE_INVALID
        return Finding(path, error, ExitCode.NOT_PROVED if invalid else ExitCode.BAD_INPUT)


def _text(path: Path) -> str:
    try:
        with path.open('rb') as file:
            data = file.read(LARGEST_FILE + 1)
        if len(data) > LARGEST_FILE:
            raise TrajectoryGuardError(Reason.TOO_LARGE, f'larger than {LARGEST_FILE} bytes')
        return data.decode()
    except OSError as error:
        problem = error.strerror or type(error).__name__
        raise TrajectoryGuardError(Reason.CERTIFICATE_INVALID, problem) from error
    except UnicodeDecodeError as error:
        raise TrajectoryGuardError(Reason.CERTIFICATE_INVALID, f'no text: {error}') from error


def _proved(verified: Verified) -> dict[str, Any]:
    return {
        'trajectory': verified.name,
        'verdict': verified.verdict,
        'duration': verified.intervals[-1][1] / NANOSECONDS,
        'intervals': [
            {'start': start / NANOSECONDS, 'end': end / NANOSECONDS, 'status': status}
            for start, end, status in verified.intervals
        ],
        'clearance': verified.clearance,
        'tracking_tolerance': verified.tracking_tolerance,
        'start': verified.start,
        'pairs_checked': verified.pairs,
        'unmoved_links': list(verified.unmoved),
        'entries': verified.entries,
        'halvings': verified.halvings,
        'seconds': verified.seconds,
        'trusted': list(verified.trusted),
    }


def _lines(finding: Finding) -> Iterator[str]:
    """Yield a finding as lines of text."""
    verified = finding.verified
    if not isinstance(verified, Verified):
        kind = 'DOES NOT HOLD' if finding.code == ExitCode.NOT_PROVED else 'UNUSABLE'
        yield f'{finding.path}: {kind}'
        yield f'  {verified}'
        return
    yield f'{finding.path}: HOLDS: {verified.name}: {verified.verdict.upper()}'
    for status in ('free', 'collision', 'suspect'):
        rows = [
            f'{start / NANOSECONDS:.6f} .. {end / NANOSECONDS:.6f}'
            for start, end, found in verified.intervals
            if found == status
        ]
        if rows:
            more = f' and {len(rows) - MAX_ROWS} more' if len(rows) > MAX_ROWS else ''
            proved = '  (nothing is claimed)' if status == 'suspect' else ''
            yield f'  {status:<9} {", ".join(rows[:MAX_ROWS])}{more} s{proved}'
    widest = max(verified.tracking_tolerance.values(), default=0.0)
    yield (
        f'  free: {verified.pairs} pairs of a body and an obstacle are farther apart than '
        f'{1e3 * verified.clearance:g} mm, with joints off by up to {widest:g} rad or m'
    )
    if verified.start is not None:
        at = ', '.join(f'{name}={value:.6g}' for name, value in verified.start.items())
        yield f'  if the motion starts at {at}'
    entries = ', '.join(f'{count} {_WORDS[kind]}' for kind, count in verified.entries.items())
    yield f'  proved again: {entries or "nothing"}, in {verified.seconds:.2f} s'
    left = [f'{link} against the scene (no joint moves it)' for link in verified.unmoved]
    yield '  not covered: ' + ', '.join(['links of the robot against each other', *left])
