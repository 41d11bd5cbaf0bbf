# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""status: shows the diagnostics of all sensors in the terminal: state, rate, latency, dropped and lost frames, last faults.

    ros2 run tactile_bringup status [--hand FILE] [--once]
"""
from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from tactile_driver.errors import reports_errors

from ..hand.description import read_hand
from .constants import BRINGUP

OK, WARN, ERROR, SILENT = range(4)
_WORDS = ('ok', 'warning', 'ERROR', 'SILENT')
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
    """The last report of each node, by its sensor and its name.

    expected: names of sensors that should report; news_s: when a node last reported for the first time.
    """

    def __init__(self, expected: Collection[str] = (), now_s: float = 0.0):
        self._expected, self.news_s = tuple(expected), now_s
        self.reports: dict[tuple[str, str], Report] = {}

    def add(self, name: str, level: int, message: str, values: Mapping[str, str], now_s: float) -> None:
        """Add one DiagnosticStatus with a name like /thumb/camera_node: camera, received at now_s."""
        sensor, _, node = name.split(':')[0].strip('/').rpartition('/')
        if (sensor, node) not in self.reports:
            self.news_s = now_s
        last = self.reports.get((sensor, node), Report(OK, '', {}, now_s))
        fault, fault_s = (message, now_s) if level != OK else (last.fault, last.fault_s)
        self.reports[sensor, node] = Report(min(level, SILENT), message, values, now_s, fault, fault_s)

    def _level(self, report: Report, now_s: float) -> int:
        """The reported level, or SILENT when the last report is older than 3.5 s."""
        return SILENT if now_s - report.time_s > BRINGUP.silence_s else report.level

    @property
    def missing(self) -> list[str]:
        """Expected sensors that have not reported."""
        return [name for name in self._expected if not any(sensor == name for sensor, _ in self.reports)]

    def faulty(self, now_s: float) -> int:
        """Number of nodes in error or silent, plus missing sensors; 1 where no node has reported."""
        return sum(self._level(report, now_s) >= ERROR for report in self.reports.values()) + len(self.missing) if self.reports else 1

    def text(self, now_s: float) -> str:
        """The table with one line per node, followed by one line per present or past fault."""
        if not self.reports:
            return 'no node reports on /diagnostics; is a sensor launched, in this ROS domain?\n'
        lines, faults = [_row(_HEADS)], []
        for (sensor, node), report in sorted(self.reports.items()):
            level, where = self._level(report, now_s), f'{sensor}/{node}'
            state = 'silent' if level == SILENT else report.values.get('state', '')
            numbers = [_number(report.values.get(key), how) for key, how in _NUMBERS]
            if state == 'idle':  # without subscribers rate, latency and age are out of date
                numbers[:-_COUNTERS] = ['-'] * (len(numbers) - _COUNTERS)
            lines.append(_row((sensor or '-', node, state, *numbers, _WORDS[level])))
            if level == SILENT:
                faults.append(f'{where}: silent for {now_s - report.time_s:.0f} s; has its process ended?')
            elif level != OK:
                faults.append(f'{where}: {report.message}')
            elif report.fault:
                faults.append(f'{where}: {now_s - report.fault_s:.0f} s ago: {report.fault}')
        lines += [_row((name, '-', 'missing', *'-' * len(_NUMBERS), 'no node reports under this name; has the sensor been launched?'))
                  for name in self.missing]
        return '\n'.join([*lines, '', *faults]).rstrip() + '\n'


def _number(text: str | None, how: str) -> str:
    """The value formatted, or - when unknown."""
    try:
        return '-' if math.isnan(float(text)) else format(float(text), how)
    except (TypeError, ValueError):
        return '-'


def _row(cells: Collection[str]) -> str:
    sensor, node, state, *numbers, last = cells
    return f'{sensor:<14} {node:<20} {state:<12}' + ''.join(f'{number:>11}' for number in numbers) + f'  {last}'


_CLEAR = '\033[2J\033[H'


def _watch(executor: SingleThreadedExecutor, status: HandStatus, once: bool, patience_s: float) -> int:
    """Print the table every second until interrupted; with once, print it when no new node has reported for 2.5 s.

    Returns the exit code.
    """
    begin = shown = time.monotonic()
    while True:
        executor.spin_once(timeout_sec=0.1)
        now = time.monotonic()
        complete = status.reports and not status.missing and now - status.news_s > BRINGUP.complete_s
        if once and (complete or now - begin > patience_s):
            print(status.text(now), end='')
            return min(status.faulty(now), 1)
        if not once and now - shown > BRINGUP.status_period_s:
            shown = now
            print((_CLEAR if sys.stdout.isatty() else '') + status.text(now), flush=True)


@reports_errors('status')
def main(args: list[str] | None = None) -> int:
    """Run the command; the exit code with --once is 1 when a node is in error or silent, or a sensor is missing."""
    parser = argparse.ArgumentParser(prog='status', description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--hand', type=Path, help='YAML file of the hand: a sensor of it that does not report is listed as missing')
    parser.add_argument('--once', action='store_true', help='print the table once and end; the exit code is 1 when something is wrong')
    parser.add_argument('--patience', type=float, default=10.0, help='with --once: longest time to wait for all reports, s')
    given = parser.parse_args(remove_ros_args(sys.argv if args is None else ['status', *args])[1:])
    status = HandStatus([sensor.name for sensor in read_hand(given.hand).sensors] if given.hand else (), time.monotonic())

    def take(message: DiagnosticArray) -> None:
        for each in message.status:
            status.add(each.name, each.level[0], each.message, {v.key: v.value for v in each.values}, time.monotonic())
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node('status')
    node.create_subscription(DiagnosticArray, '/diagnostics', take, 100)
    try:
        with SingleThreadedExecutor() as executor:
            executor.add_node(node)
            return _watch(executor, status, given.once, given.patience)
    except (KeyboardInterrupt, ExternalShutdownException):
        return 0
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
