"""
Continuous collision queries with linear vertex motion against exact answers.

The folder holds SET/vertex-face/*.csv and SET/edge-edge/*.csv, eight lines a query:
x_num,x_den,y_num,y_den,z_num,z_den,answer. *missed*: collisions that were called free; *wrong*:
whatever else was decided and is not so; *undecided*: neither.
"""

import argparse
from collections.abc import Callable, Iterator
import itertools
from pathlib import Path
import sys

from bench.ccd import BadFile, load, Queries
from bench.clock import best_ms
from bench.show import as_json, as_tables
import numpy as np

from trajectory_guard.canny import Answer, linear_answers, linear_contacts

ALL = 'all'


def floating(queries: Queries) -> np.ndarray:
    """Answer by rounded arithmetic with bounds."""
    return linear_answers(queries.kind, queries.points)


def exact(queries: Queries) -> np.ndarray:
    """Answer by exact arithmetic."""
    found = (linear_contacts(queries.kind, points) for points in queries.points)
    return np.array([Answer.MEETING if one else Answer.APART for one in found])


METHODS: dict[str, Callable[[Queries], np.ndarray]] = {'floating': floating, 'exact': exact}


def rows(files: list[Queries]) -> Iterator[dict]:
    """Yield a row for each set and arithmetic, then for all sets together."""
    found: list[dict] = []
    for name, group in itertools.groupby(files, key=lambda one: one.name):
        members = list(group)
        for method, ask in METHODS.items():
            parts = [judged(one, *timed(ask, one)) for one in members]
            found.append({'table': 'ccd', 'set': name, 'arithmetic': method, **total(parts)})
            yield found[-1]
    for method in METHODS:
        parts = [row for row in found if row['arithmetic'] == method]
        yield {'table': 'ccd', 'set': ALL, 'arithmetic': method, **total(parts)}


def timed(ask: Callable[[Queries], np.ndarray], queries: Queries) -> tuple[np.ndarray, float]:
    """Return the answers and the time a query [us]; one call warms up, the next one counts."""
    milliseconds, answers = best_ms(lambda: ask(queries), runs=1)
    return answers, 1e3 * milliseconds / max(len(queries.collide), 1)


def judged(queries: Queries, answers: np.ndarray, us: float) -> dict:
    """Count what is right."""
    missed = queries.collide & (answers == Answer.APART)
    return {
        'queries': len(answers),
        'collide': int(queries.collide.sum()),
        'missed': int(missed.sum()),
        'wrong': int((~queries.collide & (answers == Answer.MEETING)).sum()),
        'undecided': int((answers == Answer.UNDECIDED).sum()),
        'us_per_query': us,
    }


def total(parts: list[dict]) -> dict:
    """Add up counts; times are weighted by the number of queries."""
    counts = ('queries', 'collide', 'missed', 'wrong', 'undecided')
    added = {name: sum(part[name] for part in parts) for name in counts}
    us = sum(part['us_per_query'] * part['queries'] for part in parts) / max(added['queries'], 1)
    return {**added, 'us_per_query': us, 'unsound': added['missed'] + added['wrong']}


def main() -> int:
    """Measure and print; exit 1 if an answer is wrong, 2 if a file is bad."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('folder', type=Path, metavar='DIR', help='with the sets')
    parser.add_argument('--json', action='store_true', help='one object a row')
    arguments = parser.parse_args()
    try:
        files = load(arguments.folder)
    except (BadFile, OSError, UnicodeDecodeError) as error:
        print(f'ccd_queries: {error}', file=sys.stderr)
        return 2
    shown = (as_json if arguments.json else as_tables)(rows(files))
    # All rows, so that all are printed.
    return int(sum(row['unsound'] for row in shown) > 0)


if __name__ == '__main__':
    sys.exit(main())
