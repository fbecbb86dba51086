"""The guard's parameters: what they are, and that no nonsense gets in."""

from collections.abc import Iterator
import dataclasses
import math
from pathlib import Path
import re
from typing import Any

from guard_process import message, request, ros_context
import numpy as np
import pytest
from rclpy.context import Context
from rclpy.parameter import Parameter
import yaml

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.ros.configuration import Configuration
from trajectory_guard.ros.guard_node import Guard
from trajectory_guard.ros.parameters import DECLARATIONS
from trajectory_guard.ros.question import question_from_request
from trajectory_guard.settings import Settings

CONFIG = Path(__file__).parent.parent / 'config' / 'guard.yaml'
DEFAULTS = {name: declaration.default for name, declaration in DECLARATIONS.items()}


@pytest.fixture(scope='module')
def context() -> Iterator[Context]:
    with ros_context() as made:
        yield made


@pytest.fixture(scope='module')
def guard(context: Context) -> Guard:
    return Guard(context=context, cli_args=['--ros-args', '--params-file', str(CONFIG)])


def configuration(**changes: Any) -> Configuration:
    return Configuration.from_values(DEFAULTS | changes)


# What they are


def test_file_lists_them_all() -> None:
    listed = yaml.safe_load(CONFIG.read_text())['/**/guard']['ros__parameters']
    assert listed == DEFAULTS
    # ROS takes no integer for a float.
    assert {name: type(value) for name, value in listed.items()} == {
        name: type(value) for name, value in DEFAULTS.items()
    }


@pytest.mark.parametrize('name', DECLARATIONS)
def test_file_explains_it(name: str) -> None:
    block = re.search(rf'((?:^    #.*\n)+)    {name}:', CONFIG.read_text(), re.MULTILINE)
    assert block, 'no comment'
    declaration = DECLARATIONS[name]
    said = ' '.join(block[1].replace('#', ' ').split())
    assert declaration.read_only == ('(at start)' in said)
    assert declaration.at_configure == ('(at configure)' in said)
    for unit in re.findall(r'\[[^]]*\brad\b|\[m\b|\[s\b', declaration.description):
        assert unit in block[1]
    if declaration.bounds:
        (low, high) = re.findall(r'([\d.e-]+) to ([\d.e-]+)', block[1])[-1]
        assert (float(low), float(high.rstrip('.'))) == declaration.bounds


def test_file_is_the_default(guard: Guard) -> None:
    assert guard.configuration == configuration()
    defaults = dataclasses.replace(Settings(), deadline_ns=10_000_000_000)
    assert guard.configuration.settings == defaults
    assert guard.configuration.scene_files == ()


@pytest.mark.parametrize('namespace', ['', 'cell/left'])
def test_file_holds_in_every_namespace(context: Context, tmp_path: Path, namespace: str) -> None:
    changed = tmp_path / 'guard.yaml'
    changed.write_text(CONFIG.read_text().replace('clearance: 0.0', 'clearance: 0.25'))
    arguments = ['--ros-args', '--params-file', str(changed)]
    guard = Guard(context=context, namespace=namespace, cli_args=arguments)
    assert guard.configuration.settings.clearance == 0.25


@pytest.mark.parametrize('name', DECLARATIONS)
def test_descriptor(guard: Guard, name: str) -> None:
    descriptor = guard.describe_parameter(name)
    assert descriptor.description
    assert descriptor.read_only == DECLARATIONS[name].read_only
    ranges = [*descriptor.floating_point_range, *descriptor.integer_range]
    assert [(r.from_value, r.to_value) for r in ranges] == [DECLARATIONS[name].bounds] * len(
        ranges
    )
    assert bool(ranges) == (type(DEFAULTS[name]) in (int, float))
    assert bool(descriptor.additional_constraints) == DECLARATIONS[name].at_configure


# What is refused

NONSENSE = {
    'NaN': {'tolerance': math.nan},
    'infinite': {'clearance': math.inf},
    'negative': {'clearance': -1e-9},
    'zero tolerance': {'tolerance': 0.0},
    'no deadline': {'deadline': 0.0},
    'NaN deadline': {'deadline': math.nan},
    'no pieces': {'max_pieces': 0},
    'negative joint': {'tracking_tolerance': [0.1, -0.1], 'tracking_tolerance_joints': ['a', 'b']},
    'NaN joint': {'tracking_tolerance': [math.nan]},
    'no value': {'tracking_tolerance': Parameter('', Parameter.Type.DOUBLE_ARRAY, []).value},
    'values without joints': {'tracking_tolerance': [0.1, 0.1]},
    'joints without values': {'tracking_tolerance_joints': ['a', 'b']},
    'one joint twice': {
        'tracking_tolerance': [0.1, 0.1],
        'tracking_tolerance_joints': ['a', 'a'],
    },
    'wrong type': {'check_joint_limits': 'yes'},
    'no float': {'clearance': 1},
    'good and bad': {'clearance': 0.1, 'tolerance': -1.0},
    'read-only': {'autostart': False},
    'no topic': {'scene_topic': 'no topic'},
    'no such introspection': {'introspection': 'all'},
    'too many requests': {'max_requests': 257},
}


@pytest.mark.parametrize('changes', NONSENSE.values(), ids=NONSENSE)
def test_nonsense_is_refused_and_nothing_changes(guard: Guard, changes: dict[str, Any]) -> None:
    before = guard.configuration
    parameters = [
        Parameter(name, Parameter.Type.DOUBLE_ARRAY if value == [] else None, value)
        for name, value in changes.items()
    ]
    result = guard.set_parameters_atomically(parameters)
    assert not result.successful
    assert result.reason
    assert guard.configuration is before
    for name in DECLARATIONS:
        assert guard.get_parameter(name).value == DEFAULTS[name]


def test_change_holds_from_then_on(guard: Guard) -> None:
    changes = {
        'clearance': 0.01,
        'tracking_tolerance': [0.1, 0.2],
        'tracking_tolerance_joints': ['elbow', 'shoulder'],
        'max_points': 5,
    }
    restored = [Parameter(name, value=DEFAULTS[name]) for name in changes]
    changed = [Parameter(name, value=value) for name, value in changes.items()]
    try:
        assert guard.set_parameters_atomically(changed).successful
        assert guard.configuration == configuration(**changes)
        # One by one the two would not fit together on the way.
        single = guard.set_parameters([Parameter('tracking_tolerance_joints', value=['elbow'])])
        assert not single[0].successful
    finally:
        assert guard.set_parameters_atomically(restored).successful
    assert guard.configuration == configuration()


@pytest.mark.parametrize(
    ('override', 'word'),
    [
        (Parameter('clearence', value=0.1), 'clearence'),
        (Parameter('tolerance', value='small'), 'tolerance'),
        (Parameter('deadline', value=1e9), 'deadline'),
        (Parameter('scene_pose', value=[0.0] * 5), 'scene_pose'),
        (Parameter('scene_pose', value=[0.0] * 5 + [math.nan]), 'scene_pose'),
        (Parameter('tracking_tolerance', value=[-1.0]), 'tracking_tolerance'),
        (Parameter('robot_description_topic', value='no topic'), 'robot_description_topic'),
    ],
    ids=str,
)
def test_cannot_start(context: Context, override: Parameter, word: str) -> None:
    with pytest.raises(RequestError, match=word):
        Guard(context=context, parameter_overrides=[override])


def test_lists_that_yaml_leaves_empty(context: Context) -> None:
    names = ['scene_files', 'tracking_tolerance_joints']
    empty = [Parameter(name, Parameter.Type.NOT_SET) for name in names]
    assert Guard(context=context, parameter_overrides=empty).configuration == configuration()


# What they mean


def test_scene_pose_is_that_of_an_origin() -> None:
    T = configuration(scene_pose=[1.0, 2.0, 3.0, math.pi / 2, 0.0, math.pi / 2]).T_root_scene
    # First about x, then about the fixed z.
    np.testing.assert_allclose(T[:3, :3] @ [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], atol=1e-15)
    np.testing.assert_allclose(T[:3, :3] @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-15)
    assert T[:3, 3].tolist() == [1.0, 2.0, 3.0]


EACH = configuration(
    tracking_tolerance=[0.1, 0.2, 0.3], tracking_tolerance_joints=['elbow', 'shoulder', 'wrist']
)


@pytest.mark.parametrize(
    ('joints', 'asked', 'settled'),
    [
        (['shoulder', 'elbow'], [], (0.2, 0.1)),
        (['elbow', 'shoulder'], [], (0.1, 0.2)),
        (['elbow'], [0.0], (0.1,)),
        (['elbow', 'shoulder'], [0.5], (0.5, 0.5)),
        (['elbow', 'shoulder'], [0.5, 0.0], (0.5, 0.2)),
        (['wrist', 'elbow'], [0.3, 0.1], (0.3, 0.1)),
    ],
)
def test_tracking_tolerance_goes_by_the_name(
    joints: list[str], asked: list[float], settled: tuple[float, ...]
) -> None:
    trajectory = message((0.0, [0.0] * len(joints)), joints=joints)
    question = question_from_request(request(trajectory, tracking_tolerance=asked), EACH)
    assert question.settings.tracking_tolerance == settled


@pytest.mark.parametrize(
    ('joints', 'asked', 'reason'),
    [
        (['elbow', 'knee'], [], Reason.INVALID_TRACKING_TOLERANCE),
        (['elbow', 'shoulder'], [0.15], Reason.BELOW_MINIMUM),
        (['shoulder', 'elbow'], [0.1, 0.2], Reason.BELOW_MINIMUM),
        (['elbow', 'shoulder'], [0.5, 0.5, 0.5], Reason.INVALID_TRACKING_TOLERANCE),
    ],
)
def test_tracking_tolerance_never_gets_less(
    joints: list[str], asked: list[float], reason: Reason
) -> None:
    trajectory = message((0.0, [0.0] * len(joints)), joints=joints)
    with pytest.raises(RequestError) as caught:
        question_from_request(request(trajectory, tracking_tolerance=asked), EACH)
    assert caught.value.reason is reason
