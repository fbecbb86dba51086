"""
Verdicts and times beside the peers, on real robots and on scenes made for one question.

One thread unless a table says otherwise, warm, the least of several runs, methods in turn.
"""

import argparse
from pathlib import Path
import sys

from bench.built import DATA
from bench.cases import load
from bench.show import as_json, as_tables
from bench.tables import rows, TABLES


def main() -> int:
    """Measure and print; exit 1 if we called anything free that is not."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--data', type=Path, default=DATA, help='folder with trajectories.json')
    parser.add_argument('--only', nargs='+', choices=TABLES, default=(), help='some tables')
    parser.add_argument('--cases', type=int, help='so many trajectories a robot, not all')
    parser.add_argument('--json', action='store_true', help='one object a row')
    arguments = parser.parse_args()
    found = rows(load(arguments.data, arguments.cases), arguments.only)
    shown = as_json(found) if arguments.json else as_tables(found)
    # All rows, so that all are printed.
    return int(sum(row.get('unsound', 0) for row in shown) > 0)


if __name__ == '__main__':
    sys.exit(main())
