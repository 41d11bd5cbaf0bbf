# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What serial sensors share, with a reader that takes each line that begins with + for a frame."""
import os
import tty

import pytest

from tactile_driver.sources.source import NothingYet
from tactile_driver.serial.port import SerialSource


class Lines(SerialSource):
    def _new_reader(self):
        return self

    def feed(self, data):
        return [line.decode() for line in data.splitlines() if line.startswith(b'+')]

    def _poll(self):
        self._ready = self._received()[0]

    def _delivered(self, found):
        return found.upper()

    def _deafness(self):
        return 'no +'


@pytest.fixture
def port():
    master, slave = os.openpty()
    tty.setraw(slave)
    source = Lines(os.ttyname(slave), 9600, lambda: 0, 20)
    source.open()
    yield master, source
    source.close()
    os.close(master), os.close(slave)


def test_frames_come_one_by_one_and_those_unwanted_are_passed_over(port):
    master, source = port
    os.write(master, b'+a\n+b\n+c\n')
    assert [source.read(), source.read(wanted=False), source.read()] == ['+A', None, '+C']
    with pytest.raises(NothingYet):
        source.read()
    assert source.describe()['baud'] == 9600 and source.describe()['path'] == source.describe()['device']
    assert (source.corrupt, source.remark, source.calibration()) == (0, '', None)


def test_bytes_without_a_frame_are_remarked_until_one_comes_or_the_port_is_opened_anew(port):
    master, source = port
    for text, remark in ((b'x' * 19, ''), (b'x', 'no +'), (b'+y\n', '')):
        os.write(master, text)
        try:
            source.read()
        except NothingYet:
            pass
        assert source.remark == remark
    os.write(master, b'x' * 40)
    with pytest.raises(NothingYet):
        source.read()
    assert source.remark
    source.open()
    assert source.remark == ''
