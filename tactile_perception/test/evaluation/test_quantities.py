# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.evaluation.evaluation import QUANTITIES, Errors, over_surface, over_time, spread


def errors(values, x=0.0):
    found = Errors()
    for k, value in enumerate(values):
        found.add(float(k), np.array([x * k, 0.0]), value)
    return found


def test_spread_in_the_unit_of_the_quantity():
    found = spread(1e-3 * np.array([-3.0, 1.0, -2.0]), QUANTITIES['depth'])
    assert [found[name] for name in ('median', 'worst', 'bias')] == pytest.approx([2, 3, -2]) and found['count'] == 3
    assert found['within_95'] == pytest.approx(2.9)
    assert np.isnan(spread(np.zeros(0), QUANTITIES['depth'])['median'])


def test_of_an_overlap_the_least_is_the_worst():
    found = spread(np.linspace(0, 1, 101), QUANTITIES['region_overlap'])
    assert found['worst'] == 0 and found['within_95'] == pytest.approx(0.05) and 'bias' not in found


def test_over_time_and_over_the_surface():
    table = errors([1e-3] * 60 + [5e-3] * 60, x=1e-4).table()
    times = over_time(table, QUANTITIES['place'])
    assert len(times) == 12 and times[0]['median'] == pytest.approx(1) and times[-1]['median'] == pytest.approx(5)
    assert sum(part['count'] for part in times) == 120 and times[-1]['to_s'] == 119
    cells = over_surface(table, QUANTITIES['place'])
    assert [cell['median'] for cell in cells] == pytest.approx([1, 1, 3, 5, 5]) and sum(cell['count'] for cell in cells) == 120
    assert cells[0]['x_mm'] == pytest.approx(1.19)
