# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_driver.stitching.calibration import SideView, Stitching
from tactile_perception.common.camera import CameraModel
from tactile_perception.common.dots import DotTracks
from tactile_perception.errors import BadArgument, BadFrame
from tactile_perception.press.field import RestMarkers, StitchedView, camera_view, marker_field, view_maker
from tactile_perception.press.sensor import MARKER_SENSORS

SENSOR = MARKER_SENSORS['areal_single']
MATRIX = np.array([[560.0, 0, 321], [0, 561.0, 238], [0, 0, 1]])
DISTORTION = np.array([-0.08, 0.01, 0, 0, 0])
CAMERA = CameraModel(MATRIX, DISTORTION, translation=np.array([1e-4, -2e-4, 0.062]))
GRID = np.column_stack([SENSOR.grid(), np.zeros(117)])


def tracks(xyz, ids):
    uv, rest = CAMERA.project(xyz)[ids], CAMERA.project(GRID)[ids]
    return DotTracks(9, 13, ids, uv, np.full(len(ids), 200.0), np.full(len(ids), 0.1), uv - rest)


def test_the_pose_is_found_from_the_markers_seen():
    rest = CAMERA.project(GRID)
    rest[::5] = np.nan
    view = view_maker(SENSOR, (MATRIX, DISTORTION), None)(rest)
    assert view.camera.centre == pytest.approx(CAMERA.centre, abs=1e-7)
    seen, camera_centre = view.back_project(rest)
    assert np.nanmax(np.abs(seen[:, :2] - SENSOR.grid())) < 1e-7 and np.isnan(seen[0]).all()
    assert camera_centre[0] == pytest.approx(CAMERA.centre, abs=1e-7)


def test_the_field_is_what_rays_to_the_plane_tell():
    view, ids = camera_view(MATRIX, DISTORTION, CAMERA.project(GRID), SENSOR), np.arange(3, 100)
    pressed = GRID + [0, 0, -0.005]
    field = marker_field(tracks(pressed, ids), np.full(117, 100.0), view)
    centre = CAMERA.centre
    appears = centre[:2] + (pressed[:, :2] - centre[:2]) * (centre[2] / (centre[2] + 0.005))
    assert field.seen.tolist() == [3 <= k < 100 for k in range(117)]
    assert np.nanmax(np.abs(field.rest + field.shift - appears)) < 1e-7
    assert field.growth[58] == pytest.approx(np.log(2), abs=1e-3) and field.sigma[50] == pytest.approx(0.1 * 0.062 / 560, rel=1e-3)


def test_lens_distortion_is_taken_off_areas():
    view = camera_view(MATRIX, DISTORTION, CAMERA.project(GRID), SENSOR)
    corner = CAMERA.project(np.array([[0.027, 0.018, 0], [0.0271, 0.018, 0], [0.027, 0.0181, 0]]))
    px = abs(np.linalg.det(corner[1:] - corner[0]))
    assert view.back_project(corner[:1])[0][0, 2] * px == pytest.approx(1e-8, rel=1e-3)
    assert view.back_project(corner[:1])[0][0, 2] / view.back_project([[321.0, 238.0]])[0][0, 2] > 1.03


def test_what_does_not_fit_is_refused():
    with pytest.raises(BadArgument, match='flat grid'):
        camera_view(MATRIX, DISTORTION, np.zeros((4, 2)), SENSOR)
    with pytest.raises(BadFrame, match='too few'):
        camera_view(MATRIX, DISTORTION, np.full((117, 2), np.nan), SENSOR)
    with pytest.raises(BadArgument, match='marker ids'):
        marker_field(tracks(GRID, np.arange(100)), np.ones(50), camera_view(MATRIX, DISTORTION, CAMERA.project(GRID), SENSOR))


REST = np.array([[10.0, 10.0], [30.0, 10.0], [10.0, 30.0], [30.0, 30.0]])
VIEW = StitchedView(1e-4, np.zeros(2), 20.0, np.array([[-0.02, 0.0, -0.05], [0.02, 0.0, -0.05]]))


def tracks_markers(duv, area, id=(0, 1, 2, 3), rest=REST):
    id = np.asarray(id)
    duv = np.broadcast_to(np.asarray(duv, float), (len(id), 2))
    return DotTracks(2, 2, id, rest[id] + duv, np.broadcast_to(np.asarray(area, float), len(id)).copy(), np.full(len(id), np.nan), duv)


def test_growth_is_against_the_mean_untouched_area():
    markers = RestMarkers(4, lambda uv: VIEW)
    for stamp_s, area in enumerate((99.0, 101.0, 100.0)):
        markers.field(tracks_markers((0.0, 0.0), area), 0.01 * stamp_s)
    field = markers.field(tracks_markers((3.0, 0.0), 150.0), 0.03)
    assert field.growth == pytest.approx(np.log(1.5))
    assert markers.area == pytest.approx(100.0)  # a displaced marker tells nothing of its untouched area
    assert field.shift == pytest.approx(np.tile([3e-4, 0.0], (4, 1)))


def test_the_mean_area_follows_a_drift_within_seconds_whatever_the_rate():
    for rate in (10, 100):
        markers = RestMarkers(4, lambda uv: VIEW)
        for k in range(6 * rate):
            markers.field(tracks_markers((0.0, 0.0), 100.0 if k < 3 * rate else 110.0), k / rate)
            assert k != 4 * rate or markers.area == pytest.approx(104.1, abs=0.5)
        assert markers.area == pytest.approx(107.8, abs=0.2)


def test_a_marker_never_seen_untouched_has_no_growth_and_one_not_seen_no_place():
    markers = RestMarkers(4, lambda uv: VIEW)
    field = markers.field(tracks_markers((5.0, 0.0), 150.0, id=(0, 2)), 0.0)
    assert np.isnan(field.growth).all()
    assert field.seen.tolist() == [True, False, True, False]
    assert field.camera_centre[2] == pytest.approx([-0.02, 0.0, -0.05])


def test_the_view_is_made_anew_only_for_a_reference_that_moved_or_new_markers():
    asked = []
    markers = RestMarkers(4, lambda uv: asked.append(uv.copy()) or VIEW)
    markers.field(tracks_markers((0.0, 0.0), 100.0, id=(0, 1, 2)), 0.0)
    markers.field(tracks_markers((0.1, 0.0), 100.0, id=(0, 1)), 0.0)
    assert len(asked) == 1
    markers.field(tracks_markers((0.0, 0.0), 100.0), 0.0)
    assert len(asked) == 2
    assert np.isfinite(asked[-1]).all()
    markers.field(tracks_markers((0.0, 0.0), 120.0, rest=REST + 1.0), 0.0)
    assert len(asked) == 3
    assert markers.area == pytest.approx(120.0)  # another reference, other areas


PLAIN, NO_DISTORTION = np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]]), np.zeros(5)


def side(x):
    return SideView((640, 480), PLAIN, NO_DISTORTION, np.array([[1.0, 0, -x], [0, 1, 0], [0, 0, 0.05]]), np.array([x, 0, -0.05]))


STITCHING = Stitching(side(-0.02), side(0.02), (800, 500), 1e4, np.array([400.0, 250.0]), 400.0, (500.0, 140.0))


def test_a_dome_s_camera_stands_where_the_parameters_say():
    pose = np.eye(3), np.array([0.0, 0.0, 0.045])
    view = view_maker(MARKER_SENSORS['air_cushion'], (PLAIN, NO_DISTORTION), None, pose)(None)
    seen, camera_centres = view.back_project(np.array([(320.0, 240.0), (420.0, 240.0)]))
    assert camera_centres[0] == pytest.approx([0, 0, -0.045])
    assert seen[:, :2] == pytest.approx(np.array([(0, 0), (0.2 * 0.165, 0)]))


def test_a_stitched_picture_is_a_plane_with_two_camera_centres():
    view = view_maker(MARKER_SENSORS['areal_dual'], None, STITCHING.to_dict())(None)
    seen, camera_centres = view.back_project(np.array([(300.0, 250.0), (500.0, 350.0), (np.nan, np.nan)]))
    assert seen[:2] == pytest.approx(np.array([(-0.01, 0, 1e-8), (0.01, 0.01, 1e-8)]), abs=1e-12) and np.isnan(seen[2, :2]).all()
    assert camera_centres[:2] == pytest.approx(np.array([(-0.02, 0, -0.05), (0.02, 0, -0.05)]))
