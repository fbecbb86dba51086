"""Results to messages and back: nothing is lost, and an unset message is no permission."""

from collections.abc import Callable
import dataclasses
import math
from pathlib import Path
from typing import Any

from builtin_interfaces.msg import Duration
from hypothesis import given, settings
from hypothesis import strategies as st
import pytest
from rosbags.typesys import get_types_from_msg, get_typestore, Stores
from trajectory_guard_interfaces.msg import CertificationResult

from msg_adapters.result import (
    MessageTypes,
    result_from_message,
    result_to_message,
    ros_message_types,
)
from trajectory_guard.result import Interval, Result, Status, Verdict

MESSAGES = Path(__file__).parents[1] / 'trajectory_guard_interfaces' / 'msg'
PACKAGE = 'trajectory_guard_interfaces/msg'


def typestore() -> Any:
    """Return a store with the messages as they are defined in this repository."""
    store = get_typestore(Stores.ROS2_JAZZY)
    types: dict = {}
    for path in sorted(MESSAGES.glob('*.msg')):
        types.update(get_types_from_msg(path.read_text(), f'{PACKAGE}/{path.stem}'))
    store.register(types)
    return store


STORE = typestore()
RECORDED_TYPES = MessageTypes(
    CertificationResult=STORE.types[f'{PACKAGE}/CertificationResult'],
    TimeInterval=STORE.types[f'{PACKAGE}/TimeInterval'],
    Duration=STORE.types['builtin_interfaces/msg/Duration'],
    Point=STORE.types['geometry_msgs/msg/Point'],
)


def over_the_wire(result: Result) -> Any:
    """Return the message after it was bytes."""
    message = result_to_message(result, RECORDED_TYPES)
    name = f'{PACKAGE}/CertificationResult'
    return STORE.deserialize_cdr(STORE.serialize_cdr(message, name), name)


def in_memory(result: Result) -> Any:
    return result_to_message(result)


BOTH = pytest.mark.parametrize('message_of', [over_the_wire, in_memory])

lengths = st.floats(min_value=-1e9, max_value=1e9)
names = st.text(st.characters(codec='utf-8', exclude_characters='\0'), max_size=8)
times = st.integers(min_value=0, max_value=(2**31 - 1) * 10**9)
intervals = st.builds(
    Interval,
    start_ns=times,
    end_ns=times,
    status=st.sampled_from(Status),
    reason=names,
    body=names,
    obstacle=names,
    at_ns=st.none() | times,
    location=st.none() | st.tuples(lengths, lengths, lengths),
    gap_lower=st.none() | lengths,
    gap_upper=st.none() | lengths,
)
results = st.builds(
    Result,
    verdict=st.sampled_from(Verdict),
    reason_code=names,
    message=names,
    intervals=st.lists(intervals, max_size=3).map(tuple),
    tolerance=lengths,
    clearance=lengths,
    interpolation=names,
    robot_hash=names,
    scene_hash=names,
    compute_time=lengths,
    pieces=st.integers(0, 2**32 - 1),
    pairs_checked=st.integers(0, 2**32 - 1),
    unchecked_pairs=st.lists(names, max_size=3).map(tuple),
    warnings=st.lists(names, max_size=3).map(tuple),
    duration_ns=times,
)


@given(results)
@settings(derandomize=True, database=None, max_examples=60, deadline=None)
def test_a_result_survives_the_message(result: Result) -> None:
    for message_of in (over_the_wire, in_memory):
        assert result_from_message(message_of(result)) == result


@BOTH
def test_the_label_is_given_again(message_of: Callable[[Result], Any]) -> None:
    message = message_of(Result(Verdict.FREE, name='plan'))
    assert result_from_message(message, 'plan').name == 'plan'


@BOTH
def test_what_is_unknown_is_nan_or_negative(message_of: Callable[[Result], Any]) -> None:
    message = message_of(Result(Verdict.SUSPECT, intervals=(Interval(0, 5, Status.SUSPECT),)))
    (interval,) = message.intervals
    place = interval.location
    assert all(map(math.isnan, (place.x, place.y, place.z)))
    assert math.isnan(interval.gap_lower)
    assert math.isnan(interval.gap_upper)
    assert interval.at.sec < 0


@BOTH
def test_codes_are_those_of_the_message(message_of: Callable[[Result], Any]) -> None:
    for verdict in Verdict:
        assert message_of(Result(verdict)).verdict == getattr(CertificationResult, verdict.name)


def test_every_field_of_the_message_is_set() -> None:
    fields = CertificationResult.get_fields_and_field_types()
    # A certificate travels beside the result, in the response; contacts are not asked for there.
    renamed = {'duration_ns': 'duration', 'name': None, 'certificate': None, 'contacts': None}
    ours = {renamed.get(f.name, f.name) for f in dataclasses.fields(Result)} - {None}
    assert set(fields) == ours


def test_a_message_nobody_filled_in_is_rejected() -> None:
    types = ros_message_types()
    assert result_from_message(types.CertificationResult()).verdict is Verdict.REJECTED
    result = result_from_message(types.CertificationResult(intervals=[types.TimeInterval()]))
    assert result.intervals[0].status is Status.UNKNOWN


def test_a_verdict_from_the_future_is_no_verdict() -> None:
    with pytest.raises(ValueError, match='200'):
        result_from_message(CertificationResult(verdict=200))


def test_nanoseconds_of_an_interval_are_exact() -> None:
    result = Result(Verdict.FREE, intervals=(Interval(1, 2_000_000_003, Status.FREE),))
    (interval,) = result_to_message(result).intervals
    assert interval.start == Duration(sec=0, nanosec=1)
    assert interval.end == Duration(sec=2, nanosec=3)
