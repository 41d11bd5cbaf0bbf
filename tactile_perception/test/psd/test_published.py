# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import played
import pytest

from tactile_perception.errors import BadArgument
from tactile_perception.psd.finger import FingerSettings, PsdFinger
from tactile_perception.psd.geometry import error_angle
from tactile_perception.psd.published import PaperFinger


def test_the_published_method_is_less_accurate_than_the_map(model):
    volts, truth = played.scene('grid')
    errors = {}
    for name, finger in (('paper', PaperFinger(model, FingerSettings(), 0.2)), ('map', PsdFinger(model))):
        samples = finger.process(volts, played.PERIOD)
        runs = [r for r in samples.runs() if samples.contact[r].sum() > 100]
        errors[name] = [np.degrees(error_angle(finger.touch(samples, r).normal, truth.normal[r.start + 100])) for r in runs]
    assert len(errors['paper']) == len(errors['map']) == 25
    assert np.mean(errors['paper']) > 2 * np.mean(errors['map'])


def test_its_offset_is_constant_so_drift_becomes_contact(model):
    finger = PaperFinger(model, FingerSettings(), 0.2)
    samples = finger.process(played.scene('light')[0], played.PERIOD)
    assert samples.contact.mean() > 0.2


def test_bad_threshold(model):
    with pytest.raises(BadArgument, match='threshold'):
        PaperFinger(model, FingerSettings(), 0.0)
