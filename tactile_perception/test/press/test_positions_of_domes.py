# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
from functools import partial

import numpy as np
import pytest
from tactile_perception.common.camera import CameraModel
from tactile_perception.common.dots import DotTracks
from tactile_perception.press.positions import MarkerPlaces, dome_raised
from tactile_perception.press.field import CameraView

from dome_scenes import DOME, EYE, dented, markers

CAMERA = CameraModel(np.array([[230.0, 0, 320], [0, 230, 240], [0, 0, 1]]), translation=-EYE)
REST = markers()
SEEN = np.flatnonzero(np.isfinite(REST[:, 0]))


def tracks(xyz):
    """Of markers at xyz (K, 3) m; every ninth is lost."""
    id = SEEN[np.arange(len(SEEN)) % 9 > 0]
    uv, rest = CAMERA.project(xyz[id]), CAMERA.project(REST[id])
    return DotTracks(17, 17, id, uv, np.full(len(id), 100.0), np.full(len(id), 0.02), uv - rest)


def places(method=None):
    return MarkerPlaces(DOME, len(REST), lambda uv: CameraView(CAMERA, DOME.plane_z), partial(dome_raised, method))


class Knows:
    """A method that knows how far each marker is lowered."""

    def __init__(self, xyz):
        self._raised = xyz[:, 2] - REST[:, 2]

    def raised(self, field):
        return self._raised if np.nanmax(np.abs(field.shift)) > 1e-6 else None


def test_markers_of_the_untouched_dome_are_on_it():
    still = tracks(REST)
    for method in (None, Knows(REST)):
        assert places(method).locate(None, still, 0.0) == pytest.approx(REST[still.id], abs=1e-9)


def test_markers_are_taken_down_by_the_dent():
    now = dented(REST, np.array([0.02, -0.015]), 0.025)
    found, seen = places(Knows(now)), tracks(now)
    off = np.linalg.norm(found.locate(None, seen, 0.0) - now[seen.id], axis=1)
    assert off.max() < 1e-9 and np.abs(now[seen.id, 2] - REST[seen.id, 2]).max() > 0.02
    found.renew()
    assert found.locate(None, tracks(REST), 0.0) == pytest.approx(REST[seen.id], abs=1e-9)


def test_without_a_calibration_markers_that_moved_have_no_place():
    now = dented(REST, np.array([0.02, -0.015]), 0.025)
    seen = tracks(now)
    found = places().locate(None, seen, 0.0)
    near = np.hypot(*(REST[seen.id, :2] - [0.02, -0.015]).T) < 0.05
    assert np.isnan(found[near]).all() and np.array_equal(np.isnan(found[:, 0]), np.isnan(found[:, 2]))
