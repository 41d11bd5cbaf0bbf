# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The wall clock or simulated time is set forward and back: stamps follow it, processing continues, and nothing is lost."""
import time
from functools import partial

import numpy as np
import pytest
from emulated import CountingFinger, samples
from fault_rig import OK, stamps
from rclpy.clock import ClockType
from rosgraph_msgs.msg import Clock

from tactile_driver.nodes.driver_node import DriverNode
from tactile_driver.nodes.psd_node import PsdNode
from tactile_msgs.msg import Contacts, PsdVoltages
from tactile_perception.core.node import make_node

HOUR = 3600 * 10**9


@pytest.mark.parametrize('step', [HOUR, -HOUR, -10**7], ids=['an hour forward', 'an hour back', '10 ms back'])
def test_the_wall_clock_is_set(bench, beside, bus, nodes, monkeypatch, step):
    offset, true = [0], DriverNode.now_ns
    monkeypatch.setattr(DriverNode, 'now_ns', lambda self: true(self) + offset[0])
    space = bench.fresh('clock')
    volts, contacts = bench.ear.hear(PsdVoltages, f'{space}/voltages'), bench.ear.hear(Contacts, f'{space}/contacts')
    bus.plug('A1', CountingFinger, 'ttyUSB0', mark=1, patient=True)
    nodes(PsdNode, space, source='device', device='A1', batch_period=0.02)
    nodes(partial(make_node, 'psd_contact_node'), space)
    bench.until(lambda: len(volts) > 10 and len(contacts) > 10)
    offset[0], begin = step, time.monotonic()
    bench.until(lambda: len(volts) > 10 and abs(stamps(volts)[-1] - stamps(volts)[0] - step) < 10**10 and volts[-1].at > begin + 0.5)
    bench.until(lambda: contacts[-1].at > begin + 0.5)
    numbers, steps = samples([h.message for h in volts])[:, 0], np.diff(stamps(volts))
    assert (np.diff(numbers) == 1).all(), 'no sample is lost'
    assert (steps <= 0).sum() == (step < -10**8), 'stamps go back with the clock, by a small step not at all'
    bench.reported(f'{space}/psd_node', OK, 'Hz', begin)
    back = max(next(h.at for h in heard if h.at > begin) for heard in (volts, contacts))
    bench.report(f'the wall clock is set by {step / 1e9:g} s', 'nothing: stamps follow the clock', back - begin)


def test_simulated_time_stands_still_runs_and_is_set(bench, beside, bus, nodes):
    space = bench.fresh('clock')
    volts = bench.ear.hear(PsdVoltages, f'{space}/voltages')
    clock, message = bench.ear.node.create_publisher(Clock, '/clock', 10), Clock()
    bus.plug('A1', CountingFinger, 'ttyUSB0', mark=1, patient=True)
    node = nodes(PsdNode, space, source='device', device='A1', batch_period=0.02, use_sim_time=True)
    bench.reported(f'{space}/psd_node', OK, 'Hz')
    assert (stamps(volts) < 10**11).all(), 'before its first message simulated time is 0; the device clock smooths over some batches'
    bench.until(clock.get_subscription_count, lambda: 'the node has not found /clock')

    def follows() -> bool:
        clock.publish(message)
        time.sleep(0.05)
        return abs(stamps(volts)[-1] - message.clock.sec * 10**9) < 2 * 10**9

    def known() -> str:
        return (f'{message.clock.sec} s is published to {clock.get_subscription_count()} subscribers, the node\'s clock shows '
                f'{node.now_ns() / 1e9} s, voltages of {time.monotonic() - volts[-1].at:.1f} s ago {stamps(volts)[-1] / 1e9} s')
    for message.clock.sec in (1000, 5000, 10):
        begin = time.monotonic()
        bench.until(follows, known)
        bench.reported(f'{space}/psd_node', OK, 'Hz', begin)
        bench.report(f'simulated time is set to {message.clock.sec} s', 'nothing: stamps follow the clock', time.monotonic() - begin)
    assert (np.diff(samples([h.message for h in volts])[:, 0]) == 1).all(), 'no sample is lost'


@pytest.mark.parametrize('sensor_type', ['touchpad', 'areal_dual', 'psd_finger', 'taxel_array'])
def test_no_timer_of_a_node_is_on_a_clock_that_can_be_set(idle, sensor_type):
    for node in idle(sensor_type):
        assert {timer.clock.clock_type for timer in node.timers} == {ClockType.STEADY_TIME}, node.get_name()
