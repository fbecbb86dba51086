"""Results for people: a heading, what is known about each interval, and what was left out."""

from typing import TextIO

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from trajectory_guard.command_line.printable import printable
from trajectory_guard.command_line.request import SELF_COLLISION_WARNING
from trajectory_guard.errors import Reason
from trajectory_guard.result import ContactMoment, Interval, NANOSECONDS, Result, Status, Verdict

# More rows than this nobody reads; --json has them all.
MAX_ROWS = 40

# Below this many columns what belongs to a pair shares one column.
_WIDE = 110

_MILLIMETRES = 1e3
_MILLISECONDS = 1e3
_VERDICT_STYLES = {
    Verdict.REJECTED: 'bold magenta',
    Verdict.FREE: 'bold green',
    Verdict.SUSPECT: 'bold yellow',
    Verdict.COLLISION: 'bold red',
}
_STATUS_STYLES = {
    Status.UNKNOWN: 'magenta',
    Status.FREE: 'green',
    Status.SUSPECT: 'yellow',
    Status.COLLISION: 'red',
}


class Report:
    """
    Prints results as text, each as soon as it is known.

    :param file: where to; colours only if it is a terminal.
    :param width: columns; None: those of the terminal, and enough for every table in a file.
    """

    def __init__(self, file: TextIO, width: int | None = None) -> None:
        if width is None and not file.isatty():
            width = 160
        self._console = Console(file=file, width=width, highlight=False)
        self._verdicts: list[Verdict] = []
        self._unchecked: dict[str, None] = {}

    def show(self, result: Result) -> None:
        """
        Print one result.

        :param result: the result.
        """
        heading = Text(printable(result.name))
        heading.append(': ')
        heading.append(result.verdict.name, style=_VERDICT_STYLES[result.verdict])
        self._console.print(heading, soft_wrap=True)
        if result.verdict is Verdict.REJECTED:
            self._line(f'{result.reason_code}: {result.message.removeprefix(result.name + ": ")}')
        else:
            self._line(_summary(result))
            self._console.print(_table(result, self._console.width >= _WIDE))
            for contact in result.contacts[:MAX_ROWS]:
                self._line(_contact(contact))
        for warning in result.warnings:
            if warning != SELF_COLLISION_WARNING:
                self._line(f'warning: {warning}', style='yellow')
        if any(row.reason == Reason.START_STATE_UNKNOWN.value for row in result.intervals):
            self._line('hint: --start JOINT=VALUE,... says where the joints are at time 0')
        self._console.print()
        self._verdicts.append(result.verdict)
        self._unchecked.update(dict.fromkeys(result.unchecked_pairs))

    def close(self) -> None:
        """Print what was not checked at all, and how many trajectories got which verdict."""
        for pair in self._unchecked:
            self._line(f'not checked: {pair}', indent='')
        if len(self._verdicts) > 1:
            counts = [
                f'{self._verdicts.count(verdict)} {verdict.name.lower()}'
                for verdict in _VERDICT_STYLES
                if verdict in self._verdicts
            ]
            self._line(f'{len(self._verdicts)} trajectories: {", ".join(counts)}', indent='')

    def _line(self, text: str, style: str = '', indent: str = '  ') -> None:
        """Print a line as it is, however long."""
        self._console.print(Text(indent + printable(text), style=style), soft_wrap=True)


def _summary(result: Result) -> str:
    """Return what was examined, for what, and how long it took."""
    return (
        f'{result.duration_ns / NANOSECONDS:.9g} s, {result.pairs_checked} pairs, '
        f'{result.pieces} pieces, {result.compute_time * _MILLISECONDS:.2f} ms; '
        f'tolerance {result.tolerance * _MILLIMETRES:g} mm, '
        f'clearance {result.clearance * _MILLIMETRES:g} mm'
    )


def _table(result: Result, wide: bool) -> Table:
    """Return the intervals, one row each."""
    table = Table(box=box.SIMPLE, padding=(0, 1), show_edge=False)
    table.add_column(Text('start [s]'), justify='right', no_wrap=True)
    table.add_column(Text('end [s]'), justify='right', no_wrap=True)
    table.add_column(Text('status'), no_wrap=True)
    table.add_column(Text('body, obstacle'), overflow='fold')
    if wide:
        table.add_column(Text('gap [mm]'), justify='right', no_wrap=True)
        table.add_column(Text('at [s], place [m]'), justify='right', no_wrap=True)
    for row in result.intervals[:MAX_ROWS]:
        table.add_row(
            Text(_seconds(row.start_ns)),
            Text(_seconds(row.end_ns)),
            _status(row),
            *(Text(cell) for cell in (_pair_wide(row) if wide else _pair_narrow(row))),
        )
    left_out = len(result.intervals) - MAX_ROWS
    if left_out > 0:
        table.add_row('', '', f'{left_out} more', '--json has them all')
    return table


def _contact(contact: ContactMoment) -> str:
    """Return a contact in one line: when, within what, between which features, where."""
    earliest, latest = contact.earliest_ns, contact.latest_ns
    word = 'begins' if contact.begins else 'ends'
    return (
        f'contact {word} at {_seconds(round((earliest + latest) / 2))} s '
        f'(within {latest - earliest:.1g} ns): {contact.body} - {contact.obstacle}, '
        f'{contact.features}, at {_place(contact)} m'
    )


def _status(row: Interval) -> Text:
    """Return the status of an interval, and why it stayed open."""
    status = Text(row.status.name.lower(), style=_STATUS_STYLES[row.status])
    if row.reason and row.body:
        status.append(f'\n{printable(row.reason)}')
    return status


def _pair_wide(row: Interval) -> tuple[str, str, str]:
    """Return pair, gap, and instant with place, on two lines each."""
    pair = f'{printable(row.body)}\n{printable(row.obstacle)}' if row.body else row.reason
    gap = f'>= {_bound(row.gap_lower)}\n<= {_bound(row.gap_upper)}' if _has_gap(row) else ''
    at = '' if row.at_ns is None else _seconds(row.at_ns)
    return pair, gap, f'{at}\n{_place(row)}'.rstrip()


def _pair_narrow(row: Interval) -> tuple[str]:
    """Return pair, gap with instant, and place, one below the other."""
    lines = [f'{printable(row.body)} - {printable(row.obstacle)}' if row.body else row.reason]
    gap = f'gap {_bound(row.gap_lower)} .. {_bound(row.gap_upper)} mm ' if _has_gap(row) else ''
    at = '' if row.at_ns is None else f'at {_seconds(row.at_ns)} s'
    place = '' if row.location is None else f'at {_place(row)} m'
    lines += [line for line in (gap + at, place) if line]
    return ('\n'.join(lines),)


def _has_gap(row: Interval) -> bool:
    """Return whether a bound of the gap is known."""
    return row.gap_lower is not None or row.gap_upper is not None


def _place(row: Interval | ContactMoment) -> str:
    """Return where it is, to the millimetre [m]."""
    return ' '.join(f'{value:.3f}' for value in row.location or ())


def _seconds(time_ns: int) -> str:
    """Return a time, exactly: contacts may begin and end within nanoseconds [s]."""
    return f'{time_ns // NANOSECONDS}.{time_ns % NANOSECONDS:09d}'


def _bound(length: float | None) -> str:
    """Return a bound of a gap, to the micrometre or one digit [mm]."""
    if length is None:
        return '?'
    value = length * _MILLIMETRES
    return f'{value:.3f}' if abs(value) >= 1e-3 or value == 0.0 else f'{value:.0e}'
