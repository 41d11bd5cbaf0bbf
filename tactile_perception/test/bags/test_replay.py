# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A replay tells all that comes of a bag in order; images and truth come together by their stamps."""
import math
from pathlib import Path

import cv2
import numpy as np
import pytest
from geometry_msgs.msg import TransformStamped
from taxel_bags import write_taxels
from tactile_driver.frame import Frame
from tactile_driver.nodes.messages.conversions import header_of, image_to_message
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import encode
from tactile_driver.recordings.writer import BagWriter
from tactile_perception.bags.replay import Replay
from tactile_perception.parameters.file import write_parameters
from tactile_perception.bags.stamped import TRUTH, find_prefix, pairs_of
from tactile_perception.errors import BadCalibration, BadRecording
from tf2_msgs.msg import TFMessage


def of(messages, topic):
    """The messages of a topic."""
    return [message for one in messages for message in one if message.topic == topic]


def test_estimates_come_frame_by_frame(tmp_path):
    bag = write_taxels(tmp_path / 'bag', 5, change=lambda k, m: encode(m)[1] if k != 2 else b'x')
    replay = Replay(bag, tmp_path / 'bag.yaml')
    each = [f'/pad/{name}' for name in ('contact_region', 'contacts', 'slip', 'wrench', 'points')]
    assert [[message.topic for message in messages] for messages in replay] == [each, each, [], each, each]
    assert replay.prefix == '/pad/' and replay.done == 5 and len(replay.stages['all']) == 4
    line, = replay.left_out.lines()
    assert line.startswith('1 of image_raw: ') and line.endswith('(first at 1.040 s)')


def test_transforms_tell_of_the_grasped_object_and_those_that_stay_are_written_again(tmp_path):
    link = TransformStamped(child_frame_id='pad')
    link.header.frame_id = 'world'
    link.transform.rotation.z, link.transform.rotation.w = math.sqrt(0.5), math.sqrt(0.5)
    object_known = {'object.weight': 2.0, 'object.gravity': [0.0, -1.0, 0.0], 'object.gravity_frame': 'world'}
    bag = write_taxels(tmp_path / 'bag', 20, first=[('/tf_static', TFMessage(transforms=[link]))], **object_known)
    messages = list(Replay(bag, tmp_path / 'bag.yaml'))
    assert {message.topic for one in messages for message in one} == {
        '/tf_static', *(f'/pad/{name}' for name in ('contact_region', 'contacts', 'slip', 'wrench', 'points'))}
    force = of(messages, '/pad/wrench')[-1].message.wrench.force
    assert [force.x, force.y] == pytest.approx([-1.0, 0.0], abs=1e-12)


def test_images_before_the_first_camera_info_are_done_too(tmp_path, pressed_bag):
    with BagReader(pressed_bag) as reader, BagWriter(tmp_path / 'bag') as writer:
        images = [m for m in reader.messages({'/touchpad/image_raw'})][:2]
        info = next(reader.messages({'/touchpad/camera_info'}))
        for message in images:
            writer.write(message.topic, message.type_name, message.stamp_ns, message.data)
        writer.write(info.topic, info.type_name, images[1].stamp_ns + 1, info.data)
    replay = Replay(tmp_path / 'bag', Path(f'{pressed_bag}.yaml'))
    assert len(of(replay, '/touchpad/contacts')) == 2 and not replay.left_out.total


def test_a_sensor_without_a_model_of_its_surface_has_dots(tmp_path):
    own = {'sensor_type': 'my_skin', 'surface': 'none', 'rows': 0, 'columns': 0, 'numbering': 'tracks'}
    write_parameters(tmp_path / 'my_skin.yaml', own)
    image = np.full((120, 160), 170, np.uint8)
    for k in range(12):
        cv2.circle(image, (20 + 38 * (k % 4), 20 + 38 * (k // 4)), 5, 40, -1, cv2.LINE_AA)
    image = cv2.GaussianBlur(image, (0, 0), 1.0)
    with BagWriter(tmp_path / 'bag') as writer:
        for k in range(1, 4):
            message = image_to_message(Frame(image, 10**8 * k, 'mono8'), '', header_of(10**8 * k, 'skin_camera_optical'))
            kind, data = encode(message)
            writer.write('/skin/image_raw', kind, 10**8 * k, data)
    dots = of(Replay(tmp_path / 'bag', tmp_path / 'my_skin.yaml'), '/skin/dots')
    assert [len(one.message.id) for one in dots] == [12] * 3


def test_each_image_comes_with_what_is_known_of_it(pressed_bag):
    infos = []
    found = list(pairs_of(pressed_bag, '', ('image_raw', TRUTH), infos.append))
    assert len(found) == len(infos) == 14
    for name, pair in found:
        assert pair['image_raw'].header.stamp == pair[TRUTH].header.stamp
        assert name.startswith('disc at ')
    assert [len(pair[TRUTH].contacts) for _, pair in found][0] == 0


def test_the_sensor_is_found_or_has_to_be_named():
    image = 'sensor_msgs/msg/Image'
    assert find_prefix({'/a/image_raw': image, '/a/dots': 'x'}, '') == '/a/'
    assert find_prefix({'/a/image_raw': image, '/b/image_raw': image}, 'b') == '/b/'
    assert find_prefix({'/a/left/image_raw': image, '/a/right/image_raw': image}, '', 'left/image_raw') == '/a/'
    with pytest.raises(BadRecording, match='--namespace'):
        find_prefix({'/a/image_raw': image, '/b/image_raw': image}, '')


def test_a_bag_without_truth_is_refused(pressed_bag, tmp_path):
    with BagReader(pressed_bag) as reader, BagWriter(tmp_path / 'bare') as writer:
        for raw in reader.messages({'/touchpad/image_raw'}):
            writer.write(raw.topic, raw.type_name, raw.stamp_ns, raw.data)
    with pytest.raises(BadCalibration, match='tool'):
        list(pairs_of(tmp_path / 'bare', '', ('image_raw', TRUTH), lambda _info: None))
