# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What /diagnostics says of a hand, as a table for a terminal: rates, latency, states, last faults. No ROS here."""
from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass

OK, WARN, ERROR, SILENT = range(4)
_WORDS = ('ok', 'warning', 'ERROR', 'SILENT')
_COLOURS = ('\033[32m', '\033[33m', '\033[31m', '\033[31m')
_PLAIN = '\033[0m'
_SILENCE_S = 3.5  # nodes report once a second; a busy machine may delay that
_HEADS = ('sensor', 'node', 'state', 'rate Hz', 'latency ms', 'age s', 'dropped', '')
_NUMBERS = (('rate (Hz)', '.1f'), ('latency (ms)', '.1f'), ('age (s)', '.2f'), ('dropped', '.0f'))


@dataclass
class Report:
    """The last word of one node; fault: the last that was wrong, '' for none, and fault_s when that was."""

    level: int
    message: str
    values: Mapping[str, str]
    time_s: float
    fault: str = ''
    fault_s: float = math.nan


class HandStatus:
    """Collects what nodes report. expected: sensors that ought to be there."""

    def __init__(self, expected: Collection[str] = ()):
        self._expected = tuple(expected)
        self._reports: dict[tuple[str, str], Report] = {}

    def add(self, name: str, level: int, message: str, values: Mapping[str, str], now_s: float) -> None:
        """Take one status, named as /thumb/camera_node: camera."""
        sensor, _, node = name.split(':')[0].strip('/').rpartition('/')
        last = self._reports.get((sensor, node), Report(OK, '', {}, now_s))
        fault, fault_s = (message, now_s) if level != OK else (last.fault, last.fault_s)
        self._reports[sensor, node] = Report(min(level, SILENT), message, values, now_s, fault, fault_s)

    def level_of(self, report: Report, now_s: float) -> int:
        """As reported, or SILENT where it has been so for too long."""
        return SILENT if now_s - report.time_s > _SILENCE_S else report.level

    @property
    def missing(self) -> list[str]:
        """Expected sensors of which nothing is known."""
        return [name for name in self._expected if not any(sensor == name for sensor, _ in self._reports)]

    @property
    def nodes(self) -> set[str]:
        """Full names of those that have reported."""
        return {f'/{sensor}/{node}' if sensor else f'/{node}' for sensor, node in self._reports}

    @property
    def empty(self) -> bool:
        """Whether nothing has been reported at all."""
        return not self._reports

    def faulty(self, now_s: float) -> int:
        """How many nodes are in error or silent, and sensors missing."""
        return sum(self.level_of(report, now_s) >= ERROR for report in self._reports.values()) + len(self.missing)

    def text(self, now_s: float, colour: bool = False) -> str:
        """The table, a line for each node, under it one for each fault that is or was."""
        lines = [_row(('', *_HEADS))]
        for (sensor, node), report in sorted(self._reports.items()):
            level = self.level_of(report, now_s)
            mark = f'{_COLOURS[level]}{_WORDS[level]}{_PLAIN}' if colour else _WORDS[level]
            state = 'silent' if level == SILENT else report.values.get('state', '')
            numbers = [_number(report.values.get(key), how) for key, how in _NUMBERS]
            if state == 'idle':  # they are of the last time that somebody subscribed
                numbers[:-1] = ['-'] * (len(numbers) - 1)
            lines.append(_row(('', sensor or '-', node, state, *numbers, mark)))
        lines += [_row(('', name, '-', 'missing', '-', '-', '-', '-', 'nothing reports under this name; has it been launched?'))
                  for name in self.missing]
        return '\n'.join([*lines, '', *self._faults(now_s)]).rstrip() + '\n'

    def _faults(self, now_s: float) -> list[str]:
        lines = []
        for (sensor, node), report in sorted(self._reports.items()):
            where, level = f'{sensor}/{node}', self.level_of(report, now_s)
            if level == SILENT:
                lines.append(f'{where}: silent for {now_s - report.time_s:.0f} s; has its process ended?')
            elif level != OK:
                lines.append(f'{where}: {report.message}')
            elif report.fault:
                lines.append(f'{where}: {now_s - report.fault_s:.0f} s ago: {report.fault}')
        return lines


def _number(text: str | None, how: str) -> str:
    """A value as it is shown; - where it is not known."""
    try:
        value = float(text)
    except (TypeError, ValueError):
        return '-'
    return '-' if math.isnan(value) else format(value, how)


def _row(cells: Collection[str]) -> str:
    _, sensor, node, state, *numbers, last = cells
    return f'{sensor:<14} {node:<20} {state:<12}' + ''.join(f'{number:>11}' for number in numbers) + f'  {last}'
