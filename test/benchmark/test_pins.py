# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import os
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
import pins  # noqa: E402

FOLDER = Path(os.environ.get('TACTILE_RECORDINGS', '')) / 'pin_array_127'


@pytest.mark.skipif(not FOLDER.is_dir(), reason='TACTILE_RECORDINGS holds no pin_array_127')
def test_all_pins_are_matched_and_tell_depth_and_tilt():
    """How far the pins slid they hardly tell: friction lets go, and how much of the slide is left differs from press to press."""
    found = pins.run(FOLDER)
    assert np.all(found['matched'] == 127)
    assert found['depth, mm'][0] < 0.08 and found['depth, mm'][1] < 0.2
    assert found['tilt, deg'][0] < 3.0
    assert found['slide, mm'][0] < 1.05 * found['slide, mm'][2]


def test_regression_predicts_what_is_quadratic_and_says_nothing_of_noise():
    rng = np.random.default_rng(0)
    hidden = rng.normal(0, 1, (120, 3))
    x = pins.features(hidden @ rng.normal(0, 1, (3, 40)), np.arange(60))
    y = hidden[:, 0] + 0.5 * hidden[:, 1] * hidden[:, 2]
    assert np.abs(pins.predict(x, y, np.arange(60), np.arange(60, 120)) - y[60:]).max() < 0.05
    noise = rng.normal(0, 1, 120)
    assert np.abs(pins.predict(x, noise, np.arange(60), np.arange(60, 120))).std() < 0.5
