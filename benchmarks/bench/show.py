"""Rows as text: one JSON object each, or tables for people."""

from collections.abc import Iterable, Iterator
import itertools
import json
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

# Columns of text where the output is no terminal, whose width nobody knows.
WIDTH = 165

# Tables by name, for people.
TITLES = {
    'main': 'Verdicts against the truth, and times; x ca: against conservative advancement',
    'category': 'Median ms by category',
    'contact': 'Contacts: what one costs in deep collisions, and how long more is not free',
    'pose': 'Median time in pose checks (kinematics, culling and coal for all pairs)',
    'sliding': 'Motions at a constant gap; ca: conservative advancement',
    'tolerance': 'Colliding trajectories: all intervals, and the first that is not free (medians)',
    'growth': 'Pieces that each decade of tolerance adds (logarithmic: the same)',
    'obstacles': 'Boxes around a Panda; ca: conservative advancement, verdict',
    'points': 'Points of a long trajectory, all free',
    'early': 'First contact at point 20 of a trajectory; reading: the same without any search',
    'python': 'Around the kernels',
    'threads': 'A batch on one thread and on two',
    'budget': 'The free trajectory with the most pieces, within a budget of pieces',
    'certificate': 'Certificates',
    'octagons': 'Two octagons [Schroecker & Weber 2014, sec. 7.1]',
    'squares': 'Two squares of n x n squares [Schroecker & Weber 2014, tables 1 and 2]',
    'scaling': 'Exponents of growth in the number of pairs of polygons (1: linear)',
    'which': 'Tests by moving square, plain listing [Schroecker & Weber 2014, figures 5 and 6]',
    'ccd': 'Queries with linear vertex motion; missed: collisions called free',
    'figure2': 'An L among obstacles: when it touches what, where (paper: figure 2)',
    'figure2 time': 'The same: the paper on a Lisp machine, and ours',
    'pair': 'Two boxes with 12 edges each; degree: of the constraints',
    'two movers': 'Two movers against one (paper: less than an order of magnitude)',
    'exact': 'Two boxes in exact arithmetic',
    'round trip': 'One client; above: without the time of the answer itself; echo: does nothing',
    'clients': 'Clients in processes of their own, and what the guard keeps of their requests',
    'start': 'From the start of a process to its first answer, kernels compiled before',
    'gate': 'From publishing a trajectory to its arrival at the controller',
    'growth of bodies': 'Two bodies of more and more vertices; order: of cost in constraints',
}


def as_json(rows: Iterable[dict]) -> Iterator[dict]:
    """Print each row as an object on a line; pass it on."""
    for row in rows:
        print(json.dumps(row), flush=True)
        yield row


def as_tables(rows: Iterable[dict]) -> Iterator[dict]:
    """Print each run of rows of one table when it is complete; pass them on."""
    console = Console()
    if not console.is_terminal:
        console = Console(width=WIDTH)
    for name, group in itertools.groupby(rows, key=lambda row: row['table']):
        found = list(group)
        columns = list(dict.fromkeys(key for row in found for key in row if key != 'table'))
        table = Table(title=TITLES.get(name, name), title_justify='left', box=box.SIMPLE_HEAD)
        for column in columns:
            numbers = any(is_number(row.get(column)) for row in found)
            table.add_column(column.replace('_', ' '), justify='right' if numbers else 'left')
        for row in found:
            table.add_row(*(text(row.get(column)) for column in columns))
        console.print(table)
        yield from found


def is_number(value: Any) -> bool:
    """Say whether a value is set flush right."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def text(value: Any) -> str:
    """Return a value for people; three digits of a fraction are enough."""
    if value is None:
        return ''
    if isinstance(value, bool):
        return 'yes' if value else 'NO'
    if isinstance(value, float):
        return f'{value:.0f}' if abs(value) >= 100 else f'{value:.3g}'
    return str(value)
