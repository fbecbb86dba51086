"""What the supervisor promises: of small stand-ins, and of the real guard and gate."""

from contextlib import contextmanager
from itertools import pairwise
import os
from pathlib import Path
import re
import signal
import subprocess
import sys
import time

from guard_process import (
    ARM,
    asker,
    ENVIRONMENT,
    message,
    PATIENCE,
    request,
    SCENE,
)
import pytest

from trajectory_guard.result import Verdict
from trajectory_guard.ros import supervisor

# Runs two shell scripts as guard and gate, which stop quickly if at all.
SUPERVISE = """
import sys
from trajectory_guard.errors import TrajectoryGuardError
from trajectory_guard.ros import supervisor
supervisor.GRACE = 1.0
names = ['guard', 'gate']
try:
    programs = [
        supervisor.Program(name, ['bash', '-c', script], f'no {name} now', {'NAME': name})
        for name, script in zip(names, sys.argv[1:])
    ]
    sys.exit(supervisor.supervise(programs))
except TrajectoryGuardError as error:
    sys.exit(f'{error.reason}: {error}')
"""

# Each writes what happens to it into the file `events`.
RUNS = 'echo $NAME $$ runs >>events; exec sleep 1000'
LISTENS = 'trap "sleep 0.2; echo $NAME stops >>events; exit 0" TERM; echo $NAME $$ runs >>events; '
LISTENS += 'while :; do sleep 0.05; done'
DEAF = 'trap "" TERM INT; echo $NAME $$ runs >>events; while :; do sleep 0.05; done'

PARAMETERS = """
/**/guard:
  ros__parameters:
    robot_description_file: {robot}
    scene_files: [{scene}]
"""

# As bringup sets it; without it, a process that was killed is seen for so long [s].
PROFILE = {
    'FASTRTPS_DEFAULT_PROFILES_FILE': str(Path(__file__).parent.parent / 'config' / 'fastdds.xml')
}
LEASE_OF_FAST_DDS = 20.0


def test_each_program_has_its_own_keys(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []
    monkeypatch.setattr(supervisor, 'supervise', lambda programs: seen.extend(programs) or 0)
    monkeypatch.setenv('ROS_SECURITY_ENABLE', 'true')
    assert supervisor.main(['supervisor']) == 0
    assert [program.environment for program in seen] == [
        {'ROS_SECURITY_ENCLAVE_OVERRIDE': f'/trajectory_guard/{name}'}
        for name in ('guard', 'gate')
    ]
    monkeypatch.setenv('ROS_SECURITY_ENABLE', 'false')
    assert supervisor.main(['supervisor']) == 0
    assert [program.environment for program in seen[2:]] == [{}, {}]


class Supervised:
    """A running supervisor in a folder."""

    def __init__(self, process: subprocess.Popen[str], folder: Path) -> None:
        self.process = process
        self.folder = folder

    def events(self) -> list[str]:
        """Return what has happened so far."""
        file = self.folder / 'events'
        return file.read_text().splitlines() if file.exists() else []

    def pids(self) -> list[int]:
        """Return the processes that ran, in their order."""
        return [int(line.split()[1]) for line in self.events() if line.endswith('runs')]

    def wait_for(self, count: int) -> list[int]:
        """Wait for so many starts."""
        until(lambda: len(self.pids()) >= count)
        return self.pids()

    def said(self) -> str:
        """Return what was printed so far."""
        return (self.folder / 'log').read_text()

    def end(self, number: int = signal.SIGTERM) -> int:
        """Send a signal and return the exit code."""
        self.process.send_signal(number)
        return self.process.wait(20)


def until(condition, patience=20.0):
    """Wait until something holds."""
    deadline = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def alive(pid: int) -> bool:
    """Say whether a process runs; one that nobody has waited for does not."""
    try:
        return Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()[0] != 'Z'
    except OSError:
        return False


@contextmanager
def started(folder, command, **environment):
    """Run a supervisor in a session of its own; kill it in the end."""
    with (folder / 'log').open('wb') as log:
        process = subprocess.Popen(
            [sys.executable, *command],
            cwd=folder,
            stdout=log,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            env={**os.environ, 'PYTHONPATH': str(Path(__file__).parent.parent), **environment},
        )
    try:
        yield Supervised(process, folder)
    finally:
        process.kill()
        process.wait()


@pytest.fixture
def supervised(tmp_path):
    """Return a function that runs stand-ins for guard and gate under a supervisor."""
    running = []

    def run(guard, gate):
        running.append(context := started(tmp_path, ['-c', SUPERVISE, guard, gate]))
        return context.__enter__()

    yield run
    for context in running:
        context.__exit__(None, None, None)


@pytest.mark.parametrize('number', [signal.SIGKILL, signal.SIGSEGV, signal.SIGTERM])
def test_what_dies_is_started_again(supervised, number):
    """A death by any signal is said, with what holds meanwhile, and mended; the other runs on."""
    one = supervised(RUNS, RUNS)
    guard, gate = sorted(one.wait_for(2), key=lambda pid: f'gate {pid} runs' in one.events())
    os.kill(guard, number)
    again = one.wait_for(3)[2]
    assert f'guard {again} runs' in one.events()
    assert alive(again) and alive(gate) and not alive(guard)
    killed = f'guard (pid {guard}) was killed by {number.name} after 0.'
    until(lambda: f'guard started again (pid {again})' in one.said())
    (line,) = (line for line in one.said().splitlines() if killed in line)
    assert line.startswith('[ERROR]')
    assert 'starting it in 0.5 s; no guard now' in line
    assert one.end() == 0
    assert not alive(again) and not alive(gate)


def test_pauses_grow(supervised):
    """What ends at once, even in good order, is started after twice the pause each time."""
    one = supervised('date +%s.%N >>times', RUNS)
    until(lambda: 'starting it in 4 s' in one.said())
    times = [float(line) for line in (one.folder / 'times').read_text().split()]
    pauses = [after - before for before, after in pairwise(times)]
    for pause, least in zip(pauses, (0.5, 1.0, 2.0), strict=True):
        assert pause >= least
    said = re.findall(r'guard \(pid \d+\) ended with code 0 .* in (\S+) s;', one.said())
    assert said == ['0.5', '1', '2', '4']
    assert one.end() == 0


@pytest.mark.parametrize('bad', ['guard', 'gate'])
def test_bad_input_at_first_ends_all(supervised, bad):
    """Exit code 2 of a first run is bad input, which no restart mends."""
    scripts = {'guard': RUNS, 'gate': RUNS, bad: 'sleep 0.5; echo no such file; exit 2'}
    one = supervised(**scripts)
    one.wait_for(1)
    assert one.process.wait(20) == 1  # as the script of this test ends on an error
    assert re.search(rf'invalid_parameter: {bad} \(pid \d+\) cannot use', one.said())
    assert not any(map(alive, one.pids()))


def test_bad_input_later_is_a_death(supervised):
    """A file that is gone for a moment does not end what ran."""
    one = supervised(
        'echo $NAME $$ runs >>events; [[ -e old ]] && exit 2; touch old; exit 1', RUNS
    )
    one.wait_for(4)
    assert 'ended with code 1' in one.said() and 'ended with code 2' in one.said()
    assert one.end() == 0


def test_gate_stops_before_guard(supervised):
    """The guard is asked to stop when the gate has ended."""
    one = supervised(LISTENS, LISTENS)
    one.wait_for(2)
    assert one.end(signal.SIGINT) == 0
    assert one.events()[-2:] == ['gate stops', 'guard stops']


def test_interrupt_from_the_keyboard_keeps_the_order(supervised):
    """Ctrl-C goes to the whole process group, but not to guard and gate."""
    one = supervised(LISTENS, LISTENS)
    one.wait_for(2)
    os.killpg(one.process.pid, signal.SIGINT)
    assert one.process.wait(20) == 0
    assert one.events()[-2:] == ['gate stops', 'guard stops']


def test_what_does_not_stop_is_killed(supervised):
    """Each has its time to stop, and no more."""
    one = supervised(DEAF, DEAF)
    pids = one.wait_for(2)
    begin = time.monotonic()
    assert one.end() == 0
    assert 2.0 <= time.monotonic() - begin < 5.0
    assert not any(map(alive, pids))
    assert 'gate does not stop within 1 s: killing it' in one.said()


@pytest.mark.parametrize('script', [RUNS, DEAF])
def test_a_killed_supervisor_leaves_nothing(supervised, script):
    """The kernel kills guard and gate when their supervisor dies."""
    one = supervised(script, script)
    pids = one.wait_for(2)
    assert all(map(alive, pids))
    one.end(signal.SIGKILL)
    until(lambda: not any(map(alive, pids)), 5.0)


def test_stops_while_something_waits_to_be_started(supervised):
    """A pause does not delay the end."""
    one = supervised('exit 1', RUNS)
    until(lambda: 'starting it in 2 s' in one.said())
    begin = time.monotonic()
    assert one.end() == 0
    assert time.monotonic() - begin < 1.5


def test_programs_take_signals(supervised):
    """The signals that the supervisor blocks for itself are not blocked in what it starts."""
    one = supervised(f'grep SigBlk /proc/self/status >mask; {RUNS}', RUNS)
    one.wait_for(2)
    assert (one.folder / 'mask').read_text().split() == ['SigBlk:', '0' * 16]


def test_what_cannot_be_started_is_named(tmp_path):
    """An executable that is not there ends all, and the one before it."""
    script = SUPERVISE.replace("'bash', '-c', script", 'script')
    with started(tmp_path, ['-c', script, '/bin/cat', '/no/such/gate']) as one:
        assert one.process.wait(20) == 1
    assert 'cannot start gate: ' in one.said() and '/no/such/gate' in one.said()


# The real ones


def test_a_killed_guard_answers_again(tmp_path):
    """The guard is killed and comes back; soon nobody sees the dead one any more."""
    (tmp_path / 'arm.urdf').write_text(ARM)
    (tmp_path / 'scene.urdf').write_text(SCENE)
    (tmp_path / 'guard.yaml').write_text(
        PARAMETERS.format(robot=tmp_path / 'arm.urdf', scene=tmp_path / 'scene.urdf')
    )
    ask = request(message((0.0, (0.0, 0.0)), (1.0, (0.1, 0.1))))
    command = ['-m', 'trajectory_guard.ros.supervisor', '--ros-args', '-r', '__ns:=/kept']
    command += ['--params-file', 'guard.yaml']
    with started(tmp_path, command, **ENVIRONMENT, **PROFILE) as one, asker() as here:
        client = here.client('kept')
        until(lambda: answers(client.call_async(ask)))
        (pid,) = re.findall(r'guard started \(pid (\d+)\)', one.said())
        os.kill(int(pid), signal.SIGKILL)
        killed = time.monotonic()
        until(lambda: one.said().count('ready: robot') == 2, PATIENCE)
        until(lambda: answers(client.call_async(ask)))
        until(lambda: here.node.count_services('/kept/guard/certify') == 1)
        assert time.monotonic() - killed < LEASE_OF_FAST_DDS / 2
        assert one.end() == 0
    assert 'gate started (pid' in one.said()
    assert 'gate (pid' not in one.said(), 'the gate died'


def answers(future):
    """Say whether a guard answers; one that is dead, or does not know the client yet, does not."""
    deadline = time.monotonic() + 0.5
    while not future.done() and time.monotonic() < deadline:
        time.sleep(0.02)
    return future.done() and future.result().result.verdict == Verdict.FREE
