# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Simulated scenes as recordings, and the calibrations that ship."""

from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
import yaml
from ament_index_python.packages import get_package_share_directory

from tactile_bringup import share
from tactile_bringup.simulate.bags import main, write_scene
from tactile_bringup.simulate.calibrations import calibrate_specimen
from tactile_driver.nodes.messages.conversions import stamp_ns_of
from tactile_driver.nodes.messages.ground_truth import TRUTH
from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_perception.core.messages import camera_matrices
from tactile_perception.press.calibration import read_touch
from tactile_perception.tools.process_bag import main as process_bag


def topics(path):
    """Topic -> number of its messages."""
    found = {}
    with BagReader(path) as bag:
        for raw in bag.messages():
            found[raw.topic] = found.get(raw.topic, 0) + 1
    return found


def test_each_kind_of_sensor_with_its_truth(tmp_path, capsys):
    assert main(['camera', 'areal_single_press', str(tmp_path / 'sheet'), '--rate', '1']) == 0
    frames = int(capsys.readouterr().out.split(':')[1].split()[0])
    found = topics(tmp_path / 'sheet')
    assert {found[f'/areal_single/{name}'] for name in ('image_raw', 'camera_info', *(f'ground_truth/{t}' for t in TRUTH))} == {frames}
    assert main(['taxel_array', 'rest', str(tmp_path / 'pad'), '--rate', '5', '--seed', '3']) == 0
    assert topics(tmp_path / 'pad')['/taxel_array/image_raw'] == 15
    assert main(['psd_finger', 'rest', str(tmp_path / 'finger'), '--rate', '100']) == 0
    assert topics(tmp_path / 'finger')['/psd_finger/voltages'] == 1000


def test_descriptions_and_frames_go_with_a_recording_as_ros2_bag_play_will_offer_them(tmp_path):
    bag, params = tmp_path / 'pad', get_package_share_directory('tactile_bringup') + '/params/taxel_array_sim.yaml'
    assert main(['taxel_array', 'rest', str(bag), '--rate', '5']) == 0
    assert process_bag([str(bag), str(tmp_path / 'estimates'), '--params', params]) == 0
    latched, passing = ('reliable', 'transient_local'), ('reliable', 'volatile')
    for path, raw in ((bag, '/taxel_array/image_raw'), (tmp_path / 'estimates', '/taxel_array/contacts')):
        about = yaml.safe_load((path / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
        topics_of = [topic['topic_metadata'] for topic in about['topics_with_message_count']]
        found = {topic['name']: [(qos['reliability'], qos['durability']) for qos in topic['offered_qos_profiles']] for topic in topics_of}
        assert about['ros_distro'] == 'jazzy'
        assert found['/taxel_array/description'] == found['/tf_static'] == [latched] and found[raw] == [passing]
        assert topics(path)['/taxel_array/description'] == topics(path)['/tf_static'] == 1


def test_what_is_wrong_is_said_in_one_line(tmp_path, capsys):
    assert main(['taxel_array', 'nowhere', str(tmp_path / 'bag')]) == 1
    said = capsys.readouterr().err
    assert said.startswith("simulate: simulation: scene 'nowhere' is unknown; choose one of ") and said.count('\n') == 1
    assert not (tmp_path / 'bag').exists()
    (tmp_path / 'bag').mkdir()
    assert main(['camera', 'areal_single_rest', str(tmp_path / 'bag')]) == 1 and 'exists' in capsys.readouterr().err


def messages_of(path):
    """Topic -> its messages."""
    found = defaultdict(list)
    with BagReader(path) as bag:
        for raw in bag.messages():
            found[raw.topic].append(decode(raw.data, raw.type_name))
    return found


def test_one_camera_with_truth(tmp_path):
    assert write_scene(tmp_path / 'bag', 'areal_single_press', 1.0, seed=4, namespace='sheet', frames=4) == 4
    found, scene = messages_of(tmp_path / 'bag'), open_scene('areal_single_press', 1.0, seed=4)
    about, tree = yaml.safe_load(found.pop('/sheet/description')[0].data), found.pop('/tf_static')[0].transforms
    assert about['sensor_type'] == 'areal_single' and about['source'] == 'sim' and (about['width'], about['height']) == (640, 480)
    assert [(reported.header.frame_id, reported.child_frame_id, stamp_ns_of(reported.header)) for reported in tree] == [('sheet',
                                                                                                               'sheet_camera_optical',
                                                                                                               10**9)]
    moved = tree[0].transform.translation
    np.testing.assert_allclose([moved.x, moved.y, moved.z], scene.camera.centre, atol=1e-12)
    assert set(found) == {f'/sheet/{name}' for name in ('image_raw', 'camera_info', *(f'ground_truth/{truth}' for truth in TRUTH))}
    assert [stamp_ns_of(image.header) for image in found['/sheet/image_raw']] == [10**9, 2 * 10**9, 3 * 10**9, 4 * 10**9]
    np.testing.assert_array_equal(image_to_array(found['/sheet/image_raw'][2]), scene.render(2.0).image)
    np.testing.assert_allclose(camera_matrices(found['/sheet/camera_info'][0])[0], scene.camera.matrix)
    touched = [len(message.contacts) for message in found['/sheet/ground_truth/contacts']]
    assert touched == [len(scene.observe(k).truth.contacts) for k in range(4)] == [0, 0, 1, 1]
    assert found['/sheet/ground_truth/wrench'][2].wrench.force.z == pytest.approx(scene.observe(2).truth.wrench[2])
    for topic, messages in found.items():
        frame = 'sheet' if '/ground_truth/' in topic else 'sheet_camera_optical'
        assert {message.header.frame_id for message in messages} == {frame}, topic


def test_two_cameras_the_second_a_little_late(tmp_path):
    write_scene(tmp_path / 'bag', 'areal_dual_press', 10.0, frames=2)
    found = messages_of(tmp_path / 'bag')
    lefts, rights = ([stamp_ns_of(image.header) for image in found[f'/areal_dual/{side}/image_raw']] for side in ('left', 'right'))
    assert len(lefts) == len(rights) == 2 and all(3e6 <= right - left <= 4e6 for left, right in zip(lefts, rights))
    assert [stamp_ns_of(message.header) for message in found['/areal_dual/ground_truth/contacts']] == lefts
    frames = ['areal_dual_left_camera_optical', 'areal_dual_right_camera_optical']
    assert [reported.child_frame_id for reported in found['/tf_static'][0].transforms] == frames
    assert [found[f'/areal_dual/{side}/image_raw'][0].header.frame_id for side in ('left', 'right')] == frames
    assert len(found['/areal_dual/left/camera_info']) == len(found['/areal_dual/right/camera_info']) == 2


LARGEST = 2_500_000  # bytes of a file that ships
SENSORS = ('areal_single', 'areal_dual', 'air_cushion')


def shipped(sensor):
    return Path(share('calibration', f'{sensor}_sim.yaml'))


@pytest.mark.parametrize('sensor', SENSORS)
def test_it_is_small_and_holds_the_best_method(sensor):
    found = read_touch(shipped(sensor), sensor)
    assert shipped(sensor).with_suffix('.npz').stat().st_size < LARGEST and len(shipped(sensor).read_text().splitlines()) <= 200
    assert list(found.methods) == [found.best] and np.isfinite(found.stiffness) and {found.best, 'wrench'} <= set(found.file.residuals)


def numbers_of(value):
    """All numbers in nested dictionaries, lists and arrays."""
    if isinstance(value, dict):
        value = list(value.values())
    return [number for part in value for number in numbers_of(part)] if isinstance(value, list) else list(np.ravel(value).astype(float))


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize('sensor', SENSORS)
def test_it_is_made_again_the_same(sensor, tmp_path):
    calibrate_specimen(sensor, tmp_path / 'again.yaml')
    again, ours = (read_touch(path, sensor) for path in (tmp_path / 'again.yaml', shipped(sensor)))
    assert again.best == ours.best
    np.testing.assert_allclose(*(numbers_of(file.file.fitted) for file in (again, ours)), rtol=1e-3, atol=1e-6)
