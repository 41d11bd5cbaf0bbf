# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parts of the benchmark of contact methods; the whole benchmark, if recordings are available, is marked slow."""
import importlib.util
import json
import pathlib
import sys

import numpy as np
import pytest
from tactile_perception.errors import BadArgument
from tactile_perception.markers.touches.touch import TouchEstimate
from tactile_perception.markers.view.sensor import MARKER_SENSORS

pytest.importorskip('rclpy', reason='ROS is not sourced')  # bags hold ROS messages

_SPEC = importlib.util.spec_from_file_location('touch_benchmark', pathlib.Path(__file__).with_name('touch.py'))
touch = importlib.util.module_from_spec(_SPEC)
sys.modules['touch_benchmark'] = touch  # dataclasses look their module up
_SPEC.loader.exec_module(touch)

SINGLE = MARKER_SENSORS['areal_single']
TIMES = [0.002, 0.001, 0.003, 0.001]
WRENCH = np.array([0.0, 0.0, -2.0, 0.01, 0.0, 0.0])


def estimate(x, y, depth):
    return TouchEstimate(np.array([x, y, -depth]), depth, 1e-8 * np.eye(3), 1e-4)


def contact(x, y, depth):
    return np.array([x, y, -depth]), depth


def test_single_touches_are_judged():
    score = touch.TouchScore(SINGLE)
    score.add([estimate(3e-4, 4e-4, 5.1e-3)], WRENCH * 1.1, [contact(0, 0, 5e-3)], WRENCH, TIMES)
    score.add([], WRENCH, [contact(0.01, 0, 2e-3)], WRENCH, TIMES)
    score.add([], WRENCH, [contact(0.01, 0, 2e-4)], WRENCH, TIMES)
    score.add([estimate(0, 0, 1e-3)], WRENCH, [], np.zeros(6), TIMES)
    row = score.row()
    assert row['place mm'] == pytest.approx(0.5) and row['depth 95 %'] == pytest.approx(0.1)
    assert row['nse'] == pytest.approx((25 + 1) / 3)
    assert (row['presses'], row['missed'], row['split'], row['false']) == (2, 1, 0, 1), 'too shallow to be judged is the third'
    assert row['force %'] == pytest.approx(5) and row['total ms'] == pytest.approx(7)
    assert np.isnan(row['dragged force %']) and np.isnan(row['two told %'])


def test_an_axis_that_is_not_told_is_left_out_of_the_error():
    score = touch.TouchScore(SINGLE)
    told = np.where([False, False, False, False, True, True], np.nan, WRENCH * 1.2)
    score.add([estimate(0, 0, 5e-3)], told, [contact(0, 0, 5e-3)], WRENCH, TIMES)
    assert score.row()['moment %'] == pytest.approx(20)
    score.add([estimate(0, 0, 5e-3)] * 2, told * np.nan, [contact(0, 0, 5e-3)], WRENCH, TIMES)
    assert score.row()['split'] == 1 and score.row()['force %'] == np.inf


def test_what_moves_while_it_touches_is_dragged():
    score = touch.TouchScore(SINGLE, moving=True)
    for x, factor in ((0.0, 1.0), (0.0, 1.0), (1e-3, 1.3), (2e-3, 1.3), (2e-3, 1.0)):
        score.add([estimate(x, 0, 5e-3)], WRENCH * factor, [contact(x, 0, 5e-3)], WRENCH, TIMES)
    row = score.row()
    assert row['force %'] == pytest.approx(0) and row['dragged force %'] == pytest.approx(30)


def test_two_touches_count_where_they_are_far_enough_apart():
    score = touch.TouchScore(SINGLE)
    for apart, told in ((10e-3, 2), (14e-3, 2), (14e-3, 1), (18e-3, 2)):
        places = [contact(-apart / 2, 0, 3e-3), contact(apart / 2, 0, 3e-3)]
        off = 2e-3 if apart == 18e-3 else 1e-4
        score.add([estimate(place[0] + off, 0, depth) for place, depth in places][:told], WRENCH, places, WRENCH, TIMES)
    row = score.row()
    assert row['two'] == 3 and row['two told %'] == pytest.approx(200 / 3) and row['both in 1 mm %'] == pytest.approx(100 / 3)
    assert row['presses'] == 0 and np.isnan(row['place mm'])


def test_places_are_fitted_to_others_by_shift_turn_and_scale():
    rng = np.random.default_rng(0)
    places, turn = rng.normal(0, 1, (9, 2)), np.array([[np.cos(1.0), -np.sin(1.0)], [np.sin(1.0), np.cos(1.0)]])
    assert touch.touch_sources.fitted_to(places, 3 * places @ turn.T + [5, -7]) == pytest.approx(3 * places @ turn.T + [5, -7])


def test_stitching_moves_no_marker_and_a_plain_cut_does():
    rows = {row['method']: row for row in touch.stitch_rows('areal_dual')}
    assert rows['plane']['markers'] == 154 and rows['plane']['off 95 % mm'] < 0.04
    assert rows['middle']['off mean mm'] > 0.3


def test_the_tables_and_their_files(tmp_path):
    score = touch.TouchScore(SINGLE)
    score.add([estimate(0, 3e-4, 5e-3)], WRENCH, [contact(0, 0, 5e-3)], WRENCH, TIMES)
    row = {'source': 'as', 'method': 'model', **score.row()}
    touch.write([row], [dict(zip(touch.STITCH_HEAD, ('ad', 'plane', 154, 0.006, 0.01, 1.8)))], tmp_path)
    text, kept = (tmp_path / 'touch.md').read_text(), json.loads((tmp_path / 'touch.json').read_text())
    assert '| as | model | 0.3 |' in text and '| ad | plane | 154 | 0.006 | 0.01 | 1.8 |' in text
    assert kept['rows'][0]['two told %'] is None and kept['stitching'][0]['markers'] == 154


def test_an_unknown_source_is_named(tmp_path):
    with pytest.raises(BadArgument, match='areal_single'):
        touch.touch_sources.open_source('none', tmp_path)


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize('name', ['as', 'ad', 'ac'])
def test_ours_do_better_than_the_papers_on_recordings(name, tmp_path):
    try:
        source = touch.touch_sources.open_source(name, tmp_path)
    except BadArgument as error:
        pytest.skip(str(error))
    rows = {method: score.row() for method, score in touch.run(source, touch.calibrate_all(source)).items()}
    papers = min((row for method, row in rows.items() if method.startswith('paper')), key=lambda row: row['place mm'])
    ours = min((row for method, row in rows.items() if not method.startswith('paper')), key=lambda row: row['place mm'])
    assert ours['place mm'] < 0.5 * papers['place mm'] and ours['depth mm'] < papers['depth mm']
    assert ours['missed'] == ours['split'] == ours['false'] == ours['refused'] == 0
