"""The baseline's C++, compiled when it is first used and kept next to our own kernels."""

import hashlib
from importlib import metadata, util
import os
from pathlib import Path
import subprocess
import tempfile

SOURCES = Path(__file__).parent.parent / 'peers'
FLAGS = (
    *('-std=c++17', '-O3', '-DNDEBUG', '-shared', '-fPIC'),
    '-DCOAL_BACKWARD_COMPATIBILITY_WITH_HPP_FCL=0',
)


def library() -> Path:
    """
    Return the shared library, compiled if these sources have not been yet.

    :raises RuntimeError: coal's headers are missing, or the compiler fails.
    """
    place = _folder() / 'baseline.so'
    if not place.is_file():
        place.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=place.parent) as folder:
            made = Path(folder, place.name)
            _compile(made)
            made.replace(place)
    return place


def _folder() -> Path:
    digest = hashlib.sha256(' '.join((str(_prefix()), *FLAGS)).encode())
    digest.update(metadata.version('coal').encode())
    for source in sorted(SOURCES.iterdir()):
        digest.update(source.name.encode() + b'\0' + source.read_bytes())
    home = os.environ.get('XDG_CACHE_HOME') or Path.home() / '.cache'
    root = os.environ.get('TRAJECTORY_GUARD_CACHE') or Path(home, 'trajectory_guard')
    return Path(root, f'peers-{digest.hexdigest()[:16]}')


def _prefix() -> Path:
    """Return the folder where coal's wheel keeps headers and libraries."""
    spec = util.find_spec('coal')
    for folder in Path(spec.origin if spec and spec.origin else '').parents:
        if all((folder / 'include' / name).is_dir() for name in ('coal', 'eigen3')):
            return folder
    raise RuntimeError('needs the headers of coal and Eigen: pip install coal cmeel-eigen')


def _compile(made: Path) -> None:
    prefix = _prefix()
    command = [
        *(os.environ.get('CXX', 'c++'), *FLAGS),
        *('-isystem', f'{prefix}/include', '-isystem', f'{prefix}/include/eigen3'),
        *(str(SOURCES / 'baseline.cpp'), '-o', str(made)),
        *(f'-L{prefix}/lib', '-lcoal', f'-Wl,-rpath,{prefix}/lib'),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f'{" ".join(command)}\n{done.stderr}')
