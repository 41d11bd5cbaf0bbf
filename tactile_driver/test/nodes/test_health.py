# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import math
from dataclasses import replace

import numpy as np
import pytest
from tactile_driver.nodes import health as module
from tactile_driver.nodes.health import SampleMeter, capture_health, unconfigured_health
from tactile_driver.nodes.runtime.diagnostics import ERROR, OK, WARN
from tactile_driver.sources.capture import CaptureStatus

GOOD = CaptureStatus('running', 300, 2, 1, 29.9, 0.02, '')
ABOUT = {'source': 'device', 'path': '/dev/video0', 'serial': 'A111', 'rate': 30.0}


def test_a_camera_that_runs():
    health = capture_health(GOOD, ABOUT, True, '')
    assert (health.level, health.message) == (OK, '29.9 Hz')
    assert health.values['rate (Hz)'] == 29.9 and health.values['dropped'] == 2 and health.values['corrupt'] == 1
    assert health.values['device'] == '/dev/video0' and health.values['age (s)'] == 0.02


@pytest.mark.parametrize(('change', 'level', 'said'), [
    ({'rate': 14.0}, WARN, '14.0 Hz instead of 30.0 Hz'), ({'age_s': 3.0}, ERROR, 'no frame for 3.0 s'),
    ({'failing': True, 'error': 'torn', 'age_s': 3.0}, ERROR, 'torn'),
    ({'state': 'lost', 'error': 'pulled out'}, ERROR, 'pulled out'), ({'state': 'failed', 'error': 'gone'}, ERROR, 'gone'),
    ({'left_out': 0.25}, WARN, '25 % of the frames are skipped'), ({'left_out': 0.01}, OK, '29.9 Hz'),
    ({'state': 'ended'}, OK, 'is over'), ({'state': 'paused'}, OK, 'not active'),
    ({'rate': math.nan, 'age_s': math.nan}, OK, 'waiting for the first frame')])
def test_what_goes_wrong_is_said(change, level, said):
    health = capture_health(replace(GOOD, **change), ABOUT, True, '')
    assert health.level == level and said in health.message


def test_a_recordings_rate_is_no_complaint():
    assert capture_health(replace(GOOD, rate=3.0, age_s=20.0), ABOUT, False, '').level == OK


def test_without_a_source():
    assert unconfigured_health('', False).level == OK
    missing = unconfigured_health('no such device', True)
    assert missing.level == ERROR and 'retries' in missing.message and missing.values['last error'] == 'no such device'


def test_topics_that_nobody_wants_are_no_complaint():
    health = capture_health(replace(GOOD, age_s=30.0, rate=0.0), {**ABOUT, 'idle': True}, True, '')
    assert (health.level, health.message) == (OK, 'nobody subscribes')


def fed(monkeypatch, rate=1000, level=1.0, since=0.0):
    """A meter that was given 5 s of samples, since s ago."""
    now = [100.0]
    monkeypatch.setattr(module.time, 'monotonic', lambda: now[0])
    meter = SampleMeter(4.9)
    for _ in range(1000):
        now[0] += 5 / rate
        meter.add(np.full((5, 4), level))
    now[0] += since
    return meter


def test_a_rate_of_samples_and_their_saturation_are_measured(monkeypatch):
    meter, about = fed(monkeypatch), {'crc errors': 3, 'rate': 1000.0}
    assert meter.rate == pytest.approx(1000, rel=0.01)
    health = capture_health(GOOD, about, True, '', meter=meter)
    assert (health.level, health.values['crc errors'], health.values['samples'], health.values['saturated (%)']) == (OK, 3, 5000, 0)
    assert 'saturated' in capture_health(GOOD, {}, True, '', meter=fed(monkeypatch, level=4.95)).message
    assert capture_health(GOOD, {'rate': 2000.0}, True, '', meter=meter).level == WARN
    assert capture_health(GOOD, about, True, '', meter=fed(monkeypatch, since=10.0)).message.startswith('waiting'), 'of long ago'
