# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures are made of what there is, and of nothing else."""

import cv2
import numpy as np
import pytest
from tactile_perception.evaluation.evaluation import Evaluation, Instant
from tactile_perception.evaluation.plots import draw

from made import contact, region, slip


def evaluation():
    found, rng = Evaluation(), np.random.default_rng(0)
    for k in range(60):
        x, y = rng.normal(0, 5e-3, 2)
        true = Instant([contact(x, y)] if k > 10 else [], region(5e-3 * (k > 10), [1, 2, 0], (x, y)), slip(2, 1.0, 1e-3), np.ones(6))
        reported = Instant([contact(x + 1e-4, y)] if k > 10 else [], region(5e-3 * (k > 10), [1, 1, 0], (x, y)), slip(1, 0.7, 0.0),
                           np.ones(6))
        found.add(0.1 * k, reported, true)
    return found


@pytest.mark.full
def test_all_pictures(tmp_path):
    paths = draw(evaluation(), 'a_bag', tmp_path)
    assert [path.name for path in paths] == ['errors_over_time.png', 'errors_over_surface.png', 'states.png']
    for path in paths:
        picture = cv2.imread(str(path))
        assert picture.shape[0] > 200 and np.ptp(picture) == 255 and path.stat().st_size < 400_000


def test_nothing_is_drawn_of_nothing(tmp_path):
    assert draw(Evaluation(), 'a_bag', tmp_path) == []


def test_a_single_error_can_be_drawn(tmp_path):
    one = Evaluation()
    one.add(0.0, Instant([contact(0, 0)]), Instant([contact(0, 0)]))
    assert [path.name for path in draw(one, 'a_bag', tmp_path)] == ['errors_over_time.png', 'errors_over_surface.png']
