# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What needs no bytes; the rest is in test_emulator.py."""
import os
import tty

import numpy as np
import pytest

from tactile_driver.errors import BadArgument, DeviceLost
from tactile_driver.serial.frames import CountFrame, MATRIX, write_frame
from tactile_driver.sources.source import NothingYet
from tactile_driver.serial.psd import PsdSerialSource, SerialSettings

SETTINGS = SerialSettings('binary', 921600, 5.0, 12, 0.005)


def test_a_missing_port_is_told_with_those_that_exist():
    for device in ('/dev/nothing', 'no-such-serial-number'):
        with pytest.raises(DeviceLost, match='there are'):
            PsdSerialSource(device, SETTINGS, lambda: 0).open()


def test_wrong_settings():
    with pytest.raises(BadArgument, match='serial port'):
        PsdSerialSource('', SETTINGS, lambda: 0)
    with pytest.raises(BadArgument, match='binary, csv'):
        PsdSerialSource('/dev/x', SerialSettings('xml', 1, 5.0, 12, 0.005), lambda: 0)


def test_bytes_without_frames_are_told():
    master, slave = os.openpty()
    tty.setraw(slave)
    source = PsdSerialSource(os.ttyname(slave), SETTINGS, lambda: 0)
    source.open()
    for _ in range(3):
        os.write(master, b'\x80' * 2000)
        with pytest.raises(NothingYet):
            source.read()
    assert 'baud' in source.remark and source.describe()['garbage bytes'] >= 5990
    os.write(master, write_frame(CountFrame(np.zeros((4, 4), int), 0, 0, 0, 8), MATRIX))
    with pytest.raises(NothingYet):
        source.read()
    assert f'another sensor sends on {os.ttyname(slave)}: a matrix of 4 x 4 values of 8 bits; ' in source.remark
    source.close()
    os.close(master), os.close(slave)
