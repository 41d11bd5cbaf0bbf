# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A V4L2 camera: found, set up, read, lost and watched."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from tactile_driver.camera import device
from tactile_driver.camera.device import DeviceSource, FrameWatch, VideoDevice, find_device, list_devices
from tactile_driver.camera.v4l2 import Control, Mode, chosen_format, limit_of, set_controls
from tactile_driver.errors import BadArgument, BadFrame, DeviceLost
from tactile_driver.parameters.drivers import CAMERA_PARAMETERS
from tactile_driver.parameters.table import defaults
from tactile_driver.sources import source as pacing

MONOTONIC_NS, WALL_NS = 7_000_000_000_000, 1_700_000_000_000_000_000
PAD = VideoDevice('/dev/video3', 'Pad', 'A111', 'usb-Pad_A111-video-index0', True)


class FakeCapture:
    """A cv2.VideoCapture whose camera can be pulled out."""

    plugged = True
    opened = None
    age_ns = 4_000_000

    def __init__(self, path, _backend):
        type(self).opened = self
        self.path, self.asked, self.retrieved = path, [], 0
        self.image = np.full((48, 64, 3), 50, np.uint8)

    def isOpened(self):  # noqa: N802
        return self.plugged

    def set(self, prop, value):
        self.asked.append((prop, value))
        return True

    def get(self, prop):
        if prop == cv2.CAP_PROP_POS_MSEC:
            return (MONOTONIC_NS - self.age_ns) / 1e6
        return {cv2.CAP_PROP_FRAME_WIDTH: 64, cv2.CAP_PROP_FRAME_HEIGHT: 48, cv2.CAP_PROP_FPS: 30.0,
                cv2.CAP_PROP_FOURCC: cv2.VideoWriter_fourcc(*'MJPG')}[prop]

    def grab(self):
        return self.plugged

    def retrieve(self):
        self.retrieved += 1
        return self.image is not None, self.image

    def release(self):
        pass


@pytest.fixture
def fake(monkeypatch):
    """FakeCapture in place of OpenCV's, plugged in."""
    monkeypatch.setattr(FakeCapture, 'plugged', True)
    monkeypatch.setattr(device.cv2, 'VideoCapture', FakeCapture)
    monkeypatch.setattr(device, 'find_device', lambda _wanted: PAD)
    return FakeCapture


def opened(**values):
    source = DeviceSource({**defaults(CAMERA_PARAMETERS), 'device': 'A111', **values}, lambda: WALL_NS)
    source.open()
    return source


def test_settings_are_asked_for_the_format_first(fake):
    source = opened(width=1280, height=720, rate=60.0, pixel_format='MJPG')
    asked = fake.opened.asked
    assert fake.opened.path == '/dev/video3'
    assert asked[0] == (cv2.CAP_PROP_FOURCC, cv2.VideoWriter_fourcc(*'MJPG'))
    assert asked[1:4] == [(cv2.CAP_PROP_FRAME_WIDTH, 1280), (cv2.CAP_PROP_FRAME_HEIGHT, 720), (cv2.CAP_PROP_FPS, 60.0)]
    assert 'is set to 30 Hz instead of 60 Hz' in source.warning


def test_controls_that_cannot_be_set_are_warned_of_once_until_they_are_left_alone(fake):
    source = opened()
    source.read()
    assert source.warning == ''
    for exposure in (0.01, 0.02):
        source.set_controls({'exposure': exposure})
        source.read()
    assert source.warning.count('controls of /dev/video3 cannot be set') == 1
    source.set_controls({'exposure': -1.0})
    source.read()
    assert source.warning == ''


@pytest.fixture
def stands_still(monkeypatch):
    """The monotonic clock."""
    for module in (device, pacing):
        monkeypatch.setattr(module, 'time', SimpleNamespace(monotonic_ns=lambda: MONOTONIC_NS, monotonic=lambda: 1e-9 * MONOTONIC_NS))


def test_the_stamp_is_the_drivers_own(fake, stands_still):
    frame = opened().read()
    assert frame.stamp_ns == WALL_NS - 4_000_000, 'the picture was 4 ms old'
    assert (frame.encoding, frame.image.shape) == ('bgr8', (48, 64, 3))


@pytest.mark.parametrize('age_ns', [3_000_000_000, -50_000_000])
def test_a_stamp_of_another_clock_is_not_believed(fake, stands_still, monkeypatch, age_ns):
    monkeypatch.setattr(FakeCapture, 'age_ns', age_ns)
    assert opened().read().stamp_ns == WALL_NS


def test_unwanted_frames_are_not_decoded(fake):
    source = opened()
    assert source.read(wanted=False) is None
    assert fake.opened.retrieved == 0


def test_a_frame_that_cannot_be_decoded_is_bad(fake):
    source = opened()
    fake.opened.image = None
    with pytest.raises(BadFrame, match='/dev/video3'):
        source.read()


def test_pulled_out_and_plugged_in_again(fake, monkeypatch):
    source = opened()
    monkeypatch.setattr(FakeCapture, 'plugged', False)
    with pytest.raises(DeviceLost, match='stopped sending'):
        source.read()
    with pytest.raises(DeviceLost, match='cannot be opened'):
        source.open()
    with pytest.raises(DeviceLost):
        source.read()
    monkeypatch.setattr(FakeCapture, 'plugged', True)
    source.open()
    assert source.read().image.shape == (48, 64, 3)


def test_description_tells_the_mode_that_runs(fake):
    about = opened().describe()
    assert about['serial'] == 'A111' and about['path'] == '/dev/video3'
    assert (about['width'], about['height'], about['rate'], about['pixel_format']) == (64, 48, 30.0, 'MJPG')


def test_a_pixel_format_that_is_none_is_refused():
    with pytest.raises(BadArgument, match="pixel_format: 'JPEG2'"):
        opened(pixel_format='JPEG2')


RNG = np.random.default_rng(0)


@pytest.fixture
def watched(monkeypatch):
    """watched(image, s): the warning after an image at a time."""
    now = [100.0]
    monkeypatch.setattr(device, 'time', SimpleNamespace(monotonic=lambda: now[0]))
    watch = FrameWatch()

    def add(image, seconds):
        now[0] = 100.0 + seconds
        if image is not None:
            watch.add(image)
        return watch.warning
    add.watch = watch
    return add


def picture():
    """Grey with a little noise."""
    return RNG.integers(98, 103, (48, 64, 3), np.uint8)


def test_pictures_with_noise_are_in_order(watched):
    assert {watched(picture(), 0.03 * k) for k in range(100)} == {''}


def test_the_same_picture_again_and_again_is_reported_until_another_comes(watched):
    same = picture()
    reported = [watched(same, 0.1 * k) for k in range(30)]
    assert reported[:10] == [''] * 10 and reported[-1].startswith('the camera has sent the same image for 2.9 s')
    assert watched(picture(), 3.0) == ''


def test_black_pictures_are_reported_but_not_the_first_ones_of_a_camera_that_begins(watched):
    dark = [RNG.integers(0, 4, (48, 64), np.uint8) for _ in range(8)]
    reported = [watched(image, 0.1 * k) for k, image in enumerate(dark)]
    assert reported[:3] == [''] * 3 and 'black' in reported[-1]
    assert watched(picture()[:, :, 0], 0.9) == ''


@pytest.fixture
def root(tmp_path):
    """A /sys and /dev with two cameras; the first has a metadata node as UVC cameras do."""
    by_id = tmp_path / 'dev/v4l/by-id'
    by_id.mkdir(parents=True)
    for number, name, serial, index in ((0, 'Left pad', 'A111', 0), (1, 'Left pad', 'A111', 1), (10, 'Right pad', 'B222', 0)):
        interface = tmp_path / f'sys/devices/usb{serial}/1-1:1.0'
        interface.mkdir(parents=True, exist_ok=True)
        (interface.parent / 'serial').write_text(serial + '\n')
        folder = tmp_path / f'sys/class/video4linux/video{number}'
        folder.mkdir(parents=True)
        (folder / 'name').write_text(name + '\n')
        (folder / 'index').write_text(str(index))
        (folder / 'device').symlink_to(interface)
        (tmp_path / f'dev/video{number}').touch()
        (by_id / f'usb-Maker_Pad_{serial}-video-index{index}').symlink_to(f'../../video{number}')
    return tmp_path


def test_devices_are_listed_with_name_and_serial(root):
    devices = list_devices(str(root))
    assert [(d.path, d.name, d.serial, d.captures) for d in devices] == [
        ('/dev/video0', 'Left pad', 'A111', True), ('/dev/video1', 'Left pad', 'A111', False), ('/dev/video10', 'Right pad', 'B222', True)]
    assert devices[2].by_id == 'usb-Maker_Pad_B222-video-index0'


@pytest.mark.parametrize(('wanted', 'number'), [(name, 10) for name in (
    '10', '/dev/video10', 'usb-Maker_Pad_B222-video-index0', '/dev/v4l/by-id/usb-Maker_Pad_B222-video-index0', 'B222', 'B22')] + [
        ('A111', 0)])  # the pictures, not the metadata
def test_every_way_to_name_a_device(root, wanted, number):
    assert find_device(wanted, str(root)).path == f'/dev/video{number}'


@pytest.mark.parametrize(('wanted', 'what'), [
    ('7', 'is not a video device'), ('C333', 'is not a'), ('Pad', 'fits several'), ('', 'is not a')])
def test_an_unknown_device_lists_those_that_exist(root, wanted, what):
    with pytest.raises(DeviceLost) as failure:
        find_device(wanted, str(root))
    assert what in str(failure.value)
    for known in ('/dev/video0 (Left pad, serial A111', '/dev/video10 (Right pad, serial B222'):
        assert known in str(failure.value)


def test_without_any_device(tmp_path):
    with pytest.raises(DeviceLost, match='none at all'):
        find_device('0', str(tmp_path))


EXPOSURE, AUTO_EXPOSURE, GAIN, LINE = 0x9A0902, 0x9A0901, 0x980913, 0x980918


class Controlled:
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
    camera, before = Controlled(), Controlled().values
    assert set_controls(camera, {'exposure': -1.0, 'gain': -1.0, 'focus': -1.0, 'power_line_frequency': -1}) == []
    assert camera.values == before


@pytest.mark.parametrize(('wanted', 'values'), [
    ({'exposure': 0.02}, {AUTO_EXPOSURE: 1, EXPOSURE: 200}), ({'exposure': 0.0}, {AUTO_EXPOSURE: 0}), ({'gain': 30.0}, {GAIN: 30}),
    ({'power_line_frequency': 60}, {LINE: 2})])
def test_what_is_asked_for_is_set(wanted, values):
    camera = Controlled()
    assert set_controls(camera, wanted) == []
    assert {number: camera.values[number] for number in values} == values


@pytest.mark.parametrize(('wanted', 'part'), [({'gain': 500.0}, 'the camera has 64; it offers 1 to 64'),
                                              ({'white_balance': 4000.0}, 'the camera has no such control')])
def test_what_is_not_taken_is_reported(wanted, part):
    assert part in set_controls(Controlled(), wanted)[0]


MODES = (Mode('YUYV', 640, 480, 30.0), Mode('YUYV', 1280, 720, 10.0), Mode('MJPG', 1280, 720, 60.0), Mode('GREY', 640, 480, 120.0))


@pytest.mark.parametrize(('size', 'rate', 'best'), [((640, 480), 30.0, 'YUYV'), ((1280, 720), 30.0, 'MJPG'), ((1280, 720), 10.0, 'YUYV'),
                                                    ((640, 480), 500.0, 'GREY'), ((320, 240), 30.0, '')])
def test_the_best_colours_that_carry_the_rate(size, rate, best):
    assert chosen_format(MODES, size, rate) == best


def test_the_limit_is_the_exposure_or_the_bus():
    assert 'exposure of 50 ms' in limit_of(MODES[0], 'usb-1', (), 0.05)
    assert '18 MB/s of usb-1, which /dev/video2 shares' in limit_of(MODES[0], 'usb-1', ('/dev/video2',), 0.01)
