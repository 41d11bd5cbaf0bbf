# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Errors of an evaluation, how they are scored, and how they are reported."""
import json

import cv2
import numpy as np
import pytest
from made import contact, region, slip

from tactile_perception.evaluation.evaluation import QUANTITIES, Evaluation, Instant, TouchCounts, pairs, spread, touch_errors
from tactile_perception.evaluation.plots import draw
from tactile_perception.evaluation.scores import label_f1, normalised_square, region_iou
from tactile_perception.tools.evaluate import plain, text

WRENCH = np.array([0.0, 0.0, -2.0, 0.01, 0.0, 0.0])


def summed(*frames):
    evaluation = Evaluation()
    for k, (reported, true) in enumerate(frames):
        evaluation.add(float(k), reported, true)
    return evaluation.summary()


def test_each_error_in_its_unit():
    reported = Instant([contact(1e-3, 0, 1.2e-3)], region(11e-3, [1, 1, 2, 0], (1e-3, 0)), slip(1, 0.4, 3e-3), 1.1 * WRENCH)
    true = Instant([contact(0, 0, 1e-3)], region(10e-3, [1, 1, 2, 2]), slip(1, 0.5, 1e-3), WRENCH)
    errors = summed((reported, true))['errors']
    middle = {name: found['median'] for name, found in errors.items()}
    assert middle.pop('region_overlap') == pytest.approx(95 / (121 + 100 - 95), abs=0.02), 'of 9.5 mm by 10 mm'
    assert middle == pytest.approx({'position': 1, 'depth': 0.2, 'normal': 0, 'touch_force': 0, 'region_area': 21, 'region_centroid': 1,
                                    'slipping_fraction': 10, 'slip_velocity': 2, 'force': 0.2, 'force_relative': 10, 'moment': 1,
                                    'moment_relative': 10})
    assert errors['depth']['bias'] == pytest.approx(0.2) and errors['slipping_fraction']['bias'] == pytest.approx(-10)


def test_dots_that_are_not_seen_have_a_column_of_their_own():
    reported = region(5e-3, [0, 1, 2])
    found = summed((Instant(region=reported), Instant(region=region(5e-3, [0, 2, 2, 1]))))['dot_states']
    assert found['counts'] == [[1, 0, 0, 0], [0, 0, 0, 1], [0, 1, 1, 0]] and found['reported'][-1] == 'not seen'
    assert found['f1']['slipping'] == pytest.approx(2 / 3)


def test_slip_is_judged_where_something_touches_and_its_velocity_at_the_contact():
    turning = Instant(region=region(5e-3, [], (0.01, 0)), slip=slip(2, 1.0, 0.0, turn=1.0))
    still = Instant(region=region(5e-3, [], (0.01, 0)), slip=slip(2, 1.0, 0.0))
    free = Instant([], region(0, []), slip(1, 0.5, 1.0))
    still.slip.angular[:] = np.nan  # as of a disc
    found = summed((still, turning), (free, Instant([], region(0, []), slip(0, np.nan, 0.0))))
    assert found['slip_states']['counts'] == [[0, 0, 0], [0, 0, 0], [0, 0, 1]] and found['slip_states']['macro_f1'] == 1
    assert found['errors']['slip_velocity']['median'] == pytest.approx(10)


def test_weak_wrenches_have_no_relative_error_and_unknown_ones_are_counted():
    frames = [(Instant(wrench=factor * 1.2 * WRENCH), Instant(wrench=factor * WRENCH)) for factor in (1.0, 0.5, 0.01)]
    errors = summed(*frames, (Instant(wrench=np.full(6, np.nan)), Instant(wrench=WRENCH)))['errors']
    assert errors['force']['count'] == 3 and errors['force_relative']['count'] == 2
    assert errors['force']['not_reported'] == errors['moment_relative']['not_reported'] == 1
    assert errors['force_relative']['worst'] == pytest.approx(20)


def test_of_a_wrench_the_axes_that_are_reported_are_judged():
    reported = np.where(np.arange(6) == 4, np.nan, 1.2 * WRENCH)
    errors = summed((Instant(wrench=reported), Instant(wrench=WRENCH)))['errors']
    assert errors['moment']['median'] == pytest.approx(2) and errors['moment_relative']['median'] == pytest.approx(20)


def test_a_region_that_was_missed_overlaps_by_nothing():
    found = summed((Instant(region=region(0, [])), Instant(region=region(5e-3, []))))
    assert found['errors']['region_overlap']['median'] == 0 and found['errors']['region_centroid']['not_reported'] == 1


def test_what_was_never_said_is_not_judged():
    found = summed((Instant([contact(0, 0)]), Instant(wrench=WRENCH)), (Instant(), Instant()))
    assert found['errors'] == {} and found['dot_states'] is found['slip_states'] is None and found['frames']['judged'] == 0


def test_spread_in_the_unit_of_the_quantity():
    found = spread(1e-3 * np.array([-3.0, 1.0, -2.0]), QUANTITIES['depth'])
    assert [found[name] for name in ('median', 'worst', 'bias')] == pytest.approx([2, 3, -2]) and found['count'] == 3
    assert found['within_95'] == pytest.approx(2.9)
    assert np.isnan(spread(np.zeros(0), QUANTITIES['depth'])['median'])


def test_of_an_overlap_the_least_is_the_worst():
    found = spread(np.linspace(0, 1, 101), QUANTITIES['region_overlap'])
    assert found['worst'] == 0 and found['within_95'] == pytest.approx(0.05) and 'bias' not in found


def counted(frames):
    counts = TouchCounts()
    for k, (reported, true) in enumerate(frames):
        counts.add(0.1 * k, reported, true, pairs(reported, true))
    return counts


def test_pairs_lie_nearest_in_all():
    reported, true = [contact(0, 0, id=5), contact(9e-3, 0, id=6)], [contact(10e-3, 0, id=1), contact(1e-3, 0, id=2),
                                                                     contact(0.05, 0, id=3)]
    assert sorted((t.id, r.id) for t, r in pairs(reported, true)) == [(5, 2), (6, 1)]
    assert pairs([], true) == [] and len(pairs(reported, [contact(np.nan, 0)])) == 1


def test_errors_of_one_touch():
    tilted = (0.0, np.sin(0.1), np.cos(0.1))
    found = touch_errors(contact(3e-4, 4e-4, 1.1e-3, force=1.5, normal=tilted), contact(0, 0))
    assert found == pytest.approx({'position': 5e-4, 'depth': 1e-4, 'normal': 0.1, 'touch_force': -0.5})


def test_what_is_not_true_is_not_judged_and_what_is_not_reported_is_nan():
    found = touch_errors(contact(0, 0, force=np.nan), contact(0, 0, np.nan, normal=[np.nan] * 3))
    assert set(found) == {'position', 'touch_force'} and np.isnan(found['touch_force'])


def test_without_a_depth_the_place_is_one_in_space():
    reported = contact(3e-4, 0, np.nan)
    reported.position[2] = -1e-3 + 4e-4
    assert touch_errors(reported, contact(0, 0))['position'] == pytest.approx(5e-4)


def test_frames_and_touches_are_counted():
    here, other = contact(0, 0), contact(0.02, 0, id=2)
    found = counted([([here], []), ([here], []), ([], []), ([], [here]), ([here], [here]), ([contact(0, 0, id=7)], [here]),
                     ([here], [here, other]), ([here, contact(0.02, 0, id=9)], [here]), ([contact(0, 0, id=8)], [])]).summary()
    assert found['frames'] == {'judged': 9, 'touched': 5, 'missed': 1, 'too_few': 1, 'too_many': 1, 'untouched': 4, 'false': 3}
    assert {name: found['touches'][name] for name in ('there', 'never_reported', 'made_up', 'renumbered')} == {
        'there': 2, 'never_reported': 1, 'made_up': 2, 'renumbered': 2}
    assert found['touches']['reported_after_ms']['median'] == pytest.approx(100)


@pytest.mark.parametrize('factor, mean, within', [(1.0, 1.0, 0.95), (2.0, 0.25, 1.0), (0.5, 4.0, 0.42)])
def test_covariances_that_are_too_large_or_small_are_seen(factor, mean, within):
    rng = np.random.default_rng(1)
    frames = []
    for _ in range(1500):
        reported = contact(0, 0, sigma=1e-4 * factor)
        reported.position[:] += 1e-4 * rng.normal(size=3)
        frames.append(([reported], [contact(0, 0)]))
    found = counted(frames).consistency()
    assert found['mean'] == pytest.approx(mean, rel=0.08) and found['within_95'] == pytest.approx(within, abs=0.02)


def test_without_covariances_nothing_is_said_of_them():
    assert counted([([contact(0, 0, sigma=np.nan)], [contact(0, 0)])]).consistency() == {'count': 0, 'not_stated': 1}


def test_label_f1_takes_the_last_column_for_what_was_not_found():
    confusion = np.array([[6, 2, 0, 2], [0, 3, 0, 0], [0, 0, 0, 0]])
    found = label_f1(confusion)
    assert found[:2] == pytest.approx([12 / 16, 6 / 8]) and np.isnan(found[2])


def square(side, centre=(0.0, 0.0)):
    return np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * side / 2 + [*centre, 0]


def test_holes_are_taken_off():
    whole, hole = square(10e-3), square(5e-3)
    assert region_iou([whole], [whole]) == 1
    assert region_iou([whole, hole], [whole]) == pytest.approx(0.75, abs=0.01)
    assert region_iou([whole], [square(10e-3, (5e-3, 0))]) == pytest.approx(1 / 3, abs=0.01)


def test_nothing_overlaps_with_nothing_unknown():
    assert region_iou([], [square(10e-3)]) == 0
    assert np.isnan(region_iou([], [])) and np.isnan(region_iou([square(1e-3)[:2]], []))


@pytest.mark.parametrize('side', [0.3, 0.01, 1e-3])
@pytest.mark.parametrize('centre', [(0.0, 0.0), (-0.06, 0.25)])
def test_neither_place_nor_size_matters(side, centre):
    shifted = np.array(centre) + [0.25 * side, 0]
    assert region_iou([square(side, centre)], [square(side, shifted)]) == pytest.approx(0.6, abs=0.03)


NAN = np.nan


def test_a_drawn_error_has_a_normalised_square_of_its_directions():
    rng = np.random.default_rng(0)
    root = rng.normal(size=(3, 3)) * 1e-4
    squares = [normalised_square(root @ rng.normal(size=3), root @ root.T) for _ in range(4000)]
    assert {directions for _, directions in squares} == {3}
    values = np.array([square for square, _ in squares]) / 3
    assert values.mean() == pytest.approx(1, abs=0.05) and values.var() == pytest.approx(2 / 3, rel=0.1)


@pytest.mark.parametrize('across', [0.0, NAN])
def test_flat_and_unknown_directions_are_left_out(across):
    covariance = np.diag([4e-8, 1e-8, across])
    assert normalised_square(np.array([2e-4, 1e-4, 5.0]), covariance) == (pytest.approx(2.0), 2)


@pytest.mark.parametrize('error, covariance', [
    (np.full(3, NAN), np.eye(3)), (np.zeros(3), np.full((3, 3), NAN)), (np.zeros(3), np.zeros((3, 3))),
    (np.zeros(3), np.diag([1.0, 1, -1]))])
def test_what_says_nothing_is_not_judged(error, covariance):
    square, directions = normalised_square(error, covariance)
    assert np.isnan(square) and directions == 0


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
    assert rows['depth of the contact'] == ['mm', '0.25', '0.25', '0.25', '1', '0']
    assert '1 instants compared; 3 without an estimate' in page and 'touches:  1 true, 0 missed, 0 false' in page
    assert 'flags:    1 OUT_OF_RANGE' in page and 'depth of the contact +0.25 mm' in page and 'normalised squared error' in page
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
