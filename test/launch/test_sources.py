# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""touchpad.launch.py on each source that needs no device: results at the source's rate, also in a loop, without a warning;
a recording that is over ends the launch."""
import cv2
import numpy as np
import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')

from ament_index_python.packages import get_package_share_directory  # noqa: E402
from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from tactile_driver.recordings.reader import BagReader  # noqa: E402
from tactile_driver.recordings.serialization import decode  # noqa: E402
from tactile_msgs.msg import ContactRegion, DotTracks  # noqa: E402

pytestmark = pytest.mark.ros
SECONDS = 6.0
RATE = 10.0  # Hz


def params(name):
    return f'params:={get_package_share_directory("tactile_bringup")}/params/{name}'


@pytest.fixture
def run(ros2, listen):
    """Launches with some words, listens to a topic for so many s after its first message, then Ctrl-C; the stamps, s."""
    def run(words, topic, kind, seconds):
        launched = ros2('launch', 'tactile_bringup', 'touchpad.launch.py', f'rate:={RATE}', *words)
        ear = listen({topic: kind})
        assert ear.wait_for(lambda: ear.heard[topic], 60), launched.log
        ear.wait_for(lambda: launched.process.poll() is not None, seconds)
        assert launched.interrupt() == 0, launched.log
        assert launched.complaints == []
        return 1e-9 * np.array(ear.stamps(topic))
    return run


def check_rate(stamps, seconds):
    assert len(stamps) > 0.7 * RATE * seconds
    assert np.median(np.diff(stamps)) == pytest.approx(1 / RATE, rel=0.1)


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


def test_a_video_in_a_loop(run, video):
    stamps = run(['source:=file', f'path:={video}', params('marker_video.yaml'), 'loop:=true'], '/touchpad/dots', DotTracks, SECONDS)
    check_rate(stamps, SECONDS)


def test_a_bag_in_a_loop_begins_anew(run):
    run(['scene:=rest', 'record:=bag'], '/touchpad/contact_region', ContactRegion, 3.0)
    words = ['source:=bag', 'path:=bag', params('touchpad_sim.yaml'), 'loop:=true']
    stamps = run(words, '/touchpad/contact_region', ContactRegion, SECONDS)
    assert len(stamps) > 0.4 * RATE * SECONDS
    assert (np.diff(stamps) < -1.0).sum() >= 1


def test_a_launch_ends_with_its_recording_and_nothing_of_it_is_lost(ros2, listen, video, tmp_path):
    launched = ros2('launch', 'tactile_bringup', 'touchpad.launch.py', 'source:=file', f'path:={video}', params('marker_video.yaml'),
                    'record:=bag', 'rate:=4')
    ear = listen({'/diagnostics': DiagnosticArray})
    assert launched.wait(90) == 0, launched.log
    assert launched.complaints == [] and launched.log.count('the recording is over') == 1, launched.log
    said = {status.message.split(':')[0] for message in ear.heard['/diagnostics'] for status in message.status}
    assert 'ended' in said, said
    with BagReader(tmp_path / 'bag') as bag:
        last = [decode(message.data, message.type_name) for message in bag.messages({'/touchpad/dots'})][-1]
    assert np.median(last.du) == pytest.approx(6.0, abs=0.5), 'the last frame is recorded'


def test_an_unreadable_video_ends_the_launch_with_what_to_do(ros2, tmp_path):
    (tmp_path / 'press.mp4').write_text('no video')
    launched = ros2('launch', 'tactile_bringup', 'touchpad.launch.py', 'source:=file', 'path:=press.mp4')
    assert launched.wait(60) != 0
    assert 'ffmpeg' in launched.log and 'process started' not in launched.log, launched.log
