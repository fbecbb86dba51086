"""The command ``python -m trajectory_guard``."""

from trajectory_guard.command_line.app import app

if __name__ == '__main__':
    app()
