"""Messages of rosbag2 recordings, sqlite3 and mcap."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, TYPE_CHECKING

from msg_adapters.mcap_tail import ends_early, WholeRecords
from msg_adapters.sqlite_file import sqlite_damage
from trajectory_guard.errors import Reason, TrajectoryError

if TYPE_CHECKING:
    from rosbags.highlevel import AnyReader

STORAGE_SUFFIXES = ('.mcap', '.db3')

_COMPRESSED = '.zstd'


class BagMessage(NamedTuple):
    """
    One recorded message, decoded only when it is asked for.

    :param topic: its topic.
    :param message_type: for example ``sensor_msgs/msg/JointState``.
    :param time_ns: when the recorder received it [ns since the epoch].
    :param data: its bytes.
    :param decode: bytes and message type to message.
    """

    topic: str
    message_type: str
    time_ns: int
    data: bytes
    decode: Callable[[bytes, str], Any]

    def message(self) -> Any:
        """
        Return the message.

        :raises TrajectoryError: the bytes are not one.
        """
        try:
            return self.decode(self.data, self.message_type)
        # As in Bag: what the decoder raises on damaged bytes depends on the bytes.
        except Exception as error:
            raise TrajectoryError(
                Reason.TRAJECTORY_UNREADABLE,
                f'not a {self.message_type}: {type(error).__name__} {error}',
            ) from error


class Bag:
    """
    An open rosbag2 recording; close it, or use it as a context.

    Message definitions come from the bag if it has any, else from ROS 2 Jazzy. A damaged bag opens
    as far as something can be read; the error comes after its last readable message.

    :param path: folder with metadata.yaml, or one storage file (``.mcap``, ``.db3``).
    :raises TrajectoryError: nothing can be read; the message names the path.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._reader, problem = _opened_as_far_as_possible(path)
        # The storage readers meet damaged bytes with whatever exception these bytes lead to.
        except Exception as error:
            raise self._unreadable(error) from error
        self._damage = self._unreadable(problem) if problem else None

    def __enter__(self) -> Bag:
        """Return the bag, which is open already."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close the bag."""
        self.close()

    def close(self) -> None:
        """Close the files."""
        self._reader.close()

    def topics(self, message_type: str) -> list[str]:
        """
        Return the topics of one message type, sorted.

        :param message_type: for example ``sensor_msgs/msg/JointState``.
        """
        return sorted({c.topic for c in self._reader.connections if c.msgtype == message_type})

    def messages(self, topics: Mapping[str, Sequence[str]]) -> Iterator[BagMessage]:
        """
        Yield messages in the order of their receive times.

        :param topics: topics to read for each message type.
        :raises TrajectoryError: after the last readable message of a damaged bag, and if there
            were fewer messages than the bag says it has.
        """
        connections = [c for c in self._reader.connections if c.topic in topics.get(c.msgtype, ())]
        missing = Counter[str]()
        for connection in connections:
            missing[connection.topic] += connection.msgcount
        decode = self._reader.typestore.deserialize_cdr
        # No connection at all would mean every connection to the reader.
        stream = self._reader.messages(connections) if connections else iter(())
        while True:
            try:
                connection, time_ns, data = next(stream)
            except StopIteration:
                break
            except Exception as error:
                raise self._damage or self._unreadable(error) from error
            missing[connection.topic] -= 1
            yield BagMessage(connection.topic, connection.msgtype, time_ns, data, decode)
        if self._damage is not None:
            raise self._damage
        if lost := sorted(topic for topic, count in missing.items() if count > 0):
            raise self._unreadable(f'{missing[lost[0]]} messages of {lost[0]} are missing')

    def _unreadable(self, problem: object) -> TrajectoryError:
        """Return the error of this bag."""
        text = str(problem) or type(problem).__name__
        return TrajectoryError(Reason.TRAJECTORY_UNREADABLE, f'{self.path}: {text}')


def is_bag(path: Path) -> bool:
    """
    Return whether a path is read as a bag: a folder, or a file named like a bag's storage.

    :param path: any path.
    """
    return path.is_dir() or path.suffix in STORAGE_SUFFIXES


def _opened_as_far_as_possible(path: Path) -> tuple[AnyReader, str | None]:
    """
    Return a reader of what can be read, and what is wrong with the bag.

    A database is read whole or not at all, a sequence of records up to where it breaks off.
    """
    files = _storage_files(path)
    for file in files:
        if file.suffix == '.db3' and (problem := sqlite_damage(file)):
            raise ValueError(problem)
    problem = _visible_damage(path, files)
    if problem is None:
        try:
            reader = _opened([path])
            return reader, _left_out(reader, path)
        except Exception as error:
            problem = str(error) or type(error).__name__
    parts = [part for file in files for part in _readable(file)]
    if not parts:
        raise ValueError(problem)
    return _opened(parts), problem


def _opened(paths: Sequence[Any]) -> AnyReader:
    """Return a reader of the paths, open."""
    # Takes long to import, and most files are no bags.
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import get_typestore, Stores

    reader = AnyReader(paths, default_typestore=get_typestore(Stores.ROS2_JAZZY))
    reader.open()
    return reader


def _storage_files(path: Path) -> list[Path]:
    """Return the storage files of a bag by name, as the recorder numbers them."""
    files = sorted(path.iterdir()) if path.is_dir() else [path]
    return [file for file in files if file.suffix in STORAGE_SUFFIXES and file.is_file()]


def _visible_damage(path: Path, files: Sequence[Path]) -> str | None:
    """Return what is wrong at first sight; the reader would say it less clearly."""
    if path.is_dir() and not (path / 'metadata.yaml').is_file():
        return 'no metadata.yaml; `ros2 bag reindex` makes one'
    for file in files:
        if file.suffix == '.mcap' and ends_early(file):
            return f'{file.name} ends early'
    return None


def _left_out(reader: AnyReader, path: Path) -> str | None:
    """Return what the folder holds but metadata.yaml does not list, so that it is not read."""
    if not path.is_dir():
        return None
    folder: Any = reader.readers[0]
    read = {storage.path.name for storage in folder.storage.storages}
    listed = {(connection.topic, connection.msgtype) for connection in reader.connections}
    for file in sorted(path.iterdir()):
        name = file.name.removesuffix(_COMPRESSED)
        if name.endswith(STORAGE_SUFFIXES) and name not in read:
            return f'metadata.yaml does not list {file.name}'
    for storage in folder.storage.storages:
        for connection in storage.connections:
            if (connection.topic, connection.msgtype) not in listed:
                return f'metadata.yaml does not list {connection.topic} of {connection.msgtype}'
    return None


def _readable(file: Path) -> Iterator[Any]:
    """Yield a storage file if it can be opened, mended if that helps."""
    part: Any = WholeRecords(file) if ends_early(file) else file
    try:
        _opened([part]).close()
    # That the bag is damaged is known already, and said when the rest has been read.
    except Exception:
        return
    yield part
