# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_perception.psd.table import CellTable

PLACE = np.random.default_rng(1).uniform(-1, 1, (500, 2))


def values(place):
    x, y = place.T
    return np.column_stack([np.sin(2 * x) * np.cos(y), 3 * x - y, np.full(len(x), 7.0)])


def test_values_and_slopes_between_the_corners():
    table = CellTable(values)
    assert table.look_up(PLACE) == pytest.approx(values(PLACE), abs=2e-4)
    found, slopes = table.with_slopes(PLACE[3])
    step = 1e-5
    expected = np.stack([(values(PLACE[3:4] + d) - values(PLACE[3:4] - d))[0] / (2 * step) for d in ((step, 0), (0, step))], axis=1)
    assert found == pytest.approx(values(PLACE[3:4])[0], abs=2e-4) and slopes == pytest.approx(expected, abs=0.03)


def test_at_and_beyond_the_border_it_is_the_border():
    corners = np.array([[1.0, 1.0], [-1.0, -1.0], [2.0, 0.0], [-9.0, 5.0]])
    assert CellTable(values).look_up(corners) == pytest.approx(values(np.clip(corners, -1, 1)), abs=1e-6)
