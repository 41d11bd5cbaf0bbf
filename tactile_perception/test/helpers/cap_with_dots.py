# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Scenes made by geometry alone: a cap of dots with an object pressed into it."""
import os
from pathlib import Path

import numpy as np
import pytest

from tactile_perception.common.geometry import Cap
from tactile_perception.touchpad.region import ContactDots

ROWS = COLUMNS = 23
PITCH = 1.14e-3


class Pad:
    """A cap with a regular grid of dots over its plane."""

    rows, columns, pitch, cap = ROWS, COLUMNS, PITCH, Cap()

    def __init__(self):
        row, column = np.divmod(np.arange(ROWS * COLUMNS), COLUMNS)
        xy = np.stack([column - 11, row - 11], axis=1) * PITCH
        self.ids = np.arange(ROWS * COLUMNS)
        self.rest = np.column_stack([xy, self.cap.heights(xy)])

    def pressed(self, distance, heights, noise=0.0, state=1, force=None, seed=0):
        """ContactDots under an object: distance (N,) m from its outline seen along z (inside below 0), its heights (N,) over the rim."""
        xyz = self.rest.copy()
        free = np.minimum(self.rest[:, 2], heights + 0.6 * distance)  # the skin leaves the object at a slope
        xyz[:, 2] = np.where(distance < 0, heights, free)
        xyz += np.random.default_rng(seed).normal(0, noise, xyz.shape)
        score = np.clip(0.5 - distance / self.pitch, 0, 1)
        states = np.where(score > 0.5, state, 0).astype(np.uint8)
        return ContactDots(ROWS, COLUMNS, self.ids, xyz, score, states, force, max(noise, 5e-6))

    def disc(self, centre=(0.0, 0.0), radius=5e-3, height=11e-3, **more):
        """A flat disc that rests at a height."""
        distance = np.hypot(*(self.rest[:, :2] - centre).T) - radius
        return self.pressed(distance, np.full(len(self.ids), height), **more)

    def sphere(self, tip=(2e-3, -1e-3, 11e-3), radius=8e-3, **more):
        """A sphere whose lowest point is at tip: it touches where it reaches below the cap."""
        offset = np.sum((self.rest[:, :2] - tip[:2])**2, axis=1)
        heights = tip[2] + radius - np.sqrt(np.maximum(radius**2 - offset, 0))
        steep = np.hypot(*np.gradient((heights - self.rest[:, 2]).reshape(ROWS, COLUMNS), self.pitch)).ravel()
        return self.pressed((heights - self.rest[:, 2]) / np.maximum(steep, 0.1), heights, **more)

    def ring(self, inner=3.5e-3, outer=6.5e-3, height=11e-3, **more):
        """A flat ring."""
        radius = np.hypot(*self.rest[:, :2].T)
        return self.pressed(np.maximum(radius - outer, inner - radius), np.full(len(self.ids), height), **more)


@pytest.fixture
def pad():
    return Pad()


@pytest.fixture
def recording():
    """A function: truth of a recording by its name; skips where there are no recordings."""
    def load(name):
        folder = os.environ.get('TACTILE_RECORDINGS')
        if not folder or not (Path(folder) / 'simulated' / name / 'truth.npz').exists():
            pytest.skip('set TACTILE_RECORDINGS to the folder of recordings to run this')
        with np.load(Path(folder) / 'simulated' / name / 'truth.npz') as truth:
            return {key: truth[key] for key in truth.files}
    return load
