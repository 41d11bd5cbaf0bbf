# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A hand from its URDF: sensors, poses of links for joint positions, and one line for each fault."""
import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from tactile_bringup import share
from tactile_bringup.hand.configurations import main, rviz_configuration, text_parameters
from tactile_bringup.hand.description import read_hand
from tactile_bringup.parameters.table import MARKERS_PARAMETERS
from tactile_driver.errors import BadArgument

PALM = '<link name="palm"/><link name="finger"/><link name="tip"/>'
BEND = '<joint name="bend" type="revolute"><parent link="palm"/><child link="finger"/><origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/>' \
       '<axis xyz="0 2 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
MOUNT = '<joint name="mount" type="fixed"><parent link="finger"/><child link="tip"/><origin xyz="0 0 0.5"/></joint>'
TIP = '<tactile_sensor name="tip" type="psd_finger" link="tip">' \
      '<settings rate="500" calibration="tip.yaml" device=""/></tactile_sensor>'


def written(folder, *parts):
    path = folder / 'hand.urdf'
    path.write_text(f'<robot name="r">{"".join(parts)}</robot>')
    return path


def test_a_bending_finger_carries_its_sensor(tmp_path):
    hand = read_hand(written(tmp_path, PALM, BEND, MOUNT, TIP))
    sensor, = hand.sensors
    assert (hand.frame, sensor.name, sensor.type) == ('palm', 'tip', 'psd_finger')
    assert sensor.settings == {'rate': '500', 'calibration': str(tmp_path / 'tip.yaml')}
    assert sensor.xyz == pytest.approx((1, 0, 0.5)), 'at joint position 0'
    rotation, origin = hand.pose(sensor, {'bend': 0.3})
    # The axis is y of the finger, which is -x of the palm.
    assert origin == pytest.approx([1, 0.5 * np.sin(0.3), 0.5 * np.cos(0.3)])
    expected = Rotation.from_rotvec([-0.3, 0, 0]) * Rotation.from_rotvec([0, 0, np.pi / 2])
    assert (rotation.inv() * expected).magnitude() < 1e-12
    assert hand.pose(sensor, {}) is None, 'a joint whose position is unknown'


def test_a_joint_that_mimics_another_needs_no_position_of_its_own(tmp_path):
    follow = BEND.replace('bend', 'follow').replace('palm', 'finger', 1).replace('child link="finger"', 'child link="tip"').replace(
        '<axis', '<mimic joint="bend" multiplier="-2" offset="0.1"/><axis')
    robot = read_hand(written(tmp_path, PALM, BEND, follow, TIP)).robot
    assert robot.positioned == ('bend',) and robot.limits == {'bend': (-1.0, 1.0)}
    turned = robot.pose('tip', {'bend': 0.2})[0] * robot.pose('finger', {'bend': 0.2})[0].inv()
    assert turned.magnitude() == pytest.approx((Rotation.from_rotvec([0, 0, np.pi / 2]) * Rotation.from_rotvec([0, -0.3, 0])).magnitude())


@pytest.mark.parametrize(('parts', 'reported'), [
    ((PALM, BEND, MOUNT), 'holds no tactile_sensor'),
    ((PALM, BEND, MOUNT, TIP.replace('link="tip"', 'link="top"')), 'sensor tip: there is no link top; the links are palm, finger, tip'),
    ((PALM, BEND, MOUNT, TIP.replace('link="tip"', 'link="finger"')), 'its link is finger, but must have the name of the sensor frame'),
    ((PALM, BEND, MOUNT, TIP, TIP), 'sensor tip: its name is taken'),
    ((PALM, BEND, MOUNT, MOUNT, TIP, TIP), 'sensor tip: its name is taken'),
    ((PALM, BEND, MOUNT, TIP.replace('psd_finger', 'nose')), "sensor tip: type 'nose' is unknown; choose one of touchpad, "),
    ((PALM, BEND, MOUNT, TIP.replace('rate', 'speed')), "sensor tip: setting 'speed' is unknown; known are calibration, "),
    ((PALM, BEND, MOUNT, BEND, TIP), 'link finger is the child of two joints, bend and bend'),
    ((PALM, BEND, TIP), 'one link must have no parent, but palm, tip has none'),
    ((PALM, BEND.replace('palm', 'wrist'), MOUNT, TIP), 'joint bend: there is no link wrist; the links are palm, finger, tip'),
    ((PALM, BEND.replace('revolute', 'floating'), MOUNT, TIP), 'joint bend: the type is floating; known are fixed, revolute,'),
    ((PALM, BEND.replace('0 2 0', '0 0 0'), MOUNT, TIP), 'joint bend: its axis has length 0'),
    ((PALM, BEND.replace('0 2 0', '0 2'), MOUNT, TIP), "joint bend: xyz is '0 2', but must be of 3 numbers"),
    ((PALM, BEND.replace('<axis', '<mimic joint="knee"/><axis'), MOUNT, TIP), 'joint bend: there is no joint knee that it could mimic'),
    ((PALM, BEND, MOUNT.replace('name="mount" ', ''), TIP), 'a joint: name is missing'),
    (('<link name="root"/>', PALM, BEND.replace('palm', 'tip'), MOUNT, TIP), 'one link must have no parent, but root, palm has none'),
    ((PALM, '<link'), 'is not valid XML')])
def test_what_is_wrong_with_a_description_is_reported_in_one_line(tmp_path, parts, reported):
    path = written(tmp_path, *parts)
    with pytest.raises(BadArgument) as raised:
        read_hand(path)
    assert str(raised.value).startswith(f'hand {path}: ') and reported in str(raised.value) and '\n' not in str(raised.value)


def test_joints_in_a_circle(tmp_path):
    circle = MOUNT + MOUNT.replace('mount', 'back').replace('parent link="finger"', 'parent link="tip"').replace(
        'child link="tip"', 'child link="finger"')
    with pytest.raises(BadArgument, match='form a circle'):
        read_hand(written(tmp_path, PALM, circle, TIP))


@pytest.mark.parametrize(('name', 'sensors', 'joints'), [
    ('gripper', {'array': 'taxel_array', 'pad': 'touchpad'}, ('left_finger_joint',)),
    ('three_fingers', {'thumb_pad': 'touchpad', 'index_pad': 'touchpad', 'ring_tip': 'psd_finger', 'ring_array': 'taxel_array',
                       'palm': 'areal_single'}, ('thumb_base', 'index_base', 'ring_base'))])
def test_the_examples_that_ship(name, sensors, joints):
    hand = read_hand(share('urdf', f'{name}.urdf.xacro'))
    assert {sensor.name: sensor.type for sensor in hand.sensors} == sensors
    assert hand.robot.positioned == joints
    rows = {row.name: row for row in MARKERS_PARAMETERS}
    for values in (text_parameters(hand, sensor) for sensor in hand.sensors):
        assert all(rows[name].lowest <= number <= rows[name].highest for name, own in values.items() for number in np.ravel(own))


def test_the_sensors_of_the_gripper_face_each_other_and_move_apart():
    hand = read_hand(share('urdf', 'gripper.urdf.xacro'))
    gaps = []
    for position in (-0.02, 0.02):
        array, pad = (hand.pose(sensor, {'left_finger_joint': position}) for sensor in hand.sensors)
        assert array[0].apply([0, 0, 1]) == pytest.approx(-pad[0].apply([0, 0, 1]))
        gaps.append((pad[1] - array[1]) @ array[0].apply([0, 0, 1]))
    assert gaps[0] == pytest.approx(gaps[1] + 0.08) and gaps[1] > 0.02, 'with room for the cap of the touchpad and an object'


def test_a_xacro_file_with_a_fault_says_where(tmp_path):
    path = tmp_path / 'hand.urdf.xacro'
    path.write_text('<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:nothing_known/></robot>')
    with pytest.raises(BadArgument, match=r'hand\.urdf\.xacro: xacro cannot expand it: .*nothing_known'):
        read_hand(path)


def test_a_yaml_hand_becomes_a_description_of_the_same_hand(tmp_path):
    (tmp_path / 'my.yaml').write_text(yaml.safe_dump({'sensors': [
        {'name': 'left/pad', 'type': 'touchpad', 'xyz': [0.1, 0.2, 0.3], 'rpy': [0.1, 0.2, 0.3], 'calibration': 'pad.yaml', 'rate': 60},
        {'name': 'tip', 'type': 'psd_finger', 'parent': 'left_pad', 'xyz': [0, 0, 0.05]},
        {'name': 'dome', 'type': 'pins', 'parent': 'wrist'}]}))
    assert main([str(tmp_path / 'my.yaml'), str(tmp_path)]) == 0
    given, described = (read_hand(tmp_path / name) for name in ('my.yaml', 'my.urdf.xacro'))
    for one, other in zip(given.sensors[:2], described.sensors):
        assert (one.name, one.type, one.settings) == (other.name, other.type, other.settings)
        a, b = given.pose(one, {}), described.pose(other, {})
        assert a[1] == pytest.approx(b[1], abs=1e-8) and (a[0].inv() * b[0]).magnitude() < 1e-7
    assert described.sensors[2].type == 'pins' and 'wrist' in described.robot.joints


def test_rviz_shows_the_model_of_a_described_hand_alone(tmp_path):
    def displays(path):
        return [display['Class'] for display in yaml.safe_load(rviz_configuration(read_hand(path)))['Visualization Manager']['Displays']]
    model = 'rviz_default_plugins/RobotModel'
    assert model in displays(share('urdf', 'gripper.urdf.xacro')) and model not in displays(share('hands', 'example_hand.yaml'))
