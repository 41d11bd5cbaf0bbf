# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Invalid parameters set while nodes run are refused with a reason, and the node continues as before."""
import time

import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')
pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

from emulated import CountingFinger, samples  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from tactile_driver.nodes.psd_node import PsdNode  # noqa: E402
from tactile_msgs.msg import PsdVoltages  # noqa: E402

pytestmark = pytest.mark.ros


def test_a_running_driver_refuses_and_goes_on(bench, beside, bus, nodes):
    space = bench.fresh('finger')
    heard = bench.ear.hear(PsdVoltages, f'{space}/voltages')
    bus.plug('A1', CountingFinger, 'ttyUSB0', mark=1)
    node = nodes(PsdNode, space, source='device', device='A1', batch_period=0.02)
    bench.until(lambda: len(heard) > 5)
    reasons = []
    for name, value in (('device', 'B2'), ('baud', 9600), ('source', 'sim'), ('batch_period', 1e9), ('frame_id', ''), ('autostart', False)):
        result, = node.set_parameters([Parameter(name, value=value)])
        assert not result.successful and result.reason
        reasons.append(result.reason)
    assert 'deactivate and clean up first' in reasons[0]
    begin = time.monotonic()
    bench.until(lambda: heard[-1].at > begin + 0.3)
    numbers = samples([h.message for h in heard])[:, 0]
    assert (numbers[1:] == numbers[:-1] + 1).all() and set(samples([h.message for h in heard])[:, 1]) == {1}
    bench.report('a parameter is set to nonsense while running', reasons[3], next(h.at for h in heard if h.at > begin) - begin)
