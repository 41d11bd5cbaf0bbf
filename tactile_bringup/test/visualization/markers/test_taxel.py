# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from geometry_msgs.msg import Point, Vector3, WrenchStamped
from std_msgs.msg import Header
from tactile_bringup.nodes.taxel_markers_node import TaxelMarkers
from tactile_bringup.visualization import pictures as colours
from tactile_driver.frame import Frame
from tactile_driver.nodes.messages.conversions import image_to_message, polygon
from tactile_msgs.msg import Contact, ContactRegion, Contacts, Slip
from visualization_msgs.msg import Marker

SIZES = {'pitch': 1e-3, 'cell_height': 2e-3, 'full_value': 100.0, 'normal_length': 6e-3, 'force_length': 9e-3, 'full_force': 10.0,
         'full_torque': 1.0, 'flow_scale': 0.5}
HEADER = Header(frame_id='pad')
SQUARE = np.array([[-2, -2, 0], [2, -2, 0], [2, 2, 0], [-2, 2, 0]]) * 1e-3


def region(**more):
    return ContactRegion(header=HEADER, outlines=[polygon(SQUARE)], holes=[polygon(0.5 * SQUARE)], major_axis=4e-3, minor_axis=2e-3,
                         centroid=Point(x=1e-3), **more)


def slipping():
    message = Slip(header=HEADER, state=Slip.GROSS, x=[0.0, 1e-3], y=[0.0, 0.0], vx=[0.02, float('nan')], vy=[0.0, 0.0])
    message.rotation_center.x = float('nan')
    return message


def drawn(markers, **found):
    return {m.ns: m for m in markers.frame(HEADER, found).markers if m.action == Marker.ADD}


def test_pressed_taxels_are_squares_in_full_colour_on_a_plate():
    values = np.zeros((3, 4), np.uint8)
    values[1, 2], values[2, 3] = 100, 1
    found = drawn(TaxelMarkers(SIZES), image_raw=image_to_message(Frame(values, 0, 'mono8'), '', HEADER))
    plate, cells = (np.array([(p.x, p.y, p.z) for p in found[ns].points]) for ns in ('plate', 'cells'))
    assert np.ptp(plate, axis=0) == pytest.approx((4e-3, 3e-3, 0)) and np.ptp(cells, axis=0) == pytest.approx((1e-3, 1e-3, 0))
    assert len(plate) == len(cells) == 6 and cells[:, :2].mean(axis=0) == pytest.approx((0.5e-3, 0.0)), 'of row 1, column 2'
    assert plate[:, 2].max() < cells[:, 2].min() < 0, 'under the outlines, at z = 0'
    for ns, share in (('plate', 0.0), ('cells', 1.0)):
        assert found[ns].type == Marker.TRIANGLE_LIST and len(found[ns].colors) == 2, 'one a triangle: RViz does not light it'
        full = colours.of_depth(np.array([share]))[0]
        assert [(c.r, c.g, c.b) for c in found[ns].colors] == [pytest.approx(full)] * 2


def test_of_many_pressed_taxels_blocks_are_drawn_over_the_same_place():
    values = np.zeros((100, 80), np.uint8)
    values[10:90, 20:60] = 100
    cells = drawn(TaxelMarkers(SIZES), image_raw=image_to_message(Frame(values, 0, 'mono8'), '', HEADER))['cells']
    corners = np.array([(p.x, p.y) for p in cells.points])
    assert 6 * 100 < len(corners) < 6 * 800
    assert corners.min(axis=0) == pytest.approx((-20e-3, -40e-3), abs=3e-3)
    assert corners.max(axis=0) == pytest.approx((20e-3, 40e-3), abs=3e-3)


def test_outlines_holes_axes_flow_and_slip():
    found = drawn(TaxelMarkers(SIZES), contact_region=region(orientation=0.0), slip=slipping())
    assert {'outlines', 'holes', 'axes', 'flow', 'text'} == set(found)
    assert [p.x for p in found['axes'].points] == pytest.approx([-1e-3, 3e-3, 1e-3, 1e-3])
    assert len(found['flow'].points) == 2 and found['flow'].points[1].x == pytest.approx(0.01)
    assert found['text'].text == 'pad\ngross slip'


def test_contacts_and_a_wrench_of_which_only_a_part_is_known():
    wrench = WrenchStamped(header=HEADER)
    wrench.wrench.force = Vector3(x=float('nan'), y=float('nan'), z=-5.0)
    contact = Contact(id=3, normal=Vector3(z=1.0))
    found = drawn(TaxelMarkers(SIZES), contact_region=region(orientation=0.0), contacts=Contacts(header=HEADER, contacts=[contact]),
                  wrench=wrench)
    assert found['normals'].id == 3 and found['normals'].points[1].z == pytest.approx(6e-3)
    ends = found['force'].points
    assert (ends[0].x, ends[1].z, ends[0].z) == pytest.approx((1e-3, 6e-3, 10.5e-3))
