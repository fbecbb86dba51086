"""The text of a certificate to values: every field is looked at, nothing is guessed."""

from collections.abc import Mapping, Sequence
import hashlib
import json
from typing import Any

from trajectory_guard.verify.invalid import invalid
from trajectory_guard.verify.numbers import number, positive

FORMAT = 'trajectory_guard/certificate/1'
INTERPOLATION = 'joint_trajectory_controller/jazzy'

LARGEST_LIST = 10**7

_SHAPE = {
    'format': str,
    'trajectory': {'name': str, 'sha256': str, 'interpolation': str, 'joint_names': [str],
                   'start': dict | None},
    'robot': {'sha256': str, 'links': [str]},
    'scene': {'sha256': str, 'obstacles': [str], 'frames': [[float]]},
    'request': {'tolerance': float, 'clearance': float, 'tracking_tolerance': dict},
    'duration_ns': int,
    'verdict': str,
    'unchecked_pairs': [str],
    'intervals': [list],
    'pieces': [[int]],
    'balls': [list],
    'planes': [list],
    'turning': [list],
    'collisions': [list],
    'sha256': str,
}  # fmt: skip
_START = {'joint_names': [str], 'positions': [float], 'velocities': list | None}


def parse(json_text: str) -> dict[str, Any]:
    """
    Return the JSON object of a certificate.

    :param json_text: JSON without repeated keys and without NaN.
    """
    try:
        value = json.loads(json_text, object_pairs_hook=_distinct, parse_constant=_no_number)
    except (ValueError, RecursionError) as error:
        raise invalid(f'certificate: not JSON: {error}') from error
    if not isinstance(value, dict):
        raise invalid('certificate: not a JSON object')
    return value


def seal(certificate: Mapping[str, Any]) -> str:
    """Return the SHA-256 of everything in a certificate but its seal."""
    rest = {key: value for key, value in certificate.items() if key != 'sha256'}
    return hashlib.sha256(text(rest).encode()).hexdigest()


def text(certificate: Mapping[str, Any]) -> str:
    """Return the canonical JSON of a certificate."""
    try:
        return json.dumps(certificate, sort_keys=True, separators=(',', ':'), allow_nan=False)
    except (TypeError, ValueError, RecursionError) as error:
        raise invalid(f'certificate: not JSON: {error}') from error


def check_shape(certificate: Mapping[str, Any]) -> None:
    """
    Refuse a certificate with other fields or types than the format's, or a broken seal.

    :raises TrajectoryGuardError: naming the field.
    """
    check_type(certificate, _SHAPE, 'certificate')
    if certificate['format'] != FORMAT:
        raise invalid(f'format: {certificate["format"]!r} is not {FORMAT!r}')
    trajectory = certificate['trajectory']
    if trajectory['interpolation'] != INTERPOLATION:
        raise invalid(f'trajectory.interpolation: {trajectory["interpolation"]!r} is not known')
    if (start := trajectory['start']) is not None:
        check_type(start, _START, 'trajectory.start')
        if start['velocities'] is not None:
            check_type(start['velocities'], [float], 'trajectory.start.velocities')
    for name in ('tolerance', 'clearance'):
        positive(certificate['request'][name], f'request.{name}')
    for name, value in certificate['request']['tracking_tolerance'].items():
        positive(value, f'request.tracking_tolerance[{name!r}]')
    if certificate['sha256'] != seal(certificate):
        raise invalid('sha256: the seal is broken, something was changed')


def check_type(value: Any, shape: Any, where: str) -> None:
    """
    Refuse a value of another shape.

    :param shape: a type, a list with the one shape of its items, or a dictionary of fields.
    :param where: what the value is.
    """
    if isinstance(shape, dict):
        check_type(value, dict, where)
        if wrong := set(value) ^ set(shape):
            raise invalid(f'{where}: fields missing or unknown: {sorted(wrong)}')
        for key, inner in shape.items():
            check_type(value[key], inner, key if where == 'certificate' else f'{where}.{key}')
    elif isinstance(shape, list):
        check_type(value, list, where)
        for i, item in enumerate(value):
            check_type(item, shape[0], f'{where}[{i}]')
    elif shape is float:
        number(value, where)
    elif isinstance(value, bool) or not isinstance(value, shape):
        raise invalid(f'{where}: {value!r:.40} is no {getattr(shape, "__name__", shape)}')
    elif isinstance(value, list) and len(value) > LARGEST_LIST:
        raise invalid(f'{where}: {len(value)} items are too many')


def _distinct(pairs: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    keys = dict(pairs)
    if len(keys) != len(pairs):
        raise ValueError(f'a repeated key among {sorted(key for key, _ in pairs)}')
    return keys


def _no_number(name: str) -> None:
    raise ValueError(f'{name} is no number')
