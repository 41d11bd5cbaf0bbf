# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Where contacts end between dots, against the same in NumPy and against loads of edges at known places."""
import numpy as np
import pytest
from tactile_perception import _core


def placed(score, load):
    rows, columns = score.shape
    return _core.place_edges(score.ravel(), load.ravel(), rows=rows, columns=columns).reshape(score.shape)


def share(touched, free, beyond):
    free = max(free, 0.0)
    both = max(touched + free - 0.5, 0.05)
    return np.clip(both - np.sqrt(max(both**2 - 2 * free, 0.0)) + 0.25 + 0.5 * np.clip(beyond, -1, 1), 0.03, 0.97)


def reference(score, load):
    found = score.copy()
    wide = np.pad(load, 2)

    def between(inside, outside):
        """Share of the way from the touched place to the free one, by the loads on both and on the next one."""
        return share(load[inside], load[outside], wide[tuple(2 * np.array(outside) - inside + 2)])

    for place in np.ndindex(score.shape):
        touched, inverse = score[place] > 0.5, 0.0
        for step in ((0, 1), (1, 0)):
            distances = []
            for other in (tuple(np.add(place, step)), tuple(np.subtract(place, step))):
                if min(other) < 0 or (np.array(other) >= score.shape).any() or (score[other] > 0.5) == touched:
                    continue
                distances.append(between(place, other) if touched else 1 - between(other, place))
            inverse += min(distances)**-2 if distances else 0.0
        if inverse > 0:
            found[place] = (score[place] + 0.5 + (0.5 if touched else -0.5) * min(inverse**-0.5, 1.0)) / 2
    return found


@pytest.mark.parametrize('seed', range(4))
def test_random_scores_and_loads(seed):
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(2, 15, 2))
    score, load = rng.uniform(size=shape), rng.normal(1, 1, shape)
    found = placed(score, load)
    np.testing.assert_allclose(found, reference(score, load), atol=1e-12)
    np.testing.assert_array_equal(found > 0.5, score > 0.5)


@pytest.mark.parametrize('line', [0.0, 0.4, 1.5])
@pytest.mark.parametrize('edge', [0.1, 0.4, 0.7])
def test_an_edge_is_found_from_the_loads_that_it_gives_to_both_dots(edge, line):
    load = np.tile([1.0, 1.0, 0.5 + edge - edge**2 / 2 + line * (1 - edge), edge**2 / 2 + line * edge, 0.0], (3, 1))
    score = np.tile([1.0, 1.0, 1.0, 0.0, 0.0], (3, 1))
    inside, outside = placed(score, load)[1, 2:4]
    found = min(edge + 0.25, 0.97)
    assert inside == pytest.approx((1.5 + found / 2) / 2) and outside == pytest.approx((0.5 - (1 - found) / 2) / 2)


def test_a_score_without_an_edge_beside_it_stays():
    score = np.full((4, 5), 0.2)
    np.testing.assert_array_equal(placed(score, np.ones((4, 5))), score)
    assert np.isfinite(placed(np.eye(5), np.full((5, 5), np.nan))).all() and np.isfinite(placed(np.eye(5), np.full((5, 5), np.inf))).all()
