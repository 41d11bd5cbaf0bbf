# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The stage with a method and a wrench with known results."""
import numpy as np
import pytest

from tactile_driver.parameters.table import defaults
from tactile_perception.common.dots import DotTracks
from tactile_perception.common.marker_sensor import MARKER_SENSORS
from tactile_perception.common.surface_points import UNKNOWN
from tactile_perception.core.calibration_file import CalibrationFile
from tactile_perception.core.errors import BadArgument, BadFrame
from tactile_perception.press.calibration import TouchCalibration
from tactile_perception.press.estimate import AT_EDGE, TouchEstimate
from tactile_perception.press.estimator import TouchEstimator, TouchTracker
from tactile_perception.press.field import RestMarkers, checked_view, stitched_view
from tactile_perception.press.methods import SHEET_METHODS
from tactile_perception.press.parameters import MARKER_PARAMETERS

SENSOR = MARKER_SENSORS['areal_single']
VIEW = stitched_view(1e-4, np.array([320.0, 240.0]), 1000.0, np.tile([0.0, 0.0, -0.06], (2, 1)))
REST = SENSOR.grid() / 1e-4 + [320.0, 240.0]
WRENCH = np.array([0.1, 0.0, -1.5, 0.0, 0.002, 0.0])


class KnownContacts:
    """A method that reports a contact for each marker moved to the right by 5, 10 ... px, at 4 mm times its number."""

    @classmethod
    def from_fitted(cls, fitted, sensor):
        return cls()

    def estimate(self, field):
        moved = np.flatnonzero(field.shift[:, 0] > 4e-4)
        return [TouchEstimate(np.array([4e-3 * k, 0.0, -2e-3]), 2e-3, 1e-8 * np.eye(3), 1e-4, flags=AT_EDGE, wrench=WRENCH / 50)
                for k in moved]


@pytest.fixture
def make_stage(monkeypatch):
    def make(stiffness=np.nan, best='known', rest=None, **changes):
        monkeypatch.setitem(SHEET_METHODS, 'known', KnownContacts)
        calibration = TouchCalibration({'known': {}}, stiffness, None, best, CalibrationFile('areal_single', {}, {}, {}, {}), rest=rest)
        markers = RestMarkers(117, checked_view(lambda uv: VIEW, rest))
        return TouchEstimator(SENSOR, markers, {**defaults(MARKER_PARAMETERS), **changes}, calibration)
    return make


def tracks(*pressed, columns=13):
    duv = np.zeros((117, 2))
    duv[list(pressed), 0] = 5.0
    return DotTracks(9, columns, np.arange(117), REST + duv, np.full(117, 300.0), np.full(117, 0.05), duv)


def test_contacts_region_and_wrench(make_stage):
    stage = make_stage(50.0)
    nothing = stage.process(tracks(), 1.0)
    assert nothing.contacts == [] and nothing.region.area == 0 and np.isnan(nothing.wrench).all()
    result = stage.process(tracks(2), 1.1)
    contact, = result.contacts
    assert contact.position == pytest.approx([8e-3, 0, -2e-3]) and contact.depth == 2e-3 and contact.flags == AT_EDGE
    assert contact.normal == pytest.approx([0, 0, 1]) and contact.force == pytest.approx(1.5)
    assert contact.position_covariance == pytest.approx(1e-8 * np.eye(3)) and result.wrench == pytest.approx(WRENCH)
    assert result.region.area > 0 and len(result.region.outlines) == 1 and result.region.dot_state.any()
    assert stage.process(tracks(2), 1.2).contacts[0].id == contact.id


def test_forces_of_two_contacts_are_unknown(make_stage):
    stage = make_stage(50.0)
    contacts = stage.process(tracks(0, 3), 1.0).contacts
    assert len({contact.id for contact in contacts}) == 2 and np.isnan([contact.force for contact in contacts]).all()


def test_markers_of_another_grid_and_earlier_stamps_are_refused(make_stage):
    stage = make_stage()
    with pytest.raises(BadFrame, match='9 x 12 grid'):
        stage.process(tracks(columns=12), 1.0)
    stage.process(tracks(1), 2.0)
    with pytest.raises(BadFrame, match='not later'):
        stage.process(tracks(1), 1.5)


def test_a_reference_taken_under_a_press_gives_no_contacts(make_stage):
    bell = 6 * np.exp(-np.sum((REST - [400, 200])**2, axis=1) / (2 * 60**2))[:, None] * [1, 0.5]
    stage = make_stage(rest=REST - bell)
    for k in range(2):
        with pytest.raises(BadFrame, match='touched when the reference was taken'):
            stage.process(tracks(1), 1.0 + k)
    good = make_stage(rest=REST + [2.0, 1.0])
    assert good.process(tracks(1), 1.0).contacts


def test_points_are_the_tracked_markers_without_forces(make_stage):
    stage, seen = make_stage(50.0), tracks(2)
    seen.xyz = np.column_stack([SENSOR.grid(), np.full(117, -1e-3)])
    keep = np.arange(117) != 5
    points = stage.process(seen.take(keep), 1.0).points()
    assert points.shape == (9, 13) and points.xyz[keep] == pytest.approx(seen.xyz[keep]) and np.isnan(points.xyz[5]).all()
    assert points.displacement[keep] == pytest.approx(np.tile([0, 0, -1e-3], (116, 1)), abs=1e-9)
    assert points.normal[keep] == pytest.approx(np.tile([0, 0, 1.0], (116, 1))) and points.state[5] == UNKNOWN
    assert np.isnan(points.force).all() and set(points.state[keep]) == {0, 1}


SIGMA = 1e-4


def touch(x, y, depth=2e-3, sigma=SIGMA):
    return TouchEstimate(np.array([x, y, -depth]), depth, sigma**2 * np.eye(3), sigma)


def test_two_contacts_keep_their_ids_in_any_order():
    tracker = TouchTracker()
    for k in range(20):
        left, right = touch(-0.01 + 1e-4 * k, 0.0), touch(0.01 - 1e-4 * k, 0.0)
        assert tracker.process([right, left] if k % 2 else [left, right], 0.03 * k) == ([2, 1] if k % 2 else [1, 2])


def test_ids_are_not_reused():
    tracker = TouchTracker()
    assert tracker.process([touch(0.0, 0.0)], 0.0) == [1]
    for k in range(1, 6):
        assert tracker.process([], 0.03 * k) == []
    assert tracker.process([touch(0.0, 0.0)], 0.3) == [2]


def test_a_contact_missed_for_two_frames_continues():
    tracker = TouchTracker()
    for k in range(5):
        tracker.process([touch(0.0, 0.0)], 0.03 * k)
    tracker.process([], 0.15)
    tracker.process([], 0.18)
    assert tracker.process([touch(0.0, 0.0)], 0.21) == [1]


@pytest.mark.parametrize('rate', [15.0, 30.0, 60.0])
def test_contacts_keep_their_ids_at_any_rate(rate):
    tracker, rng = TouchTracker(), np.random.default_rng(0)
    for k in range(int(2 * rate)):
        x = 0.02 * (1 - np.cos(2 * k / rate))  # m, there and back at up to 0.04 m/s
        positions = np.array([[x, 0.0], [0.02, 0.02 - x / 2]]) + SIGMA * rng.standard_normal((2, 2))
        assert tracker.process([touch(*position) for position in positions], 1 + k / rate) == [1, 2]


def test_nan_and_earlier_stamps_are_refused():
    tracker = TouchTracker()
    tracker.process([touch(0.0, 0.0)], 1.0)
    for stamp in (1.0, 0.5, np.nan):
        with pytest.raises(BadFrame, match='not later'):
            tracker.process([], stamp)
    with pytest.raises(BadArgument, match='finite position'):
        tracker.process([touch(np.nan, 0.0)], 2.0)
