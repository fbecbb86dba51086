"""What an adversary tries with the gate."""

from collections.abc import Iterator
import time

from builtin_interfaces.msg import Time
from gate_process import Bench, fake_guard, FakeGuard, gate_process, soon
from guard_process import asker, message, parameters
import pytest
from rclpy.serialization import serialize_message

FREE = message((0.0, [0.0, 0.0]), (1.0, [0.5, 0.5]))

# From passing on until the controller begins [s].
DELAY = 0.3


@pytest.fixture(scope='module')
def fake() -> Iterator[FakeGuard]:
    with fake_guard('adversary') as made:
        yield made


@pytest.fixture(scope='module')
def bench(tmp_path_factory: pytest.TempPathFactory, fake: FakeGuard) -> Iterator[Bench]:
    arguments = parameters(max_start_delay=DELAY, max_drift=0.02, max_state_age=0.4)
    folder = tmp_path_factory.mktemp('gate')
    with asker() as ask, gate_process(folder, 'adversary', *arguments) as process:
        made = Bench(ask.node, 'adversary')
        made.wait(process, '')
        yield made


def test_states_from_before_the_controller_began_count_for_nothing(bench: Bench) -> None:
    time.sleep(2 * DELAY)
    bench.free(FREE)
    # It may be accelerating, of which no state that is known yet tells.
    assert bench.code(FREE) == 'state_changed'
    assert 'begun' in bench.decisions[-1].message
    time.sleep(2 * DELAY)
    bench.free(FREE)


@pytest.mark.parametrize('sec', [-1, -2])
def test_a_stamp_of_negative_seconds_is_none_though_its_sum_is(bench: Bench, sec: int) -> None:
    time.sleep(2 * DELAY)
    trajectory = message((0.0, [0.0, 0.0]), (1.0, [0.5, 0.5]))
    # The controller's type of time raises at negative seconds.
    trajectory.header.stamp = Time(sec=sec, nanosec=-sec * 10**9)
    assert bench.code(trajectory) == 'stamp_invalid'


@pytest.mark.parametrize('encapsulation', [0x03, 0x07, 0x09, 0x0B])
def test_an_encoding_that_another_vendor_reads_otherwise(bench: Bench, encapsulation: int) -> None:
    time.sleep(2 * DELAY)
    raw = serialize_message(FREE)
    count = len(bench.decisions)
    # Fast DDS reads them all as plain CDR; by the standard the alignment is another.
    bench.sender.publish(bytes([0, encapsulation]) + raw[2:])
    soon(lambda: len(bench.decisions) > count, 'a decision')
    assert bench.decisions[-1].reason_code == 'trajectory_unreadable'
