# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')
from sensor_msgs.msg import Image  # noqa: E402
from tactile_driver.frame import Frame  # noqa: E402
from tactile_driver.nodes.conversions import header_of, image_to_message  # noqa: E402
from tactile_driver.nodes.parameters import defaults  # noqa: E402
from tactile_perception.errors import BadArgument, BadFrame, ClockSetBack  # noqa: E402
from tactile_perception.nodes.taxel_stages import TaxelMessages, taxel_values  # noqa: E402
from tactile_perception.pipeline.taxel_parameters import TAXEL_PARAMETERS  # noqa: E402

pytestmark = pytest.mark.ros
VALUES = defaults(TAXEL_PARAMETERS)


def image(values, stamp=1.0):
    encoding = 'mono8' if values.dtype == np.uint8 else 'mono16'
    return image_to_message(Frame(values, 0, encoding), '', header_of(round(stamp * 1e9), 'pad'))


def pressed(level=100):
    values = np.full((44, 44), 3, np.uint8)
    values[15:30, 10:35] = level
    return values


@pytest.mark.parametrize('kind', [np.uint8, np.uint16])
def test_all_bits_arrive(kind):
    values = np.arange(12).reshape(3, 4).astype(kind) * (20 if kind == np.uint8 else 5000)
    assert taxel_values(image(values)).tolist() == values.tolist()


def test_another_byte_order_and_longer_rows():
    message = Image(height=1, width=2, step=6, encoding='mono16', is_bigendian=1, data=bytes([1, 2, 3, 4, 9, 9]))
    assert taxel_values(message).tolist() == [[258, 772]]


@pytest.mark.parametrize('change', [dict(encoding='bgr8'), dict(step=40), dict(height=0), dict(height=45)])
def test_refused_images(change):
    message = image(pressed())
    for name, value in change.items():
        setattr(message, name, value)
    with pytest.raises(BadFrame):
        taxel_values(message)


def test_results_go_under_the_images_header():
    stage = TaxelMessages(VALUES)
    for k in range(3):
        stage.on_image(image(np.full((44, 44), 3, np.uint8), 1 + 0.01 * k))
    found = stage.on_image(image(pressed(), 1.5))
    assert {topic: message.header.stamp.nanosec for topic, message in found.items()} == dict.fromkeys(
        ('contact_region', 'contacts', 'slip', 'wrench'), 500_000_000)
    assert found['contact_region'].area == pytest.approx(375e-6, rel=0.1) and len(found['contacts'].contacts) == 1
    assert np.isnan(found['wrench'].wrench.force.z)


def test_the_object_can_be_told_while_it_runs():
    stage = TaxelMessages(VALUES)
    stage.on_image(image(np.full((44, 44), 3, np.uint8), 1.0))
    stage.set_object({'object.depth': 4e-4})
    area = stage.on_image(image(pressed(), 1.1))
    assert area['wrench'].wrench.force.z == pytest.approx(-3e5 / 0.002 * 4e-4 * area['contact_region'].area)
    with pytest.raises(BadArgument):
        stage.set_object({'object.gravity': [0.0, 0.0, 0.0]})


def test_a_recording_that_begins_again():
    stage = TaxelMessages(VALUES)
    stage.on_image(image(pressed(), 9.0))
    with pytest.raises(ClockSetBack):
        stage.on_image(image(pressed(), 1.0))
    assert not stage.on_image(image(pressed(), 1.1))['contacts'].contacts
