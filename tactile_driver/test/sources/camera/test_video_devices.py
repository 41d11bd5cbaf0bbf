# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest

from tactile_driver.errors import DeviceLost
from tactile_driver.camera.device import find_device, list_devices


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


@pytest.mark.parametrize('wanted', ['10', '/dev/video10', 'usb-Maker_Pad_B222-video-index0',
                                    '/dev/v4l/by-id/usb-Maker_Pad_B222-video-index0', 'B222', 'B22'])
def test_every_way_to_name_a_device(root, wanted):
    assert find_device(wanted, str(root)).path == '/dev/video10'


def test_a_serial_number_means_the_pictures_not_the_metadata(root):
    assert find_device('A111', str(root)).path == '/dev/video0'


@pytest.mark.parametrize(('wanted', 'what'), [('7', 'is no video device'), ('C333', 'is no'), ('Pad', 'fits several'), ('', 'is no')])
def test_an_unknown_device_lists_those_that_exist(root, wanted, what):
    with pytest.raises(DeviceLost) as failure:
        find_device(wanted, str(root))
    assert what in str(failure.value)
    for known in ('/dev/video0 (Left pad, serial A111', '/dev/video10 (Right pad, serial B222'):
        assert known in str(failure.value)


def test_without_any_device(tmp_path):
    with pytest.raises(DeviceLost, match='none at all'):
        find_device('0', str(tmp_path))
