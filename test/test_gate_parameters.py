"""The gate's parameters and codes: what they are, and that no nonsense gets in."""

from collections.abc import Iterator
import math
from pathlib import Path
import re
from typing import Any

from guard_process import ros_context
import pytest
from rclpy.context import Context
from rclpy.parameter import Parameter
from trajectory_guard_interfaces.msg import GateDecision
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
import yaml

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.ros.gate import Gate
from trajectory_guard.ros.gate_codes import PASSED, REMEDIES, remedy
from trajectory_guard.ros.gate_configuration import GateConfiguration
from trajectory_guard.ros.gate_parameters import DECLARATIONS

ROOT = Path(__file__).parent.parent
CONFIG = ROOT / 'config' / 'guard.yaml'
TABLE = ROOT / 'docs' / 'gate.md'
DEFAULTS = {name: declaration.default for name, declaration in DECLARATIONS.items()}


@pytest.fixture(scope='module')
def context() -> Iterator[Context]:
    with ros_context() as made:
        yield made


@pytest.fixture(scope='module')
def gate(context: Context) -> Gate:
    return Gate(context=context, cli_args=['--ros-args', '--params-file', str(CONFIG)])


def configuration(**changes: Any) -> GateConfiguration:
    return GateConfiguration.from_values(DEFAULTS | changes)


# What they are


def test_file_lists_them_all() -> None:
    listed = yaml.safe_load(CONFIG.read_text())['/**/gate']['ros__parameters']
    assert listed == DEFAULTS
    # ROS takes no integer for a float.
    assert {name: type(value) for name, value in listed.items()} == {
        name: type(value) for name, value in DEFAULTS.items()
    }


@pytest.mark.parametrize('name', DECLARATIONS)
def test_file_explains_it(name: str) -> None:
    text = CONFIG.read_text().split('/**/gate:')[1]
    block = re.search(rf'((?:^    #.*\n)+)    {name}:', text, re.MULTILINE)
    assert block, 'no comment'
    declaration = DECLARATIONS[name]
    assert declaration.read_only == ('(at start)' in block[1])
    for unit in re.findall(r'\[[^]]*\brad\b|\[m\b|\[s\b', declaration.description):
        assert unit in block[1]
    if declaration.bounds:
        low, high = re.findall(r'([\d.e-]+) to ([\d.e-]+)', block[1].replace('\n    # ', ' '))[-1]
        assert (float(low), float(high.rstrip('.'))) == declaration.bounds


def test_file_is_the_default(gate: Gate) -> None:
    assert gate.configuration == configuration()


@pytest.mark.parametrize('name', DECLARATIONS)
def test_descriptor(gate: Gate, name: str) -> None:
    descriptor = gate.describe_parameter(name)
    assert descriptor.description
    assert descriptor.read_only == DECLARATIONS[name].read_only
    bounds = [(r.from_value, r.to_value) for r in descriptor.floating_point_range]
    assert bounds == ([DECLARATIONS[name].bounds] if type(DEFAULTS[name]) is float else [])


# What is refused


@pytest.mark.parametrize(
    'changes',
    [
        {'clearance': math.nan},
        {'max_drift': -1e-9},
        {'max_drift': math.inf},
        {'deadline': 0.0},
        {'max_state_age': 0.0},
        {'tracking_tolerance': [-0.1]},
        {'tracking_tolerance': [math.nan]},
        {'tracking_tolerance': [0.1, 0.1]},
        {'tracking_tolerance_joints': ['a', 'b']},
        {'tracking_tolerance': [0.1, 0.1], 'tracking_tolerance_joints': ['a', 'a']},
        {'state_interfaces': ['velocity']},
        {'state_interfaces': ['position', 'effort']},
        {'state_interfaces': ['position', 'acceleration']},
        {'state_interfaces': ['']},
        {'guard': 'other'},
        {'output_topic': 'other'},
        {'deadline': 2},
        {'max_drift': 0.01, 'deadline': -1.0},
    ],
    ids=str,
)
def test_nonsense_is_refused_and_nothing_changes(gate: Gate, changes: dict[str, Any]) -> None:
    before = gate.configuration
    result = gate.set_parameters_atomically(
        [Parameter(name, value=value) for name, value in changes.items()]
    )
    assert not result.successful
    assert result.reason
    assert gate.configuration is before
    for name in DECLARATIONS:
        assert gate.get_parameter(name).value == DEFAULTS[name]


def test_change_holds_from_then_on(gate: Gate) -> None:
    changes = {
        'clearance': 0.01,
        'tracking_tolerance': [0.1, 0.2],
        'tracking_tolerance_joints': ['elbow', 'shoulder'],
        'state_interfaces': ['position'],
        'continuous_joints': ['wrist'],
    }
    restored = [Parameter(name, value=DEFAULTS[name]) for name in changes]
    changed = [Parameter(name, value=value) for name, value in changes.items()]
    try:
        assert gate.set_parameters_atomically(changed).successful
        assert gate.configuration == configuration(**changes)
    finally:
        assert gate.set_parameters_atomically(restored).successful
    assert gate.configuration == configuration()


@pytest.mark.parametrize(
    ('override', 'word'),
    [
        (Parameter('clearence', value=0.1), 'clearence'),
        (Parameter('deadline', value='soon'), 'deadline'),
        (Parameter('max_drift', value=1e9), 'max_drift'),
        (Parameter('output_topic', value='no topic'), 'topic'),
        (Parameter('guard', value=''), 'guard'),
        (Parameter('guard', value='no guard'), 'guard'),
        (Parameter('joint_states_topic', value=''), 'joint_states_topic'),
        (Parameter('tracking_tolerance', value=[-1.0]), 'tracking_tolerance'),
    ],
    ids=str,
)
def test_cannot_start(context: Context, override: Parameter, word: str) -> None:
    with pytest.raises(RequestError, match=word):
        Gate(context=context, parameter_overrides=[override])


# What they mean


def test_tracking_tolerance_goes_by_the_name() -> None:
    each = configuration(
        tracking_tolerance=[0.1, 0.2], tracking_tolerance_joints=['elbow', 'shoulder']
    )
    assert each.tracking_tolerance_of(['shoulder', 'elbow']) == (0.2, 0.1)
    with pytest.raises(RequestError) as caught:
        each.tracking_tolerance_of(['shoulder', 'knee'])
    assert caught.value.reason is Reason.INVALID_TRACKING_TOLERANCE
    assert configuration(tracking_tolerance=[0.3]).tracking_tolerance_of(['a', 'b']) == (0.3, 0.3)


# What is raised


def test_what_is_raised_holds_and_ends_nothing(gate: Gate) -> None:
    def broken() -> None:
        raise ZeroDivisionError('on the way')

    decided: list[GateDecision] = []
    for _ in range(2):
        gate._keeper.consider(JointTrajectory(), broken, str, decided.append)
    assert [d.decision for d in decided] == [GateDecision.HELD] * 2
    assert {d.reason_code for d in decided} == {'internal_error'}
    assert 'on the way' in decided[0].message
    one = JointTrajectory(joint_names=['a'], points=[JointTrajectoryPoint(positions=[0.0])])
    trial = gate._keeper.consider(one, broken, str, decided.append)
    assert decided[-1].reason_code == 'guard_missing'
    # A step that comes after the decision is not taken.
    gate._keeper._step(trial, broken)
    assert len(decided) == 3
    # What is told of a decision does not change it.
    gate._keeper.consider(JointTrajectory(), lambda: None, str, lambda _: broken())
    gate._keeper.consider(JointTrajectory(), lambda: None, str, decided.append)
    assert decided[-1].reason_code == 'stop'
    assert decided[-1].number == 5


# Codes


def rows() -> dict[str, str]:
    """Return the rows of the table in the documentation: code and the rest of the row."""
    return dict(re.findall(r'^\| `(\w+)` \| (.+) \|$', TABLE.read_text(), re.MULTILINE))


def test_every_code_of_the_gate_is_in_the_table() -> None:
    sources = [
        *ROOT.glob('trajectory_guard/ros/gate*.py'),
        ROOT / 'trajectory_guard/paths/entry.py',
        ROOT / 'trajectory_guard/paths/takeover.py',
    ]
    used = {
        name for path in sources for name in re.findall(r'Reason\.([A-Z_]+)', path.read_text())
    }
    codes = {Reason[name].value for name in used}
    assert codes <= rows().keys()
    # Whatever the gate says of its own has a remedy; the rest are those of trajectories.
    trajectories = {Reason.TRAJECTORY_UNREADABLE, Reason.INVALID_TRACKING_TOLERANCE}
    assert codes <= {*REMEDIES, *PASSED, *trajectories, Reason.INVALID_PARAMETER}


@pytest.mark.parametrize('reason', REMEDIES)
def test_the_table_says_what_the_log_says(reason: Reason) -> None:
    assert rows()[reason.value].endswith(remedy(reason.value))


def test_codes_of_the_guard_explain_themselves() -> None:
    assert 'message' in remedy('collision')
