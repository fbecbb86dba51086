"""What a node has decided so far, counted: the outcomes, the reasons, how long it took."""

from collections import Counter, deque
import threading

# Latencies that the statistics look back on.
WINDOW = 1000

# Different outcomes, and different reasons, that are counted each by its name. Codes are few and
# stable; whatever comes beyond is counted together, so that nothing grows without bound.
NAMES = 64
OTHER = 'other'

# Characters of a name, and of the last message, that are kept.
NAME_LENGTH = 64
MESSAGE_LENGTH = 500


class Tally:
    """Counts of outcomes and reasons, and the last latencies; any thread may count or ask."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._outcomes: Counter[str] = Counter()
        self._reasons: Counter[str] = Counter()
        self._latencies: deque[float] = deque(maxlen=WINDOW)
        self._last = ('', '', '')

    def count(self, outcome: str, reason: str, seconds: float, message: str = '') -> None:
        """
        Count one decision.

        :param outcome: what was decided, for instance 'free'.
        :param reason: stable code of the reason; '': there is none.
        :param seconds: how long it took [s]; what is negative or NaN is no latency.
        :param message: the reason in words.
        """
        outcome, reason = str(outcome)[:NAME_LENGTH], str(reason)[:NAME_LENGTH]
        with self._lock:
            _count(self._outcomes, outcome)
            if reason:
                _count(self._reasons, reason)
            if seconds >= 0:
                self._latencies.append(float(seconds))
            self._last = (outcome, reason, message[:MESSAGE_LENGTH])

    def entries(self) -> list[tuple[str, str]]:
        """
        Return everything as names with values, in a fixed order.

        Latencies are those of the last 1000 decisions [s]; a percentile is the least of them that
        so many per cent do not exceed.
        """
        with self._lock:
            outcomes, reasons = dict(self._outcomes), dict(self._reasons)
            latencies, last = list(self._latencies), self._last
        latencies.sort()
        return [
            ('decisions', str(sum(outcomes.values()))),
            *((f'outcome {name}', str(number)) for name, number in sorted(outcomes.items())),
            *((f'reason {name}', str(number)) for name, number in sorted(reasons.items())),
            *(
                (f'latency {name} [s]', f'{_percentile(latencies, per_cent):.6f}')
                for name, per_cent in (('p50', 50), ('p99', 99), ('max', 100))
                if latencies
            ),
            *zip(('last outcome', 'last reason', 'last message'), last, strict=True),
        ]


def _count(counter: Counter[str], name: str) -> None:
    """Count a name, or all names together that come when there are enough."""
    counter[name if name in counter or len(counter) < NAMES else OTHER] += 1


def _percentile(ascending: list[float], per_cent: int) -> float:
    """Return the least value that so many per cent of all do not exceed (the nearest rank)."""
    return ascending[-(-len(ascending) * per_cent // 100) - 1]
