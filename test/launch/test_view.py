# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A viewer that hangs or dies does not slow the sensor."""
import os
import signal
import time
from contextlib import suppress

import numpy as np
import psutil
import pytest

from tactile_msgs.msg import Contacts

pytest.importorskip('rerun', reason='Rerun, an optional extra, is not installed: environment/extras.txt')
PHASE_S = 5.0


class Stopped:
    """Context in which processes are halted, as by Ctrl-Z: they keep their connections, and take nothing from them."""

    def __init__(self, processes):
        self._processes = processes

    def __enter__(self):
        for process in self._processes:
            process.send_signal(signal.SIGSTOP)

    def __exit__(self, *_exc):
        for process in self._processes:
            process.send_signal(signal.SIGCONT)


@pytest.mark.timeout(240)
def test_a_viewer_that_hangs_or_dies_does_not_slow_the_sensor(ros2, listen):
    ros2('launch', 'tactile_bringup', 'touchpad.launch.py', 'rate:=10')
    view = ros2('run', 'tactile_bringup', 'view', '--web')
    heard = listen({})
    late = []  # s, of each message
    heard.node.create_subscription(Contacts, '/touchpad/contacts', lambda message: late.append(
        time.time() - message.header.stamp.sec - 1e-9 * message.header.stamp.nanosec), 50)
    view.wait_for_line('open http://localhost', 90)
    assert heard.wait_for(lambda: len(late) > 20 and heard.node.count_subscribers('/touchpad/image_raw'), 90)

    def measured():
        """Messages a second and median latency, s, of the time from now on."""
        late.clear()
        time.sleep(PHASE_S)
        return len(late) / PHASE_S, float(np.median(late))
    family = psutil.Process(view.process.pid)
    rerun = [each for each in family.children(recursive=True) if 'rerun' in each.name()]
    assert rerun
    rows = []
    for hanging in (rerun, [family, *family.children(recursive=True)]) * 2:
        running = measured()
        with Stopped(hanging):
            rows.append((running, measured()))
    os.killpg(view.process.pid, signal.SIGKILL)
    rows.append((rows[-1][0], measured()))
    for each in rerun:  # a killed command cannot end its viewer
        with suppress(psutil.NoSuchProcess):
            each.kill()
    print(np.round(rows, 3).tolist())
    rate, latency = np.transpose(rows, (2, 1, 0))  # of each: (with a viewer that runs, with one that does not)
    best = max(rate[1][0], rate[1][2]), max(rate[1][1], rate[1][3]), rate[1][4]  # Rerun hangs; the command hangs; it is dead
    assert min(best) > 0.7 * np.median(rate[0])
    assert latency[1].min() < 1.5 * latency[0].min() + 0.02  # s; the least that other programs disturbed
