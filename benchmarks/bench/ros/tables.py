"""Tables of the service and of the gate, each a function that yields rows."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
import functools
import multiprocessing
import statistics
import time

from bench.built import DATA
from bench.cases import Case, load
from bench.clock import quantiles
from bench.ros.client import Answer, Client, request_for, spinning
from bench.ros.gate import gate
from bench.ros.process import echo_command, guard_command, resident_mb, running

CASES = 20  # trajectories that are asked for in turn
WARM_UP = 100
CLIENTS = 2
STARTS = 3

# What is asked of it.
ABOVE_MS = 3.0
START_S = 3.0
GROWTH_PERCENT = 5.0

SERVERS = {'guard': guard_command, 'echo': echo_command}


def round_trip(requests: int) -> Iterator[dict]:
    """Yield how long one client waits: for the guard, and in turns for one that does nothing."""
    cases = panda()
    answers: dict[str, list[Answer]] = {name: [] for name in SERVERS}
    with spinning() as (node, executor), running(guard_command()), running(echo_command()):
        clients = {name: Client(node, executor, name) for name in SERVERS}
        for client in clients.values():
            client.connect(request_for(cases[0]))
        for i in range(WARM_UP + requests):
            for name, client in clients.items():
                answer = client.ask(request_for(cases[i % len(cases)]))
                if i >= WARM_UP:
                    answers[name].append(answer)
    medians = {name: statistics.median(a.above_ms for a in answers[name]) for name in SERVERS}
    for name, found in answers.items():
        row = {
            'table': 'round trip',
            'server': name,
            'requests': requests,
            **quantiles([answer.ms for answer in found]),
            **quantiles([answer.above_ms for answer in found], 'above_'),
            'x_echo': medians[name] / medians['echo'],
        }
        if name == 'guard':
            row['unsound'] = missed(found, cases, WARM_UP)
            row['met'] = medians[name] <= ABOVE_MS
        yield row


def clients(requests: int) -> Iterator[dict]:
    """Yield what clients in processes of their own see, and what the guard keeps of it."""
    spawn = multiprocessing.get_context('spawn')
    with running(guard_command()) as guard, ProcessPoolExecutor(CLIENTS, spawn) as pool:
        list(pool.map(ask_many, [WARM_UP] * CLIENTS))
        before = resident_mb(guard.pid)
        found = list(pool.map(ask_many, [requests] * CLIENTS))
        after = resident_mb(guard.pid)
    lost = sum(row['lost'] for row in found)
    growth = 100.0 * (after / before - 1.0)
    yield {
        'table': 'clients',
        'clients': CLIENTS,
        'requests': CLIENTS * requests,
        'lost': lost,
        'unsound': sum(row['unsound'] for row in found),
        **quantiles([ms for row in found for ms in row['ms']]),
        **quantiles([ms for row in found for ms in row['above_ms']], 'above_'),
        'resident_mb': after,
        'growth_percent': growth,
        'met': lost == 0 and growth <= GROWTH_PERCENT,
    }


def ask_many(requests: int) -> dict:
    """Return what one client gets for so many requests, in a process of its own."""
    cases = panda()
    with spinning() as (node, executor):
        client = Client(node, executor, 'guard')
        client.connect(request_for(cases[0]))
        found = [client.ask(request_for(cases[i % len(cases)])) for i in range(requests)]
    answered = [answer for answer in found if answer.result]
    return {
        'lost': len(found) - len(answered),
        'unsound': missed(found, cases),
        'ms': [answer.ms for answer in answered],
        'above_ms': [answer.above_ms for answer in answered],
    }


def start(_: int) -> Iterator[dict]:
    """Yield the time from the start of a process to its first answer, kernels compiled before."""
    (case, *_) = panda()
    for name, command in SERVERS.items():
        seconds = []
        with spinning() as (node, executor):
            for _ in range(STARTS):
                begin = time.perf_counter()
                with running(command()):
                    Client(node, executor, name).connect(request_for(case))
                    seconds.append(time.perf_counter() - begin)
        row = {
            'table': 'start',
            'server': name,
            'least_s': min(seconds),
            'median_s': statistics.median(seconds),
        }
        if name == 'guard':
            row['met'] = row['median_s'] <= START_S
        yield row


TABLES: dict[str, Callable[[int], Iterator[dict]]] = {
    'round trip': round_trip,
    'clients': clients,
    'start': start,
    'gate': lambda requests: gate(panda(), requests),
}


@functools.cache
def panda() -> Sequence[Case]:
    """Return cases of the Panda at its shelf."""
    (found,) = (bench for bench in load(DATA, CASES) if bench.name == 'panda')
    return found.cases


def missed(answers: Sequence[Answer], cases: Sequence[Case], first: int = 0) -> int:
    """Count collisions that were called free; the first answer is that to the first-th request."""
    return sum(
        answer.missed(cases[i % len(cases)])
        for i, answer in enumerate(answers, first)
        if answer.result
    )
