# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Nodes that are killed: perception alone, and a sensor of a hand whose launch file restarts it."""
import signal
import time

import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')
pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

from emulated import CountingFinger, samples  # noqa: E402
from tactile_driver.nodes.psd_node import PsdNode  # noqa: E402
from tactile_msgs.msg import Contacts, PsdVoltages  # noqa: E402

pytestmark = pytest.mark.ros
PERCEPTION = 'tactile_perception.node:psd_contact_node'


def test_perception_is_killed_and_started_again_beside_a_driver_that_goes_on(bench, beside, bus, nodes):
    bus.plug('A1', CountingFinger, 'ttyUSB0', mark=1)
    space = bench.fresh('finger')
    volts, contacts = bench.ear.hear(PsdVoltages, f'{space}/voltages'), bench.ear.hear(Contacts, f'{space}/contacts')
    nodes(PsdNode, space, source='device', device='A1', batch_period=0.02)
    first = bench.zygote.start(PERCEPTION, space)
    bench.until(lambda: len(contacts) > 10)
    first.send(signal.SIGKILL)
    assert first.wait() == -9
    seen, begin = len(contacts), time.monotonic()
    bench.zygote.start(PERCEPTION, space)
    bench.until(lambda: len(contacts) > seen + 10)
    numbers = samples([h.message for h in volts])[:, 0]
    assert (numbers[1:] == numbers[:-1] + 1).all(), 'the driver misses nothing'
    bench.report('perception killed, started again', 'its launch file says so', contacts[seen].at - begin)
