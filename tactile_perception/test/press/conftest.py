# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Fields of a sheet observed from 62 mm with a Gaussian dent."""
import numpy as np
import pytest
from touchpad_bags import recording_folder  # noqa: F401

from tactile_perception.common.marker_sensor import MARKER_SENSORS
from tactile_perception.press.field import MarkerField
from tactile_perception.press.presses import Presses

EYE, WIDTH, NOISE = 0.062, 8e-3, 4e-6
GRID = MARKER_SENSORS['areal_single'].grid()


def _gaussian(xy, position, depth, width=WIDTH):
    return depth * np.exp(-np.sum((xy - position) ** 2, axis=1) / (2 * width**2))


def _field(position, depth, noise=NOISE, seed=0):
    """The MarkerField of one press at position (2,) m of that depth, m."""
    rng = np.random.default_rng([seed, *(int(abs(v) * 1e7) for v in (*position, depth))])

    def zoom(xy):
        return EYE / (EYE - _gaussian(xy, position, depth))
    h = 1e-6
    scale, out = zoom(GRID), np.maximum(np.hypot(*GRID.T), 1e-9)
    slope = (zoom(GRID * (1 + h / out)[:, None]) - scale) / h * out
    growth = np.log(scale * np.abs(scale + slope)) + rng.normal(0, 2e-3, len(GRID))
    shift = GRID * (scale - 1)[:, None] + rng.normal(0, noise, GRID.shape)
    px = 9000.0
    camera_centre = np.tile([0, 0, -EYE], (len(GRID), 1))
    return MarkerField(GRID, shift, growth, camera_centre, GRID * px, shift * px, 400 * np.exp(growth))


def _presses(positions=None, depths=(1.5e-3, 3e-3, 4.5e-3, 6e-3), seed=1):
    """Three untouched frames, then presses; by default at nine positions."""
    if positions is None:
        positions = [(x, y) for y in (-9e-3, 0, 9e-3) for x in (-18e-3, 0, 18e-3)]
    pressed = [(np.array(position), depth) for position in positions for depth in depths]
    fields = [_field((0, 0), 0.0, seed=seed + k) for k in range(3)] + [
        _field(position, depth, seed=seed) for position, depth in pressed]
    position = np.array([[np.nan] * 3] * 3 + [[*position, -depth] for position, depth in pressed])
    return Presses(tuple(fields), position, np.array([0.0] * 3 + [depth for _, depth in pressed]), plate=_plate())


def _plate():
    """A plate that is pressed onto all markers in steps of a millimetre."""
    depths = 1e-3 * np.arange(9)
    zoom = EYE / (EYE - depths)
    still = _field((0, 0), 0.0)
    fields = tuple(MarkerField(GRID, GRID * (z - 1), np.full(len(GRID), 2 * np.log(z)), still.camera_centre, still.uv, still.duv,
                               still.area) for z in zoom)
    position = np.column_stack([np.zeros((9, 2)), -depths])
    return Presses(fields, position, depths)


@pytest.fixture(scope='session')
def bell_field():
    """A function that makes the field of one press."""
    return _field


@pytest.fixture(scope='session')
def bell_presses():
    """A function that makes Presses."""
    return _presses
