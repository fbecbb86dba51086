"""Where the demo finds its files."""

from importlib import metadata
from pathlib import Path

from ament_index_python import (
    get_package_prefix,
    get_package_share_directory,
    PackageNotFoundError,
)

from trajectory_guard.demo.error import DemoError

PACKAGE = 'trajectory_guard'
ROBOTS = 'example-robot-data'
PANDA = 'panda_description/urdf/panda.urdf'
CHECKOUT = Path(__file__).parents[2]


def config_file(name: str) -> Path:
    """
    Return a file of ``config/``: the installed one, else that of the checkout.

    :param name: name in the folder.
    :raises DemoError: it is in neither.
    """
    try:
        places = [Path(get_package_share_directory(PACKAGE)), CHECKOUT]
    except PackageNotFoundError:
        places = [CHECKOUT]
    for place in places:
        path = place / 'config' / name
        if path.is_file():
            return path.resolve()
    raise DemoError(f'config/{name} is neither installed nor in {CHECKOUT}')


def guard_executable() -> Path:
    """
    Return the installed executable of the service node, where ``ros2 run`` looks for it.

    :raises DemoError: the package is not installed.
    """
    try:
        executable = Path(get_package_prefix(PACKAGE), 'lib', PACKAGE, 'guard')
    except PackageNotFoundError as error:
        raise DemoError(f'{PACKAGE} is not installed here; ./bringup demo does that') from error
    if not executable.is_file():
        raise DemoError(f'{executable} is missing; ./bringup demo installs it')
    return executable


def panda_urdf() -> Path:
    """
    Return the Panda of example-robot-data.

    :raises DemoError: the package is not installed.
    """
    try:
        files = metadata.files(ROBOTS) or []
    except metadata.PackageNotFoundError as error:
        raise DemoError(f'needs the robots of {ROBOTS}: pip install {ROBOTS}') from error
    for file in files:
        if file.as_posix().endswith(PANDA):
            return Path(file.locate()).resolve()
    raise DemoError(f'{ROBOTS} has no {PANDA}')
