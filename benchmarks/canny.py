"""
The algebraic contact times: the paper's example, and what they cost.

One thread, warm, the least of several runs.
"""

import argparse
import itertools
from pathlib import Path
import sys

from bench.algebraic import TABLES
from bench.figure2 import contacts, l_shape, obstacles, path
from bench.picture import draw, Drawn
from bench.show import as_json, as_tables

from trajectory_guard.canny import still


def picture(file: Path) -> None:
    """Draw the obstacles, the L at both ends of its path and where it begins or ends to touch."""
    motion = path()
    moments = [
        (float(when), touching)
        for one in contacts()
        for when, touching in ((one.start, one.opening), (one.end, one.closing))
    ]
    places = [(0.0, '#69c', 1.0), *((s, '#fc6', 0.5) for s, _ in moments), (1.0, '#69c', 1.0)]
    table, *others = obstacles()
    bodies = [Drawn(table, still().pose(0.0), '#bbb', layer=0)]
    bodies += [Drawn(body, still().pose(0.0), '#bbb') for body in others]
    bodies += [Drawn(part, motion.pose(s), *look) for s, *look in places for part in l_shape()]
    points = [(c.point, f's = {s:.4f}') for s, touching in moments for c in touching[:1]]
    draw(file, bodies, points)


def main() -> int:
    """Measure and print; exit 1 if a target was not met."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--only', nargs='+', choices=TABLES, default=(), help='some tables')
    parser.add_argument('--json', action='store_true', help='one object a row')
    parser.add_argument('--picture', type=Path, metavar='OUT.svg', help='draw the example')
    arguments = parser.parse_args()
    if arguments.picture:
        picture(arguments.picture)
    chosen = [table() for name, table in TABLES.items() if name in (arguments.only or TABLES)]
    rows = itertools.chain.from_iterable(chosen)
    shown = (as_json if arguments.json else as_tables)(rows)
    # All rows, so that all are printed.
    return int(sum(not row.get('met', True) for row in shown) > 0)


if __name__ == '__main__':
    sys.exit(main())
