# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
from collections import defaultdict

import numpy as np
import pytest
import yaml
from tactile_bringup.simulate.bags import write_scene
from tactile_driver.errors import BadArgument
from tactile_driver.nodes.messages.ground_truth import TRUTH
from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_perception.nodes.messages.conversions import camera_matrices


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


def test_an_unknown_scene_is_named(tmp_path):
    with pytest.raises(BadArgument, match='areal_single_demo'):
        write_scene(tmp_path / 'bag', 'none', 1.0)
