"""
The kernels as machine code: compiled once for this machine, kept in a cache, loaded on demand.

The cache file is named after a digest of all sources, the flags and the processor, so an edit can
never meet code of an older version, and a shared home never code of another machine.
"""

import ctypes
import functools
import hashlib
import os
from pathlib import Path
import platform
import shlex
import shutil
import subprocess
import tempfile
import threading

SOURCES = Path(__file__).parent
UNIT = SOURCES / 'kernels.cpp'

# No contraction, no fast math: the margins count every rounding. Square roots need no errno, and
# no trap handler is there to see which of two branches was computed.
FLAGS = (
    '-std=c++17',
    '-O3',
    '-march=native',
    '-ffp-contract=off',
    '-fno-math-errno',
    '-fno-trapping-math',
    '-fPIC',
    '-shared',
)
COMPILERS = ('c++', 'g++', 'clang++')

COMPILING = 'compiling the kernels (once; some seconds)'

_lock = threading.Lock()


class KernelError(RuntimeError):
    """The kernels cannot be compiled or loaded on this machine."""


def is_cold(unit: Path = UNIT) -> bool:
    """Say whether a unit of the kernels has yet to be compiled on this machine."""
    return not _path(unit).is_file()


def library() -> ctypes.CDLL:
    """Return the kernels; see :func:`load`."""
    return load(UNIT)


@functools.cache
def load(unit: Path) -> ctypes.CDLL:
    """
    Return a unit that includes the kernels, compiled if need be.

    :param unit: C++ source.
    :raises KernelError: there is no compiler, or it failed; the message says what it said.
    """
    with _lock:
        path = _path(unit)
        if path.is_file():
            try:
                return ctypes.CDLL(str(path))
            except OSError:
                path.unlink(missing_ok=True)
        return _compile(unit, path)


def _path(unit: Path) -> Path:
    """Return where the machine code of a unit is kept."""
    home = os.environ.get('XDG_CACHE_HOME') or os.path.join(os.path.expanduser('~'), '.cache')
    root = os.environ.get('TRAJECTORY_GUARD_CACHE') or os.path.join(home, 'trajectory_guard')
    return Path(root) / f'{unit.stem}-{_digest(unit)}.so'


@functools.cache
def _digest(unit: Path) -> str:
    digest = hashlib.sha256(repr((FLAGS, os.environ.get('CXX'))).encode())
    # A unit of somebody else's may include any of the sources.
    for source in (*sorted(SOURCES.glob('*.[ch]pp')), unit):
        digest.update(source.name.encode() + b'\0' + source.read_bytes())
    digest.update(_processor().encode())
    return digest.hexdigest()[:16]


def _processor() -> str:
    """Return what the compiler's native flags depend on."""
    try:
        lines = Path('/proc/cpuinfo').read_text(encoding='utf-8', errors='replace').splitlines()
    except OSError:
        return platform.machine() + platform.processor()
    told = ('model name', 'cpu family', 'model', 'flags', 'Features', 'CPU part')
    first = {line.partition(':')[0].strip(): line for line in reversed(lines)}
    return platform.machine() + ''.join(first.get(name, '') for name in told)


def _compile(unit: Path, path: Path) -> ctypes.CDLL:
    """Compile to a file of our own and rename it, so that nobody ever loads half of one."""
    with tempfile.TemporaryDirectory(prefix='trajectory_guard-') as scratch:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with tempfile.NamedTemporaryFile(dir=path.parent, prefix='.', delete=False) as made:
                target = Path(made.name)
        except OSError:
            target = path = Path(scratch, 'kernels.so')  # nowhere to keep it
        try:
            _run_compiler(unit, target)
            if target != path:
                target.chmod(0o755)
                target.replace(path)
            return ctypes.CDLL(str(path))
        except OSError as error:
            raise KernelError(f'the kernels could not be loaded: {error}') from error
        finally:
            if target != path:
                target.unlink(missing_ok=True)


def _run_compiler(unit: Path, target: Path) -> None:
    wanted = shlex.split(os.environ.get('CXX', ''))
    names = wanted[:1] or COMPILERS
    compiler = next(filter(None, map(shutil.which, names)), None)
    if compiler is None:
        raise KernelError(
            f'the kernels need a C++ compiler, and there is none of {", ".join(names)} '
            '(Debian, Ubuntu: apt install g++)'
        )
    command = [compiler, *wanted[1:], *FLAGS, f'-I{SOURCES}', '-o', str(target), str(unit)]
    done = subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL)
    if done.returncode != 0:
        raise KernelError(
            f'{compiler} could not compile the kernels:\n{done.stderr.strip()[-2000:]}'
        )
