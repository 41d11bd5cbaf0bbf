# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Each launch file with the real RViz on a virtual screen, and the real rosbag2, where they are installed."""
import os
import pathlib
import shutil
import subprocess
import sys
import time

import cv2
import numpy as np
import pytest
import yaml
from ament_index_python.packages import get_package_share_directory
from sensor_msgs.msg import Image
from visualization_msgs.msg import MarkerArray
from waiting import until

from tactile_bringup.hand.configurations import moved_file, rviz_configuration
from tactile_bringup.hand.description import read_hand
from tactile_msgs.msg import Contacts

MISSING = [name for name in ('rviz2', 'Xvfb', 'xdotool', 'import') if shutil.which(name) is None]
pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(MISSING), reason=f'not installed: {", ".join(MISSING)}')]
SHARE = pathlib.Path(get_package_share_directory('tactile_bringup'))
KINDS = {'MarkerArray': MarkerArray, 'Image': Image}
# launch file -> arguments: rates that RViz, which draws without a graphics card, and the sensor reach together on two cores
LAUNCHED = {'touchpad': ['rate:=5'], 'areal_single': ['rate:=5'], 'areal_dual': ['rate:=3'], 'air_cushion': ['rate:=3'],
            'gel': ['rate:=2'], 'photometric_gel': ['rate:=2'], 'pins': ['rate:=2'], 'psd_finger': ['rate:=200'],
            'taxel_array': ['rate:=5'], 'force_taxels': ['rate:=50'], 'hand': []}
SIZE = 1600, 960  # px, of the window
GROUND = 38, 32, 32  # BGR, of the 3D view
WARNING = 26, 209, 255  # BGR
PATIENCE_S = 90
# where the real rosbag2_py and `ros2 bag` are; only `ros2 bag` gets this path: other messages may lie there too
_PYTHON = pathlib.Path('lib', f'python3.{sys.version_info.minor}', 'site-packages')
ROSBAG2 = [prefix / _PYTHON for prefix in map(pathlib.Path, os.environ.get('AMENT_PREFIX_PATH', '').split(':'))
           if (prefix / _PYTHON / 'ros2bag').is_dir()]


@pytest.fixture
def screen(monkeypatch):
    """A virtual screen for what is started after it. Without -noreset it refuses connections for a moment after each last window."""
    reading, writing = os.pipe()
    process = subprocess.Popen(['Xvfb', '-displayfd', str(writing), '-noreset', '-screen', '0', '1680x1050x24', '-nolisten', 'tcp'],
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, pass_fds=[writing])
    os.close(writing)
    with open(reading) as ready:
        number = ready.readline().strip()  # a free one, which Xvfb writes when it accepts connections
    assert number, 'Xvfb ended at once'
    monkeypatch.setenv('DISPLAY', f':{number}')
    yield
    process.terminate()
    process.wait(10)


def window():
    """The number of RViz's window, '' before it is there."""
    found = subprocess.run(['xdotool', 'search', '--onlyvisible', '--name', ' - RViz'], capture_output=True, text=True).stdout.split()
    return found[0] if found else ''


def size_of(number):
    shown = subprocess.run(['xdotool', 'getwindowgeometry', '--shell', number], capture_output=True, text=True, check=True).stdout
    values = dict(line.split('=') for line in shown.split())
    return int(values['WIDTH']), int(values['HEIGHT'])


def view_of(number, path):
    """The 3D view (H, W, 3) BGR in a picture of the window, left at path: the box of the pixels that have its background colour."""
    subprocess.run(['import', '-window', number, str(path)], check=True)
    picture = cv2.imread(str(path), cv2.IMREAD_COLOR)
    ground = (picture == GROUND).all(axis=2)
    rows, columns = np.flatnonzero(ground.mean(axis=1) > 0.1), np.flatnonzero(ground.mean(axis=0) > 0.1)
    assert len(rows) and len(columns), 'there is no 3D view'
    return picture[rows[0]:rows[-1] + 1, columns[0]:columns[-1] + 1]


def letters(view):
    """(H, W) whether a pixel is as bright as a text or as yellow as a warning; grid, axes and sensors are neither."""
    return (view >= 250).all(axis=2) | (np.abs(view.astype(int) - WARNING) < 12).all(axis=2)


def shown_by(name):
    """(topic, type) of the enabled displays."""
    text = rviz_configuration(read_hand(SHARE / 'hands' / 'example_hand.yaml')) if name == 'hand' else \
        moved_file(name, name, name)
    displays = yaml.safe_load(text)['Visualization Manager']['Displays']
    return {each['Topic']['Value']: KINDS[each['Class'].split('/')[1]] for each in displays if each['Enabled'] and 'Topic' in each}


@pytest.mark.parametrize('name', LAUNCHED)
def test_rviz_shows_a_sensor_and_a_hand(ros2, listen, screen, tmp_path, name):
    picture = tmp_path / f'{name}.png'
    topics = shown_by(name)
    ear = listen(topics)
    launched = ros2('launch', 'tactile_bringup', f'{name}.launch.py', 'rviz:=true', *LAUNCHED[name])
    assert until(window, patience_s=PATIENCE_S), launched.log
    number = window()

    def taken():
        return {topic for topic in topics if any(info.node_name == 'rviz2' for info in ear.node.get_subscriptions_info_by_topic(topic))}
    assert ear.wait_for(lambda: taken() == set(topics), PATIENCE_S), set(topics) - taken()
    assert ear.wait_for(lambda: all(ear.heard.values()), PATIENCE_S), [topic for topic, heard in ear.heard.items() if not heard]
    assert size_of(number) == SIZE
    written = until(lambda: letters(view_of(number, picture)).sum() > 30, patience_s=PATIENCE_S)  # of a name alone 45
    view = view_of(number, picture)
    assert written, 'no text in the 3D view'
    assert view.shape[0] > 600 and view.shape[1] > 500
    assert (view != GROUND).any(axis=2).mean() > 0.02, 'more than a grid'
    for _ in range(5):
        found = letters(view_of(number, picture))
        edge = np.concatenate([found[0], found[-1], found[:, 0], found[:, -1]])
        assert not edge.any(), 'text is cut off by the edge of the view'
        time.sleep(2.0)
    rviz = [line for line in launched.log.splitlines() if line.startswith('[rviz2')]
    assert rviz and not [line for line in rviz if 'ERROR' in line or 'FATAL' in line]
    launched.interrupt()


@pytest.mark.skipif(not ROSBAG2, reason='not installed: ros2bag')
def test_rosbag2_records_a_launch_and_plays_it_into_another(ros2, listen, tmp_path, monkeypatch):
    def ros2_bag(*words):
        with monkeypatch.context() as patch:
            patch.setenv('PYTHONPATH', str(ROSBAG2[0]), prepend=os.pathsep)
            return ros2('bag', *words)

    bag, raw = tmp_path / 'bag', [f'/areal_dual/{side}/image_raw' for side in ('left', 'right')]
    launched = ros2('launch', 'tactile_bringup', 'areal_dual.launch.py', 'rate:=3')
    ear = listen(dict.fromkeys(raw, Image))
    recorder = ros2_bag('record', '-o', str(bag), '--topics', *raw)
    assert ear.wait_for(lambda: all(ear.node.count_subscribers(topic) == 2 for topic in raw), PATIENCE_S), recorder.log
    before = {topic: len(heard) for topic, heard in ear.heard.items()}
    assert ear.wait_for(lambda: all(len(ear.heard[topic]) >= before[topic] + 20 for topic in raw), PATIENCE_S), launched.log
    recorder.interrupt()
    launched.interrupt()
    assert (bag / 'metadata.yaml').exists(), recorder.log
    found = listen({'/again/contacts': Contacts})
    again = ros2('launch', 'tactile_bringup', 'areal_dual.launch.py', 'namespace:=again', 'source:=topics', f'topic:={raw[0]}',
                 f'right_topic:={raw[1]}', f'params:={SHARE / "params" / "areal_dual_sim.yaml"}',
                 f'calibration:={SHARE / "calibration" / "areal_dual_sim.yaml"}')
    assert found.wait_for(lambda: all(found.node.count_subscribers(topic) == 2 for topic in raw), PATIENCE_S), again.log
    player = ros2_bag('play', str(bag), '--delay', '3')  # s, until the subscribers have found it
    assert player.wait(PATIENCE_S) == 0, player.log
    assert found.wait_for(lambda: len(found.heard['/again/contacts']) >= 10, 30), again.log
