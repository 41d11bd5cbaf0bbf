# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Places of a sheet's markers from where they appear, on deflections whose markers went down and in known ways sideways."""
from dataclasses import replace

import numpy as np
import pytest
from tactile_perception.common.camera import CameraModel
from tactile_perception.common.dots import DotTracks
from tactile_perception.errors import BadArgument
from tactile_perception.press.positions import MarkerPlaces, SheetSurface, on_rays
from tactile_perception.press.field import MarkerField, camera_view
from tactile_perception.press.sensor import MARKER_SENSORS

SENSOR = MARKER_SENSORS['areal_single']
REST = SENSOR.grid()
EYE = np.array([1e-3, -2e-3, -0.062])


@pytest.fixture(scope='module')
def surface():
    return SheetSurface(SENSOR)


def appears(xyz):
    return EYE[:2] + (xyz[:, :2] - EYE[:2]) * EYE[2] / (EYE[2] - xyz[:, 2:])


def pressed(tip, depth, width=0.009, inwards=0.0):
    """A bell that is zero at the clamp; markers go inwards by that share of its slope times its height."""
    clamp = np.prod(np.cos(np.pi * REST / SENSOR.size), axis=1)
    away = REST - tip
    bell = depth * clamp * np.exp(-0.5 * (away**2).sum(1) / width**2)
    return np.column_stack([REST - inwards * bell[:, None] * away / width, -bell])


def found(surface, xyz, noise=5e-6, camera_centres=None):
    camera_centres = np.tile(EYE, (len(REST), 1)) if camera_centres is None else camera_centres
    place = appears(xyz) + noise * np.random.default_rng(0).standard_normal(REST.shape)
    plain = np.full(len(REST), np.nan)
    field = MarkerField(REST, place - REST, plain, camera_centres, plain, REST, REST, plain)
    return on_rays(field, surface.raised(field), SENSOR)


@pytest.mark.parametrize('tip', [(0.0, 0.0), (0.015, -0.010), (-0.018, 0.008)])
@pytest.mark.parametrize('depth', [0.5e-3, 3e-3, 10e-3])
def test_depths_of_a_bell_to_a_twentieth(surface, tip, depth):
    xyz = pressed(np.array(tip), depth)
    assert np.sqrt(np.mean((found(surface, xyz) - xyz)[:, 2]**2)) < 0.05 * depth + 5e-5


def test_what_goes_sideways_is_reported_from_what_goes_down(surface):
    xyz = pressed(np.array([0.006, 0.004]), 6e-3, inwards=0.1)
    off = found(surface, xyz) - xyz
    assert np.sqrt(np.mean(off[:, 2]**2)) < 0.8e-3
    assert np.sqrt(np.mean(off[:, :2]**2)) < 0.12e-3


def test_markers_that_are_not_seen_have_no_place_and_leave_the_others_theirs(surface):
    xyz = pressed(np.array([0.0, 0.0]), 5e-3)
    lost = np.random.default_rng(1).choice(len(REST), 12, replace=False)
    hidden = xyz.copy()
    hidden[lost] = np.nan
    got = found(surface, hidden)
    assert np.isnan(got[lost]).all()
    seen = np.setdiff1d(np.arange(len(REST)), lost)
    assert np.sqrt(np.mean((got - xyz)[seen, 2]**2)) < 0.3e-3


@pytest.mark.parametrize('wrong', [{'size': (0.05, 0.045)}, {'rows': 13}, {'rows': 1, 'columns': 117}])
def test_what_does_not_fit_together_is_refused(wrong):
    with pytest.raises(BadArgument, match='sheet'):
        SheetSurface(replace(SENSOR, **wrong))


CAMERA = CameraModel(np.array([[560.0, 0, 320], [0, 560, 240], [0, 0, 1]]), translation=np.array([0.0, 0.0, 0.062]))


def tracks(xyz, rest_uv):
    uv = CAMERA.project(xyz)
    count = len(uv)
    return DotTracks(9, 13, np.arange(count), uv, np.full(count, 300.0), np.full(count, np.nan), uv - rest_uv)


def test_the_camera_s_place_comes_from_the_untouched_markers_and_theirs_from_the_picture():
    rest = np.column_stack([SENSOR.grid(), np.zeros(117)])
    rest_uv = CAMERA.project(rest)
    places = MarkerPlaces(SENSOR, 117, lambda uv: camera_view(CAMERA.matrix, CAMERA.distortion, uv, SENSOR), SheetSurface(SENSOR).raised)
    assert places.locate(None, tracks(rest, rest_uv), 0.0) == pytest.approx(rest, abs=1e-6)
    down = rest.copy()
    down[:, 2] = -4e-3 * np.exp(-0.5 * ((rest[:, :2] - [0.004, 0.002])**2).sum(1) / 0.008**2)
    assert np.sqrt(np.mean((places.locate(None, tracks(down, rest_uv), 0.0) - down)[:, 2]**2)) < 0.15e-3
    places.renew()
    assert places.locate(None, tracks(rest, rest_uv), 0.0) == pytest.approx(rest, abs=1e-6)
