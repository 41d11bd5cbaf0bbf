# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Diagnostics of a hand as a table for a terminal: state, rate, latency, dropped and lost frames, last faults. Needs no ROS."""
from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass

OK, WARN, ERROR, SILENT = range(4)
_WORDS = ('ok', 'warning', 'ERROR', 'SILENT')
_COLOURS = ('\033[32m', '\033[33m', '\033[31m', '\033[31m')
_PLAIN = '\033[0m'
_SILENCE_S = 3.5  # chosen: three missed reports (nodes report once a second), plus the delay of a busy machine
_HEADS = ('sensor', 'node', 'state', 'rate Hz', 'latency ms', 'age s', 'dropped', 'lost', '')
#: Key in /diagnostics and number format. The last _COUNTERS count since the start; the others are current values.
_NUMBERS = (('rate (Hz)', '.1f'), ('latency (ms)', '.1f'), ('age (s)', '.2f'), ('dropped', '.0f'), ('lost frames', '.0f'))
_COUNTERS = 2


@dataclass
class Report:
    """The last report of one node, received at time_s. fault: the last message above OK, '' for none; fault_s: when it came."""

    level: int
    message: str
    values: Mapping[str, str]
    time_s: float
    fault: str = ''
    fault_s: float = math.nan


class HandStatus:
    """The last report of each node. expected: names of sensors that should report."""

    def __init__(self, expected: Collection[str] = ()):
        self._expected = tuple(expected)
        self._reports: dict[tuple[str, str], Report] = {}

    def add(self, name: str, level: int, message: str, values: Mapping[str, str], now_s: float) -> None:
        """Add one DiagnosticStatus with a name like /thumb/camera_node: camera, received at now_s."""
        sensor, _, node = name.split(':')[0].strip('/').rpartition('/')
        last = self._reports.get((sensor, node), Report(OK, '', {}, now_s))
        fault, fault_s = (message, now_s) if level != OK else (last.fault, last.fault_s)
        self._reports[sensor, node] = Report(min(level, SILENT), message, values, now_s, fault, fault_s)

    def level_of(self, report: Report, now_s: float) -> int:
        """The reported level, or SILENT when the last report is older than 3.5 s."""
        return SILENT if now_s - report.time_s > _SILENCE_S else report.level

    @property
    def missing(self) -> list[str]:
        """Expected sensors that have not reported."""
        return [name for name in self._expected if not any(sensor == name for sensor, _ in self._reports)]

    @property
    def nodes(self) -> set[str]:
        """Full names of the nodes that have reported."""
        return {f'/{sensor}/{node}' if sensor else f'/{node}' for sensor, node in self._reports}

    @property
    def empty(self) -> bool:
        """Whether no node has reported."""
        return not self._reports

    def faulty(self, now_s: float) -> int:
        """Number of nodes in error or silent, plus missing sensors."""
        return sum(self.level_of(report, now_s) >= ERROR for report in self._reports.values()) + len(self.missing)

    def text(self, now_s: float, colour: bool = False) -> str:
        """The table with one line per node, followed by one line per present or past fault."""
        lines = [_row(('', *_HEADS))]
        for (sensor, node), report in sorted(self._reports.items()):
            level = self.level_of(report, now_s)
            mark = f'{_COLOURS[level]}{_WORDS[level]}{_PLAIN}' if colour else _WORDS[level]
            state = 'silent' if level == SILENT else report.values.get('state', '')
            numbers = [_number(report.values.get(key), how) for key, how in _NUMBERS]
            if state == 'idle':  # without subscribers rate, latency and age are out of date
                numbers[:-_COUNTERS] = ['-'] * (len(numbers) - _COUNTERS)
            lines.append(_row(('', sensor or '-', node, state, *numbers, mark)))
        lines += [_row(('', name, '-', 'missing', *'-' * len(_NUMBERS), 'no node reports under this name; has the sensor been launched?'))
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
    """The value formatted, or - when unknown."""
    try:
        value = float(text)
    except (TypeError, ValueError):
        return '-'
    return '-' if math.isnan(value) else format(value, how)


def _row(cells: Collection[str]) -> str:
    _, sensor, node, state, *numbers, last = cells
    return f'{sensor:<14} {node:<20} {state:<12}' + ''.join(f'{number:>11}' for number in numbers) + f'  {last}'
