"""
Draws the pictures of ``toleranced_motions.md``.

Each is made from the library's own values; the same files come out every time.
"""

import argparse
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
import sys

import matplotlib
from matplotlib.figure import Figure
from PIL import Image

HERE = Path(__file__).parent
# The motions and squares of the paper's experiments are the benchmark's.
sys.path.append(str(HERE.parent / 'benchmarks'))

from drawing import fat_polygon, shrinking_cover, squares  # noqa: E402

PICTURES: dict[str, Callable[[], Figure]] = {
    'fat_polygon': fat_polygon.draw,
    'shrinking_cover': shrinking_cover.draw,
    'squares': squares.draw,
}
# What an indexed PNG has.
COLOURS = 256


def main() -> int:
    """Draw all pictures, or the one named."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--out', type=Path, default=HERE / 'pictures', help='folder of the files')
    parser.add_argument('--only', choices=PICTURES, help='draw this one alone')
    parser.add_argument('--dpi', type=int, default=120, help='dots per inch')
    arguments = parser.parse_args()
    if arguments.dpi < 1:
        parser.error(f'--dpi must be positive, got {arguments.dpi}')
    arguments.out.mkdir(parents=True, exist_ok=True)
    for name in [arguments.only] if arguments.only else PICTURES:
        with matplotlib.rc_context({'font.size': 9.0, 'axes.titlesize': 9.0}):
            save(PICTURES[name](), arguments.out / f'{name}.png', arguments.dpi)
    return 0


def save(figure: Figure, path: Path, dpi: int) -> None:
    """Write a picture with few colours, which is a third of the size and looks the same."""
    drawn = BytesIO()
    figure.savefig(drawn, dpi=dpi)
    image = Image.open(drawn).convert('RGB')
    image.quantize(COLOURS, dither=Image.Dither.NONE).save(path, optimize=True)


if __name__ == '__main__':
    sys.exit(main())
