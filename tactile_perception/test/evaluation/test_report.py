# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The report says in words what the numbers say, and is JSON; pictures are made of what there is, and of nothing else."""
import json

import cv2
import numpy as np
import pytest
from made import contact, region, slip
from tactile_perception.evaluation.evaluation import Evaluation, Instant
from tactile_perception.evaluation.plots import draw
from tactile_perception.tools.evaluate import plain, text

TIMES = {'latency_ms': {'contacts': {'median': 12.34, 'within_95': 20.0, 'worst': 99.9, 'count': 5}}, 'stages_ms': {}, 'memory_mb': 151.2,
         'left_out': ['2 of image_raw: image is black']}


def report(*frames, times=TIMES):
    evaluation = Evaluation()
    for k, (reported, true) in enumerate(frames):
        evaluation.add(float(k), reported, true)
    return {'instants': {'judged': len(frames), 'without an estimate': 3, 'without truth': 0}, **evaluation.summary(), 'times': times}


def test_the_text_says_it_all():
    reported = Instant([contact(1e-3, 0, 1.25e-3, flags=1)], region(10e-3, [1, 0]), slip(1, 0.5, 1e-3), np.arange(6.0))
    page = text(report((reported, Instant([contact(0, 0)], region(10e-3, [1, 2]), slip(2, 1.0, 1e-3), np.arange(6.0)))))
    rows = {line[:50].strip(): line[50:].split() for line in page.splitlines()}
    assert rows['depth of the touch'] == ['mm', '0.25', '0.25', '0.25', '1', '0']
    assert '1 instants compared; 3 without an estimate' in page and 'touches:  1 true, 0 missed, 0 false' in page
    assert 'flags:    1 OUT_OF_RANGE' in page and 'depth of the touch +0.25 mm' in page and 'normalised squared error' in page
    assert 'latency of contacts: 12.3 ms in the median, 20 in 95 %, 99.9 at most' in page
    assert 'memory: 151 MB' in page and 'left out: 2 of image_raw: image is black' in page
    assert max(map(len, page.splitlines())) < 180


def test_of_little_little_is_said():
    page = text(report((Instant(wrench=np.ones(6)), Instant(wrench=np.ones(6))),
                       times={'latency_ms': {}, 'stages_ms': {}, 'memory_mb': np.nan, 'left_out': []}))
    assert 'touches:' not in page and 'dots' not in page and 'covariance' not in page and 'memory' not in page
    assert 'force of the wrench' in page


def test_json_has_none_for_what_is_not_known():
    found = plain(report((Instant([]), Instant([]))))
    assert found['touches']['reported_after_ms']['median'] is None
    assert json.loads(json.dumps(found, allow_nan=False)) == found


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
