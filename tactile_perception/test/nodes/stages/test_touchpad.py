# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From message to message: what nodes and process_bag both run."""
import contextlib
import copy

import numpy as np
import pytest

pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

from std_msgs.msg import Header  # noqa: E402
from tactile_perception.errors import BadCalibration, BadFrame  # noqa: E402
from tactile_perception.nodes.messages.point_cloud import POINTS  # noqa: E402
from tactile_perception.nodes.stages.touchpad import RESULTS, ContactMessages, DotMessages  # noqa: E402

pytestmark = pytest.mark.ros


@pytest.fixture(scope='module')
def done(ball_messages):
    """Dots and results of each image."""
    info, images, values, _ = ball_messages
    dots, contact = DotMessages(values), ContactMessages(values)
    for stage in (dots, contact):
        stage.on_camera_info(info)
    found = [dots.on_image(image) for image in images]
    return found, [contact.on_dots(message) for message in found]


def test_the_stamp_goes_through_and_the_frame_is_the_sensors(ball_messages, done):
    dots, results = done
    for image, message, result in zip(ball_messages[1], dots, results):
        wanted = Header(stamp=image.header.stamp, frame_id='touchpad')
        assert message.header == wanted and set(result) == {*RESULTS, 'points'}
        assert all(type(part) is (RESULTS | POINTS)[topic] and part.header == wanted for topic, part in result.items())


def test_a_ball_is_one_contact_and_rest_is_none(ball_messages, done):
    truth, results = ball_messages[3], done[1]
    for result in results[:2]:
        assert result['contacts'].contacts == [] and result['contact_region'].area == 0 and result['wrench'].wrench.force.z == 0
    contact, = results[2]['contacts'].contacts
    assert contact.depth == pytest.approx(truth.contacts[0].depth, abs=0.3e-3)
    assert contact.force == pytest.approx(truth.contacts[0].force, rel=0.15)
    assert results[2]['wrench'].wrench.force.z == pytest.approx(truth.wrench[2], rel=0.15)
    assert len(results[2]['contact_region'].outlines) == 1


def test_the_image_is_not_looked_at_before_its_camera_is_known(ball_messages):
    info, images, values, _ = ball_messages
    dots, contact = DotMessages(values), ContactMessages(values)
    assert dots.needs_camera and dots.suspicion == ''
    with pytest.raises(BadFrame, match='no camera_info'):
        dots.on_image(images[0])
    dots.on_camera_info(info)
    assert not dots.needs_camera
    message = dots.on_image(images[0])
    with pytest.raises(BadFrame, match='no usable camera_info'):
        contact.on_dots(message)


def test_only_what_is_asked_for_becomes_a_message(ball_messages):
    info, images, values, _ = ball_messages
    dots, contact = DotMessages(values), ContactMessages(values)
    dots.on_camera_info(info), contact.on_camera_info(info)
    first, second = (dots.on_image(image) for image in images[:2])
    assert list(contact.on_dots(first, ['wrench'])) == ['wrench'] and contact.on_dots(second, []) == {}


def test_without_a_surface_dots_need_no_camera(ball_messages):
    _, images, values, _ = ball_messages
    message = DotMessages({**values, 'surface': 'none'}).on_image(images[0])
    assert len(message.id) > 515 and len(message.x) == 0


def test_the_same_camera_info_changes_nothing_another_begins_anew_with_the_next_image(ball_messages):
    info, images, values, _ = ball_messages
    dots = DotMessages(values)
    dots.on_camera_info(info)
    dots.on_image(images[0])
    stage, later = dots.stage, copy.deepcopy(info)
    later.header.stamp.sec += 5
    dots.on_camera_info(later)
    dots.on_image(images[1])
    assert dots.stage is stage
    later.k = np.where(np.arange(9) == 2, later.k + 1, later.k)
    dots.on_camera_info(later)
    assert dots.stage is stage, 'nothing of it has come yet'
    dots.on_image(images[2])
    assert dots.stage is not stage


@pytest.mark.parametrize('stray', [{'width': 320, 'height': 240}, {'k': np.zeros(9)}, {'k': np.zeros(9), 'width': 0, 'height': 0}])
def test_a_stray_camera_info_among_good_ones_changes_nothing(ball_messages, stray):
    info, images, values, _ = ball_messages
    dots, stages = DotMessages(values), []
    other = copy.deepcopy(info)
    for name, value in stray.items():
        setattr(other, name, value)
    dots.on_camera_info(info)
    for image in images:
        dots.on_image(image)
        stages.append(dots.stage)
        with pytest.raises(BadFrame, match='k is zero') if 'k' in stray else contextlib.nullcontext():
            dots.on_camera_info(other)
    assert len(set(map(id, stages))) == 1


def test_images_have_to_be_of_camera_infos_size(ball_messages):
    info, images, values, _ = ball_messages
    dots, other = DotMessages(values), copy.deepcopy(info)
    other.width, other.height = 320, 240
    dots.on_camera_info(other)
    with pytest.raises(BadFrame, match='image is 640 x 480 px, camera_info is for 320 x 240 px'):
        dots.on_image(images[0])
    other.width = other.height = 0
    dots.on_camera_info(other)
    assert len(dots.on_image(images[0]).id) > 515


def test_a_missing_calibration_is_named_before_anything_runs(ball_messages, tmp_path):
    values = {**ball_messages[2], 'calibration': str(tmp_path / 'none.yaml')}
    for kind in (DotMessages, ContactMessages):
        with pytest.raises(BadCalibration, match='none.yaml'):
            kind(values)
