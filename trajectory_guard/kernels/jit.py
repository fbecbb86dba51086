"""
The two ways kernels are compiled, and where the machine code is kept.

numba looks only at a function's own file to tell whether cached code is stale, so an edit in one
kernel would leave its old copy inside the callers.  For trusted code that is not acceptable: the
cache folder is named after a digest of all kernel sources.
"""

from collections.abc import Callable
import hashlib
import os
from pathlib import Path
from typing import Any

from numba import config, njit


def _folder() -> Path | None:
    """Return the cache folder of these sources, or None if it cannot be made."""
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parent.glob('*.py')):
        digest.update(source.name.encode() + b'\0' + source.read_bytes())
    home = os.environ.get('XDG_CACHE_HOME') or os.path.join(os.path.expanduser('~'), '.cache')
    root = os.environ.get('TRAJECTORY_GUARD_CACHE') or os.path.join(home, 'trajectory_guard')
    folder = Path(root) / f'kernels-{digest.hexdigest()[:16]}'
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return None
    return folder


FOLDER = _folder()
OPTIONS: dict[str, Any] = {
    'cache': FOLDER is not None,
    'nogil': True,
    'error_model': 'numpy',
    'fastmath': False,
    'no_cfunc_wrapper': True,
}


def _compiled(function: Callable, **options: Any) -> Callable:
    """Decorate a kernel; its cache goes to the folder of these sources, or nowhere."""
    previous = getattr(config, 'CACHE_DIR')  # noqa: B009 - numba makes it at import
    setattr(config, 'CACHE_DIR', str(FOLDER or ''))  # noqa: B010
    try:
        return njit(**OPTIONS, **options)(function)
    finally:
        setattr(config, 'CACHE_DIR', previous)  # noqa: B010


def kernel(function: Callable) -> Callable:
    """Compile a function that only kernels call; no wrapper for Python is built."""
    return _compiled(function, no_cpython_wrapper=True)


def entry(function: Callable) -> Callable:
    """Compile a function that Python calls too."""
    return _compiled(function)
