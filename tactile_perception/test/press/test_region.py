# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_perception.common.marker_sensor import MARKER_SENSORS, MarkerSensor, dome_cap, first_touch_height
from tactile_perception.core.errors import BadArgument
from tactile_perception.press.estimate import TouchEstimate
from tactile_perception.press.estimator import region_of
from tactile_perception.press.field import MarkerField

SHEET, DOME = MARKER_SENSORS['areal_single'], MARKER_SENSORS['air_cushion']
EYE = np.array([0.0, 0.0, -0.06])


def field_at_rest():
    rest = SHEET.grid()
    count = len(rest)
    nothing = np.zeros((count, 2))
    return MarkerField(rest, nothing, np.zeros(count), np.tile(EYE, (count, 1)), nothing, nothing, np.ones(count))


def touch(x, y, depth, radius=np.nan):
    return TouchEstimate(np.array([x, y, -depth]), depth, 1e-8 * np.eye(3), 1e-4, radius)


def patch_of(depth, tip, sensor, position=(0.0, 0.0)):
    """Radius, m, of the disc of one contact."""
    return np.sqrt(region_of([touch(*position, depth, tip)], field_at_rest(), sensor, tip).area / np.pi)


FLAT_DISC = type(DOME)(9, 9, (4e-3, 4e-3), rim_radius=0.02, height=1e-9)


@pytest.mark.parametrize('patch', [0.5e-3, 2e-3, 4e-3])
def test_the_contact_of_a_tip_in_the_middle_of_a_round_skin(patch):
    # The skin outside is the catenary's small-slope form; its depth at the patch's edge and the cap's height add up.
    outside = patch**2 / 8e-3 * np.log(0.02 / patch)
    assert patch_of(outside + patch**2 / 16e-3, 8e-3, FLAT_DISC) == pytest.approx(patch, rel=1e-4)


def test_the_contact_of_a_tip_is_at_most_a_hemisphere():
    assert patch_of(0.03, 5e-3, FLAT_DISC) == pytest.approx(0.95 * 5e-3, rel=1e-4)


def test_a_contact_beyond_the_rim_has_a_region_of_one_point():
    found = region_of([touch(0.2, 0.0, 1e-3, 8e-3)], field_at_rest(), DOME, 8e-3)
    assert 0 < found.area < 1e-12 and np.isfinite(found.centroid).all()


def test_a_contact_has_a_circular_outline_and_sticking_markers():
    found = region_of([touch(4.5e-3, 0.0, 6e-3)], field_at_rest(), SHEET, 8e-3)
    radius = np.hypot(*(found.outlines[0][:, :2] - [4.5e-3, 0.0]).T)
    assert found.area == pytest.approx(np.pi * radius[0]**2)
    assert np.ptp(radius) < 1e-9
    assert 3e-3 < radius[0] < 8e-3
    assert -6e-3 < found.centroid[2] < -3e-3  # the rim of the patch is higher than the tip
    assert found.dot_state[SHEET.grid().tolist().index([4.5e-3, 0.0])] == 1
    assert 1 <= found.dot_state.sum() <= 9
    assert found.dot_id.tolist() == list(range(117))


def test_the_estimated_tip_radius_is_preferred_to_the_nominal_one():
    wide, narrow = (region_of([touch(0.0, 0.0, 3e-3, r)], field_at_rest(), SHEET, 8e-3).area for r in (12e-3, 4e-3))
    assert wide > 1.5 * narrow


def test_on_the_slope_of_a_dome_the_outline_is_on_the_tip():
    tip, position = 0.025, np.array([0.05, -0.02])
    lowest = np.array([*position, 0.09])
    found = region_of([TouchEstimate(lowest, 0.02, 1e-8 * np.eye(3), 1e-4)], field_at_rest(), DOME, tip)
    outline, ball = found.outlines[0], lowest + [0.0, 0.0, tip]
    assert np.linalg.norm(outline - ball, axis=1) == pytest.approx(tip, rel=1e-9)
    assert (outline - outline.mean(0)) @ found.normal == pytest.approx(0.0, abs=1e-12)
    assert found.normal == pytest.approx(DOME.normal(position / (1 + tip / 0.15375)), abs=1e-9) and found.normal[0] > 0.2
    assert 0.009 < np.sqrt(found.area / np.pi) < 0.016


@pytest.mark.parametrize('wrong', [{}, {'size': (0.06, 0.04), 'rim_radius': 0.1, 'height': 0.1}, {'rim_radius': 0.1}])
def test_a_sensor_that_is_neither_sheet_nor_dome_is_refused(wrong):
    with pytest.raises(BadArgument, match='either size'):
        MarkerSensor(9, 13, (4e-3, 4e-3), **wrong)


DOME, SHEET = MARKER_SENSORS['air_cushion'], MARKER_SENSORS['areal_single']


def test_a_tip_contacts_a_slope_beside_its_lowest_point():
    height = first_touch_height([[0, 0], [0.05, 0.0]], 0.02, DOME)
    assert height[0] == pytest.approx(0.12) and height[1] > dome_cap(DOME).heights(np.array([[0.05, 0]]))[0]
    assert np.isnan(first_touch_height([0.3, 0.0], 0.02, DOME)[0])
    assert first_touch_height([0.01, 0.0], 0.02, SHEET) == [0.0]
