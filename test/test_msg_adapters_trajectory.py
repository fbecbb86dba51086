"""Messages to trajectories and joint states, whatever the messages are made of."""

from collections.abc import Callable
import math
from types import SimpleNamespace
from typing import Any

import builtin_interfaces.msg
from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from rosbags.typesys import get_typestore, Stores
import sensor_msgs.msg
import std_msgs.msg
import trajectory_msgs.msg

from msg_adapters.result import nanoseconds_to_message
from msg_adapters.trajectory import (
    joint_state_from_message,
    nanoseconds_from_message,
    stamp_from_message,
    trajectory_from_message,
)
from trajectory_guard.errors import Reason, TrajectoryError

RECORDED = get_typestore(Stores.ROS2_JAZZY).types
FLOAT_FIELDS = ('positions', 'velocities', 'accelerations', 'effort')

Make = Callable[..., Any]


def make_plain(_: str, /, **fields: Any) -> Any:
    """Return what a reader of text makes."""
    return SimpleNamespace(**fields)


def make_recorded(name: str, /, **fields: Any) -> Any:
    """Return what rosbags makes; its arrays are numpy's."""
    arrays = {
        key: np.array(value, dtype=np.float64)
        if isinstance(value, list) and key != 'name'
        else value
        for key, value in fields.items()
        if key not in ('joint_names', 'points')
    }
    return RECORDED[name.replace('/', '/msg/')](**{**fields, **arrays})


def make_live(name: str, /, **fields: Any) -> Any:
    """Return what rclpy makes."""
    modules = {
        'builtin_interfaces': builtin_interfaces.msg,
        'sensor_msgs': sensor_msgs.msg,
        'std_msgs': std_msgs.msg,
        'trajectory_msgs': trajectory_msgs.msg,
    }
    package, _, name = name.partition('/')
    return getattr(modules[package], name)(**fields)


MAKERS = pytest.mark.parametrize('make', [make_plain, make_recorded, make_live])


def header(make: Make) -> Any:
    stamp = make('builtin_interfaces/Time', sec=17, nanosec=5)
    return make('std_msgs/Header', stamp=stamp, frame_id='world')


def trajectory(make: Make, names: list[str], points: list[tuple[int, int, dict]]) -> Any:
    return make(
        'trajectory_msgs/JointTrajectory',
        header=header(make),
        joint_names=names,
        points=[
            make(
                'trajectory_msgs/JointTrajectoryPoint',
                **{field: values.get(field, []) for field in FLOAT_FIELDS},
                time_from_start=make('builtin_interfaces/Duration', sec=sec, nanosec=nanosec),
            )
            for sec, nanosec, values in points
        ],
    )


def joint_state(make: Make, name: list[str], **fields: list[float]) -> Any:
    values = {'position': [], 'velocity': [], 'effort': [], **fields}
    return make('sensor_msgs/JointState', header=header(make), name=name, **values)


@MAKERS
def test_a_trajectory_keeps_every_number_and_the_order(make: Make) -> None:
    message = trajectory(
        make,
        ['b', 'a'],
        [
            (0, 0, {'positions': [0.1, -0.2]}),
            (1, 1, {'positions': [0.3, 0.4], 'velocities': [1e-300, -2.5]}),
            (
                2**31 - 1,
                999_999_999,
                {
                    'positions': [math.pi, 1.0 / 3.0],
                    'velocities': [5.0, 6.0],
                    'accelerations': [7.0, 8.0],
                    'effort': [9.0, 10.0],
                },
            ),
        ],
    )
    value = trajectory_from_message(message, 'plan')
    assert stamp_from_message(message) == 17_000_000_005
    assert value.name == 'plan'
    assert value.joint_names == ('b', 'a')
    assert value.times_ns.tolist() == [0, 1_000_000_001, 2_147_483_647_999_999_999]
    assert value.positions.tolist() == [[0.1, -0.2], [0.3, 0.4], [math.pi, 1.0 / 3.0]]
    assert value.has_velocities.tolist() == [False, True, True]
    assert value.velocities[1:].tolist() == [[1e-300, -2.5], [5.0, 6.0]]
    assert value.has_accelerations.tolist() == [False, False, True]
    assert value.accelerations[2].tolist() == [7.0, 8.0]


@MAKERS
@pytest.mark.parametrize(
    ('names', 'points', 'reason'),
    [
        ([], [], Reason.NO_POINTS),
        (['a'], [], Reason.NO_POINTS),
        ([], [(0, 0, {'positions': [1.0]})], Reason.NO_JOINTS),
        (['a'], [(0, 0, {})], Reason.MISSING_POSITIONS),
        (['a'], [(0, 0, {'effort': [1.0]})], Reason.EFFORT_ONLY),
        (['a'], [(0, 0, {'positions': [1.0, 2.0]})], Reason.SIZE_MISMATCH),
        (['a'], [(0, 0, {'positions': [math.nan]})], Reason.NOT_FINITE),
        (['a'], [(-1, 5, {'positions': [1.0]})], Reason.NEGATIVE_TIME),
        (['a', 'a'], [(0, 0, {'positions': [1.0, 2.0]})], Reason.DUPLICATE_JOINT),
        (['a'], [(1, 0, {'positions': [1.0]})] * 2, Reason.UNSORTED_TIMES),
    ],
)
def test_what_cannot_be_played_is_refused(
    make: Make, names: list[str], points: list, reason: Reason
) -> None:
    with pytest.raises(TrajectoryError) as caught:
        trajectory_from_message(trajectory(make, names, points))
    assert caught.value.reason is reason


def test_a_stamp_needs_a_header() -> None:
    assert stamp_from_message(SimpleNamespace()) == 0
    with pytest.raises(TrajectoryError, match='stamp'):
        stamp_from_message(SimpleNamespace(header=SimpleNamespace()))


@pytest.mark.parametrize('field', ['joint_names', 'points'])
def test_a_missing_field_is_named(field: str) -> None:
    message = trajectory(make_plain, ['a'], [(0, 0, {'positions': [1.0]})])
    delattr(message, field)
    with pytest.raises(TrajectoryError, match=field):
        trajectory_from_message(message)


@pytest.mark.parametrize('field', [*FLOAT_FIELDS, 'time_from_start'])
def test_a_missing_field_of_a_point_is_named_with_the_point(field: str) -> None:
    message = trajectory(make_plain, ['a'], [(k, 0, {'positions': [1.0]}) for k in range(3)])
    delattr(message.points[2], field)
    with pytest.raises(TrajectoryError, match=rf'points\[2\].*{field}'):
        trajectory_from_message(message)


@given(st.integers(min_value=-(2**31) * 10**9, max_value=2**31 * 10**9 - 1))
@settings(derandomize=True, database=None)
def test_nanoseconds_survive_a_message_exactly(time_ns: int) -> None:
    for make in (make_plain, make_recorded, make_live):
        message = nanoseconds_to_message(
            time_ns, lambda make=make, **fields: make('builtin_interfaces/Duration', **fields)
        )
        assert 0 <= message.nanosec < 10**9
        assert nanoseconds_from_message(message) == time_ns


@pytest.mark.parametrize('sec', [1.0, '1', None])
def test_a_time_that_is_no_integer_is_refused(sec: object) -> None:
    with pytest.raises(TrajectoryError) as caught:
        nanoseconds_from_message(SimpleNamespace(sec=sec, nanosec=0))
    assert caught.value.reason is Reason.TRAJECTORY_UNREADABLE


@MAKERS
def test_a_joint_state_without_velocities_has_none(make: Make) -> None:
    state = joint_state_from_message(
        joint_state(make, ['a', 'b'], position=[1.0, 2.0], effort=[3.0, math.nan])
    )
    assert state.joint_names == ('a', 'b')
    assert state.positions.tolist() == [1.0, 2.0]
    assert state.velocities is None


@MAKERS
def test_nan_in_a_joint_state_is_not_measured(make: Make) -> None:
    state = joint_state_from_message(
        joint_state(
            make,
            ['wheel', 'a', 'b'],
            position=[math.nan, 1.0, 2.0],
            velocity=[4.0, 0.5, math.nan],
        )
    )
    assert state.joint_names == ('a', 'b')
    assert state.positions.tolist() == [1.0, 2.0]
    assert state.velocities is not None
    assert state.velocities.tolist() == [0.5, 0.0]


@MAKERS
def test_velocities_that_are_all_nan_are_none(make: Make) -> None:
    message = joint_state(make, ['a'], position=[1.0], velocity=[math.nan])
    assert joint_state_from_message(message).velocities is None


@MAKERS
@pytest.mark.parametrize(
    ('name', 'fields', 'reason'),
    [
        (['a', 'b'], {'position': [1.0]}, Reason.SIZE_MISMATCH),
        (['a'], {}, Reason.SIZE_MISMATCH),
        (['a'], {'position': [1.0], 'velocity': [1.0, 2.0]}, Reason.SIZE_MISMATCH),
        (['a'], {'position': [math.inf]}, Reason.NOT_FINITE),
        (['a'], {'position': [1.0], 'velocity': [-math.inf]}, Reason.NOT_FINITE),
        (['a', 'a'], {'position': [1.0, 2.0]}, Reason.DUPLICATE_JOINT),
        ([], {}, Reason.NO_JOINTS),
        (['a'], {'position': [math.nan]}, Reason.NO_JOINTS),
    ],
)
def test_a_joint_state_that_says_nothing_sure_is_refused(
    make: Make, name: list[str], fields: dict, reason: Reason
) -> None:
    with pytest.raises(TrajectoryError) as caught:
        joint_state_from_message(joint_state(make, name, **fields))
    assert caught.value.reason is reason


def test_text_in_a_joint_state_is_refused() -> None:
    with pytest.raises(TrajectoryError, match='position'):
        joint_state_from_message(joint_state(make_plain, ['a'], position=['x']))
