# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Noise from zero to the point where an estimator must give up: errors grow in proportion, then there is no result, never a confident
wrong one.

Every error is at most slope times noise, above a floor without noise, and at most six of its stated standard deviations above that floor,
where these are stated.
"""
from dataclasses import dataclass

import numpy as np
import pytest
import rig
from printed_dots import make_scene

from tactile_perception import detect_dots, index_dots
from tactile_perception.core.errors import TactileError

UNKNOWN = np.nan, np.nan


@dataclass(frozen=True)
class Ramp:
    """estimate: (level, rng) -> (error, its standard deviation or NaN), error NaN for no result; levels: rising, the first without noise;
    floor, slope: of the error; gives_up: level from which on there is no result, infinite where the last still has one."""

    estimate: object
    levels: tuple
    floor: float
    slope: float
    gives_up: float


def _detected(method):
    """RMS error of positions, px, by noise of the image, grey levels; no result where not nine dots of ten are found."""
    scene = make_scene('plain', 1)

    def estimate(level, rng):
        dots = detect_dots(scene.frame(level, rng), 'dark', method)
        apart = np.hypot(*(scene.uv[:, None] - dots.uv).transpose(2, 0, 1))
        right = apart.min(axis=1) < 3
        if right.mean() < 0.9:
            return UNKNOWN
        false = np.mean(apart.min(axis=0) > 3) > 0.1
        return (np.inf if false else float(np.sqrt(np.mean(apart.min(axis=1)[right]**2)))), float(np.median(dots.sigma))
    return estimate


def _numbered(level, rng):
    """Share of wrong numbers, by noise of positions in pitches."""
    scene = make_scene('plain', 1)
    found = index_dots(scene.uv + rng.normal(0, level * 18.0, scene.uv.shape), 23, 23)
    known = found.id >= 0
    return (float(np.mean(found.id[known] != np.flatnonzero(known))) if found.certain and known.any() else np.nan), np.nan


def _pressed(sensor):
    """Error of the deepest contact's position, m (finger: angle, rad), by noise of raw data in counts (finger: V); untouched data are as
    noisy, and a contact in them is infinitely wrong."""
    def estimate(level, rng):
        of = rig.seen(sensor)
        chain, true = of.chain(), of.truth[0]

        def noisy(raw):
            values = raw + rng.normal(0, 1, raw.shape) * level
            return values if sensor == 'psd_finger' else np.clip(np.rint(values), 0, 255).astype(np.uint8)
        for raw in of.rest[:12]:
            if rig.contacts(chain(noisy(raw))) and sensor in rig.SENSORS[:4]:
                return np.inf, np.nan
        found = rig.contacts(chain(noisy(of.pressed)))
        if not found:
            return UNKNOWN
        deepest = max(found, key=lambda contact: np.nan_to_num(contact.depth, nan=1.0))
        off = deepest.normal - true.normal if sensor == 'psd_finger' else (deepest.position - true.position)[:2]
        scale = 1 / 0.016 if sensor == 'psd_finger' else 1.0
        return float(np.linalg.norm(off)), scale * float(np.sqrt(np.trace(deepest.covariance)))
    return estimate


RAMPS = {
    'dots, likelihood': Ramp(_detected('likelihood'), (0, 8, 64), 0.02, 0.006, 64),
    'dots, blobs': Ramp(_detected('blobs'), (0, 2, 8, 64), 0.05, 0.015, 64),
    'numbers': Ramp(_numbered, (0, 0.05, 0.1, 0.3, 1), 0.0, 0.0, 0.3),
    'touchpad': Ramp(_pressed('touchpad'), (0, 16, 64), 5e-4, 5e-5, 64),
    'areal_single': Ramp(_pressed('areal_single'), (0, 8, 16, 128), 1e-3, 1e-4, 128),
    'air_cushion': Ramp(_pressed('air_cushion'), (0, 8, 128), 6e-3, 1e-3, 128),
    'psd_finger': Ramp(_pressed('psd_finger'), (0, 0.01, 0.1, 1, 3), 0.02, 1.0, 3),
    'taxel_array': Ramp(_pressed('taxel_array'), (0, 1, 10, 100), 3e-4, 1e-4, 100),
}


@pytest.mark.parametrize('name', RAMPS)
@pytest.mark.filterwarnings('ignore::RuntimeWarning')
def test_errors_grow_with_noise_and_then_there_is_no_result(name):
    ramp = RAMPS[name]
    for level in ramp.levels:
        try:
            error, sigma = ramp.estimate(level, np.random.default_rng(1))
        except TactileError:
            error, sigma = UNKNOWN
        if level >= ramp.gives_up:
            assert np.isnan(error), f'under noise of {level:g} there is a result, {error:g} off'
            continue
        assert not error > ramp.floor + ramp.slope * level, f'{error:g} off under noise of {level:g}'
        assert level or np.isfinite(error), 'without noise there is a result'
        assert not error > 6 * sigma + ramp.floor, f'sure and wrong under noise of {level:g}: {error:g} off, {sigma:g} stated'
