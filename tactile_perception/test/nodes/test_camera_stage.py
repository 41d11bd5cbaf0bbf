# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From message to message: what nodes and process_bag both run."""
import contextlib
import copy

import numpy as np
import pytest

pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

from std_msgs.msg import Header  # noqa: E402
from tactile_perception.dots.stage import DotStage  # noqa: E402
from tactile_perception.errors import BadCalibration, BadFrame  # noqa: E402
from tactile_perception.nodes.messages.conversions import POINTS, RESULTS  # noqa: E402
from tactile_perception.touchpad.stage import ContactRegionStage  # noqa: E402

pytestmark = pytest.mark.ros


@pytest.fixture(scope='module')
def done(ball_messages):
    """Dots and results of each image."""
    info, images, values, _ = ball_messages
    dots, contact = DotStage(values), ContactRegionStage(values)
    for stage in (dots, contact):
        stage.take('camera_info', info)
    found = [dots.process(image)['dots'][0] for image in images]
    return found, [{topic: only for topic, (only,) in contact.process(message).items()} for message in found]


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
    dots, contact = DotStage(values), ContactRegionStage(values)
    assert dots.waits and dots.health()[0] == ''
    with pytest.raises(BadFrame, match='no camera_info'):
        dots.process(images[0])['dots'][0]
    dots.take('camera_info', info)
    assert not dots.waits
    message = dots.process(images[0])['dots'][0]
    with pytest.raises(BadFrame, match='no usable camera_info'):
        contact.process(message)


def test_only_what_is_asked_for_becomes_a_message(ball_messages):
    info, images, values, _ = ball_messages
    dots, contact = DotStage(values), ContactRegionStage(values)
    dots.take('camera_info', info), contact.take('camera_info', info)
    first, second = (dots.process(image)['dots'][0] for image in images[:2])
    assert list(contact.process(first, ['wrench'])) == ['wrench'] and contact.process(second, []) == {}


def test_the_same_camera_info_changes_nothing_another_begins_anew_with_the_next_image(ball_messages):
    info, images, values, _ = ball_messages
    dots = DotStage(values)
    dots.take('camera_info', info)
    dots.process(images[0])['dots'][0]
    stage, later = dots.estimator, copy.deepcopy(info)
    later.header.stamp.sec += 5
    dots.take('camera_info', later)
    dots.process(images[1])['dots'][0]
    assert dots.estimator is stage
    later.k = np.where(np.arange(9) == 2, later.k + 1, later.k)
    dots.take('camera_info', later)
    assert dots.estimator is stage, 'nothing of it has come yet'
    dots.process(images[2])['dots'][0]
    assert dots.estimator is not stage


@pytest.mark.parametrize('stray', [{'width': 320, 'height': 240}, {'k': np.zeros(9)}, {'k': np.zeros(9), 'width': 0, 'height': 0}])
def test_a_stray_camera_info_among_good_ones_changes_nothing(ball_messages, stray):
    info, images, values, _ = ball_messages
    dots, stages = DotStage(values), []
    other = copy.deepcopy(info)
    for name, value in stray.items():
        setattr(other, name, value)
    dots.take('camera_info', info)
    for image in images:
        dots.process(image)['dots'][0]
        stages.append(dots.estimator)
        with pytest.raises(BadFrame, match='k is zero') if 'k' in stray else contextlib.nullcontext():
            dots.take('camera_info', other)
    assert len(set(map(id, stages))) == 1


def test_images_have_to_be_of_camera_infos_size(ball_messages):
    info, images, values, _ = ball_messages
    dots, other = DotStage(values), copy.deepcopy(info)
    other.width, other.height = 320, 240
    dots.take('camera_info', other)
    with pytest.raises(BadFrame, match='image is 640 x 480 px, camera_info is for 320 x 240 px'):
        dots.process(images[0])['dots'][0]
    other.width = other.height = 0
    dots.take('camera_info', other)
    assert len(dots.process(images[0])['dots'][0].id) > 515


def test_a_missing_calibration_is_named_before_anything_runs(ball_messages, tmp_path):
    values = {**ball_messages[2], 'calibration': str(tmp_path / 'none.yaml')}
    for kind in (DotStage, ContactRegionStage):
        with pytest.raises(BadCalibration, match='none.yaml'):
            kind(values)
