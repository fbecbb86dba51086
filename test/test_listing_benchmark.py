"""The benchmark of the paper's experiments: its rows are as promised, its outcomes as expected."""

import json
import os
from pathlib import Path
import subprocess
import sys

ROOT = Path(__file__).parent.parent
SCRIPT = ROOT / 'benchmarks' / 'schroecker_weber.py'

FIELDS = {
    'name',
    'n',
    'distribution',
    'outcome',
    'polygon_pairs',
    'polygon_tests',
    'depth',
    'seconds',
    'paper_seconds',
}


def test_json_rows():
    command = [sys.executable, str(SCRIPT), '--max-n', '2', '--json']
    # The code of this tree, whatever is installed.
    path = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get('PYTHONPATH')])])
    env = {**os.environ, 'PYTHONPATH': path}
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=env)
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    assert {row['table'] for row in rows} == {'octagons', 'squares', 'which'}
    for row in rows:
        if row['table'] == 'which':
            assert row['most_tests'] >= row['median_tests'] >= row['least_tests'] > 0
            assert bool(row['open_squares']) == (row['outcome'] == 'collision')
            continue
        assert row.keys() >= FIELDS
        assert row['met']
        assert row['seconds'] > 0.0
    squares = [row for row in rows if row['table'] == 'squares']
    assert {(row['n'], row['distribution'], row['outcome']) for row in squares} == {
        (n, distribution, outcome)
        for n in (1, 2)
        for distribution in ('global', 'individual', 'adapted')
        for outcome in ('collision', 'near-collision', 'no-collision')
    }
    for row in squares:
        assert row['polygon_pairs'] == row['n'] ** 4
        assert row['polygon_tests'] <= row['plain_tests']
    examples = {row['name']: row['outcome'] for row in rows if row['table'] == 'octagons'}
    assert examples['example 1'] == 'free'
    assert examples['example 2'] == 'suspect'
