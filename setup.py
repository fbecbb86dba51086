"""Installs the package, for colcon (ament_python) and for pip alike."""

from pathlib import Path

from setuptools import find_packages, setup

NAME = 'trajectory_guard'
# colcon --symlink-install runs a link to this file.
HERE = Path(__file__).resolve().parent


def requirements(name: str) -> list[str]:
    """Return the requirements of one file, without its comments."""
    lines = (HERE / 'requirements' / f'{name}.txt').read_text(encoding='utf-8').splitlines()
    return [line for line in lines if line and not line.startswith('#')]


def config_files() -> list[tuple[str, list[str]]]:
    """Return the files below config/, each with the folder it is installed to."""
    files = sorted(path for path in Path('config').rglob('*') if path.is_file())
    return [(f'share/{NAME}/{path.parent}', [str(path)]) for path in files]


setup(
    name=NAME,
    version='0.1.0',
    description='Certified collision freedom for the motion a controller really plays.',
    license='Apache-2.0',
    maintainer='trajectory_guard maintainers',
    maintainer_email='maintainers@trajectory-guard.invalid',
    packages=find_packages(include=[NAME, f'{NAME}.*', 'msg_adapters', 'msg_adapters.*']),
    package_data={f'{NAME}.kernels': ['*.hpp', '*.cpp']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{NAME}']),
        (f'share/{NAME}', ['package.xml']),
        *config_files(),
    ],
    python_requires='>=3.10,<3.14',
    install_requires=requirements('runtime'),
    zip_safe=False,
    entry_points={
        'console_scripts': [
            'gate = trajectory_guard.ros.gate:main',
            'guard = trajectory_guard.ros.guard:main',
        ]
    },
)
