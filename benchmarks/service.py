"""
The guard's service and the gate as their users see them, in processes of their own.

The Panda of the tests at its shelf; everything on this machine, in a ROS domain of its own.
"""

import argparse
import itertools
import sys

from bench.ros.process import own_domain
from bench.ros.tables import TABLES
from bench.show import as_json, as_tables


def main() -> int:
    """Measure and print; exit 1 if a target was not met or a collision called free."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--only', nargs='+', choices=TABLES, default=(), help='some tables')
    parser.add_argument('--requests', type=int, default=1000, help='that count, of each client')
    parser.add_argument('--json', action='store_true', help='one object a row')
    arguments = parser.parse_args()
    own_domain()
    chosen = [
        table(arguments.requests)
        for name, table in TABLES.items()
        if name in (arguments.only or TABLES)
    ]
    rows = itertools.chain.from_iterable(chosen)
    shown = (as_json if arguments.json else as_tables)(rows)
    # All rows, so that all are printed.
    bad = sum(not row.get('met', True) or row.get('unsound', 0) > 0 for row in shown)
    return int(bad > 0)


if __name__ == '__main__':
    sys.exit(main())
