"""What the viewer reads."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from statistics import median
from typing import TextIO

from rich import box
from rich.console import Console
from rich.rule import Rule
from rich.table import Table
from rich.text import Text

from trajectory_guard.command_line.report import Report
from trajectory_guard.demo.answer import Answer
from trajectory_guard.demo.case import Case
from trajectory_guard.demo.next_steps import Step
from trajectory_guard.demo.poses import REPETITIONS, Sampled
from trajectory_guard.result import Result, Verdict

# Columns of text that goes into a file or a pipe.
PIPE_WIDTH = 100

INTRODUCTION = (
    'A Panda works among a table, a crate, a carton, a sign and a shelf. The guard, a ROS 2 '
    'service in a process of its own, is asked about three motions; it answers for every instant '
    'of the spline that the controller would play. Below each answer stands what a check of '
    f'single poses (Pinocchio and Coal) would have said. Times are medians of {REPETITIONS} runs.'
)

_MILLI = 1e3
_STYLES = {'free': 'green', 'suspect': 'yellow', 'collision': 'red', 'rejected': 'magenta'}


class DemoReport:
    """
    Prints the demo.

    :param file: where to; colours only if it is a terminal.
    """

    def __init__(self, file: TextIO) -> None:
        width = None if file.isatty() else PIPE_WIDTH
        self._file = file
        self._console = Console(file=file, width=width, highlight=False)
        self._results = Report(file, self._console.width)

    def introduce(self) -> None:
        """Say what the viewer is going to see."""
        self._console.print(INTRODUCTION, end='\n\n')

    def show(
        self,
        number: int,
        case: Case,
        answers: Sequence[Answer],
        wider: Result | None,
        checks: Mapping[str, Sampled],
    ) -> None:
        """
        Print one case.

        :param number: its number.
        :param case: the case.
        :param answers: what the guard answered, each time the same.
        :param wider: what it answered when it was asked for too much clearance.
        :param checks: what checks of single poses say, by their names.
        """
        result = answers[0].result
        compute_time = median(answer.result.compute_time for answer in answers)
        round_trip = median(answer.round_trip for answer in answers)
        self._console.print(Rule(f'{number}. {case.title}', align='left', style='dim'))
        self._console.print(case.story, end='\n\n')
        self._results.show(replace(result, compute_time=compute_time))
        if wider is not None:
            # Another report: it is not to be counted with the three.
            name = f'{case.file}, asked for {wider.clearance * _MILLI:g} mm'
            Report(self._file, self._console.width).show(replace(wider, name=name))
        table = Table(box=box.SIMPLE, padding=(0, 1), show_edge=False)
        table.add_column('checked by')
        table.add_column('poses', justify='right')
        table.add_column('answer')
        table.add_column(Text('smallest gap [mm]'), justify='right')
        table.add_column(Text('time [ms]'), justify='right')
        table.add_row(
            'the guard',
            'all',
            _word(result.verdict.name.lower()),
            _gap(result, wider),
            f'{compute_time * _MILLI:.2f}',
        )
        table.add_row('  through ROS', '', '', '', f'{round_trip * _MILLI:.2f}')
        for name, sampled in checks.items():
            table.add_row(
                name,
                str(len(sampled.times)),
                _word('collision' if sampled.hits.any() else 'free'),
                f'{sampled.distances.min() * _MILLI:.3f}',
                f'{sampled.check_time * _MILLI:.2f}',
            )
        self._console.print(table)
        self._console.print()

    def close(self, problems: Sequence[str], steps: Sequence[Step]) -> None:
        """
        Print what holds for all cases, and how to go on.

        :param problems: what is not as the demo promises.
        :param steps: commands to try.
        """
        self._results.close()
        self._console.print()
        for problem in problems:
            self._console.print(Text(f'not as promised: {problem}', style='bold red'))
        if problems:
            return
        self._console.print('To try next:')
        for step in steps:
            self._console.print(Text(f'  # {step.purpose}', style='dim'), soft_wrap=True)
            for line in step.command:
                self._console.print(Text(f'  {line}'), soft_wrap=True)


def _word(answer: str) -> Text:
    """Return an answer in its colour."""
    return Text(answer, style=_STYLES[answer])


def _gap(result: Result, wider: Result | None) -> str:
    """Return what is proved about the smallest gap [mm]."""
    rows = (wider or result).intervals
    lower = [row.gap_lower for row in rows if row.gap_lower is not None]
    upper = [row.gap_upper for row in rows if row.gap_upper is not None]
    if lower and upper:
        return f'{min(lower) * _MILLI:.3f} to {min(upper) * _MILLI:.3f}'
    return f'> {result.clearance * _MILLI:.3f}' if result.verdict is Verdict.FREE else '?'
