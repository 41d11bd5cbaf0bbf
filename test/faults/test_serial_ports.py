# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Sensors on serial ports: unplugged, plugged in elsewhere, swapped, at a wrong baud rate; how SIGKILL and SIGTERM end a driver."""
import signal
import time

import numpy as np
import pytest
import serial
from emulated import CountingArray, CountingFinger, frames, samples
from fault_rig import ERROR, OK, PATIENCE, WARN, stamps
from sensor_msgs.msg import Image

from tactile_driver.emulators import CORRUPTIONS
from tactile_driver.nodes.psd_node import PsdNode
from tactile_driver.nodes.taxel_array_node import TaxelArrayNode
from tactile_msgs.msg import PsdVoltages

ARRAY = {'rows': 4, 'columns': 4}
RNG = np.random.default_rng(1)


def messages(heard, since=0.0):
    return [h.message for h in list(heard) if h.at > since]


def driver(bench, nodes, kind, data, topic, **parameters):
    """driver(device): (name of its node, its raw data as they come)."""
    def start(device):
        space = bench.fresh('serial')
        heard = bench.ear.hear(data, f'{space}/{topic}')
        return nodes(kind, space, source='device', device=str(device), **parameters).get_fully_qualified_name(), heard
    return start


@pytest.fixture
def finger(bench, nodes):
    return driver(bench, nodes, PsdNode, PsdVoltages, 'voltages', batch_period=0.02)


@pytest.fixture
def array(bench, nodes):
    return driver(bench, nodes, TaxelArrayNode, Image, 'image_raw', **ARRAY)


def test_unplugged_and_plugged_in_under_another_name(bench, beside, bus, finger):
    bus.plug('A1', CountingFinger, 'ttyUSB0', mark=1)
    node, heard = finger('A1')
    bench.until(lambda: len(heard) > 5)
    pulled = time.monotonic()
    bus.pull('A1')
    reported = bench.reported(node, ERROR, 'device:', pulled)
    assert 'cable' in reported.text and reported.values['state'] == 'lost'
    time.sleep(1.0)
    bus.plug('B2', CountingFinger, 'ttyUSB0', mark=2)  # another sensor on its former port
    plugged = time.monotonic()
    bus.plug('A1', CountingFinger, 'ttyUSB1', mark=1)
    bench.until(lambda: messages(heard, plugged))
    back = next(h.at for h in heard if h.at > plugged)
    bench.reported(node, OK, 'Hz', plugged)
    assert set(samples(messages(heard))[:, 1]) == {1}, 'never the other sensor'
    assert bench.logged('device is back', pulled) and (np.diff(stamps(heard)) > 0).all()
    bench.report('unplugged, plugged in under another name', reported.text, back - plugged)


def test_sensors_swapped_between_ports_named_by_path_are_reported_and_give_no_numbers(bench, beside, bus, finger, array):
    bus.plug('A1', CountingFinger, 'ttyUSB0', mark=1)
    bus.plug('B2', CountingArray, 'ttyUSB1', mark=2)
    (finger_node, volts), (array_node, images) = finger(bus.folder / 'ttyUSB0'), array(bus.folder / 'ttyUSB1')
    bench.until(lambda: len(volts) > 5 and len(images) > 5)
    bus.pull('A1')
    bus.pull('B2')
    swapped = time.monotonic()
    bus.plug('B2', CountingArray, 'ttyUSB0', mark=2)
    bus.plug('A1', CountingFinger, 'ttyUSB1', mark=1)
    reported = bench.reported(finger_node, ERROR, 'another sensor sends', swapped)
    assert '4 x 4' in reported.text and 'serial number' in reported.values['what to do']
    reported_array = bench.reported(array_node, ERROR, 'another sensor sends', swapped)
    assert '5 x 4' in reported_array.text
    later = max(reported.at, reported_array.at)  # data in transit when the cables were pulled have arrived by then
    assert messages(volts, later) == [] and messages(images, later) == []
    assert set(samples(messages(volts))[:, 1]) == {1} and set(frames(messages(images))[:, 1]) == {2}
    bus.pull('A1')
    bus.pull('B2')
    right = time.monotonic()
    bus.plug('A1', CountingFinger, 'ttyUSB0', mark=1)
    bus.plug('B2', CountingArray, 'ttyUSB1', mark=2)
    bench.until(lambda: messages(volts, right) and messages(images, right))
    back = max(next(h.at for h in each if h.at > right) for each in (volts, images))
    bench.reported(finger_node, OK, 'Hz', right)
    assert set(samples(messages(volts))[:, 1]) == {1} and set(frames(messages(images))[:, 1]) == {2}
    bench.report('finger and array swapped between ports, named by path', reported.text, back - right)


def test_a_wrong_baud_rate_is_reported_and_gives_no_numbers(bench, beside, bus, array):
    emulator = bus.plug('A1', CountingArray, 'ttyUSB0', mark=1, rate=400.0)
    emulator.spoil = lambda data: CORRUPTIONS['wrong_baud'](data, RNG) * 40  # the byte rate of a fast sensor
    node, heard = array(bus.folder / 'ttyUSB0')
    reported = bench.reported(node, WARN, 'but no frames')
    assert 'baud' in reported.text and not heard
    emulator.spoil = None
    right = time.monotonic()
    bench.until(lambda: heard)
    bench.reported(node, OK, 'Hz', right)
    assert set(frames(messages(heard))[:, 1]) == {1}
    bench.report('wrong baud rate', reported.text, heard[0].at - right)


CODES = {signal.SIGKILL: -9, signal.SIGTERM: 0}


def test_a_signal_ends_the_driver_frees_the_device_and_the_next_start_works(bench, beside, bus):
    bus.plug('A1', CountingFinger, 'ttyUSB0', mark=1)
    port, before = bus.folder / 'ttyUSB0', 'nothing'
    for number in CODES:
        space, begun = bench.fresh('driver'), time.monotonic()
        heard = bench.ear.hear(PsdVoltages, f'{space}/voltages')
        process = bench.start('tactile_driver', 'psd_node', space, source='device', device=port)
        bench.until(lambda: heard)  # noqa: B023
        bench.report(f'start after {before}', 'nothing', heard[0].at - begun)
        sent = time.monotonic()
        process.send_signal(number)
        assert process.wait(PATIENCE) == CODES[number], process.log
        lasted = time.monotonic() - sent
        assert 'Traceback' not in process.log, process.log
        with serial.Serial(str(port), exclusive=True):
            pass
        before = number.name
        bench.report(f'{before} while active', f'exit code {CODES[number]}', lasted)
