# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Simulated scenes as recordings, and the calibrations that ship."""

from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
import yaml
from ament_index_python.packages import get_package_share_directory
from tactile_bringup.installed import share
from tactile_bringup.simulate.bags import main, write_psd_scene, write_scene, write_taxel_scene
from tactile_bringup.simulate.calibrations import calibrate_specimen, main as main_calibrations
from tactile_driver.nodes.messages.ground_truth import TRUTH
from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_perception.press.calibration import read_touch
from tactile_perception.nodes.messages.conversions import camera_matrices
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


def stamp_ns(message):
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def test_one_camera_with_truth(tmp_path):
    assert write_scene(tmp_path / 'bag', 'areal_single_press', 1.0, seed=4, namespace='sheet', frames=4) == 4
    found, scene = messages_of(tmp_path / 'bag'), open_scene('areal_single_press', 1.0, seed=4)
    about, tree = yaml.safe_load(found.pop('/sheet/description')[0].data), found.pop('/tf_static')[0].transforms
    assert about['sensor_type'] == 'areal_single' and about['source'] == 'sim' and (about['width'], about['height']) == (640, 480)
    assert [(told.header.frame_id, told.child_frame_id, stamp_ns(told)) for told in tree] == [('sheet', 'sheet_camera_optical', 10**9)]
    moved = tree[0].transform.translation
    np.testing.assert_allclose([moved.x, moved.y, moved.z], scene.camera.centre, atol=1e-12)
    assert set(found) == {f'/sheet/{name}' for name in ('image_raw', 'camera_info', *(f'ground_truth/{truth}' for truth in TRUTH))}
    assert [stamp_ns(image) for image in found['/sheet/image_raw']] == [10**9, 2 * 10**9, 3 * 10**9, 4 * 10**9]
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
    lefts, rights = ([stamp_ns(image) for image in found[f'/areal_dual/{side}/image_raw']] for side in ('left', 'right'))
    assert len(lefts) == len(rights) == 2 and all(3e6 <= right - left <= 4e6 for left, right in zip(lefts, rights))
    assert [stamp_ns(message) for message in found['/areal_dual/ground_truth/contacts']] == lefts
    frames = ['areal_dual_left_camera_optical', 'areal_dual_right_camera_optical']
    assert [told.child_frame_id for told in found['/tf_static'][0].transforms] == frames
    assert [found[f'/areal_dual/{side}/image_raw'][0].header.frame_id for side in ('left', 'right')] == frames
    assert len(found['/areal_dual/left/camera_info']) == len(found['/areal_dual/right/camera_info']) == 2


def contacts_in(bag, topic):
    with BagReader(bag) as reader:
        return {raw.stamp_ns: decode(raw.data, raw.type_name).contacts for raw in reader.messages({f'/psd_finger/{topic}'})}


@pytest.mark.full
def test_the_calibration_that_ships_tells_where_a_touch_is(tmp_path):
    assert write_psd_scene(tmp_path / 'bag', 'grid', 1000.0) > 11_000
    words = ['--params', share('params', 'psd_finger_sim.yaml'), '--calibration', share('calibration', 'psd_finger_sim.yaml')]
    assert process_bag([str(tmp_path / 'bag'), str(tmp_path / 'out'), *words]) == 0
    told, true = (contacts_in(tmp_path / 'out', topic) for topic in ('contacts', 'ground_truth/contacts'))
    both = [(told[s][0], true[s][0]) for s in told if told[s] and true.get(s)]
    error = [np.degrees(np.linalg.norm([getattr(a.normal, k) - getattr(b.normal, k) for k in 'xyz'])) for a, b in both]
    assert len(both) > 500 and np.median(error) < 0.6
    assert np.median([abs(a.force / b.force - 1) for a, b in both]) < 0.15


def told(bag, topic):
    with BagReader(bag) as reader:
        return {raw.stamp_ns: decode(raw.data, raw.type_name) for raw in reader.messages({f'/taxel_array/{topic}'})}


@pytest.mark.full
def test_the_calibration_that_ships_tells_region_force_and_slip(tmp_path):
    assert write_taxel_scene(tmp_path / 'bag', 'turn', 50.0) == 230
    words = ['--params', share('params', 'taxel_array_sim.yaml'), '--calibration', share('calibration', 'taxel_array_sim.yaml')]
    assert process_bag([str(tmp_path / 'bag'), str(tmp_path / 'out'), *words]) == 0
    found = {topic: told(tmp_path / 'out', topic) for topic in ('contact_region', 'slip', 'wrench')}
    true = {topic: told(tmp_path / 'out', f'ground_truth/{topic}') for topic in found}
    held = [stamp for stamp, message in true['wrench'].items() if -message.wrench.force.z > 5]
    force = [found['wrench'][s].wrench.force.z / true['wrench'][s].wrench.force.z - 1 for s in held]
    assert np.median(np.abs(force)) < 0.06
    area = [found['contact_region'][s].area / true['contact_region'][s].area - 1 for s in held]
    assert np.median(np.abs(area)) < 0.1
    states = np.array([(true['slip'][s].state, found['slip'][s].state) for s in held])
    assert np.mean(states[:, 0] == states[:, 1]) > 0.8
    gross = [s for s in held if true['slip'][s].state == 2 == found['slip'][s].state]
    turn = [found['slip'][s].velocity.angular.z / true['slip'][s].velocity.angular.z - 1 for s in gross[5:]]
    assert np.median(np.abs(turn)) < 0.15
    centre = [np.hypot(found['slip'][s].rotation_center.x, found['slip'][s].rotation_center.y) for s in gross]
    assert np.nanmedian(centre) < 2e-3


LARGEST = 2_000_000  # bytes of a file that ships
# sensor: errors (m) of place and depth in the median over the frames of one press
SENSORS = {'areal_single': (0.5e-3, 0.2e-3), 'areal_dual': (0.6e-3, 0.1e-3), 'air_cushion': (3e-3, 3e-3)}


def shipped(sensor):
    return Path(share('calibration', f'{sensor}_sim.yaml'))


def contacts_in_calibrations(bag, sensor, topic):
    """Contacts of each frame, by stamp."""
    with BagReader(bag) as reader:
        return {raw.stamp_ns: decode(raw.data, raw.type_name).contacts for raw in reader.messages({f'/{sensor}/{topic}'})}


@pytest.mark.parametrize('sensor', SENSORS)
@pytest.mark.full
def test_the_calibration_that_ships_tells_where_a_press_is(sensor, tmp_path):
    write_scene(tmp_path / 'bag', f'{sensor}_press', 5.0, frames=16)
    params = share('params', f'{sensor}_sim.yaml')
    assert process_bag([str(tmp_path / 'bag'), str(tmp_path / 'out'), '--params', params, '--calibration', str(shipped(sensor))]) == 0
    told, true = (contacts_in_calibrations(tmp_path / 'out', sensor, topic) for topic in ('contacts', 'ground_truth/contacts'))
    assert not [stamp for stamp in told if told[stamp] and not true[stamp]]
    pairs = [(told[stamp], true[stamp]) for stamp in told if true[stamp]]
    assert len(pairs) > 4 and all(len(ours) == 1 for ours, _ in pairs[2:])
    places = np.array([[(c.position.x, c.position.y, c.depth) for c in (ours[0], its[0])] for ours, its in pairs if ours])
    off = np.abs(places[:, 0] - places[:, 1])
    assert np.median(np.hypot(*off[:, :2].T)) < SENSORS[sensor][0] and np.median(off[:, 2]) < SENSORS[sensor][1]


@pytest.mark.parametrize('sensor', SENSORS)
def test_it_is_small_and_holds_the_best_method(sensor):
    found = read_touch(shipped(sensor), sensor)
    assert shipped(sensor).with_suffix('.npz').stat().st_size < LARGEST and len(shipped(sensor).read_text().splitlines()) <= 200
    assert list(found.methods) == [found.best] and np.isfinite(found.stiffness) and len(found.file.residuals) > 2


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


def test_an_unknown_type_is_one_line(tmp_path, capsys):
    assert main_calibrations([str(tmp_path), 'touchpad']) == 1
    assert capsys.readouterr().err.count('\n') == 1
