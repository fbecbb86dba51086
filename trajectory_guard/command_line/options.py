"""The options that the commands share; each is checked where it is read, so errors name it."""

from collections.abc import Callable
from dataclasses import dataclass
import math
from pathlib import Path
from typing import Annotated, Any

import typer

from trajectory_guard.errors import RequestError
from trajectory_guard.result import NANOSECONDS
from trajectory_guard.settings import Cover, Scope, Settings

# Thirty years; timers fail at three hundred [s].
LONGEST_DEADLINE = 1e9

POSE_FIELDS = 'x y z roll pitch yaw'


@dataclass(frozen=True, slots=True)
class Pose:
    """
    A pose as URDF writes it.

    :param xyz: position [m].
    :param rpy: angles about the fixed axes x, y, z, in this order [rad].
    """

    xyz: tuple[float, ...]
    rpy: tuple[float, ...]


def parse_start(text: str) -> dict[str, float]:
    """
    Return the joint positions that ``--start`` gives.

    :param text: ``JOINT=VALUE`` pairs separated by commas.
    """
    start: dict[str, float] = {}
    for pair in text.split(','):
        name, equals, value = (part.strip() for part in pair.rpartition('='))
        if not (name and equals):
            raise typer.BadParameter(f'expected JOINT=VALUE, got {pair!r}')
        if name in start:
            raise typer.BadParameter(f'joint {name!r} is given twice')
        start[name] = _number(value, f'{name}=')
    return start


def parse_pose(text: str) -> Pose:
    """
    Return the six numbers of ``--scene-pose``.

    :param text: numbers separated by blanks.
    """
    parts = text.split()
    if len(parts) != 6:
        raise typer.BadParameter(f'expected six numbers "{POSE_FIELDS}", got {text!r}')
    values = [_number(part, '') for part in parts]
    return Pose(xyz=tuple(values[:3]), rpy=tuple(values[3:]))


def parse_deadline(text: str) -> int:
    """
    Return the nanoseconds of ``--deadline``.

    :param text: seconds.
    """
    seconds = _number(text, '')
    if seconds > LONGEST_DEADLINE:
        raise typer.BadParameter(f'{text} s is more than {LONGEST_DEADLINE:g} s')
    return _checked(deadline_ns=round(seconds * NANOSECONDS))


def _number(text: str, where: str) -> float:
    """Return a finite number, or say where there is none."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise typer.BadParameter(f'{where}{text} is not a finite number')
    return value


def _checked(**setting: Any) -> Any:
    """Return the value of one setting, checked where all users of it are."""
    try:
        Settings(**setting)
    except RequestError as error:
        raise typer.BadParameter(str(error)) from error
    (value,) = setting.values()
    return value


def _parse_setting(name: str) -> Callable[[str], float]:
    """Return the parser of a number that is the setting of that name."""

    def parse(text: str) -> float:
        try:
            return _checked(**{name: float(text)})
        except ValueError as error:
            raise typer.BadParameter(f'{text!r} is not a number') from error

    return parse


def _parse_tracking_tolerance(text: str) -> float:
    """Return the number of ``--tracking-tolerance``."""
    value = _number(text, '')
    _checked(tracking_tolerance=(value,))
    return value


def _parse_scope(text: str | Scope) -> Scope:
    """Return the scope of that name; the default comes as it is."""
    for scope in Scope:
        if text in (scope, scope.name.lower()):
            return scope
    names = ', '.join(scope.name.lower() for scope in Scope)
    raise typer.BadParameter(f'{text!r} is not one of {names}')


def _parse_cover(text: str | Cover) -> Cover:
    """Return the cover of that name; the default comes as it is."""
    if isinstance(text, Cover):
        return text
    try:
        return Cover.named(text)
    except RequestError as error:
        raise typer.BadParameter(str(error)) from error


_FILE: dict[str, Any] = {'exists': True, 'dir_okay': False, 'readable': True}
_LENGTH: dict[str, Any] = {'metavar': 'METRES', 'show_default': True}

Urdf = Annotated[
    Path,
    typer.Option(
        **_FILE,
        metavar='FILE',
        help='Robot with collision geometry, or the mesh file of a free body.',
    ),
]
Scenes = Annotated[
    list[Path],
    typer.Option(
        '--scene',
        **_FILE,
        metavar='FILE',
        help='Obstacles: a URDF without movable joints, or a mesh. May be repeated.',
    ),
]
Trajectories = Annotated[
    list[Path],
    typer.Option(
        '--trajectory',
        metavar='FILE',
        help='Where the trajectories are: YAML, JSON or a bag. May be repeated.',
    ),
]
ScenePose = Annotated[
    Pose | None,
    typer.Option(
        parser=parse_pose,
        metavar=f'"{POSE_FIELDS.upper()}"',
        help="Pose of the scene in the robot's root link, metres and radians.",
    ),
]
Tolerance = Annotated[
    float,
    typer.Option(
        parser=_parse_setting('tolerance'),
        **_LENGTH,
        help='Gaps above this are decided; below it the answer may be "suspect".',
    ),
]
Clearance = Annotated[
    float,
    typer.Option(
        parser=_parse_setting('clearance'), **_LENGTH, help='Distance that "free" must exceed.'
    ),
]
TrackingTolerance = Annotated[
    float,
    typer.Option(
        parser=_parse_tracking_tolerance,
        metavar='RADIANS',
        show_default=True,
        help='How far every joint may follow off the path (metres if it slides).',
    ),
]
Start = Annotated[
    dict[str, float] | None,
    typer.Option(
        parser=parse_start,
        metavar='JOINT=VALUE,...',
        help='Where joints are at time 0, radians or metres. What a bag has measured goes first.',
    ),
]
NoSelfCollision = Annotated[
    bool,
    typer.Option(
        '--no-self-collision', help='Accept that links are not checked against each other.'
    ),
]
NoJointLimits = Annotated[
    bool, typer.Option('--no-joint-limits', help='Accept curves that leave the joint limits.')
]
AllowEndVelocity = Annotated[
    bool,
    typer.Option('--allow-end-velocity', help='Accept a last point that does not come to rest.'),
]
Deadline = Annotated[
    int | None,
    typer.Option(
        parser=parse_deadline,
        metavar='SECONDS',
        help='Time for each answer; what is not decided by then is "suspect".',
    ),
]
Certificate = Annotated[
    str | None,
    typer.Option(
        metavar='OUT.json',
        help='Write what proves the answer; a folder (OUT/) for several trajectories.',
    ),
]
ScopeOption = Annotated[
    Scope,
    typer.Option(
        '--scope',
        parser=_parse_scope,
        metavar='|'.join(scope.name.lower() for scope in Scope),
        show_default='all',
        help='How much is asked: all intervals, up to the first that is not free, or any.',
    ),
]
CoverOption = Annotated[
    Cover,
    typer.Option(
        '--cover',
        parser=_parse_cover,
        metavar='|'.join(cover.name.lower() for cover in Cover),
        show_default='hull',
        help='How motions are enclosed: by hulls and planes, or by balls of displacements.',
    ),
]
Refine = Annotated[
    bool,
    typer.Option(
        '--refine/--no-refine',
        help='Look closer at suspect intervals, down to what rounding allows.',
    ),
]
Contacts = Annotated[
    bool,
    typer.Option(
        '--contacts', help='Name the features that touch where collisions begin and end.'
    ),
]
Json = Annotated[
    bool, typer.Option('--json', help='Print one JSON object a line for each trajectory.')
]
Topics = Annotated[
    list[str] | None,
    typer.Option(metavar='NAME', help='Trajectory topic; may be repeated. [default: all]'),
]
JointStates = Annotated[
    list[str] | None,
    typer.Option(
        metavar='NAME', help='JointState topic; may be repeated. [default: /joint_states]'
    ),
]
