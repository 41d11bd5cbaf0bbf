# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Untouched sheets and cushion report no contact: marker fields with the noise measured in images."""
import dataclasses

import numpy as np
import pytest
from tactile_perception.press.methods import make_method
from tactile_perception.press.field import RestMarkers

from sheet_rig import PRESSED_AT, RATE, SENSORS, Sheet

FRAMES = 40  # images in which the noise is measured
COUNT = {'areal_single': 2000, 'areal_dual': 1000, 'air_cushion': 1000}


class Noise:
    """Fields of untouched images with more noise of the camera, and how much each marker's shift and growth vary; fields like them."""

    def __init__(self, kind):
        sheet = Sheet(kind, f'{kind}_press', PRESSED_AT[kind])
        chain, rest = sheet.chain(), RestMarkers(sheet.sensor.rows * sheet.sensor.columns, sheet.make_view)
        rng, fields = np.random.default_rng(2), []
        for k in range(FRAMES):
            grains = rng.normal(0, 1.0, sheet.rest[0].shape)
            image = np.clip(np.rint(sheet.rest[k % len(sheet.rest)] + grains), 0, 255).astype(np.uint8)
            fields.append(rest.field(chain.tracker.process(image, 100.0 + k / RATE)))
        later = fields[FRAMES // 2:]
        self.middle, seen = later[-1], np.all([field.seen for field in later], axis=0)
        self.shift, self.growth = (np.std([getattr(field, name) for field in later], axis=0) for name in ('shift', 'growth'))
        name = sheet.calibration.best
        self.method = make_method(name, sheet.calibration.fitted(name), sheet.sensor)
        self.sure = np.median((self.shift.mean(axis=1) / np.median([field.sigma for field in later], axis=0))[seen])

    def false_touches(self, count, seed=3):
        """Touches told in `count` frames of that noise."""
        rng, told = np.random.default_rng(seed), 0
        for _ in range(count):
            shift = self.shift * rng.standard_normal(self.shift.shape)
            growth = self.growth * rng.standard_normal(self.growth.shape)
            told += len(self.method.estimate(dataclasses.replace(self.middle, shift=shift, growth=growth)))
        return told


@pytest.fixture(scope='module', params=SENSORS)
def noise(request):
    return request.param, Noise(request.param)


def test_the_noise_is_what_the_tracks_say(noise):
    assert 0.3 < noise[1].sure < 3


def test_no_touch_in_noisy_frames(noise):
    assert noise[1].false_touches(COUNT[noise[0]]) == 0


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_no_touch_in_10000_noisy_frames(noise):
    assert noise[1].false_touches(10_000) == 0
