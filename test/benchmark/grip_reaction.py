# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Reaction time of the grip reflex: from the true onset of slip to the command that closes the gripper.

    python test/benchmark/grip_reaction.py [--sensor taxel_array] [--rounds 5]

Launches grip_reflex.launch.py, subscribes to ground_truth/slip and grip_command, and prints a line for each slip: the reaction time from
the onset (a twentieth of the contact slips) and from gross slip, both by the stamps of the data, and the time from the onset to the
receipt here, by the clock.
"""
from __future__ import annotations

import argparse
import os
import signal
import subprocess
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import rclpy
from sensor_msgs.msg import JointState
from tactile_msgs.msg import Slip

_REST_S = 0.5  # s without slip that separate two slips. Chosen
_LONGEST_S = 120.0  # s, limit of a round
_LOOK_S = 3.0  # s between evaluations of the received messages, which may take longer than a frame. Chosen


@dataclass(frozen=True)
class Reaction:
    """s to the command: from the onset of a slip by stamps, from where the whole contact slips (NaN: it never did), by the clock."""

    stamps: float
    from_gross: float
    received: float


def reactions(truth: Sequence[tuple[float, int]], commands: Sequence[tuple[float, float, float]]) -> list[Reaction]:
    """Of the slips in truth, (stamp s, state), by commands, (stamp s, receipt s, force N), in order; NaN where none closed until half
    a second after its end.

    A command closes where its force is more than the one before, which was more than none: the first touch is no slip.
    """
    closing = [(stamp, received) for (_, _, before), (stamp, received, force) in zip(commands, commands[1:]) if force > before > 0]
    found = []
    for slip in _slips(truth):
        onset, end = slip[0][0], slip[-1][0] + _REST_S
        stamp, received = next((one for one in closing if onset <= one[0] < end), (np.nan, np.nan))
        gross = next((at for at, state in slip if state == Slip.GROSS), np.nan)
        found.append(Reaction(stamp - onset, stamp - gross, received - onset))
    return found


def _slips(truth: Sequence[tuple[float, int]]) -> list[list[tuple[float, int]]]:
    """(stamp, state) of the frames of each slip."""
    slips: list[list[tuple[float, int]]] = []
    for stamp, state in truth:
        if state == Slip.NONE:
            continue
        if not slips or stamp - slips[-1][-1][0] > _REST_S:
            slips.append([])
        slips[-1].append((stamp, state))
    return slips


def table(found: Sequence[Reaction]) -> str:
    """A line for each, ms, - where it was not answered or never gross, and the median of the others."""
    rows = [(one.stamps, one.from_gross, one.received) for one in found]
    lines = [[f'{1e3 * value:.0f}' if np.isfinite(value) else '-' for value in row] for row in (*rows, np.nanmedian(rows, axis=0))]
    names = [*(f'slip {k}' for k in range(1, len(rows) + 1)), 'median']
    head = 'ms        | onset to command | all slips to command | onset to receipt\n'
    return head + '\n'.join(f'{name:9} | {row[0]:>16} | {row[1]:>20} | {row[2]:>16}' for name, row in zip(names, lines))


def listen(sensor: str, rounds: int) -> tuple[list, list]:
    """(truth, commands) as reactions takes them, heard until so many slips are over."""
    node, truth, commands = rclpy.create_node('grip_reaction'), [], []
    node.create_subscription(Slip, f'/{sensor}/ground_truth/slip', lambda m: truth.append((_seconds(m), m.state)), 100)
    node.create_subscription(JointState, f'/{sensor}/grip_command',
                             lambda m: commands.append((_seconds(m), time.time(), m.effort[0])), 100)
    end = time.monotonic() + rounds * _LONGEST_S
    while len(reactions(truth, commands)) <= rounds and time.monotonic() < end:
        pause = time.monotonic() + _LOOK_S
        while time.monotonic() < pause:
            rclpy.spin_once(node, timeout_sec=0.1)
    node.destroy_node()
    return truth, commands


def _seconds(message) -> float:
    return message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec


def main() -> None:
    """Launch, listen, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--sensor', choices=('taxel_array', 'touchpad'), default='taxel_array')
    parser.add_argument('--rounds', type=int, default=5, help='slips to hear')
    given = parser.parse_args()
    launched = subprocess.Popen(['ros2', 'launch', 'tactile_bringup', 'grip_reflex.launch.py', f'sensor:={given.sensor}'],
                                start_new_session=True)
    rclpy.init()
    try:
        print(table(reactions(*listen(given.sensor, given.rounds))[:given.rounds]))
    finally:
        os.killpg(launched.pid, signal.SIGINT)
        launched.wait(30)
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()
