"""
The experiments of Schroecker & Weber (2014), section 7, beside the figures they print.

Their control points are not printed; the motions here are of the same kind (rational of degree 8,
``bench.listing.motions`` states them) with the same outcomes. One thread, warm, the least of
several runs; preparation of the meshes (trees, metrics) is a column of its own, as in the paper.
"""

import argparse
import sys

from bench.listing.octagons import octagon_rows
from bench.listing.squares import scaling_rows, square_rows, which_rows
from bench.show import as_json, as_tables


def rows(most: int) -> list[dict]:
    """Return the rows of all tables, up to most x most squares."""
    squares = list(square_rows(most))
    return [*octagon_rows(), *squares, *scaling_rows(squares), *which_rows(min(most, 10))]


def main() -> int:
    """Measure and print; exit 1 if an outcome is another, or the plain listing tests less."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        '--max-n', type=int, default=100, help='largest subdivision, n x n squares'
    )
    parser.add_argument('--json', action='store_true', help='one object a row')
    arguments = parser.parse_args()
    if arguments.max_n < 1:
        parser.error(f'--max-n must be positive, got {arguments.max_n}')
    found = rows(arguments.max_n)
    shown = list(as_json(found) if arguments.json else as_tables(found))
    return int(not all(row.get('met', True) for row in shown))


if __name__ == '__main__':
    sys.exit(main())
