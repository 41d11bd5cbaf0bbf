# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""status: shows the diagnostics of all sensors in the terminal: state, rate, latency, dropped and lost frames, last faults.

    ros2 run tactile_bringup status [--hand FILE] [--once]
"""
from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args
from tactile_driver.command import tells_errors

from ..hand.description import names_in
from ..hand.status_table import HandStatus

_QUEUE = 100  # messages, chosen
_PERIOD_S, _LOOK_S = 1.0, 2.5  # chosen; nodes report once a second
_CLEAR = '\033[2J\033[H'


class StatusNode(Node):
    """Passes every message of /diagnostics to status."""

    def __init__(self, status: HandStatus):
        super().__init__('status')
        self._status = status
        self._reporters: set[str] = set()
        self.news_s = time.monotonic()  # when a node was discovered or reported for the first time
        self.create_subscription(DiagnosticArray, '/diagnostics', self._take, _QUEUE)

    def _take(self, message: DiagnosticArray) -> None:
        known = len(self._status.nodes)
        for status in message.status:
            self._status.add(status.name, status.level[0], status.message, {v.key: v.value for v in status.values}, time.monotonic())
        if len(self._status.nodes) > known:
            self.news_s = time.monotonic()

    def is_complete(self) -> bool:
        """Whether every discovered publisher of /diagnostics has reported, and no new one has appeared for 2.5 s."""
        found = {f'{info.node_namespace.rstrip("/")}/{info.node_name}' for info in self.get_publishers_info_by_topic('/diagnostics')}
        if not found <= self._reporters:
            self._reporters |= found
            self.news_s = time.monotonic()
        heard = found <= self._status.nodes and not self._status.missing and not self._status.empty
        return heard and time.monotonic() - self.news_s > _LOOK_S


def watch(node: StatusNode, status: HandStatus, once: bool, patience_s: float) -> int:
    """Print the table every second until interrupted; with once, print it when all nodes have reported and return the exit code."""
    with SingleThreadedExecutor() as executor:
        executor.add_node(node)
        begin = shown = time.monotonic()
        while True:
            executor.spin_once(timeout_sec=0.1)
            now = time.monotonic()
            if once and (node.is_complete() or now - begin > patience_s):
                return _print_once(status, now)
            if not once and now - shown > _PERIOD_S:
                shown = now
                terminal = sys.stdout.isatty()
                print((_CLEAR if terminal else '') + _text(status, now, terminal), flush=True)


def _print_once(status: HandStatus, now: float) -> int:
    print(_text(status, now, sys.stdout.isatty()), end='')
    return 1 if status.empty or status.faulty(now) else 0


def _text(status: HandStatus, now: float, colour: bool) -> str:
    if status.empty:
        return 'no node reports on /diagnostics; is a sensor launched, in this ROS domain?\n'
    return status.text(now, colour)


@tells_errors('status')
def main(args: list[str] | None = None) -> int:
    """Run the command; the exit code with --once is 1 when a node is in error or silent, or a sensor is missing."""
    parser = argparse.ArgumentParser(prog='status', description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--hand', type=Path, help='YAML file of the hand: a sensor of it that does not report is listed as missing')
    parser.add_argument('--once', action='store_true', help='print the table once and end; the exit code is 1 when something is wrong')
    parser.add_argument('--patience', type=float, default=10.0, help='with --once: longest time to wait for all reports, s')
    given = parser.parse_args(remove_ros_args(sys.argv if args is None else ['status', *args])[1:])
    status = HandStatus(names_in(given.hand))
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    node = StatusNode(status)
    try:
        return watch(node, status, given.once, given.patience)
    except (KeyboardInterrupt, ExternalShutdownException):
        return 0
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
