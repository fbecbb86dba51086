"""The command ``python -m trajectory_guard.demo``."""

import sys

FAILED = 3


def main() -> int:
    """
    Run the demo.

    :returns: exit code: 0 all answers are as promised, 1 they are not, 3 it could not be run.
    """
    try:
        from trajectory_guard.demo.error import DemoError
        from trajectory_guard.demo.ros.run import run
        from trajectory_guard.errors import TrajectoryGuardError
    except ImportError as error:
        print(f'demo: {error}; ./bringup demo installs what is needed', file=sys.stderr)
        return FAILED
    try:
        return run(sys.stdout)
    except (DemoError, TrajectoryGuardError) as error:
        print(f'demo: {error}', file=sys.stderr)
        return FAILED
    except KeyboardInterrupt:
        return 130


if __name__ == '__main__':
    sys.exit(main())
