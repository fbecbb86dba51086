"""Where the file behind a URI of a robot description may lie, and how large it may be."""

from collections.abc import Iterator
import os
from pathlib import Path
from typing import NamedTuple
from urllib.parse import unquote

from trajectory_guard.errors import Reason, RobotError

PACKAGE = 'package://'
FILE = 'file://'


class MeshLimits(NamedTuple):
    """
    Which mesh files may be read.

    :param roots: folders that they lie in, links resolved; empty: anywhere.
    :param max_bytes: size of a file; None: any.
    """

    roots: tuple[Path, ...] = ()
    max_bytes: int | None = None

    def read(self, path: Path) -> bytes:
        """
        Return the content of a file.

        :raises RobotError: MESH_FORBIDDEN, TOO_LARGE.
        :raises OSError: it cannot be read.
        """
        # Links are followed once: the file that is checked is the one that is opened.
        real = path.resolve(strict=True)
        if self.roots and not any(real.is_relative_to(root.resolve()) for root in self.roots):
            raise RobotError(
                Reason.MESH_FORBIDDEN,
                f'mesh {str(real)!r} does not lie in {", ".join(map(str, self.roots))}',
            )
        with real.open('rb') as file:
            if self.max_bytes is None:
                return file.read()
            content = file.read(self.max_bytes + 1)
        if len(content) > self.max_bytes:
            raise RobotError(
                Reason.TOO_LARGE, f'mesh {str(real)!r} is larger than {self.max_bytes} bytes'
            )
        return content


ANY_MESH = MeshLimits()


def places(uri: str, folder: Path | None) -> Iterator[Path]:
    """
    Yield the places to look for a resource, the best first.

    `package://NAME/REST` is looked up in the ament index (through its environment variable, as
    its own Python package does), in ROS_PACKAGE_PATH, and in the folders above the description
    that are named NAME or contain NAME. Other relative paths start at the description's folder.

    :param uri: package URI, file URI, or path.
    :param folder: folder of the description; None if it did not come from a file.
    """
    for text in dict.fromkeys((uri, unquote(uri))):
        if text.startswith(PACKAGE):
            name, _, rest = text.removeprefix(PACKAGE).lstrip('/').partition('/')
            yield from _package_places(name, rest, folder)
        elif text.startswith(FILE):
            yield Path('/', text.removeprefix(FILE).removeprefix('localhost'))
        elif '://' not in text and folder is not None:
            yield folder / text
        elif '://' not in text and Path(text).is_absolute():
            yield Path(text)


def _package_places(name: str, rest: str, folder: Path | None) -> Iterator[Path]:
    for prefix in _search_path('AMENT_PREFIX_PATH'):
        yield prefix / 'share' / name / rest
    for root in _search_path('ROS_PACKAGE_PATH'):
        if root.name == name:
            yield root / rest
        yield root / name / rest
    if folder is not None:
        folder = folder.absolute()
        for root in (folder, *folder.parents):
            if root.name == name:
                yield root / rest
            yield root / name / rest


def _search_path(variable: str) -> list[Path]:
    return [Path(entry) for entry in os.environ.get(variable, '').split(os.pathsep) if entry]
