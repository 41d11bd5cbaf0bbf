# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Controls of a camera that are set, refused or missing, and the pixel format that is chosen."""
import pytest
from tactile_driver.camera.v4l2 import Control, Mode, chosen_format, limit_of, set_controls

EXPOSURE, AUTO_EXPOSURE, GAIN, LINE = 0x9A0902, 0x9A0901, 0x980913, 0x980918


class Camera:
    """A driver that holds values in their range, and of automatic exposure knows 0 and 1 only."""

    def __init__(self):
        self.values = {EXPOSURE: 156, AUTO_EXPOSURE: 0, GAIN: 10, LINE: 0}

    def controls(self):
        return [Control(number, hex(number), 1, {GAIN: 64, EXPOSURE: 5000}.get(number, 2), 0) for number in self.values]

    def get(self, number):
        return self.values[number]

    def set(self, number, value):
        if number == AUTO_EXPOSURE and value > 1:
            raise OSError(22, 'Invalid argument')
        self.values[number] = min(value, 64) if number == GAIN else value


def test_what_is_left_alone_stays():
    camera, before = Camera(), Camera().values
    assert set_controls(camera, {'exposure': -1.0, 'gain': -1.0, 'focus': -1.0, 'power_line_frequency': -1}) == []
    assert camera.values == before


@pytest.mark.parametrize(('wanted', 'values'), [
    ({'exposure': 0.02}, {AUTO_EXPOSURE: 1, EXPOSURE: 200}), ({'exposure': 0.0}, {AUTO_EXPOSURE: 0}), ({'gain': 30.0}, {GAIN: 30}),
    ({'power_line_frequency': 60}, {LINE: 2})])
def test_what_is_asked_for_is_set(wanted, values):
    camera = Camera()
    assert set_controls(camera, wanted) == []
    assert {number: camera.values[number] for number in values} == values


@pytest.mark.parametrize(('wanted', 'part'), [({'gain': 500.0}, 'the camera has 64; it offers 1 to 64'),
                                              ({'white_balance': 4000.0}, 'the camera has no such control')])
def test_what_is_not_taken_is_reported(wanted, part):
    assert part in set_controls(Camera(), wanted)[0]


MODES = (Mode('YUYV', 640, 480, 30.0), Mode('YUYV', 1280, 720, 10.0), Mode('MJPG', 1280, 720, 60.0), Mode('GREY', 640, 480, 120.0))


@pytest.mark.parametrize(('size', 'rate', 'best'), [((640, 480), 30.0, 'YUYV'), ((1280, 720), 30.0, 'MJPG'), ((1280, 720), 10.0, 'YUYV'),
                                                    ((640, 480), 500.0, 'GREY'), ((320, 240), 30.0, '')])
def test_the_best_colours_that_carry_the_rate(size, rate, best):
    assert chosen_format(MODES, size, rate) == best


def test_the_limit_is_the_exposure_or_the_bus():
    assert 'exposure of 50 ms' in limit_of(MODES[0], 'usb-1', (), 0.05)
    assert '18 MB/s of usb-1, which /dev/video2 shares' in limit_of(MODES[0], 'usb-1', ('/dev/video2',), 0.01)
