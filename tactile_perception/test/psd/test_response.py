# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_perception.errors import BadCalibration
from tactile_perception.psd.response import features, fit_load, fit_touch_level, level_basis, place_part

RNG = np.random.default_rng(2)
PLACE = RNG.uniform(-0.6, 0.6, (120, 2))
SQUARE = (PLACE**2).sum(1)
FORCE = RNG.uniform(0.5, 4.0, 120)
LIGHT = 2.5 * FORCE**0.7 * (1 - 0.8 * SQUARE) * RNG.normal(1, 0.01, 120)


def test_force_from_light_and_position():
    fitted, error = fit_load(PLACE, LIGHT, FORCE)
    found = np.exp(features(PLACE, LIGHT) @ fitted)
    assert np.median(np.abs(found / FORCE - 1)) < 0.03 and error < 0.03
    assert place_part(fitted, PLACE) == pytest.approx(features(PLACE, np.ones(120)) @ fitted)


@pytest.mark.parametrize('chosen', [slice(0, 5), FORCE < 0.6])
def test_too_few_or_equal_loads_are_refused(chosen):
    with pytest.raises(BadCalibration, match='12 are needed'):
        fit_load(PLACE[chosen], LIGHT[chosen], FORCE[chosen])


def test_light_at_first_contact_by_position():
    level = 0.3 * (1 - 0.7 * SQUARE)
    fitted, span = fit_touch_level(PLACE, level + RNG.normal(0, 0.01, 120), 8 * level, 0.02)
    assert level_basis(PLACE, len(fitted)) @ fitted == pytest.approx(level, abs=0.015)
    assert 0.1 < span[0] < span[1] < 0.33 and 0.7 < span[2] < 0.9
    few, _ = fit_touch_level(PLACE[:3], level[:3], 8 * level[:3], 0.02)
    assert len(few) == 1


@pytest.mark.parametrize('level', [np.full(20, 1.5), np.full(20, 0.0), np.tile([0.05, 0.6], 10)])
def test_onsets_labelled_late_or_at_random_are_refused(level):
    with pytest.raises(BadCalibration, match='onset'):
        fit_touch_level(PLACE[:20], level, np.full(20, 2.0), 0.02)
