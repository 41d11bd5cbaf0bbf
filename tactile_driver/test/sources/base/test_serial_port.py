# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import os
import tty
from types import SimpleNamespace

import pytest

from tactile_driver.errors import DeviceLost
from tactile_driver.serial import port as serial_port
from tactile_driver.serial.port import SerialPort, find_port

PORTS = [SimpleNamespace(device='/dev/ttyUSB0', description='FT232R', serial_number='A901'),
         SimpleNamespace(device='/dev/ttyUSB1', description='FT232R', serial_number='A902')]


def test_a_port_is_found_by_its_serial_number(monkeypatch, tmp_path):
    monkeypatch.setattr(serial_port.list_ports, 'comports', lambda: PORTS)
    monkeypatch.setattr(serial_port, '_BY_ID', tmp_path)
    (tmp_path / 'usb-FTDI').write_text('')
    assert find_port('A902') == '/dev/ttyUSB1'
    assert find_port('usb-FTDI') == str(tmp_path / 'usb-FTDI')
    with pytest.raises(DeviceLost, match='several.*A901'):
        find_port('A90')


def test_what_has_come_is_read_and_a_port_that_is_gone_is_told():
    master, slave = os.openpty()
    tty.setraw(slave)
    port = SerialPort(os.ttyname(slave), 115200)
    port.open()
    os.write(master, b'abc')
    found = b''.join(port.read() for _ in range(4))  # the terminal may hand it over in parts
    assert found == b'abc' and port.read() == b''
    os.close(master), os.close(slave)
    with pytest.raises(DeviceLost, match='is gone'):
        port.read()
    port.close()
    with pytest.raises(DeviceLost, match='not open'):
        port.read()
