"""Trajectory messages as YAML or JSON text, the way ``ros2 topic echo`` prints them."""

from collections.abc import Callable, Iterator
from functools import partial
import json
import re
from reprlib import repr as shown
from types import SimpleNamespace
from typing import Any, NamedTuple

from msg_adapters.strict_yaml import plain_value, StrictYamlError
from msg_adapters.trajectory import (
    multi_dof_from_message,
    stamp_from_message,
    trajectory_from_message,
)
from trajectory_guard.errors import Reason, TrajectoryError
from trajectory_guard.paths.multi_dof import MultiDofTrajectory
from trajectory_guard.paths.trajectory import Trajectory

# Ten thousand points of a seven-joint arm take 5 MB; reading this much takes about a minute.
MAX_CHARACTERS = 64 * 1024 * 1024

_SEPARATOR = re.compile(r'^---(?=\s|$)', re.MULTILINE)
_CONTENT = re.compile(r'^[^\S\n]*[^\s#]', re.MULTILINE)
_TRUNCATED = '...'
_INT32 = range(-(2**31), 2**31)
_UINT32 = range(2**32)


class Document(NamedTuple):
    """
    One document of a text.

    :param name: the text's name, the document if there are several, and the place in a list
        (``plan.yaml#2``, ``plan.json[0]``).
    :param trajectory: the trajectory, named so, or why there is none.
    :param stamp_ns: when it begins, 0: when it arrives [ns].
    """

    name: str
    trajectory: Trajectory | MultiDofTrajectory | TrajectoryError
    stamp_ns: int = 0


def trajectories_from_text(text: str, name: str = '') -> Iterator[Trajectory | MultiDofTrajectory]:
    """
    Yield the trajectories of a text in their order.

    :param text: as for :func:`documents`.
    :param name: where the text comes from.
    :raises TrajectoryError: at the first document that is none.
    """
    for document in documents(text, name):
        if isinstance(document.trajectory, TrajectoryError):
            raise document.trajectory
        yield document.trajectory


def documents(text: str, name: str = '') -> Iterator[Document]:
    """
    Yield a trajectory, or why there is none, for every document of a text.

    An error is a value here, so that one bad document does not hide the others.

    :param text: YAML documents separated by ``---``, or JSON; a document is a JointTrajectory, a
        MultiDOFJointTrajectory (its points have ``transforms``), or a list of them. The header
        may be missing; unknown keys may not be there.
    :param name: where the text comes from, for names and errors.
    """
    if len(text) > MAX_CHARACTERS:
        problem = f'{len(text)} characters, at most {MAX_CHARACTERS} are read'
        yield _failed(name, TrajectoryError(Reason.TOO_LARGE, problem))
        return
    sources = _sources(text)
    for number, source in enumerate(sources, 1):
        yield from _documents(source, f'{name}#{number}' if len(sources) > 1 else name)


def _sources(text: str) -> list[Callable[[], Any]]:
    """
    Return a function for every document that returns its plain value or raises.

    YAML is parsed one document at a time and only when asked, so a file of many messages is never
    held as objects as a whole.
    """
    try:
        value = json.loads(text, object_pairs_hook=_unique_keys)
    except (ValueError, RecursionError):
        # The YAML reader takes what JSON does not, and says in which line neither is met.
        return list(_yaml_sources(text))
    return [lambda: value]


def _yaml_sources(text: str) -> Iterator[Callable[[], Any]]:
    """Yield a function for every document that is more than blanks and comments."""
    start = 0
    line = 0
    for separator in [*_SEPARATOR.finditer(text), None]:
        chunk = text[start : separator.start() if separator else len(text)]
        if _CONTENT.search(chunk):
            yield partial(_yaml_value, chunk, line)
        line += chunk.count('\n')
        start = separator.end() if separator else 0


def _yaml_value(text: str, lines_before: int) -> Any:
    """
    Return the plain value of one YAML document.

    :param text: the document.
    :param lines_before: lines of the whole text before it.
    :raises TrajectoryError: it cannot be read.
    """
    try:
        return plain_value(text)
    except StrictYamlError as error:
        place = '' if error.line is None else f'line {lines_before + error.line}: '
        raise TrajectoryError(Reason.TRAJECTORY_UNREADABLE, f'{place}{error}') from error


def _unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return a JSON object; a repeated key is as wrong here as in YAML."""
    values = dict(pairs)
    if len(values) < len(pairs):
        raise ValueError('a key is repeated')
    return values


def _documents(source: Callable[[], Any], name: str) -> Iterator[Document]:
    """
    Yield what one document of a text holds.

    :param source: returns the plain value of the document or raises.
    :param name: name of the document.
    """
    try:
        value = source()
    except TrajectoryError as error:
        yield _failed(name, error)
        return
    if not isinstance(value, list):
        yield _document(value, name)
        return
    for index, item in enumerate(value):
        yield _document(item, f'{name}[{index}]')


def _document(value: Any, name: str) -> Document:
    """Return the trajectory of a plain value, or why there is none."""
    try:
        message = _message(value)
        convert = multi_dof_from_message if _has_poses(message) else trajectory_from_message
        return Document(name, convert(message, name), stamp_from_message(message))
    except TrajectoryError as error:
        return _failed(name, error)


def _failed(name: str, error: TrajectoryError) -> Document:
    """Return the document that has no trajectory; the error says which one it is."""
    return Document(
        name, TrajectoryError(error.reason, f'{name}: {error}' if name else str(error))
    )


def _has_poses(message: SimpleNamespace) -> bool:
    """Say whether a message is a MultiDOFJointTrajectory."""
    return bool(message.points) and hasattr(message.points[0], 'transforms')


def _message(value: Any) -> SimpleNamespace:
    """
    Return the plain value of a document as a message; its points are all of the first one's kind.

    :raises TrajectoryError: the layout is another one, or a value is of another type.
    """
    if not isinstance(value, dict) or not {'joint_names', 'points'} <= value.keys():
        found = f'keys {shown(sorted(value))}' if isinstance(value, dict) else shown(value)
        raise _unreadable(f'expected a mapping with joint_names and points, found {found}')
    _refuse_unknown(value, {'header', 'joint_names', 'points'}, 'the trajectory')
    points = _items(value['points'], 'points')
    poses = bool(points) and isinstance(points[0], dict) and 'transforms' in points[0]
    read = _pose_point if poses else _point
    return SimpleNamespace(
        header=_header(value['header']) if 'header' in value else None,
        joint_names=_strings(value['joint_names'], 'joint_names'),
        points=[read(point, f'points[{index}]') for index, point in enumerate(points)],
    )


def _header(value: Any) -> SimpleNamespace:
    """Return the plain value of a header as std_msgs/Header message."""
    if not isinstance(value, dict) or 'stamp' not in value:
        raise _unreadable(f'header: expected a mapping with stamp, found {shown(value)}')
    _refuse_unknown(value, {'stamp', 'frame_id'}, 'header')
    (frame_id,) = _strings([value.get('frame_id', '')], 'header.frame_id')
    return SimpleNamespace(stamp=_time(value['stamp'], 'header.stamp'), frame_id=frame_id)


def _point(value: Any, field: str) -> SimpleNamespace:
    """
    Return the plain value of a point as JointTrajectoryPoint message.

    A misspelt key is refused: without its velocities a point is played differently.

    :param value: the plain value.
    :param field: its name in the document.
    """
    arrays = ('positions', 'velocities', 'accelerations', 'effort')
    if not isinstance(value, dict) or 'time_from_start' not in value:
        raise _unreadable(f'{field}: expected a mapping with time_from_start')
    _refuse_unknown(value, {*arrays, 'time_from_start'}, field)
    return SimpleNamespace(
        time_from_start=_time(value['time_from_start'], f'{field}.time_from_start'),
        **{name: _numbers(value.get(name, []), f'{field}.{name}') for name in arrays},
    )


def _pose_point(value: Any, field: str) -> SimpleNamespace:
    """
    Return the plain value of a point as MultiDOFJointTrajectoryPoint message.

    :param value: the plain value.
    :param field: its name in the document.
    """
    twist = {'linear': 'xyz', 'angular': 'xyz'}
    layouts = {
        'transforms': {'translation': 'xyz', 'rotation': 'xyzw'},
        'velocities': twist,
        'accelerations': twist,
    }
    if not isinstance(value, dict) or 'time_from_start' not in value:
        raise _unreadable(f'{field}: expected a mapping with time_from_start')
    _refuse_unknown(value, {*layouts, 'time_from_start'}, field)
    return SimpleNamespace(
        time_from_start=_time(value['time_from_start'], f'{field}.time_from_start'),
        **{
            name: [
                SimpleNamespace(
                    **{
                        part: _vector(_part(item, part, layout, place), keys, f'{place}.{part}')
                        for part, keys in layout.items()
                    }
                )
                for k, item in enumerate(_items(value.get(name, []), f'{field}.{name}'))
                for place in [f'{field}.{name}[{k}]']
            ]
            for name, layout in layouts.items()
        },
    )


def _part(value: Any, part: str, layout: dict[str, str], field: str) -> Any:
    """Return a part of a transform or twist that has all its parts and no other."""
    if not isinstance(value, dict) or value.keys() != layout.keys():
        raise _unreadable(f'{field}: expected {" and ".join(layout)}, found {shown(value)}')
    return value[part]


def _vector(value: Any, keys: str, field: str) -> SimpleNamespace:
    """Return a mapping of numbers as geometry_msgs/Vector3 or Quaternion message."""
    if not isinstance(value, dict) or value.keys() != set(keys):
        raise _unreadable(f'{field}: expected {", ".join(keys)}, found {shown(value)}')
    numbers = _numbers([value[key] for key in keys], field)
    return SimpleNamespace(**dict(zip(keys, numbers, strict=True)))


def _time(value: Any, field: str) -> SimpleNamespace:
    """Return the plain value of a time as builtin_interfaces/Duration or Time message."""
    if not isinstance(value, dict) or value.keys() != {'sec', 'nanosec'}:
        raise _unreadable(f'{field}: expected sec and nanosec, found {shown(value)}')
    for name, allowed in (('sec', _INT32), ('nanosec', _UINT32)):
        if type(value[name]) is not int or value[name] not in allowed:
            raise _unreadable(
                f'{field}.{name}: expected an integer from {allowed[0]} to {allowed[-1]}, '
                f'found {shown(value[name])}'
            )
    return SimpleNamespace(**value)


def _strings(value: Any, field: str) -> list[str]:
    """Return a list of strings."""
    for index, item in enumerate(_items(value, field)):
        if not isinstance(item, str):
            raise _unreadable(f'{field}[{index}]: expected a string, found {shown(item)}')
    return value


def _numbers(value: Any, field: str) -> list[float]:
    """Return a list of numbers as floats; NaN and infinity are numbers here."""
    for index, item in enumerate(_items(value, field)):
        if type(item) is not float and type(item) is not int:
            raise _unreadable(f'{field}[{index}]: expected a number, found {shown(item)}')
    try:
        return [float(item) for item in value]
    except OverflowError as error:
        raise TrajectoryError(Reason.NOT_FINITE, f'{field}: {error}') from error


def _items(value: Any, field: str) -> list:
    """Return a list that was not cut short."""
    if not isinstance(value, list):
        raise _unreadable(f'{field}: expected a list, found {shown(value)}')
    if value and value[-1] == _TRUNCATED:
        raise _unreadable(
            f'{field} was cut short when it was printed; use `ros2 topic echo --full-length`'
        )
    return value


def _refuse_unknown(value: dict, known: set[str], field: str) -> None:
    """Refuse keys that the message does not have."""
    if unknown := sorted(value.keys() - known):
        raise _unreadable(f'{field}: unknown key {shown(unknown[0])}, known are {sorted(known)}')


def _unreadable(message: str) -> TrajectoryError:
    """Return the error of a text that holds no trajectory."""
    return TrajectoryError(Reason.TRAJECTORY_UNREADABLE, message)
