# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np

from tactile_perception.dots.index.extrapolate import grow

ROW, COLUMN = np.divmod(np.arange(196), 14)
RC = np.stack([ROW, COLUMN], axis=1)
UV = np.stack([20 * COLUMN + 0.15 * (COLUMN - 6.5) ** 2, 20 * ROW + 3 * COLUMN], axis=1)  # bent and sheared


def test_numbers_go_on_over_gaps():
    kept = np.random.default_rng(1).uniform(size=196) > 0.3
    member = (COLUMN < 4)[kept]
    rc, grown = grow(UV[kept], np.where(member[:, None], RC[kept], 0), member, 20.0)
    assert grown.all()
    np.testing.assert_array_equal(rc, RC[kept])


def test_dots_between_the_rows_stay_out():
    uv = np.vstack([UV, UV[[60, 100]] + [9.0, 10.0]])
    member = np.append(COLUMN < 6, [False, False])
    rc, grown = grow(uv, np.vstack([RC, [[0, 0], [0, 0]]]), member, 20.0)
    assert not grown[196:].any()
    assert grown[:196].all()
    np.testing.assert_array_equal(rc[:196], RC)


def test_a_wrong_number_does_not_stay():
    rc, member = RC.copy(), np.ones(196, bool)
    rc[77, 1] += 1
    _, grown = grow(UV, rc, member, 20.0)
    assert not grown[77]
    assert grown.mean() > 0.9


def test_too_few_dots_stay_as_they_are():
    member = np.array([True, True, False])
    _, grown = grow(UV[:3], RC[:3], member, 20.0)
    np.testing.assert_array_equal(grown, member)
