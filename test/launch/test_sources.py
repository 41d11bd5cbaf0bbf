# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""touchpad.launch.py on a video: the recording that is over ends the launch, and nothing of it is lost."""
import cv2
import numpy as np
import pytest

from ament_index_python.packages import get_package_share_directory
from diagnostic_msgs.msg import DiagnosticArray
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode

pytestmark = pytest.mark.ros
RATE = 10.0  # Hz


def params(name):
    return f'params:={get_package_share_directory("tactile_bringup")}/params/{name}'


@pytest.fixture
def video(tmp_path):
    """8 x 6 dots at rest; two seconds, the last frame 6 px to the right."""
    path = tmp_path / 'rest.avi'
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*'MJPG'), RATE, (320, 240))
    image = np.full((240, 320, 3), 170, np.uint8)
    for k in range(48):
        cv2.circle(image, (26 + 38 * (k % 8), 22 + 38 * (k // 8)), 5, (40, 40, 40), -1, cv2.LINE_AA)
    for k in range(20):
        writer.write(cv2.GaussianBlur(np.roll(image, 6 if k == 19 else 0, axis=1), (0, 0), 1.0))
    writer.release()
    return path


def test_a_launch_ends_with_its_recording_and_nothing_of_it_is_lost(ros2, listen, video, tmp_path):
    launched = ros2('launch', 'tactile_bringup', 'touchpad.launch.py', 'source:=file', f'path:={video}', params('marker_video.yaml'),
                    'record:=bag', 'rate:=4')
    ear = listen({'/diagnostics': DiagnosticArray})
    assert launched.wait(120) == 0, launched.log
    assert launched.complaints == [] and launched.log.count('the recording is over') == 1, launched.log
    said = {status.message.split(':')[0] for message in ear.heard['/diagnostics'] for status in message.status}
    assert 'ended' in said, said
    with BagReader(tmp_path / 'bag') as bag:
        last = [decode(message.data, message.type_name) for message in bag.messages({'/touchpad/dots'})][-1]
    assert np.median(last.du) == pytest.approx(6.0, abs=0.5), 'the last frame is recorded'
