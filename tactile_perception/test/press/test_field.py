# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The field of markers and their positions."""
from dataclasses import replace

import numpy as np
import pytest
from dome_scenes import DOME, EYE as DOME_EYE, dented, markers

from tactile_driver.stitching.calibration import SideView, Stitching
from tactile_perception.common.camera import CameraModel
from tactile_perception.common.dots import DotTracks
from tactile_perception.common.marker_sensor import MARKER_SENSORS
from tactile_perception.core.errors import BadArgument, BadFrame
from tactile_perception.press.field import MarkerField, MarkerView, RestMarkers, camera_view, stitched_view, view_maker
from tactile_perception.press.positions import MarkerPositions

SENSOR = MARKER_SENSORS['areal_single']
MATRIX = np.array([[560.0, 0, 321], [0, 561.0, 238], [0, 0, 1]])
DISTORTION = np.array([-0.08, 0.01, 0, 0, 0])
CAMERA = CameraModel(MATRIX, DISTORTION, translation=np.array([1e-4, -2e-4, 0.062]))
GRID = np.column_stack([SENSOR.grid(), np.zeros(117)])


def tracks(xyz, ids):
    uv, rest = CAMERA.project(xyz)[ids], CAMERA.project(GRID)[ids]
    return DotTracks(9, 13, ids, uv, np.full(len(ids), 200.0), np.full(len(ids), 0.1), uv - rest)


def test_the_pose_is_found_from_the_visible_markers():
    rest = CAMERA.project(GRID)
    rest[::5] = np.nan
    view = view_maker(SENSOR, (MATRIX, DISTORTION), None)(rest)
    assert view.camera.centre == pytest.approx(CAMERA.centre, abs=1e-7)
    seen = view.back_project(rest)
    assert np.nanmax(np.abs(seen[:, :2] - SENSOR.grid())) < 1e-7 and np.isnan(seen[0]).all()


def test_the_field_is_the_projection_onto_the_plane():
    view, ids = camera_view(MATRIX, DISTORTION, CAMERA.project(GRID), SENSOR), np.arange(3, 100)
    pressed, markers = GRID + [0.001, 0, -0.005], RestMarkers(117, lambda uv: view)
    untouched = tracks(GRID, np.arange(117))
    untouched.area = np.full(117, 100.0)
    markers.field(untouched, 0.0)
    field = markers.field(tracks(pressed, ids), 0.1)
    assert field.camera_centre[50] == pytest.approx(CAMERA.centre, abs=1e-7)
    centre = CAMERA.centre
    appears = centre[:2] + (pressed[:, :2] - centre[:2]) * (centre[2] / (centre[2] + 0.005))
    assert field.seen.tolist() == [3 <= k < 100 for k in range(117)]
    assert np.nanmax(np.abs(field.rest + field.shift - appears)) < 1e-7
    assert field.growth[58] == pytest.approx(np.log(2), abs=1e-3)


def test_areas_are_corrected_for_lens_distortion():
    view = camera_view(MATRIX, DISTORTION, CAMERA.project(GRID), SENSOR)
    corner = CAMERA.project(np.array([[0.027, 0.018, 0], [0.0271, 0.018, 0], [0.027, 0.0181, 0]]))
    px = abs(np.linalg.det(corner[1:] - corner[0]))
    assert view.back_project(corner[:1])[0, 2] * px == pytest.approx(1e-8, rel=1e-3)
    assert view.back_project(corner[:1])[0, 2] / view.back_project([[321.0, 238.0]])[0, 2] > 1.03


def test_inconsistent_input_is_refused():
    with pytest.raises(BadArgument, match='flat grid'):
        camera_view(MATRIX, DISTORTION, np.zeros((4, 2)), SENSOR)
    with pytest.raises(BadFrame, match='too few'):
        camera_view(MATRIX, DISTORTION, np.full((117, 2), np.nan), SENSOR)
    with pytest.raises(BadArgument, match='marker ids'):
        RestMarkers(50, lambda uv: VIEW).field(tracks(GRID, np.arange(100)), 0.0)


REST = np.array([[10.0, 10.0], [30.0, 10.0], [10.0, 30.0], [30.0, 30.0]])
VIEW = stitched_view(1e-4, np.zeros(2), 20.0, np.array([[-0.02, 0.0, -0.05], [0.02, 0.0, -0.05]]))


def tracks_markers(duv, area, id=(0, 1, 2, 3), rest=REST):
    id = np.asarray(id)
    duv = np.broadcast_to(np.asarray(duv, float), (len(id), 2))
    return DotTracks(2, 2, id, rest[id] + duv, np.broadcast_to(np.asarray(area, float), len(id)).copy(), np.full(len(id), np.nan), duv)


def test_growth_is_relative_to_the_mean_untouched_area():
    markers = RestMarkers(4, lambda uv: VIEW)
    for stamp_s, area in enumerate((99.0, 101.0, 100.0)):
        markers.field(tracks_markers((0.0, 0.0), area), 0.01 * stamp_s)
    field = markers.field(tracks_markers((3.0, 0.0), 150.0), 0.03)
    assert field.growth == pytest.approx(np.log(1.5))
    assert markers.area == pytest.approx(100.0)  # a displaced marker does not show its untouched area
    assert field.shift == pytest.approx(np.tile([3e-4, 0.0], (4, 1)))


def test_the_mean_area_follows_a_drift_within_seconds_at_any_rate():
    for rate in (10, 100):
        markers = RestMarkers(4, lambda uv: VIEW)
        for k in range(6 * rate):
            markers.field(tracks_markers((0.0, 0.0), 100.0 if k < 3 * rate else 110.0), k / rate)
            assert k != 4 * rate or markers.area == pytest.approx(104.1, abs=0.5)
        assert markers.area == pytest.approx(107.8, abs=0.2)


def test_growth_needs_an_untouched_area_and_position_a_visible_marker():
    markers = RestMarkers(4, lambda uv: VIEW)
    field = markers.field(tracks_markers((5.0, 0.0), 150.0, id=(0, 2)), 0.0)
    assert np.isnan(field.growth).all()
    assert field.seen.tolist() == [True, False, True, False]
    assert field.camera_centre[2] == pytest.approx([-0.02, 0.0, -0.05])


def test_the_view_is_remade_only_for_a_moved_reference_or_new_markers():
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


def test_the_camera_pose_of_a_dome_is_that_of_the_parameters():
    pose = np.eye(3), np.array([0.0, 0.0, 0.045])
    view = view_maker(MARKER_SENSORS['air_cushion'], (PLAIN, NO_DISTORTION), None, pose)(None)
    seen = view.back_project(np.array([(320.0, 240.0), (420.0, 240.0)]))
    assert view.camera.centre == pytest.approx([0, 0, -0.045])
    assert seen[:, :2] == pytest.approx(np.array([(0, 0), (0.2 * 0.165, 0)]))


def test_a_stitched_image_is_a_plane_with_two_camera_centres():
    view = view_maker(MARKER_SENSORS['areal_dual'], None, STITCHING.to_dict())(None)
    uv = np.array([(300.0, 250.0), (500.0, 350.0), (np.nan, np.nan)])
    seen = view.back_project(uv)
    assert seen[:2] == pytest.approx(np.array([(-0.01, 0, 1e-8), (0.01, 0.01, 1e-8)]), abs=1e-12) and np.isnan(seen[2, :2]).all()
    tracked = DotTracks(1, 3, np.arange(3), uv, np.ones(3), np.ones(3), np.zeros((3, 2)))
    field = RestMarkers(3, lambda uv: view).field(tracked, 0.0)
    assert field.camera_centre[:2] == pytest.approx(np.array([(-0.02, 0, -0.05), (0.02, 0, -0.05)]))


UNTOUCHED = SENSOR.grid()
EYE = np.array([1e-3, -2e-3, -0.062])


@pytest.fixture(scope='module')
def surface():
    return MarkerPositions(SENSOR)


def appears(xyz):
    return EYE[:2] + (xyz[:, :2] - EYE[:2]) * EYE[2] / (EYE[2] - xyz[:, 2:])


def pressed(tip, depth, width=0.009, inwards=0.0):
    """A dent that is zero at the clamp; markers move inwards by a share of its slope times its height."""
    clamp = np.prod(np.cos(np.pi * UNTOUCHED / SENSOR.size), axis=1)
    away = UNTOUCHED - tip
    bell = depth * clamp * np.exp(-0.5 * (away**2).sum(1) / width**2)
    return np.column_stack([UNTOUCHED - inwards * bell[:, None] * away / width, -bell])


def found(surface, xyz, noise=5e-6, camera_centres=None):
    camera_centres = np.tile(EYE, (len(UNTOUCHED), 1)) if camera_centres is None else camera_centres
    position = appears(xyz) + noise * np.random.default_rng(0).standard_normal(UNTOUCHED.shape)
    plain = np.full(len(UNTOUCHED), np.nan)
    field = MarkerField(UNTOUCHED, position - UNTOUCHED, plain, camera_centres, UNTOUCHED, UNTOUCHED, plain)
    return surface.xyz(field)


@pytest.mark.parametrize('tip', [(0.0, 0.0), (0.015, -0.010), (-0.018, 0.008)])
@pytest.mark.parametrize('depth', [0.5e-3, 3e-3, 10e-3])
def test_depths_of_a_dent_are_accurate_to_5_percent(surface, tip, depth):
    xyz = pressed(np.array(tip), depth)
    assert np.sqrt(np.mean((found(surface, xyz) - xyz)[:, 2]**2)) < 0.05 * depth + 5e-5


def test_lateral_displacement_is_separated_from_depth(surface):
    xyz = pressed(np.array([0.006, 0.004]), 6e-3, inwards=0.1)
    off = found(surface, xyz) - xyz
    assert np.sqrt(np.mean(off[:, 2]**2)) < 0.8e-3
    assert np.sqrt(np.mean(off[:, :2]**2)) < 0.12e-3


def test_missing_markers_have_no_position_and_do_not_affect_others(surface):
    xyz = pressed(np.array([0.0, 0.0]), 5e-3)
    lost = np.random.default_rng(1).choice(len(UNTOUCHED), 12, replace=False)
    hidden = xyz.copy()
    hidden[lost] = np.nan
    got = found(surface, hidden)
    assert np.isnan(got[lost]).all()
    seen = np.setdiff1d(np.arange(len(UNTOUCHED)), lost)
    assert np.sqrt(np.mean((got - xyz)[seen, 2]**2)) < 0.3e-3


@pytest.mark.parametrize('wrong', [{'size': (0.05, 0.045)}, {'rows': 13}, {'rows': 1, 'columns': 117}])
def test_inconsistent_arguments_are_refused(wrong):
    with pytest.raises(BadArgument, match='sheet'):
        MarkerPositions(replace(SENSOR, **wrong))


DOME_CAMERA = CameraModel(np.array([[230.0, 0, 320], [0, 230, 240], [0, 0, 1]]), translation=-DOME_EYE)
ON_DOME = markers()
SEEN = np.flatnonzero(np.isfinite(ON_DOME[:, 0]))


def dots_at(xyz):
    """Dots of markers at xyz (K, 3), m; every ninth is lost."""
    id = SEEN[np.arange(len(SEEN)) % 9 > 0]
    uv, rest = DOME_CAMERA.project(xyz[id]), DOME_CAMERA.project(ON_DOME[id])
    return DotTracks(17, 17, id, uv, np.full(len(id), 100.0), np.full(len(id), 0.02), uv - rest)


def positions(method=None):
    """A function of dots that returns their positions; method: of the dome."""
    markers = RestMarkers(len(ON_DOME), lambda uv: MarkerView(DOME_CAMERA, DOME.plane_z))
    return lambda dots: MarkerPositions(DOME, method).xyz(markers.field(dots, 0.0))[dots.id]


class Knows:
    """A method that knows the displacement of each marker."""

    def __init__(self, xyz):
        self._raised = xyz[:, 2] - ON_DOME[:, 2]

    def raised(self, field):
        return self._raised if np.nanmax(np.abs(field.shift)) > 1e-6 else None


def test_markers_of_the_untouched_dome_are_on_it():
    still = dots_at(ON_DOME)
    for method in (None, Knows(ON_DOME)):
        assert positions(method)(still) == pytest.approx(ON_DOME[still.id], abs=1e-9)


def test_markers_are_lowered_by_the_dent():
    now = dented(ON_DOME, np.array([0.02, -0.015]), 0.025)
    found, seen = positions(Knows(now)), dots_at(now)
    off = np.linalg.norm(found(seen) - now[seen.id], axis=1)
    assert off.max() < 1e-9 and np.abs(now[seen.id, 2] - ON_DOME[seen.id, 2]).max() > 0.02
    assert found(dots_at(ON_DOME)) == pytest.approx(ON_DOME[seen.id], abs=1e-9)


def test_without_a_calibration_displaced_markers_have_no_position():
    now = dented(ON_DOME, np.array([0.02, -0.015]), 0.025)
    seen = dots_at(now)
    found = positions()(seen)
    near = np.hypot(*(ON_DOME[seen.id, :2] - [0.02, -0.015]).T) < 0.05
    assert np.isnan(found[near]).all() and np.array_equal(np.isnan(found[:, 0]), np.isnan(found[:, 2]))
