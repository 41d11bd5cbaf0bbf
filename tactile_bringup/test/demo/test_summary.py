# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import math

import pytest

from tactile_bringup.demo.summary import Reading, Summary

TOUCH = dict(dots=529, displacement=7.25, states=(400, 100, 29), area=84e-6, depth=2.5e-3, force=1.5, touches=1,
             motion=(1e-3, 0, 0, 0, 0, 0.1), motion_interval=0.1, slip='incipient slip', slipping=0.22)


def filled(count=91, rate=30.0, **values):
    summary = Summary()
    for k in range(count):
        summary.add(Reading(k / rate, 0.01 + 1e-4 * k, **values))
    return summary


def test_rate_and_latency():
    summary = filled(100)
    assert summary.rate == pytest.approx(30.0)
    assert summary.latency_ms(50) == pytest.approx(10 + 0.1 * (10 + 89 / 2))
    assert summary.latency_ms(50, lately=False) == pytest.approx(10 + 0.1 * 99 / 2)
    assert math.isnan(Summary().rate) and math.isnan(Summary().latency_ms(50))


def test_stamps_of_a_recording_tell_no_latency():
    summary = Summary()
    for k in range(10):
        summary.add(Reading(k / 30, 1.7e9))
    assert math.isnan(summary.latency_ms(50)) and 'latency - ms' in summary.report()[0]


def test_the_panel_says_the_numbers_in_their_units():
    text = '\n'.join(filled(**TOUCH).panel(Reading(3.0, 0.02, **TOUCH)))
    for words in ('3.0 s', '30.0 Hz', '529', '400 untouched, 100 sticking, 29 slipping', '1 touch, 84 mm^2, 2.50 mm deep, 1.50 N',
                  '(+10.0, +0.0, +0.0) mm/s, turning 57 deg/s', 'incipient slip, 22 % of the contact'):
        assert words in text


def test_what_is_not_known_is_not_made_up():
    line = filled().line(Reading(1.0, dots=70))
    assert '70 dots' in line and 'largest displacement - px' in line and 'nan' not in line
    assert 'nan' not in '\n'.join(filled().panel(Reading(1.0, touches=1, states=(1, 2, 3))))


def test_the_report_tells_the_largest():
    summary = filled(**TOUCH)
    summary.add(Reading(4.0, 0.02, **{**TOUCH, 'force': 3.25}))
    frames, largest = summary.report()
    assert frames.startswith('92 frames')
    assert largest == 'largest displacement 7.2 px, area 84 mm^2, depth 2.5 mm, force 3.2 N'
    assert Summary().report()[1] == 'largest values unknown'
