# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import functools

import numpy as np
import pytest
from tactile_perception.common.camera import CameraModel
from tactile_perception.common.dots import DotTracks
from tactile_perception.markers.places import dome as dome_places
from tactile_perception.markers.places.dome import DomePlaces
from tactile_perception.markers.regression import dome as regression_dome
from tactile_perception.markers.regression.dome import DomeRegression
from tactile_perception.markers.view.marker_field import CameraView

from dome_scenes import DOME, EYE, FEW, dented, dome_presses, markers

CAMERA = CameraModel(np.array([[230.0, 0, 320], [0, 230, 240], [0, 0, 1]]), translation=-EYE)
REST = markers()
SEEN = np.flatnonzero(np.isfinite(REST[:, 0]))


def tracks(xyz):
    """Of markers at xyz (K, 3) m; every ninth is lost."""
    id = SEEN[np.arange(len(SEEN)) % 9 > 0]
    uv, rest = CAMERA.project(xyz[id]), CAMERA.project(REST[id])
    return DotTracks(17, 17, id, uv, np.full(len(id), 100.0), np.full(len(id), 0.02), uv - rest)


def places(method=None):
    return DomePlaces(DOME, len(REST), lambda uv: CameraView(CAMERA, DOME.plane_z), method)


@functools.cache
def calibrated():
    with pytest.MonkeyPatch.context() as patch:  # one ridge, not the best of several: sooner
        patch.setattr(regression_dome, 'RIDGES', (1e-6,))
        return DomeRegression.from_fitted(DomeRegression.fit(dome_presses(FEW), DOME), DOME)


def test_markers_of_the_untouched_dome_are_on_it():
    still = tracks(REST)
    for method in (None, calibrated()):
        assert places(method).locate(None, still) == pytest.approx(REST[still.id], abs=1e-9)


def test_markers_are_taken_down_by_the_dent():
    now = dented(REST, np.array([0.02, -0.015]), 0.025)
    found, seen = places(calibrated()), tracks(now)
    off = np.linalg.norm(found.locate(None, seen) - now[seen.id], axis=1)
    assert np.sqrt(np.mean(off**2)) < 2e-3 and np.abs(now[seen.id, 2] - REST[seen.id, 2]).max() > 0.02
    found.renew()
    assert found.locate(None, tracks(REST)) == pytest.approx(REST[seen.id], abs=1e-9)


def test_without_a_calibration_markers_that_moved_have_no_place():
    now = dented(REST, np.array([0.02, -0.015]), 0.025)
    seen = tracks(now)
    found = places().locate(None, seen)
    near = np.hypot(*(REST[seen.id, :2] - [0.02, -0.015]).T) < 0.05
    assert np.isnan(found[near]).all() and np.array_equal(np.isnan(found[:, 0]), np.isnan(found[:, 2]))


def test_a_dome_that_shrinks_towards_the_eye_is_held_by_the_markers_furthest_from_the_dents():
    rest = np.array([[0.0, 0.0, 0.16], [0.01, 0.0, 0.16], [0.08, 0.0, 0.13], [-0.08, 0.0, 0.13], [np.nan] * 3])
    dented = rest * 1.0
    dented[:2, 2] -= 0.03
    distance = np.array([0.0, 0.01, 0.08, 0.08, np.nan])
    assert dome_places.still_scale(0.88 * dented, rest, distance) == pytest.approx(1 / 0.88)
    assert dome_places.still_scale(dented, rest, np.full(5, np.nan)) == 1.0
