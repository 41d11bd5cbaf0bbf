# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Rest places lie on the cap under their untouched images, and are renewed only when the reference has moved."""
import numpy as np
import pytest
from tactile_perception.camera import CameraModel
from tactile_perception.dots.dots import DotTracks
from tactile_perception.pipeline.rest_places import RestPlaces
from tactile_perception.surface.cap import Cap

CAMERA = CameraModel([[700, 0, 320], [0, 700, 240], [0, 0, 1]], translation=[0, 0, 0.04])


def tracks(uv, duv):
    n = len(uv)
    return DotTracks(3, 3, np.arange(n), uv + duv, np.full(n, 90.0), np.full(n, 0.02), np.broadcast_to(duv, (n, 2)).astype(float))


@pytest.fixture
def rest():
    return RestPlaces(Cap(), CAMERA, 3, 3)


def test_places_are_on_the_sphere_and_project_to_the_untouched_image(rest):
    uv = np.array([[300.0, 220.0], [320.0, 240.0], [420.0, 300.0]])
    assert rest.update(tracks(uv, np.array([4.0, -2.0])))
    assert np.linalg.norm(rest.xyz[:3] - [0, 0, -0.007], axis=1) == pytest.approx(0.02, abs=1e-12)
    assert CAMERA.project(rest.xyz[:3]) == pytest.approx(uv, abs=1e-9)
    assert np.isnan(rest.xyz[3:]).all()


def test_only_a_moved_reference_or_a_new_dot_counts(rest):
    uv = np.array([[300.0, 220.0], [320.0, 240.0]])
    assert rest.update(tracks(uv, np.zeros(2)))
    assert not rest.update(tracks(uv + 0.01, np.array([9.0, 9.0])))
    assert rest.update(tracks(uv + 0.05, np.zeros(2)))
    assert rest.update(tracks(np.vstack([uv, [[350.0, 260.0]]]), np.zeros(2)))
    missing = tracks(uv, np.zeros(2))
    missing.duv[0] = np.nan
    rest.update(missing)
    assert np.isfinite(rest.xyz[:3]).all()
