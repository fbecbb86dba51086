"""Certificates to files: one, or a folder with one for each trajectory."""

import os
from pathlib import Path
import re

from trajectory_guard.certificate import text
from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.result import Result

# Characters of a trajectory's label that are safe in a file name.
_UNSAFE = re.compile(r'[^A-Za-z0-9._-]+')
_LONGEST_NAME = 80


class Certificates:
    """
    Writes the certificate of each result.

    :param target: a file, or a folder if it is one or its name ends with a slash.
    :param folder: whether it is a folder.
    :raises RequestError: the folder cannot be made, or the file's folder does not exist.
    """

    def __init__(self, target: Path, folder: bool) -> None:
        self._target = target
        self._folder = folder
        self._count = 0
        try:
            if folder:
                target.mkdir(parents=True, exist_ok=True)
            elif not target.absolute().parent.is_dir():
                raise FileNotFoundError(f'no folder {str(target.absolute().parent)!r}')
            elif target.exists() and not target.is_file():
                # A file would take the place of a device, as of /dev/null.
                raise OSError('it is no regular file')
        except OSError as error:
            raise _unusable(target, error) from error

    def write(self, result: Result) -> None:
        """
        Write a result's certificate, whole or not at all.

        A rejected trajectory has none; a file of an earlier run must not pass for it.

        :param result: the result.
        :raises RequestError: the file cannot be written; the message names it.
        """
        self._count += 1
        path = self._target / self._name(result) if self._folder else self._target
        try:
            if result.certificate is None:
                path.unlink(missing_ok=True)
                return
            scratch = path.with_name(f'.{path.name}.{os.getpid()}')
            try:
                scratch.write_text(text(result.certificate), encoding='utf-8')
                scratch.replace(path)
            finally:
                scratch.unlink(missing_ok=True)
        except OSError as error:
            raise _unusable(path, error) from error

    def _name(self, result: Result) -> str:
        label = _UNSAFE.sub('-', os.path.basename(result.name)).strip('-.')[-_LONGEST_NAME:]
        return f'{self._count:04d}-{label}.json' if label else f'{self._count:04d}.json'


def is_folder(target: Path, told: str) -> bool:
    """Say whether certificates go to a folder; ``told`` is how the user wrote it."""
    return target.is_dir() or told.endswith(('/', os.sep))


def _unusable(path: Path, error: OSError) -> RequestError:
    return RequestError(
        Reason.INVALID_PARAMETER,
        f'--certificate: cannot write {str(path)!r}: {error.strerror or error}',
    )
