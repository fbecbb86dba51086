"""
The tables, each a function that yields rows.

A row is a dict: 'table' names its table, the other keys are columns. Where a row has a target, the
column 'met' says whether it was reached. A row with 'unsound' above zero makes the command fail.
"""

from collections.abc import Callable, Iterable, Iterator

from bench.cases import Bench
from bench.tables.budget import budget
from bench.tables.certificate import certificate
from bench.tables.main import main
from bench.tables.obstacles import obstacles
from bench.tables.points import points
from bench.tables.python import python
from bench.tables.sliding import sliding
from bench.tables.threads import threads
from bench.tables.tolerance import tolerance

TABLES: dict[str, Callable[[list[Bench]], Iterable[dict]]] = {
    'main': main,
    'sliding': sliding,
    'tolerance': tolerance,
    'obstacles': obstacles,
    'points': points,
    'python': python,
    'threads': threads,
    'budget': budget,
    'certificate': certificate,
}


def rows(benches: list[Bench], only: Iterable[str] = ()) -> Iterator[dict]:
    """Yield the rows of all tables, or of some."""
    for name, table in TABLES.items():
        if not only or name in only:
            yield from table(benches)
