"""Counts are exact, latencies are those of the window, and nothing grows without bound."""

import math
import random
import threading

import pytest

from trajectory_guard.ros.tally import MESSAGE_LENGTH, NAMES, OTHER, Tally, WINDOW


def entries(tally):
    """Return the entries by name; no name comes twice."""
    found = tally.entries()
    assert len(dict(found)) == len(found)
    return dict(found)


def test_empty():
    """A tally that counted nothing says so, and has no latencies."""
    assert Tally().entries() == [
        ('decisions', '0'),
        ('last outcome', ''),
        ('last reason', ''),
        ('last message', ''),
    ]


def test_counts_by_outcome_and_reason():
    """Each decision counts once for its outcome and once for its reason, if it has one."""
    tally = Tally()
    tally.count('free', '', 0.001)
    tally.count('suspect', 'deadline', 0.003, 'no time')
    tally.count('suspect', 'below_tolerance', 0.002, 'close')
    found = entries(tally)
    assert found['decisions'] == '3'
    assert found['outcome free'] == '1'
    assert found['outcome suspect'] == '2'
    assert found['reason deadline'] == found['reason below_tolerance'] == '1'
    assert (found['last outcome'], found['last reason']) == ('suspect', 'below_tolerance')
    assert found['last message'] == 'close'
    assert found['latency p50 [s]'] == '0.002000'
    assert found['latency max [s]'] == '0.003000'


@pytest.mark.parametrize('number', [1, 2, 99, 100, 101, WINDOW, WINDOW + 500])
def test_percentiles_are_ranks_in_the_window(number):
    """At least so many per cent of the window are not above, and fewer are not above the next."""
    tally = Tally()
    latencies = [i / 1000 for i in range(1, number + 1)]
    random.Random(1).shuffle(latencies)
    for seconds in latencies:
        tally.count('free', '', seconds)
    window = latencies[-WINDOW:]
    found = entries(tally)
    assert float(found['latency max [s]']) == max(window)
    for name, share in (('p50', 0.5), ('p99', 0.99)):
        value = float(found[f'latency {name} [s]'])
        assert value in window
        assert sum(x <= value for x in window) >= share * len(window)
        assert sum(x < value for x in window) < share * len(window)


@pytest.mark.parametrize('seconds', [math.nan, -1.0])
def test_what_is_no_latency_spoils_none(seconds):
    """The decision counts all the same."""
    tally = Tally()
    for each in (seconds, 1.0, seconds):
        tally.count('free', '', each)
    found = entries(tally)
    assert found['decisions'] == '3'
    assert {found[f'latency {name} [s]'] for name in ('p50', 'p99', 'max')} == {'1.000000'}


def test_names_are_bounded_and_none_is_lost():
    """Whoever invents names fills the tally no further; all decisions are counted."""
    tally = Tally()
    for i in range(10 * NAMES):
        tally.count(f'outcome{i}', f'{i:03}' * 1000, 0.0, 'x' * 10_000)
    found = entries(tally)
    assert len(found) <= 2 * (NAMES + 1) + 10
    assert sum(map(len, found)) < 20_000
    for kind in ('outcome ', 'reason '):
        counts = [int(value) for key, value in found.items() if key.startswith(kind)]
        assert sum(counts) == 10 * NAMES
        assert int(found[kind + OTHER]) == 9 * NAMES
    assert found['last message'] == 'x' * MESSAGE_LENGTH


def test_threads_lose_no_count():
    """Threads count while another reads."""
    tally, each, threads = Tally(), 2000, 4

    def work(name):
        for i in range(each):
            tally.count(name, f'reason{i % 5}', 1e-3)

    workers = [threading.Thread(target=work, args=(f'outcome{i}',)) for i in range(threads)]
    for worker in workers:
        worker.start()
    while any(worker.is_alive() for worker in workers):
        entries(tally)
    found = entries(tally)
    assert [found[f'outcome outcome{i}'] for i in range(threads)] == [str(each)] * threads
    assert [found[f'reason reason{i}'] for i in range(5)] == [str(each * threads // 5)] * 5
