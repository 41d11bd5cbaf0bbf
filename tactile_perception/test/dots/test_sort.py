# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.dots import Dots
from tactile_perception.dots.published import SortNumbers

ACROSS, FRAME = 20.0, 1 / 30
REST = np.stack(np.meshgrid(np.arange(6) * 30.0, np.arange(5) * 30.0), -1).reshape(-1, 2)
WAY = np.arange(60)[:, None] * [3.0, -5.0]  # px, of each frame: in four of them more than a marker is across


def markers(uv):
    return Dots(uv, np.full(len(uv), np.pi / 4 * ACROSS**2), np.full(len(uv), np.nan))


@pytest.mark.parametrize('pattern', [REST, None])
def test_numbers_stay_with_markers_that_move_in_any_order(pattern):
    numbers, rng = SortNumbers(pattern), np.random.default_rng(0)
    assert np.array_equal(numbers.update(markers(REST), 0.0), np.arange(len(REST)))
    for k, moved in enumerate(WAY, 1):
        order = rng.permutation(len(REST))
        assert np.array_equal(numbers.update(markers(REST[order] + moved + rng.normal(0, 0.3, REST.shape)), k * FRAME), order)


@pytest.mark.parametrize('hidden, found', [(3, True), (30, False)])
def test_a_marker_that_is_hidden_is_found_where_it_was_going_but_not_for_ever(hidden, found):
    numbers = SortNumbers(REST)
    for k, moved in enumerate(WAY):
        seen = np.arange(len(REST)) != 8 if 20 <= k < 20 + hidden else np.full(len(REST), True)
        id = numbers.update(markers((REST + moved)[seen]), k * FRAME)
        assert np.array_equal(np.delete(id, 8) if seen.all() else id, np.delete(np.arange(len(REST)), 8))
    assert id[8] == (8 if found else -1)


def test_a_step_beyond_what_overlaps_and_a_new_marker_have_no_number():
    numbers = SortNumbers(REST)
    assert numbers.update(markers(np.vstack([REST, [[400.0, 400.0]]])), 0.0)[-1] == -1
    assert (numbers.update(markers(REST + 15.0), FRAME) == -1).all()
