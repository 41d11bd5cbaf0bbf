# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From message to message: what nodes and process_bag both run."""

import pytest
from std_msgs.msg import Header
from tactile_perception.dots.stage import DotStage
from tactile_perception.errors import BadCalibration
from tactile_perception.nodes.messages.conversions import POINTS, RESULTS
from tactile_perception.touchpad.stage import ContactRegionStage


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


def test_only_what_is_asked_for_becomes_a_message(ball_messages):
    info, images, values, _ = ball_messages
    dots, contact = DotStage(values), ContactRegionStage(values)
    dots.take('camera_info', info), contact.take('camera_info', info)
    first, second = (dots.process(image)['dots'][0] for image in images[:2])
    assert list(contact.process(first, ['wrench'])) == ['wrench'] and contact.process(second, []) == {}


def test_a_missing_calibration_is_named_before_anything_runs(ball_messages, tmp_path):
    values = {**ball_messages[2], 'calibration': str(tmp_path / 'none.yaml')}
    for kind in (DotStage, ContactRegionStage):
        with pytest.raises(BadCalibration, match='none.yaml'):
            kind(values)
