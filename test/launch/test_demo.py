# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""demo.launch.py on a simulated sensor, a recorded video and an array's file ends by itself and writes its pictures."""
import re
from pathlib import Path

import cv2
import numpy as np
import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')

from ament_index_python.packages import get_package_share_directory  # noqa: E402

pytestmark = pytest.mark.ros


def frames_in(path):
    video, count = cv2.VideoCapture(str(path)), 0
    while video.grab():
        count += 1
    return count


def check_files(log, folder, wanted):
    pictures = sorted(path.stem for path in folder.glob('*.png'))
    assert wanted & set(pictures), (pictures, log)
    for name in pictures:
        assert cv2.imread(str(folder / f'{name}.png')).shape == (552, 640, 3)
        assert str(folder / f'{name}.png') in log
    assert frames_in(folder / 'demo.mp4') > 20


def test_a_simulated_sensor_is_shown(ros2, tmp_path):
    launched = ros2('launch', 'tactile_bringup', 'demo.launch.py', 'out:=pictures', 'seconds:=5', 'rate:=15', 'scene:=rectangle_drag')
    assert launched.wait(90) == 0, launched.log
    assert launched.complaints == []
    check_files(launched.log, tmp_path / 'pictures', {'largest_contact', 'deepest_contact'})
    assert re.search(r'\d+ untouched, \d+ sticking, \d+ slipping', launched.log)
    assert re.search(r'touch(es)?, \d+ mm\^2, [\d.]+ mm deep, [\d.]+ N', launched.log)
    assert re.search(r'\d+ frames, [\d.]+ Hz, latency \d+ ms', launched.log)


@pytest.fixture
def press_video(tmp_path):
    """8 x 6 dots, pitch 40 px, that move by 12 px to the right and back; (path, frames)."""
    path = tmp_path / 'press.avi'
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*'MJPG'), 25.0, (320, 240))
    for k in range(100):
        shift = 12.0 * np.clip(min(k - 40, 90 - k) / 15, 0, 1)
        image = np.full((240, 320, 3), 170, np.uint8)
        for row in range(6):
            for column in range(8):
                centre = round(16 * (20 + 38 * column + shift)), round(16 * (22 + 38 * row))
                cv2.circle(image, centre, 16 * 5, (40, 40, 40), -1, cv2.LINE_AA, 4)
        writer.write(cv2.GaussianBlur(image, (0, 0), 1.0))
    writer.release()
    return path


def test_a_recorded_video_is_shown(ros2, tmp_path, press_video):
    shipped = f'{get_package_share_directory("tactile_bringup")}/params/marker_video.yaml'
    launched = ros2('launch', 'tactile_bringup', 'demo.launch.py', 'out:=pictures', 'source:=file', f'path:={press_video}',
                    f'params:={shipped}', 'rate:=12')
    assert launched.wait(90) == 0, launched.log
    assert launched.complaints == []
    assert 'contact_region_node' not in launched.log
    check_files(launched.log, tmp_path / 'pictures', {'largest_displacement'})
    assert '48 dots' in launched.log
    assert float(re.search(r'largest displacement ([\d.]+) px$', launched.log, re.MULTILINE).group(1)) == pytest.approx(12.0, abs=0.5)


def test_a_file_of_an_array_is_shown(ros2, tmp_path):
    text = Path(get_package_share_directory('tactile_bringup'), 'params', 'taxel_array.yaml').read_text()
    (tmp_path / 'mat.yaml').write_text(re.sub(r'(rows|columns): 44', r'\1: 20', text))
    frames = np.zeros((100, 20, 20))
    frames[40:80, 6:15, 4:13] = np.minimum(np.arange(40), 10)[:, None, None] * 15.0
    times = np.arange(100) / 25.0
    np.savetxt(tmp_path / 'grasp.csv', np.column_stack([times, frames.reshape(100, -1)]), '%g', ',')
    launched = ros2('launch', 'tactile_bringup', 'demo.launch.py', 'out:=pictures', 'source:=file', 'path:=grasp.csv', 'params:=mat.yaml')
    assert launched.wait(90) == 0, launched.log
    assert launched.complaints == []
    assert 'no contact' in launched.log and float(re.search(r'largest area (\d+) mm', launched.log).group(1)) == pytest.approx(81, rel=0.3)
    picture = cv2.imread(str(tmp_path / 'pictures' / 'largest_contact.png'))
    assert (picture != cv2.imread(str(tmp_path / 'pictures' / 'first.png'))).any()
    assert frames_in(tmp_path / 'pictures' / 'demo.mp4') > 20


def test_where_nothing_comes_it_fails_with_a_word(ros2):
    demo = ros2('run', 'tactile_bringup', 'demo', '--ros-args', '-p', 'patience:=1.0', '-p', 'out:=pictures')
    assert demo.wait(30) == 1
    assert 'demo: no frame' in demo.log and 'dots' in demo.log
    assert 'Traceback' not in demo.log
