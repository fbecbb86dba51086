"""The commands that measure the algebraic contact times."""

import json
from pathlib import Path
import subprocess
import sys
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / 'benchmarks'))

from bench import algebraic, ccd  # noqa: E402

DATA = Path(__file__).parent / 'data' / 'ccd'
LINE = '1,2,3,4,-5,8,1\n'


def run(command, *arguments):
    """Run a command; return its exit code, its rows and its errors."""
    done = subprocess.run(
        [sys.executable, ROOT / 'benchmarks' / command, *arguments], capture_output=True, text=True
    )
    return done.returncode, [json.loads(row) for row in done.stdout.splitlines()], done.stderr


def test_queries():
    """Nothing missed, nothing wrong; exact arithmetic decides all."""
    code, rows, _ = run('ccd_queries.py', DATA, '--json')
    assert code == 0
    whole = {row['arithmetic']: row for row in rows if row['set'] == 'all'}
    assert whole.keys() == {'floating', 'exact'}
    for row in whole.values():
        assert (row['queries'], row['collide'], row['missed'], row['wrong']) == (324, 160, 0, 0)
        assert row['us_per_query'] > 0
    assert whole['exact']['undecided'] == 0
    assert whole['floating']['undecided'] < 80


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        (LINE * 7, '7 lines'),
        (LINE * 7 + '1,2,3,4,-5,8\n', ':8: 6 columns'),
        (LINE * 7 + LINE.replace(',1\n', ',2\n'), ":8: the answer is '2'"),
        (LINE * 7 + LINE.replace(',1\n', ',0\n'), 'different answers'),
        (LINE * 7 + LINE.replace('4', '0'), ':8: 3/0 is no number'),
        (LINE * 7 + LINE.replace('4', 'x'), ':8: 3/x is no number'),
        (LINE * 7 + LINE.replace('4', '7'), ':8: 3/7 is no double'),
        (LINE * 7 + LINE.replace('3', '9' * 400), 'is no number'),
    ],
)
def test_bad_files(tmp_path, text, words):
    folder = tmp_path / 'set' / 'edge-edge'
    folder.mkdir(parents=True)
    (folder / 'data.csv').write_text(text)
    with pytest.raises(ccd.BadFile, match=words):
        ccd.load(tmp_path)
    code, rows, errors = run('ccd_queries.py', tmp_path, '--json')
    assert (code, rows) == (2, [])
    assert 'data.csv' in errors


def test_no_files(tmp_path):
    with pytest.raises(ccd.BadFile, match='no files'):
        ccd.load(tmp_path)


def test_a_good_file(tmp_path):
    folder = tmp_path / 'set' / 'vertex-face'
    folder.mkdir(parents=True)
    (folder / 'data.csv').write_text(LINE * 16)
    (found,) = ccd.load(tmp_path)
    assert (found.name, found.points.shape) == ('set', (2, 8, 3))
    assert found.collide.tolist() == [True, True]
    assert found.points[1, 7].tolist() == [0.5, 0.75, -0.625]


def test_the_example_and_its_picture(tmp_path):
    """The L enters and leaves three obstacles; both ends and six contacts are drawn."""
    file = tmp_path / 'out.svg'
    code, rows, _ = run('canny.py', '--json', '--only', 'figure2', '--picture', file)
    assert code == 0
    events = [row for row in rows if row['table'] == 'figure2']
    assert [row['event'] for row in events] == ['enters', 'leaves'] * 3
    assert [row['obstacle'] for row in events] == ['1', '1', '2', '2', '3', '3']
    times = [row['s'] for row in events]
    assert times == sorted(times)
    assert {row['table'] for row in rows} == {'figure2', 'figure2 time'}
    tree = ElementTree.parse(file).getroot()
    assert len(tree.findall('{*}circle')) == 6
    # Eight places of two boxes, three sides each, and the obstacles.
    assert len(tree.findall('{*}polygon')) > 8 * 2 * 3


def test_growth_counts_constraints(monkeypatch):
    monkeypatch.setattr(algebraic, 'GROWING', (4, 8))
    rows = list(algebraic.growth())
    # Two tetrahedra: 6 * 6 edges, 4 * 4 vertices and faces twice.
    assert rows[0]['constraints'] == 36 + 16 + 16
    assert all(row['us'] > 0 and row['built'] <= row['constraints'] for row in rows)


def test_contacts_of_real_robots_are_pinned():
    """Entry and exit to a microsecond, whatever the machine's speed."""
    rows = list(algebraic.pin())
    assert [row['contacts'] for row in rows] == [12] * 3 + [13] * 3
    by_way = {(row['robot'], row['asked']): row for row in rows}
    for robot in ('panda', 'ur5'):
        rough, fine = (by_way[robot, way] for way in ('tolerance 0.1 mm', 'refine'))
        assert fine['open_ns'] <= 1000 < rough['open_ns']
        assert by_way[robot, 'refine, contacts named']['contact_ns'] < 1.0
