"""Trajectories as text: what `ros2 topic echo` prints is read, and nothing else slips through."""

from array import array
import json
import math
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st
import pytest
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
import yaml

from msg_adapters import strict_yaml
from msg_adapters import text as text_module
from msg_adapters.text import documents, trajectories_from_text
from trajectory_guard.errors import Reason, TrajectoryError
from trajectory_guard.paths.trajectory import Trajectory

# As printed by `ros2 topic echo`, with some numbers in the forms that people write.
ECHOED = """\
header:
  stamp:
    sec: 0
    nanosec: 0
  frame_id: ''
joint_names:
- shoulder
- elbow
points:
- positions:
  - 0.0
  - -1.0e-05
  velocities: []
  accelerations: []
  effort: []
  time_from_start:
    sec: 0
    nanosec: 0
- positions:
  - 1e-5
  - 2
  velocities:
  - .5
  - +1.
  accelerations: []
  effort: []
  time_from_start:
    sec: 1
    nanosec: 500000000
"""
SHORT = '{joint_names: [a], points: [{positions: [1], time_from_start: {sec: 0, nanosec: 1}}]}'
OBJECT = {
    'joint_names': ['a'],
    'points': [{'positions': [1.5], 'time_from_start': {'sec': 2, 'nanosec': 3}}],
}


def only_error(text: str) -> TrajectoryError:
    """Return the error of the only document."""
    (document,) = documents(text, 'plan.yaml')
    assert isinstance(document.trajectory, TrajectoryError)
    return document.trajectory


def test_what_echo_prints_is_read() -> None:
    (trajectory,) = trajectories_from_text(ECHOED, 'plan.yaml')
    assert trajectory.name == 'plan.yaml'
    assert trajectory.joint_names == ('shoulder', 'elbow')
    assert trajectory.times_ns.tolist() == [0, 1_500_000_000]
    assert trajectory.positions.tolist() == [[0.0, -1e-5], [1e-5, 2.0]]
    assert trajectory.has_velocities.tolist() == [False, True]
    assert trajectory.velocities[1].tolist() == [0.5, 1.0]


def plain(value: Any) -> Any:
    """Return a message as `ros2 topic echo` prints it, which cuts lists after 128 items."""
    if hasattr(value, 'get_fields_and_field_types'):
        return {name: plain(getattr(value, name)) for name in value.get_fields_and_field_types()}
    if isinstance(value, list | array):
        items = [plain(item) for item in value[:128]]
        return [*items, '...'] if len(value) > 128 else items
    return value


def echoed(message: Any, flow: bool = False) -> str:
    return yaml.dump(plain(message), sort_keys=False, width=10**9, default_flow_style=flow)


def point(position: float, sec: int) -> JointTrajectoryPoint:
    message = JointTrajectoryPoint(positions=[position, 0.1], velocities=[1e-9, -1e22])
    message.time_from_start.sec = sec
    return message


def test_the_stamp_is_kept_if_there_is_one() -> None:
    assert [d.stamp_ns for d in documents(ECHOED)] == [0]
    assert [d.stamp_ns for d in documents(ECHOED.replace('nanosec: 0', 'nanosec: 7', 1))] == [7]
    assert [d.stamp_ns for d in documents(SHORT)] == [0]


@pytest.mark.parametrize('flow', [False, True])
def test_what_ros_itself_prints_is_read(flow: bool) -> None:
    message = JointTrajectory(
        joint_names=['yes', '1.0'], points=[point(0.1 + 0.2, 0), point(1e-300, 7)]
    )
    printed = echoed(message, flow)
    (trajectory,) = trajectories_from_text(f'{printed}---\n')
    assert trajectory.joint_names == ('yes', '1.0')
    assert trajectory.positions.tolist() == [[0.1 + 0.2, 0.1], [1e-300, 0.1]]
    assert trajectory.velocities.tolist() == [[1e-9, -1e22]] * 2
    assert trajectory.times_ns.tolist() == [0, 7_000_000_000]


def test_what_ros_cut_short_is_refused() -> None:
    message = JointTrajectory(joint_names=['a', 'b'], points=[point(0.0, k) for k in range(129)])
    error = only_error(echoed(message))
    assert error.reason is Reason.TRAJECTORY_UNREADABLE
    assert '--full-length' in str(error)


@pytest.mark.parametrize('text', [ECHOED, f'---\n{ECHOED}', f'{ECHOED}---\n', f'{ECHOED}...\n'])
def test_separators_around_one_document_change_nothing(text: str) -> None:
    (trajectory,) = trajectories_from_text(text, 'plan.yaml')
    assert trajectory.name == 'plan.yaml'


@pytest.mark.parametrize('text', ['', '\n', '---\n', '# nothing\n---\n  # here\n', '[]', '--- \n'])
def test_nothing_is_no_trajectory_and_no_error(text: str) -> None:
    assert list(documents(text)) == []


def test_a_bad_document_hides_no_other() -> None:
    broken = 'joint_names: [\n'
    text = '---\n'.join([ECHOED, broken, SHORT + '\n', 'a: 1\n', ECHOED.replace('\n', '\r\n')])
    found = list(documents(text, 'plan.yaml'))
    assert [document.name for document in found] == [f'plan.yaml#{k}' for k in range(1, 6)]
    good = [isinstance(document.trajectory, Trajectory) for document in found]
    assert good == [True, False, True, False, True]
    assert f'plan.yaml#2: line {text[: text.index(broken)].count(chr(10)) + 2}: ' in str(
        found[1].trajectory
    )
    with pytest.raises(TrajectoryError, match=r'plan\.yaml#2'):
        list(trajectories_from_text(text, 'plan.yaml'))


@pytest.mark.parametrize('indent', [None, 2])
def test_json_is_read_alone_and_in_a_list(indent: int | None) -> None:
    (trajectory,) = trajectories_from_text(json.dumps(OBJECT, indent=indent), 'p.json')
    assert trajectory.positions.tolist() == [[1.5]]
    assert trajectory.times_ns.tolist() == [2_000_000_003]
    found = list(documents(json.dumps([OBJECT, 3, OBJECT], indent=indent), 'p.json'))
    assert [document.name for document in found] == ['p.json[0]', 'p.json[1]', 'p.json[2]']
    assert isinstance(found[1].trajectory, TrajectoryError)


def test_a_yaml_list_is_read_as_a_list() -> None:
    assert [t.name for t in trajectories_from_text(f'- {SHORT}\n- {SHORT}\n', 'p')] == [
        'p[0]',
        'p[1]',
    ]


@pytest.mark.parametrize(
    ('old', 'new', 'reason', 'said'),
    [
        ('- elbow', '- 2', Reason.TRAJECTORY_UNREADABLE, ['joint_names[1]', '2']),
        ('- elbow', '- shoulder', Reason.DUPLICATE_JOINT, ['shoulder']),
        ('- elbow', "- '...'", Reason.TRAJECTORY_UNREADABLE, ['joint_names', '--full-length']),
        ('1.0e-05', 'fast', Reason.TRAJECTORY_UNREADABLE, ['points[0].positions[1]', "'-fast'"]),
        ('- -1.0e-05', "- '1.0'", Reason.TRAJECTORY_UNREADABLE, ['points[0].positions[1]', '1.0']),
        ('- -1.0e-05', '- true', Reason.TRAJECTORY_UNREADABLE, ['points[0].positions[1]', 'True']),
        ('- -1.0e-05', '- null', Reason.TRAJECTORY_UNREADABLE, ['points[0].positions[1]', 'None']),
        ('- -1.0e-05', '- 1:30', Reason.TRAJECTORY_UNREADABLE, ['points[0].positions[1]', '1:30']),
        ('- -1.0e-05', '- 0x10', Reason.TRAJECTORY_UNREADABLE, ['points[0].positions[1]', '0x10']),
        ('- -1.0e-05', '- 1_0', Reason.TRAJECTORY_UNREADABLE, ['points[0].positions[1]', '1_0']),
        ('- -1.0e-05', '- [1]', Reason.TRAJECTORY_UNREADABLE, ['points[0].positions[1]', '[1]']),
        ('- -1.0e-05', '- .nan', Reason.NOT_FINITE, ['point 0', 'elbow', 'nan']),
        ('- -1.0e-05', '- -.inf', Reason.NOT_FINITE, ['point 0', 'elbow', 'inf']),
        ('- -1.0e-05', '- 1e999', Reason.NOT_FINITE, ['point 0', 'elbow', 'inf']),
        ('  - -1.0e-05\n', '', Reason.SIZE_MISMATCH, ['1 positions', '2 joints']),
        ('velocities', 'velocites', Reason.TRAJECTORY_UNREADABLE, ['points[0]', 'velocites']),
        ('points:', 'Points:', Reason.TRAJECTORY_UNREADABLE, ['joint_names and points', 'Points']),
        ('joint_names:', 'names:', Reason.TRAJECTORY_UNREADABLE, ['joint_names', 'names']),
        ('header:', 'head:', Reason.TRAJECTORY_UNREADABLE, ["unknown key 'head'"]),
        (
            'sec: 1\n',
            'sec: 1.0\n',
            Reason.TRAJECTORY_UNREADABLE,
            ['points[1].time_from_start.sec'],
        ),
        (
            'sec: 1\n',
            "sec: '1'\n",
            Reason.TRAJECTORY_UNREADABLE,
            ['points[1].time_from_start.sec'],
        ),
        ('sec: 1\n', 'sec: true\n', Reason.TRAJECTORY_UNREADABLE, ['time_from_start.sec', 'True']),
        ('sec: 1\n', 'sec: 2147483648\n', Reason.TRAJECTORY_UNREADABLE, ['2147483648']),
        ('500000000', '-1', Reason.TRAJECTORY_UNREADABLE, ['time_from_start.nanosec', '-1']),
        ('    nanosec: 500000000\n', '', Reason.TRAJECTORY_UNREADABLE, ['sec and nanosec']),
        ('sec: 1\n', 'sec: -1\n', Reason.UNSORTED_TIMES, ['point 1']),
        ('effort: []', 'effort: {}', Reason.TRAJECTORY_UNREADABLE, ['points[0].effort', 'a list']),
        ('effort: []', 'effort: &x []', Reason.TRAJECTORY_UNREADABLE, ['line 15', 'anchors']),
        ('effort: []', 'effort: *x', Reason.TRAJECTORY_UNREADABLE, ['line 15', 'aliases']),
        ('effort: []', 'effort: !!set {}', Reason.TRAJECTORY_UNREADABLE, ['line 15', 'tags']),
        ('effort: []', 'positions: [0, 0]', Reason.TRAJECTORY_UNREADABLE, ['line 15', 'repeated']),
        ('effort: []', '[a]: []', Reason.TRAJECTORY_UNREADABLE, ['line 15', 'key']),
        ('effort: []', 'effort: [', Reason.TRAJECTORY_UNREADABLE, ['line ']),
        ('effort: []', 'effort: \x07', Reason.TRAJECTORY_UNREADABLE, ['character']),
    ],
)
def test_the_error_names_file_field_and_value(
    old: str, new: str, reason: Reason, said: list[str]
) -> None:
    assert old in ECHOED
    error = only_error(ECHOED.replace(old, new, 1))
    assert error.reason is reason
    for part in ['plan.yaml: ', *said]:
        assert part in str(error)


@pytest.mark.parametrize('text', ['3', 'some words', '{"a": 1}', '[[]]', 'null', '\ufeff'])
def test_another_layout_is_named(text: str) -> None:
    error = only_error(text)
    assert error.reason is Reason.TRAJECTORY_UNREADABLE
    assert 'expected a mapping with joint_names and points' in str(error)


def test_a_repeated_key_is_refused_in_json_too() -> None:
    text = '{"joint_names": ["a"], "joint_names": ["b"], "points": []}'
    assert "the key 'joint_names' is repeated" in str(only_error(text))


@pytest.mark.parametrize(
    'text',
    [
        # Seven levels of ten aliases are ten million items.
        '\n'.join(
            [
                'a0: &a0 [x]',
                *(f'a{k}: &a{k} [{", ".join([f"*a{k - 1}"] * 10)}]' for k in range(1, 8)),
            ]
        ),
        '[' * 200_000,
        '{"a":' * 200_000,
        '{a: ' * 200_000,
        '- ' * 200_000,
        '? ' * 200_000,
        '"' + 'x' * 200_000,
        '{' + ''.join(f'k{k}: 1, ' for k in range(20_000)) + '}',
        '{"joint_names": ["a"], "points": [{"positions": [' + '9' * 200_000 + ']}]}',
    ],
)
def test_hostile_text_is_refused(text: str) -> None:
    assert only_error(text).reason is Reason.TRAJECTORY_UNREADABLE
    assert len(str(only_error(text))) < 1000


@pytest.mark.parametrize('loader', [yaml.SafeLoader, yaml.CSafeLoader])
def test_both_yaml_loaders_read_alike(monkeypatch: pytest.MonkeyPatch, loader: type) -> None:
    monkeypatch.setattr(strict_yaml, '_LOADER', loader)
    assert isinstance(next(documents(ECHOED)).trajectory, Trajectory)
    for old, new, said in (
        ("''", '*x', 'line 5: anchors and aliases'),
        ("''", '!!str x', 'line 5: tags'),
        ("''", "'", 'line '),
        ('- 0.0', "- '0.0'", "found '0.0'"),
        ('- 0.0', '- \x07', 'character '),
    ):
        assert said in str(only_error(ECHOED.replace(old, new, 1)))


def test_text_beyond_the_bound_is_not_parsed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(text_module, 'MAX_CHARACTERS', len(ECHOED) - 1)
    assert only_error(ECHOED).reason is Reason.TOO_LARGE


printable = st.text(st.characters(min_codepoint=1, max_codepoint=0x2FF), max_size=60)
numbers = st.floats(allow_nan=True, allow_infinity=True) | st.integers(-(10**20), 10**20)
values = st.recursive(
    st.none() | st.booleans() | numbers | st.text(max_size=4),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(
            st.sampled_from(
                ['joint_names', 'points', 'positions', 'time_from_start', 'sec', 'nanosec']
            )
            | st.text(max_size=3),
            inner,
            max_size=4,
        )
    ),
    max_leaves=12,
)
DAMAGED = st.builds(
    lambda start, end, put: ECHOED[:start] + put + ECHOED[end:],
    st.integers(0, len(ECHOED)),
    st.integers(0, len(ECHOED)),
    printable,
)


@given(printable | DAMAGED | values.map(json.dumps))
@settings(derandomize=True, database=None, max_examples=300, deadline=None)
def test_any_text_ends_in_a_trajectory_or_a_clear_error(text: str) -> None:
    for document in documents(text, 'plan.yaml'):
        assert document.name.startswith('plan.yaml')
        if isinstance(document.trajectory, TrajectoryError):
            assert str(document.trajectory).startswith(document.name)
        else:
            assert document.trajectory.name == document.name


@given(st.lists(st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=2), min_size=1, max_size=4))
@settings(derandomize=True, database=None, max_examples=50, deadline=None)
def test_every_number_survives_json_and_echo(rows: list[list[float]]) -> None:
    message = JointTrajectory(joint_names=['a', 'b'])
    for sec, row in enumerate(rows):
        message.points.append(JointTrajectoryPoint(positions=row))
        message.points[-1].time_from_start.sec = sec
    points = [
        {'positions': row, 'time_from_start': {'sec': sec, 'nanosec': 0}}
        for sec, row in enumerate(rows)
    ]
    for text in (
        echoed(message),
        json.dumps({'joint_names': ['a', 'b'], 'points': points}),
    ):
        (trajectory,) = trajectories_from_text(text)
        assert trajectory.positions.tolist() == rows
        assert not math.isnan(trajectory.positions.sum())
