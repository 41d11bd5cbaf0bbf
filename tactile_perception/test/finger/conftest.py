# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A simulated finger, and the model that its calibration scene gives."""
import played
import pytest

from tactile_perception.finger.calibration import find_presses, fit_finger
from tactile_perception.finger.parameters import PsdFinger


@pytest.fixture(scope='session')
def fit():
    return fit_finger(find_presses([played.recording('calibration')], 4.9))


@pytest.fixture(scope='session')
def model(fit):
    return fit.model


@pytest.fixture
def finger(model):
    return PsdFinger(model)
