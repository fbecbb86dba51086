"""What the README shows works as shown."""

from pathlib import Path
import re
import subprocess
import sys

import pytest

ROOT = Path(__file__).parent.parent
README = (ROOT / 'README.md').read_text(encoding='utf-8')


@pytest.mark.parametrize('code', re.findall(r'```python\n(.*?)```', README, re.DOTALL))
def test_python_examples_run(code):
    """Each example runs from the root of the checkout and prints a verdict."""
    done = subprocess.run(
        [sys.executable, '-c', code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert re.match(r"(FREE|SUSPECT|COLLISION) \[\(0, \d+, '", done.stdout)


@pytest.mark.parametrize('command', ['check', 'replay'])
def test_options_exist(command):
    """Every option of the table is one of the command's."""
    done = subprocess.run(
        [sys.executable, '-m', 'trajectory_guard', command, '--help'],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    options = re.findall(r'^\| `(--[a-z-]+)`', README, re.MULTILINE)
    assert len(options) >= 8
    for option in [*options, '--urdf', '--scene', '--json']:
        assert option in done.stdout


def test_files_named_exist():
    """Paths in the README are there."""
    for path in re.findall(r'`([\w/]+\.(?:py|yaml|txt|urdf))`', README):
        assert (ROOT / path).exists(), path
    for path in re.findall(r"'(test/data/[\w/.]+)'", README):
        assert (ROOT / path).exists(), path
