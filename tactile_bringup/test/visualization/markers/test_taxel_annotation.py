# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The annotated image of an array shows values, the region, contacts and the slip where they are."""
import numpy as np
import pytest
from geometry_msgs.msg import Point, Point32, Polygon, Vector3, WrenchStamped
from tactile_bringup.nodes.taxel_markers_node import coloured, taxel_annotation
from tactile_bringup.visualization.pictures import annotate
from tactile_msgs.msg import Contact, ContactRegion, Contacts, Slip

SIZES = {'pitch': 1e-3, 'flow_scale': 0.5}


def messages():
    """A square of 10 mm about (5, 2) mm that slips at 4 mm/s along x."""
    corners = [Point32(x=x, y=y) for x, y in ((0.0, -3e-3), (0.01, -3e-3), (0.01, 7e-3), (0.0, 7e-3))]
    region = ContactRegion(outlines=[Polygon(points=corners)], area=1e-4, centroid=Point(x=5e-3, y=2e-3))
    slip = Slip(state=Slip.GROSS)
    slip.velocity.linear, slip.velocity.angular = Vector3(x=4e-3), Vector3(z=float('nan'))
    wrench = WrenchStamped()
    wrench.wrench.force.z = -3.0
    contacts = Contacts(contacts=[Contact(position=Point(x=5e-3, y=2e-3))])
    return {'contact_region': region, 'contacts': contacts, 'slip': slip, 'wrench': wrench}


def test_everything_lies_where_it_is():
    what = taxel_annotation(messages(), (44, 44), SIZES)
    assert what.outlines[0][0] == pytest.approx([21.5, 18.5]) and what.contacts[0] == pytest.approx([26.5, 23.5])
    assert what.duv[0] == pytest.approx([2.0, 0.0]) and what.uv[0] == pytest.approx([28.5, 23.5])
    assert what.text == ['1 contact, 100 mm2, 3.0 N', 'gross slip']


def test_nothing_is_said_of_what_is_not_known():
    what = taxel_annotation({}, (44, 44), SIZES)
    assert what.text == ['nothing touches', ''] and not what.outlines and not len(what.uv) and not len(what.contacts)
    still = messages()
    still['slip'].state = Slip.NONE
    assert not len(taxel_annotation(still, (44, 44), SIZES).uv)


def test_values_have_colours_and_the_picture_is_large_and_bright():
    values = np.zeros((44, 44), np.uint8)
    values[19:29, 22:32] = 100
    colour = coloured(values, 120.0)
    assert colour.shape == (44, 44, 3) and (colour[24, 27] != colour[0, 0]).any()
    picture = annotate(colour, taxel_annotation(messages(), (44, 44), SIZES))
    assert picture.shape[1] >= 600 and picture.shape[0] > picture.shape[1]
