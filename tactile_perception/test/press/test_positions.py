# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Places of markers from where they appear: of a sheet, on deflections whose markers went down and in known ways sideways; of a dome."""
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from dome_scenes import DOME, EYE as DOME_EYE, dented, markers
from tactile_perception.common.camera import CameraModel
from tactile_perception.common.dots import DotTracks
from tactile_perception.errors import BadArgument
from tactile_perception.press.field import CameraView, MarkerField
from tactile_perception.press.positions import MarkerPlaces, SheetSurface, dome_raised, on_rays
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


CAMERA = CameraModel(np.array([[230.0, 0, 320], [0, 230, 240], [0, 0, 1]]), translation=-DOME_EYE)
ON_DOME = markers()
SEEN = np.flatnonzero(np.isfinite(ON_DOME[:, 0]))


def tracks(xyz):
    """Of markers at xyz (K, 3) m; every ninth is lost."""
    id = SEEN[np.arange(len(SEEN)) % 9 > 0]
    uv, rest = CAMERA.project(xyz[id]), CAMERA.project(ON_DOME[id])
    return DotTracks(17, 17, id, uv, np.full(len(id), 100.0), np.full(len(id), 0.02), uv - rest)


def places(method=None):
    return MarkerPlaces(DOME, len(ON_DOME), lambda uv: CameraView(CAMERA, DOME.plane_z), partial(dome_raised, method))


class Knows:
    """A method that knows how far each marker is lowered."""

    def __init__(self, xyz):
        self._raised = xyz[:, 2] - ON_DOME[:, 2]

    def raised(self, field):
        return self._raised if np.nanmax(np.abs(field.shift)) > 1e-6 else None


def test_markers_of_the_untouched_dome_are_on_it():
    still = tracks(ON_DOME)
    for method in (None, Knows(ON_DOME)):
        assert places(method).locate(None, still, 0.0) == pytest.approx(ON_DOME[still.id], abs=1e-9)


def test_markers_are_taken_down_by_the_dent():
    now = dented(ON_DOME, np.array([0.02, -0.015]), 0.025)
    found, seen = places(Knows(now)), tracks(now)
    off = np.linalg.norm(found.locate(None, seen, 0.0) - now[seen.id], axis=1)
    assert off.max() < 1e-9 and np.abs(now[seen.id, 2] - ON_DOME[seen.id, 2]).max() > 0.02
    found.renew()
    assert found.locate(None, tracks(ON_DOME), 0.0) == pytest.approx(ON_DOME[seen.id], abs=1e-9)


def test_without_a_calibration_markers_that_moved_have_no_place():
    now = dented(ON_DOME, np.array([0.02, -0.015]), 0.025)
    seen = tracks(now)
    found = places().locate(None, seen, 0.0)
    near = np.hypot(*(ON_DOME[seen.id, :2] - [0.02, -0.015]).T) < 0.05
    assert np.isnan(found[near]).all() and np.array_equal(np.isnan(found[:, 0]), np.isnan(found[:, 2]))
