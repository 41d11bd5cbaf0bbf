# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')
from geometry_msgs.msg import TransformStamped  # noqa: E402
from tactile_driver.frame import Frame  # noqa: E402
from tactile_driver.nodes.messages.conversions import header_of, image_to_message  # noqa: E402
from tactile_driver.parameters.table import defaults  # noqa: E402
from tactile_perception.errors import BadArgument, BadFrame, ClockSetBack  # noqa: E402
from tactile_perception.taxel.stage import TaxelStage  # noqa: E402
from tactile_perception.taxel.parameters import TAXEL_PARAMETERS  # noqa: E402
from tf2_msgs.msg import TFMessage  # noqa: E402

VALUES = defaults(TAXEL_PARAMETERS)


def image(values, stamp=1.0):
    encoding = 'mono8' if values.dtype == np.uint8 else 'mono16'
    return image_to_message(Frame(values, 0, encoding), '', header_of(round(stamp * 1e9), 'pad'))


def pressed(level=100):
    values = np.full((44, 44), 3, np.uint8)
    values[15:30, 10:35] = level
    return values


@pytest.mark.parametrize('change', [dict(encoding='bgr8'), dict(step=40), dict(height=0), dict(height=45)])
def test_refused_images(change):
    message = image(pressed())
    for name, value in change.items():
        setattr(message, name, value)
    with pytest.raises(BadFrame):
        TaxelStage(VALUES).process(message)


def test_results_go_under_the_images_header():
    stage = TaxelStage(VALUES)
    for k in range(3):
        stage.process(image(np.full((44, 44), 3, np.uint8), 1 + 0.01 * k))
    found = only(stage.process(image(pressed(), 1.5)))
    assert {topic: message.header.stamp.nanosec for topic, message in found.items()} == dict.fromkeys(
        ('contact_region', 'contacts', 'slip', 'wrench', 'points'), 500_000_000)
    assert found['contact_region'].area == pytest.approx(375e-6, rel=0.1) and len(found['contacts'].contacts) == 1
    assert np.isnan(found['wrench'].wrench.force.z)


def test_the_object_can_change_while_it_runs():
    stage = TaxelStage(VALUES)
    stage.process(image(np.full((44, 44), 3, np.uint8), 1.0))
    stage.change(VALUES | {'object.depth': 4e-4})
    area = only(stage.process(image(pressed(), 1.1)))
    assert area['wrench'].wrench.force.z == pytest.approx(-3e5 / 0.002 * 4e-4 * area['contact_region'].area)
    with pytest.raises(BadArgument):
        stage.check_change(VALUES | {'object.gravity': [0.0, 0.0, 0.0]})


def only(found):
    """Topic -> its only message."""
    return {topic: message for topic, (message,) in found.items()}


def transforms(*links):
    message = TFMessage()
    for parent, child, turn, place in links:
        one = TransformStamped(child_frame_id=child)
        one.header.frame_id = parent
        one.transform.rotation.z, one.transform.rotation.w = np.sin(turn / 2), np.cos(turn / 2)
        one.transform.translation.x, one.transform.translation.y, one.transform.translation.z = place
        message.transforms.append(one)
    return message


def test_friction_follows_the_attitude_from_tf():
    """Equations 6 and 7: half of the weight, turned into the sensor frame; the moment by the centre of mass of the object's own frame."""
    known = {'object.weight': 4.0, 'object.depth': 4e-4, 'object.gravity': [0.0, -1.0, 0.0], 'object.gravity_frame': 'world',
             'object.centre_of_mass': [0.0, 0.02, 0.0], 'object.centre_of_mass_frame': 'object'}
    stage = TaxelStage(VALUES | known)
    stage.process(image(np.full((44, 44), 3, np.uint8), 1.0))
    force = only(stage.process(image(pressed(), 1.1)))['wrench'].wrench.force
    assert np.isnan(force.x) and np.isfinite(force.z) and "'pad'" in stage.health()[0] and 'object or world' in stage.health()[0]
    stage.take('/tf', transforms(('/world', 'wrist', np.pi / 2, (0.3, 0, 1)), ('wrist', '/pad', 0.0, (0, 0, 0.1)),
                                   ('pad', 'object', 0.0, (0.01, 0, 0))))
    assert stage.health()[0] == ''
    found = only(stage.process(image(pressed(), 1.2)))['wrench'].wrench
    # Gravity, along the world's -y, is along -x of a pad turned left; the centre of mass is at (0.01, 0.02).
    assert [found.force.x, found.force.y] == pytest.approx([-2.0, 0.0], abs=1e-9) and found.torque.z == pytest.approx(0.02 * 2.0)
    stage.take('/tf', transforms(('world', 'wrist', 0.0, (0.3, 0, 1))))
    found = only(stage.process(image(pressed(), 1.3)))['wrench'].wrench
    assert [found.force.x, found.force.y] == pytest.approx([0.0, -2.0], abs=1e-9) and found.torque.z == pytest.approx(-0.01 * 2.0)


def test_an_invalid_transform_is_refused_and_its_neighbours_are_taken():
    stage = TaxelStage(VALUES | {'object.weight': 4.0, 'object.gravity_frame': 'world'})
    stage.process(image(np.full((44, 44), 3, np.uint8), 1.0))
    with pytest.raises(BadFrame, match='elbow'):
        stage.take('/tf', transforms(('world', 'elbow', np.nan, (0, 0, 0)), ('world', 'pad', 0.0, (0, 0, 0))))
    assert np.isfinite(only(stage.process(image(pressed(), 1.1)))['wrench'].wrench.force.y)


def test_a_recording_that_begins_again():
    stage = TaxelStage(VALUES)
    stage.process(image(pressed(), 9.0))
    with pytest.raises(ClockSetBack):
        stage.process(image(pressed(), 1.0))
    assert not only(stage.process(image(pressed(), 1.1)))['contacts'].contacts
