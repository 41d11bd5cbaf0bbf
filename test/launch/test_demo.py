# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""demo.launch.py on a simulated sensor and an array's file ends by itself and writes pictures; calibrate.launch.py: what it says first."""
import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from ament_index_python.packages import get_package_share_directory

from tactile_bringup.launch.demo import type_of


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
    assert launched.wait(120) == 0, launched.log
    assert launched.complaints == []
    check_files(launched.log, tmp_path / 'pictures', {'largest_contact', 'deepest_contact'})
    assert re.search(r'\d+ mm2, [\d.]+ mm deep, [\d.]+ N, .*\d+ stick, \d+ slip', launched.log)
    assert re.search(r'\d+ frames, [\d.]+ Hz, latency \d+ ms', launched.log)


def test_a_folder_of_an_arrays_frames_is_shown(ros2, tmp_path):
    text = Path(get_package_share_directory('tactile_bringup'), 'params', 'taxel_array.yaml').read_text()
    (tmp_path / 'mat.yaml').write_text(re.sub(r'(rows|columns): 44', r'\1: 20', text))
    frames = np.zeros((100, 20, 20))
    frames[40:80, 6:15, 4:13] = np.minimum(np.arange(40), 10)[:, None, None] * 15.0
    frames += np.random.default_rng(1).normal(0, 0.2, frames.shape) - 3  # signed, with fractions: a file a frame
    (tmp_path / 'grasp').mkdir()
    for number, frame in enumerate(frames):
        np.savetxt(tmp_path / 'grasp' / f'frame_{number}.csv', frame, '%.2f', ',')
    launched = ros2('launch', 'tactile_bringup', 'demo.launch.py', 'out:=pictures', 'source:=file', 'path:=grasp', 'rate:=25',
                    'params:=mat.yaml')
    assert 'RuntimeWarning' not in launched.log
    assert launched.wait(120) == 0, launched.log
    assert launched.complaints == []
    assert 'nothing touches' in launched.log
    assert float(re.search(r'largest area (\d+) mm', launched.log).group(1)) == pytest.approx(81, rel=0.3)
    picture = cv2.imread(str(tmp_path / 'pictures' / 'largest_contact.png'))
    assert (picture != cv2.imread(str(tmp_path / 'pictures' / 'first.png'))).any()
    assert frames_in(tmp_path / 'pictures' / 'demo.mp4') > 20


@pytest.mark.parametrize(('names', 'params', 'kind'), [
    (['a.csv', 'b.CSV', 'about.md'], '', 'taxel_array'), (['1.png', '2.png', 'targets.csv'], '', 'touchpad'),
    (['1.png'], 'pressure_array_14x6', 'taxel_array'), (['a.csv'], 'areal_single', 'areal_single'),
    (['1.png'], 'marker_video', 'dots'), (['1.png'], 'pin_dome', 'pins'), ([], '', 'touchpad')])
def test_what_is_played_says_which_sensor_is_started(tmp_path, names, params, kind):
    for name in names:
        (tmp_path / name).touch()
    file = params and str(Path(get_package_share_directory('tactile_bringup'), 'params', f'{params}.yaml'))
    assert type_of({'source': 'file', 'path': str(tmp_path), 'params': file}) == kind
    if names and not params:
        assert type_of({'source': 'file', 'path': str(tmp_path / names[0]), 'params': ''}) == kind


def test_where_nothing_comes_it_fails_with_a_word(ros2):
    demo = ros2('run', 'tactile_bringup', 'demo', '--ros-args', '-p', 'patience:=1.0', '-p', 'out:=pictures')
    assert demo.wait(120) == 1
    assert 'demo: no frame' in demo.log and 'dots' in demo.log
    assert 'Traceback' not in demo.log


SESSION = ('launch', 'tactile_bringup', 'calibrate.launch.py', 'namespace:=/palm', 'scene:=areal_single_session', 'rate:=5')


def test_a_session_on_the_simulated_stage_begins_and_keeps_what_it_has_when_interrupted(ros2):
    launched = ros2(*SESSION, 'simulated_stage:=true', 'probe:=stage_tip', 'wrench:=/stage/wrench')
    launched.wait_for_line('press 1 of 12: go to', 120)
    launched.wait_for_line('held at|dropped', 120)
    launched.interrupt()  # exit codes after it: test_sensors.py
    assert 'start it again with the same output to continue' in launched.log and 'does not join' not in launched.log
