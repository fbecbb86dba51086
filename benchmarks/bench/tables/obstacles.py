"""Cost against the number of obstacles, for a motion that keeps 5 cm from all of them."""

from collections.abc import Iterator
import math
import time

from bench.cases import Bench
from bench.clock import best_ms
from bench.clutter import CLEARANCE, strewn
from bench.peers import Baseline, Spline
from trajectory_guard.cell.scene import Scene
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import certify
from trajectory_guard.result import Verdict
from trajectory_guard.settings import Settings

COUNTS = (1, 10, 50, 200, 1000, 10_000)
MOST_MS = {200: 1.0}

# From here on the cost is to grow slower than the count.
MANY = 200


def obstacles(_: list[Bench]) -> Iterator[dict]:
    """Yield a row a count."""
    robot, path, boxes = strewn(max(COUNTS))
    before = None
    for count in COUNTS:
        scene = Scene(tuple(boxes[:count]), digest='')
        begin = time.perf_counter()
        cell = Workcell(robot, scene)
        build = time.perf_counter() - begin
        ms, result = best_ms(lambda cell=cell: certify(cell, path, Settings()))
        baseline, spline = Baseline(cell), Spline.from_path(path)
        ca_ms, _ = best_ms(lambda b=baseline, s=spline: b.verdict(s), 1)
        kept = certify(cell, path, Settings(clearance=CLEARANCE)).verdict == Verdict.FREE
        row = {
            'table': 'obstacles',
            'boxes': count,
            'verdict': result.verdict.name.lower(),
            'proved_5_cm': kept,
            'ms': ms,
            'pieces': result.pieces,
            'us_a_box': 1e3 * ms / count,
            'build_s': build,
            'ca_ms': ca_ms,
        }
        if before:
            # ms grows like count ** exponent from the row above to this one.
            row['exponent'] = math.log(ms / before[1]) / math.log(count / before[0])
        if count in MOST_MS:
            row |= {'target': f'ms <= {MOST_MS[count]:g}', 'met': ms <= MOST_MS[count]}
        elif count > MANY:
            row |= {'target': 'exponent < 1', 'met': row['exponent'] < 1.0}
        before = count, ms
        yield row
