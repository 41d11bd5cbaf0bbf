# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""SIGKILL and SIGTERM of a driver: how it ends, that it releases the device, and that the next start works."""
import signal
import time

import pytest

import serial
from emulated import CountingFinger
from fault_rig import PATIENCE
from tactile_msgs.msg import PsdVoltages

pytestmark = pytest.mark.ros
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
