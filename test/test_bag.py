"""Bags: every trajectory is found, with the joint states known at its time, and damage is said."""

from collections.abc import Callable, Iterator
from pathlib import Path
import random
import shutil
import sqlite3
from typing import Any

import numpy as np
import pytest
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import get_types_from_msg, get_typestore, Stores

from msg_adapters.bag import Bag, is_bag
from msg_adapters.recorded import JOINT_STATE, JOINT_TRAJECTORY, Recorded, recorded_trajectories
from trajectory_guard.errors import Reason, TrajectoryError
from trajectory_guard.paths.trajectory import Trajectory

STORE = get_typestore(Stores.ROS2_JAZZY)
SECOND = 1_000_000_000
STORAGES = pytest.mark.parametrize('storage', list(StoragePlugin))

# What a test writes: topic, receive time [ns], message or bytes.
Entry = tuple[str, int, Any]


def header() -> Any:
    stamp = STORE.types['builtin_interfaces/msg/Time'](sec=2**31 - 1, nanosec=5)
    return STORE.types['std_msgs/msg/Header'](stamp=stamp, frame_id='')


def array(values: list[float]) -> np.ndarray:
    return np.array(values, dtype=np.float64)


def plan(position: float, names: tuple[str, ...] = ('a', 'b')) -> Any:
    """Return a trajectory message that is told from others by its first position."""
    duration = STORE.types['builtin_interfaces/msg/Duration']
    point = STORE.types['trajectory_msgs/msg/JointTrajectoryPoint']
    none = array([])
    points = [
        point(array([position] * len(names)), none, none, none, duration(sec=sec, nanosec=7))
        for sec in (1, 2)
    ]
    return STORE.types[JOINT_TRAJECTORY](header(), list(names), points)


def state(velocity: list[float] | None = None, **positions: float) -> Any:
    return STORE.types[JOINT_STATE](
        header(),
        list(positions),
        array([*positions.values()]),
        array(velocity or []),
        array([]),
    )


def write(path: Path, storage: StoragePlugin, entries: list[Entry], **options: Any) -> Path:
    """Write a bag; bytes are written as a trajectory."""
    with Writer(path, version=9, storage_plugin=storage, **options) as writer:
        connections: dict[str, Any] = {}
        for topic, time_ns, message in entries:
            kind = getattr(message, '__msgtype__', JOINT_TRAJECTORY)
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=STORE)
            raw = message if isinstance(message, bytes) else STORE.serialize_cdr(message, kind)
            writer.write(connections[topic], time_ns, raw)
    return path


def storage_file(folder: Path) -> Path:
    (file,) = (file for file in folder.iterdir() if file.suffix in ('.mcap', '.db3'))
    return file


def first_positions(recorded: Iterator[Recorded]) -> list[float]:
    return [
        r.trajectory.positions[0, 0].item()
        for r in recorded
        if isinstance(r.trajectory, Trajectory)
    ]


def read_to_damage(path: Path) -> tuple[list[Recorded], TrajectoryError | None]:
    """Return what a bag gives before it fails, and how it fails."""
    found: list[Recorded] = []
    try:
        found.extend(recorded_trajectories(path))
    except TrajectoryError as error:
        return found, error
    return found, None


TWO_TOPICS: list[Entry] = [
    ('/arm/plan', 1 * SECOND, plan(1.0)),
    ('/joint_states', 2 * SECOND, state(a=0.1, b=0.2)),
    ('/hand/plan', 3 * SECOND, plan(2.0, ('c',))),
    ('/arm/plan', 4 * SECOND + 1, plan(3.0)),
]


@STORAGES
def test_every_trajectory_is_found_in_its_order(tmp_path: Path, storage: StoragePlugin) -> None:
    folder = write(tmp_path / 'bag', storage, TWO_TOPICS)
    for path in (folder, storage_file(folder)):
        recorded = list(recorded_trajectories(path))
        assert [r.name for r in recorded] == [
            f'{path}:/arm/plan@1.000000000',
            f'{path}:/hand/plan@3.000000000',
            f'{path}:/arm/plan@4.000000001',
        ]
        assert first_positions(iter(recorded)) == [1.0, 2.0, 3.0]
        assert {r.stamp_ns for r in recorded} == {(2**31 - 1) * SECOND + 5}
        assert isinstance(recorded[0].trajectory, Trajectory)
        assert recorded[0].trajectory.times_ns.tolist() == [SECOND + 7, 2 * SECOND + 7]
        assert first_positions(recorded_trajectories(path, ['/hand/plan'])) == [2.0]


@STORAGES
@pytest.mark.parametrize('mode', [CompressionMode.FILE, CompressionMode.MESSAGE])
def test_compressed_bags_are_read(
    tmp_path: Path, storage: StoragePlugin, mode: CompressionMode
) -> None:
    path = tmp_path / 'bag'
    writer = Writer(path, version=9, storage_plugin=storage)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connection = writer.add_connection('/plan', JOINT_TRAJECTORY, typestore=STORE)
        writer.write(connection, 5, STORE.serialize_cdr(plan(4.0), JOINT_TRAJECTORY))
    assert first_positions(recorded_trajectories(path)) == [4.0]


@STORAGES
def test_the_start_is_what_was_measured_last(tmp_path: Path, storage: StoragePlugin) -> None:
    entries: list[Entry] = [
        ('/plan', 10, plan(1.0)),
        ('/joint_states', 20, state(a=0.1, b=0.2)),
        ('/joint_states', 30, state(a=0.3, b=0.4)),
        ('/plan', 30, plan(2.0)),
        ('/joint_states', 31, state(a=0.5, b=0.6)),
        ('/joint_states', 40, state([0.25], b=0.7)),
        ('/plan', 41, plan(3.0)),
        ('/plan', 42, plan(4.0)),
        ('/joint_states', 43, state(a=9.0, b=9.0)),
    ]
    recorded = list(recorded_trajectories(write(tmp_path / 'bag', storage, entries)))
    starts = [r.start for r in recorded]
    assert starts[0] is None
    assert starts[1] is not None
    assert dict(zip(starts[1].joint_names, starts[1].positions, strict=True)) == {
        'a': 0.3,
        'b': 0.4,
    }
    assert starts[1].velocities is None
    for start in starts[2:]:
        assert start is not None
        assert start.velocities is not None
        assert dict(zip(start.joint_names, start.positions, strict=True)) == {'a': 0.5, 'b': 0.7}
        assert dict(zip(start.joint_names, start.velocities, strict=True)) == {'a': 0.0, 'b': 0.25}


@STORAGES
def test_joint_states_are_taken_from_the_topics_asked_for(
    tmp_path: Path, storage: StoragePlugin
) -> None:
    path = write(
        tmp_path / 'bag',
        storage,
        [
            ('/joint_states', 1, state(a=0.1)),
            ('/measured', 2, state(a=0.2)),
            ('/other', 3, state(a=0.3)),
            ('/plan', 4, plan(1.0, ('a',))),
        ],
    )
    for topics, expected in (([], 0.1), (['/measured'], 0.2), (['/measured', '/other'], 0.3)):
        (recorded,) = recorded_trajectories(path, (), topics)
        assert recorded.start is not None
        assert recorded.start.positions.tolist() == [expected]


def test_a_joint_state_without_joints_says_nothing(tmp_path: Path) -> None:
    entries: list[Entry] = [
        ('/joint_states', 1, state(a=0.1)),
        ('/joint_states', 2, state()),
        ('/joint_states', 3, state(b=float('nan'))),
        ('/plan', 4, plan(1.0)),
    ]
    (recorded,) = recorded_trajectories(write(tmp_path / 'bag', StoragePlugin.MCAP, entries))
    assert recorded.start is not None
    assert recorded.start.joint_names == ('a',)


def test_a_joint_state_that_is_wrong_rejects_the_trajectory_after_it(tmp_path: Path) -> None:
    entries: list[Entry] = [
        ('/plan', 1, plan(1.0)),
        ('/joint_states', 2, state(a=float('inf'))),
        ('/plan', 3, plan(2.0)),
    ]
    first, second = recorded_trajectories(write(tmp_path / 'bag', StoragePlugin.MCAP, entries))
    assert isinstance(first.trajectory, Trajectory)
    assert isinstance(second.trajectory, TrajectoryError)
    assert second.trajectory.reason is Reason.NOT_FINITE
    assert '/joint_states at 0.000000002' in str(second.trajectory)


@STORAGES
def test_bytes_that_are_no_trajectory_hide_no_other(
    tmp_path: Path, storage: StoragePlugin
) -> None:
    raw = bytes(STORE.serialize_cdr(plan(2.0), JOINT_TRAJECTORY))
    damaged = [raw[:k] for k in range(0, len(raw), 7)]
    entries: list[Entry] = [('/plan', k, data) for k, data in enumerate(damaged)]
    path = write(tmp_path / 'bag', storage, [*entries, ('/plan', 10**6, plan(3.0))])
    *bad, good = recorded_trajectories(path)
    assert len(bad) == len(damaged)
    for recorded in bad:
        assert isinstance(recorded.trajectory, TrajectoryError)
        assert recorded.name in str(recorded.trajectory)
    assert isinstance(good.trajectory, Trajectory)


def test_a_definition_of_the_bag_goes_before_ours(tmp_path: Path) -> None:
    """A JointTrajectory with one field more is read by its own definition."""
    store = get_typestore(Stores.EMPTY)
    point = 'trajectory_msgs/msg/JointTrajectoryPoint'
    types = {
        **get_types_from_msg('int32 sec\nuint32 nanosec\n', 'builtin_interfaces/msg/Duration'),
        **get_types_from_msg(
            'float64[] positions\nfloat64[] velocities\nfloat64[] accelerations\n'
            'float64[] effort\nbuiltin_interfaces/Duration time_from_start\n',
            point,
        ),
        **get_types_from_msg(
            f'string extra\nstring[] joint_names\n{point}[] points\n', JOINT_TRAJECTORY
        ),
    }
    store.register(types)
    duration = store.types['builtin_interfaces/msg/Duration'](sec=1, nanosec=0)
    none = array([])
    message = store.types[JOINT_TRAJECTORY](
        'x', ['a'], [store.types[point](array([6.0]), none, none, none, duration)]
    )
    with Writer(tmp_path / 'bag', version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection('/plan', JOINT_TRAJECTORY, typestore=store)
        writer.write(connection, 1, store.serialize_cdr(message, JOINT_TRAJECTORY))
    assert first_positions(recorded_trajectories(tmp_path / 'bag')) == [6.0]


def test_a_topic_that_is_not_there_is_named_with_those_that_are(tmp_path: Path) -> None:
    path = write(tmp_path / 'bag', StoragePlugin.MCAP, TWO_TOPICS)
    for topics in (['/arm/plan', '/nope'], ['/joint_states']):
        with pytest.raises(TrajectoryError) as caught:
            list(recorded_trajectories(path, topics))
        assert topics[-1] in str(caught.value)
        assert '/hand/plan' in str(caught.value)
    with pytest.raises(TrajectoryError, match='/joint_states'):
        list(recorded_trajectories(path, (), ['/nope']))


@STORAGES
def test_a_bag_without_trajectories_gives_none(tmp_path: Path, storage: StoragePlugin) -> None:
    path = write(tmp_path / 'bag', storage, [('/joint_states', 1, state(a=0.1))])
    assert list(recorded_trajectories(path)) == []
    empty = write(tmp_path / 'empty', storage, [])
    assert list(recorded_trajectories(empty)) == []


@pytest.mark.parametrize('name', ['nothing', 'nothing.mcap', 'nothing.db3'])
def test_a_bag_that_is_not_there_is_named(tmp_path: Path, name: str) -> None:
    with pytest.raises(TrajectoryError, match=name):
        list(recorded_trajectories(tmp_path / name))


def test_a_folder_that_is_no_bag_is_refused(tmp_path: Path) -> None:
    assert is_bag(tmp_path)
    with pytest.raises(TrajectoryError, match=r'metadata\.yaml'):
        list(recorded_trajectories(tmp_path))


@STORAGES
def test_a_folder_without_metadata_is_read_and_refused(
    tmp_path: Path, storage: StoragePlugin
) -> None:
    path = write(tmp_path / 'bag', storage, TWO_TOPICS)
    (path / 'metadata.yaml').unlink()
    found, error = read_to_damage(path)
    assert first_positions(iter(found)) == [1.0, 2.0, 3.0]
    assert error is not None
    assert 'reindex' in str(error)


def change_metadata(path: Path, old: str, new: str) -> None:
    text = (path / 'metadata.yaml').read_text()
    assert old in text
    (path / 'metadata.yaml').write_text(text.replace(old, new))


@STORAGES
@pytest.mark.parametrize(
    ('old', 'new'),
    [
        ('message_count: 2', 'message_count: 3'),
        ('name: /arm/plan', 'name: /leg/plan'),
        ('type: trajectory_msgs/msg/JointTrajectory', 'type: std_msgs/msg/String'),
        ('storage_identifier: ', 'storage_identifier: x'),
        ('version: 9', 'version: 99'),
        ('rosbag2_bagfile_information', 'x'),
        ('rosbag2_bagfile_information:', '['),
    ],
)
def test_metadata_that_does_not_fit_is_no_silence(
    tmp_path: Path, storage: StoragePlugin, old: str, new: str
) -> None:
    path = write(tmp_path / 'bag', storage, TWO_TOPICS)
    change_metadata(path, old, new)
    _, error = read_to_damage(path)
    assert error is not None
    assert str(path) in str(error)


@STORAGES
def test_topics_that_the_reader_does_not_match_are_no_silence(
    tmp_path: Path, storage: StoragePlugin
) -> None:
    """The reader passes over a topic whose quality of service differs in file and metadata."""
    path = tmp_path / 'bag'
    lasting = QosTime(2147483647, 4294967295)
    quality = Qos(
        QosHistory.KEEP_LAST,
        10,
        QosReliability.RELIABLE,
        QosDurability.VOLATILE,
        lasting,
        lasting,
        QosLiveliness.AUTOMATIC,
        lasting,
        False,
    )
    with Writer(path, version=9, storage_plugin=storage) as writer:
        connection = writer.add_connection(
            '/plan', JOINT_TRAJECTORY, typestore=STORE, offered_qos_profiles=[quality]
        )
        writer.write(connection, 5, STORE.serialize_cdr(plan(4.0), JOINT_TRAJECTORY))
    assert first_positions(recorded_trajectories(path)) == [4.0]
    change_metadata(path, 'depth: 10', 'depth: 11')
    found, error = read_to_damage(path)
    assert found == []
    assert error is not None
    assert '1 messages of /plan are missing' in str(error)


@STORAGES
def test_a_file_that_metadata_does_not_list_is_no_silence(
    tmp_path: Path, storage: StoragePlugin
) -> None:
    path = write(tmp_path / 'bag', storage, TWO_TOPICS)
    file = storage_file(path)
    shutil.copy(file, path / f'bag_1{file.suffix}')
    _, error = read_to_damage(path)
    assert error is not None
    assert f'bag_1{file.suffix}' in str(error)


def long_bag(path: Path, storage: StoragePlugin) -> Path:
    """Write a bag of several chunks and pages."""
    entries: list[Entry] = []
    filler = STORE.types['std_msgs/msg/String']('x' * 100_000)
    for k in range(40):
        entries += [('/filler', 2 * k, filler), ('/plan', 2 * k + 1, plan(float(k)))]
    return write(path, storage, entries)


def test_a_recording_that_ends_early_is_read_up_to_there(tmp_path: Path) -> None:
    folder = long_bag(tmp_path / 'bag', StoragePlugin.MCAP)
    file = storage_file(folder)
    data = file.read_bytes()
    counts = []
    for size in (len(data) - 9, len(data) * 7 // 10, len(data) * 4 // 10, 100):
        file.write_bytes(data[:size])
        for path in (folder, file):
            found, error = read_to_damage(path)
            assert error is not None
            assert error.reason is Reason.TRAJECTORY_UNREADABLE
            assert str(path) in str(error)
            assert f'{file.name} ends early' in str(error)
            assert first_positions(iter(found)) == [float(k) for k in range(len(found))]
        counts.append(len(found))
    assert counts[0] == 40
    assert counts[0] > counts[1] > counts[2] > counts[3] == 0


def test_a_recording_that_breaks_in_the_middle_is_read_up_to_there(tmp_path: Path) -> None:
    folder = long_bag(tmp_path / 'bag', StoragePlugin.MCAP)
    file = storage_file(folder)
    data = bytearray(file.read_bytes())
    middle = len(data) // 2
    data[middle : middle + 400_000] = bytes([255]) * 400_000
    file.write_bytes(data)
    found, error = read_to_damage(folder)
    assert error is not None
    assert 0 < len(first_positions(iter(found))) < 40


def test_a_database_that_ends_early_is_not_read(tmp_path: Path) -> None:
    folder = long_bag(tmp_path / 'bag', StoragePlugin.SQLITE3)
    file = storage_file(folder)
    data = file.read_bytes()
    for size in (len(data) - 1, len(data) - 4096, len(data) // 2, 120, 50, 0):
        file.write_bytes(data[:size])
        for path in (folder, file):
            found, error = read_to_damage(path)
            assert found == []
            assert error is not None
            assert file.name in str(error)


@pytest.mark.parametrize('suffix', ['-wal', '-journal'])
def test_changes_that_were_never_merged_are_no_silence(tmp_path: Path, suffix: str) -> None:
    folder = write(tmp_path / 'bag', StoragePlugin.SQLITE3, TWO_TOPICS)
    file = storage_file(folder)
    log = Path(f'{file}{suffix}')
    log.write_bytes(b'')
    assert read_to_damage(folder)[1] is None
    log.write_bytes(b'x')
    for path in (folder, file):
        found, error = read_to_damage(path)
        assert found == []
        assert error is not None
        assert log.name in str(error)


def test_bags_of_older_recorders_have_no_definitions(tmp_path: Path) -> None:
    """The schema of ROS 2 Foxy: no table for definitions, none for the schema's version."""
    file = tmp_path / 'old.db3'
    database = sqlite3.connect(file)
    database.executescript(
        'CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, '
        'serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);'
        'CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, '
        'timestamp INTEGER NOT NULL, data BLOB NOT NULL);'
    )
    database.execute(
        'INSERT INTO topics VALUES (1, ?, ?, ?, ?)', ('/plan', JOINT_TRAJECTORY, 'cdr', '')
    )
    data = bytes(STORE.serialize_cdr(plan(8.0), JOINT_TRAJECTORY))
    database.execute('INSERT INTO messages VALUES (1, 1, 5, ?)', (data,))
    database.commit()
    database.close()
    assert first_positions(recorded_trajectories(file)) == [8.0]


@STORAGES
def test_any_damage_ends_in_an_error_or_in_trajectories(
    tmp_path: Path, storage: StoragePlugin
) -> None:
    file = storage_file(write(tmp_path / 'bag', storage, TWO_TOPICS))
    data = file.read_bytes()
    rng = random.Random(7)
    damages: list[Callable[[], bytes]] = [
        lambda: data[: rng.randrange(len(data))],
        lambda: data[: (at := rng.randrange(len(data)))] + rng.randbytes(8) + data[at + 8 :],
        lambda: data[: (at := rng.randrange(len(data)))] + data[at + rng.randrange(1, 100) :],
        lambda: rng.randbytes(rng.randrange(200)),
    ]
    for k in range(80):
        file.write_bytes(damages[k % len(damages)]())
        found, error = read_to_damage(file)
        assert error is None or str(file) in str(error)
        for recorded in found:
            assert isinstance(recorded.trajectory, Trajectory | TrajectoryError)


def test_messages_are_decoded_only_when_asked(tmp_path: Path) -> None:
    path = write(tmp_path / 'bag', StoragePlugin.MCAP, [('/plan', 3, b'\0\1\0\0x')])
    with Bag(path) as bag:
        (message,) = bag.messages({JOINT_TRAJECTORY: ['/plan']})
    assert (message.topic, message.time_ns) == ('/plan', 3)
    with pytest.raises(TrajectoryError, match='not a trajectory_msgs'):
        message.message()
