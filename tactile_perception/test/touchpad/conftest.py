# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the tests of the pad's surface share: recordings with the truth of their dots."""
import json
import os
from pathlib import Path

import numpy as np
import pytest
from tactile_perception.common.camera import CameraModel
from cap_with_dots import pad, recording  # noqa: F401
from pressed_ball import ball  # noqa: F401


class TouchpadRecording:
    """Truth of one recording, and measurements made of it with known errors."""

    def __init__(self, folder):
        description = json.loads((folder / 'sensor.json').read_text())
        camera = description['cameras'][0]
        self.camera = CameraModel(np.array(camera['K'], float), np.array(camera['dist_k1_k2_p1_p2_k3'], float),
                                  np.array(camera['R_cam_from_sensor']), np.array(camera['t_cam_from_sensor']))
        self.truth = dict(np.load(folder / 'truth.npz'))
        self.rest = self.truth['dot_rest_xyz'].astype(float)
        self.info = description['info']
        self.centring = self.truth['uv'][0] - self.camera.project(self.rest)

    def measure(self, frame, rng, pixel=0.008, spread=18e-6, gain=0.0):
        """Unit rays (K, 3), ranges (K,) m with noise and an error that grows with the displacement, and the true ranges (K,)."""
        origin, place = self.camera.centre, self.truth['dot_xyz'][frame].astype(float)
        rays = self.camera.rays(self.truth['uv'][frame] - self.centring + rng.normal(size=(len(place), 2)) * pixel)
        true = ((place - origin) * rays).sum(1)
        moved = true - np.linalg.norm(self.rest - origin, axis=1)
        return rays, true + gain * moved + rng.normal(size=len(true)) * spread, true


@pytest.fixture
def touchpad():
    """Opens a touchpad recording by name; skips where there are none."""
    def open_recording(name):
        root = os.environ.get('TACTILE_RECORDINGS')
        if not root:
            pytest.skip('set TACTILE_RECORDINGS to the folder of recordings to run this')
        return TouchpadRecording(Path(root) / 'simulated' / name)
    return open_recording
