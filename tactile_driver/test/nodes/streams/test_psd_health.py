# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import math
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')

from tactile_driver.nodes.runtime.diagnostics import ERROR, OK, WARN  # noqa: E402
from tactile_driver.nodes.streams import psd_health  # noqa: E402
from tactile_driver.nodes.streams.psd_health import SampleMeter, sample_health  # noqa: E402
from tactile_driver.sources.base.capture import CaptureStatus  # noqa: E402

GOOD = CaptureStatus('running', 300, 0, 0, 200.0, 0.004, '')


def fed(monkeypatch, rate=1000, level=1.0, since=0.0):
    now = [100.0]
    monkeypatch.setattr(psd_health.time, 'monotonic', lambda: now[0])
    meter = SampleMeter(4.9)
    for _ in range(1000):
        now[0] += 5 / rate
        meter.add(np.full((5, 4), level))
    now[0] += since
    return meter


def test_rate_and_saturation_are_measured(monkeypatch):
    meter = fed(monkeypatch)
    assert meter.rate == pytest.approx(1000, rel=0.01) and meter.samples == 5000 and meter.saturated_part == 0
    health = sample_health(GOOD, {'crc errors': 3, 'rate': 1000.0}, meter, True, '')
    assert health.level == OK and health.values['crc errors'] == 3
    assert sample_health(GOOD, {}, fed(monkeypatch, level=4.95), True, '').level == WARN


@pytest.mark.parametrize(('change', 'remark', 'level', 'said'), [
    ({'age_s': 3.0}, '', ERROR, 'no samples for 3.0 s'), ({'state': 'lost', 'error': 'pulled out'}, '', ERROR, 'pulled out'),
    ({'state': 'paused'}, '', OK, 'not active'), ({}, 'no frames: baud', WARN, 'baud'),
    ({'left_out': 0.25}, '', WARN, '25 % of the frames are skipped')])
def test_what_goes_wrong_is_said(monkeypatch, change, remark, level, said):
    health = sample_health(replace(GOOD, **change), {}, fed(monkeypatch), True, remark)
    assert health.level == level and said in health.message


def test_samples_of_long_ago_tell_no_rate(monkeypatch):
    meter = fed(monkeypatch, rate=500, since=10.0)
    assert math.isnan(meter.rate) and sample_health(GOOD, {'rate': 1000.0}, meter, True, '').level == OK


def test_too_few_samples_and_none_at_all(monkeypatch):
    assert sample_health(GOOD, {'rate': 2000.0}, fed(monkeypatch), True, '').level == WARN
    assert sample_health(GOOD, {'rate': 2000.0}, SampleMeter(5.0), True, '').message.startswith('waiting')
    assert math.isnan(SampleMeter(5.0).rate)
