"""
An MCAP file that ends too early, presented as a whole one.

A recorder that is killed leaves a file without summary and footer, and readers refuse it as a
whole. Up to the damage it is a plain sequence of records, and a footer that names no summary is
legal: the reader then scans the records. Layout: https://mcap.dev/spec.
"""

import io
from pathlib import Path
import struct
from typing import Any

MAGIC = b'\x89MCAP0\r\n'

_RECORD_HEAD = struct.Struct('<BQ')
_KNOWN_OPCODES = range(0x01, 0x10)
_DATA_END = 0x0F
_FOOTER = 0x02
_TAIL = (
    _RECORD_HEAD.pack(_DATA_END, 4) + bytes(4) + _RECORD_HEAD.pack(_FOOTER, 20) + bytes(20) + MAGIC
)


def ends_early(path: Path) -> bool:
    """
    Return whether a file starts as MCAP but does not end as one.

    :param path: any file.
    """
    with path.open('rb') as file:
        starts = file.read(len(MAGIC)) == MAGIC
        size = file.seek(0, io.SEEK_END)
        file.seek(max(size - len(MAGIC), 0))
        return starts and (size < 2 * len(MAGIC) or file.read() != MAGIC)


class WholeRecords:
    """
    The whole records of a damaged MCAP file and an empty summary, as the path of a file.

    Nothing is copied: opening it gives a file whose last bytes are not on disk.

    :param path: the damaged file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.suffix = path.suffix

    def __str__(self) -> str:
        """Return the path of the damaged file."""
        return str(self.path)

    def exists(self) -> bool:
        """Return whether the damaged file is there."""
        return self.path.exists()

    def is_dir(self) -> bool:
        """Return False: it is a file."""
        return False

    def open(self, mode: str = 'rb') -> io.BufferedReader:
        """
        Open for reading.

        :param mode: has to be ``rb``.
        """
        if mode != 'rb':
            raise ValueError(f'a damaged file is only read, mode {mode!r} is not possible')
        return io.BufferedReader(_Repaired(self.path))


class _Repaired(io.RawIOBase):
    """The bytes of the whole records, then those of the tail."""

    def __init__(self, path: Path) -> None:
        self._file = path.open('rb')
        self._whole = _whole_bytes(self._file)
        self._position = 0

    def readable(self) -> bool:
        """Return True."""
        return True

    def seekable(self) -> bool:
        """Return True."""
        return True

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Set the position; `whence` as everywhere."""
        base = {
            io.SEEK_SET: 0,
            io.SEEK_CUR: self._position,
            io.SEEK_END: self._whole + len(_TAIL),
        }[whence]
        self._position = max(base + offset, 0)
        return self._position

    def tell(self) -> int:
        """Return the position."""
        return self._position

    def readinto(self, buffer: Any) -> int:
        """Fill the buffer as far as one side of the seam goes."""
        if self._position < self._whole:
            self._file.seek(self._position)
            data = self._file.read(min(len(buffer), self._whole - self._position))
        else:
            start = self._position - self._whole
            data = _TAIL[start : start + len(buffer)]
        buffer[: len(data)] = data
        self._position += len(data)
        return len(data)

    def close(self) -> None:
        """Close the damaged file as well."""
        self._file.close()
        super().close()


def _whole_bytes(file: io.BufferedReader) -> int:
    """Return where the last whole record of the data section ends."""
    size = file.seek(0, io.SEEK_END)
    end = len(MAGIC)
    while True:
        file.seek(end)
        head = file.read(_RECORD_HEAD.size)
        if len(head) < _RECORD_HEAD.size:
            return end
        opcode, length = _RECORD_HEAD.unpack(head)
        after = end + _RECORD_HEAD.size + length
        if opcode not in _KNOWN_OPCODES or opcode in (_DATA_END, _FOOTER) or after > size:
            return end
        end = after
