"""Where the file behind a URI of a robot description may lie."""

from collections.abc import Iterator
import os
from pathlib import Path
from urllib.parse import unquote

PACKAGE = 'package://'
FILE = 'file://'


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
