# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Accuracy from image to contact, on recordings by an independent simulation and on simulated scenes."""
import importlib.util
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from tactile_perception.errors import BadArgument

_SPEC = importlib.util.spec_from_file_location('pipeline_benchmark', Path(__file__).with_name('pipeline.py'))
pipeline = importlib.util.module_from_spec(_SPEC)
sys.modules['pipeline_benchmark'] = pipeline  # dataclasses look their module up
_SPEC.loader.exec_module(pipeline)

OURS = {name: pipeline.METHODS[name] for name in ('membrane', 'paper')}


def rows(source, calibration=None, methods=OURS, **more):
    try:
        opened = pipeline.sources.open_source(source, **more)
    except BadArgument as error:
        pytest.skip(str(error))
    return {name: score.row() for name, score in pipeline.run(opened, methods, calibration).items()}


@pytest.fixture(scope='module')
def calibration(tmp_path_factory):
    try:
        return pipeline.sources.calibrate('tp_calib', tmp_path_factory.mktemp('calibration'))
    except BadArgument as error:
        pytest.skip(str(error))


# source: least contact F1, sticking F1, slipping F1, region IoU from the rest shape alone; NaN: nothing of that kind happens there.
# To be reached in the mean of such scenes are 0.90 (a ring: 0.85), 0.85, 0.85 and 0.78; a ring's narrow region overlaps by less.
RECORDINGS = {'tp_rect_drag': (0.95, 0.85, 0.85, 0.87), 'tp_ring_press': (0.87, 0.85, np.nan, 0.64),
              'tp_disc_twist': (0.95, 0.85, 0.85, 0.88)}


@pytest.mark.parametrize('name', RECORDINGS)
def test_contact_on_recordings_from_the_rest_shape_alone(name):
    found = rows(name)
    ours, papers = found['membrane'], found['paper']
    for key, least in zip(('contact F1', 'stick F1', 'slip F1', 'IoU'), RECORDINGS[name]):
        assert not ours[key] < least, (key, ours[key])
    assert ours['contact F1'] > papers['contact F1'] - 0.01 and ours['IoU'] > papers['IoU']
    assert ours['xyz mm'] < 0.08 and ours['false frames'] == ours['refused'] == 0 and ours['missed'] < 2
    assert ours['depth mm'] < 0.1 and ours['force %'] < 5


@pytest.mark.parametrize('name, stick, slip, overlap', [('tp_disc_impact', 0.9, 0.85, 0.9), ('tp_rect_release', 0.95, 0.85, 0.81),
                                                        ('tp_two_spheres', 0.9, 0.8, 0.65)])
def test_contact_on_recordings_of_an_impact_a_release_and_two_objects(name, stick, slip, overlap):
    found = rows(name, methods={'membrane': {}})['membrane']
    assert found['contact F1'] > 0.88 and found['stick F1'] > stick and not found['slip F1'] < slip and found['IoU'] > overlap
    assert found['xyz mm'] < 0.06 and found['false frames'] == found['refused'] == 0


@pytest.mark.parametrize('name', ['tp_rect_drag', 'tp_disc_twist'])
def test_contact_on_recordings_when_calibrated(name, calibration):
    found = rows(name, calibration, {'membrane': {}})['membrane']
    assert found['xyz mm'] < 0.03 and found['depth mm'] < 0.03 and found['force %'] < 5
    assert found['contact F1'] > 0.92 and found['IoU'] > 0.78


def test_where_nothing_slips_dots_called_slipping_count_against_sticking_alone():
    score = pipeline.Score()
    score.counts = {'contact': np.array([60, 0, 0]), 'sticking': np.array([53, 0, 7]), 'slipping': np.array([0, 7, 0])}
    row = score.row()
    assert np.isnan(row['slip F1']) and row['stick F1'] == pytest.approx(106 / 113)


def test_nothing_touches_in_the_recording_of_noise():
    found = rows('tp_noise')
    for row in found.values():
        assert row['false frames'] == 0 and row['refused'] == 0


# scene: least contact F1, IoU. Here dots that are free but within some micrometres of the object count as free, which recordings leave
# out: a ball's thin edge costs more.
SCENES = {'ring_press': (0.85, 0.58), 'two_spheres': (0.74, 0.58), 'rectangle_drag': (0.88, 0.76),
          'glare': (0.84, 0.68), 'noise': (0.84, 0.68)}


@pytest.mark.parametrize('name', SCENES)
def test_contact_in_our_own_scenes(name):
    found = rows(f'scene:{name}', rate=8.0)
    ours, papers = found['membrane'], found['paper']
    assert ours['contact F1'] > SCENES[name][0] and ours['IoU'] > SCENES[name][1]
    assert ours['contact F1'] > papers['contact F1'] and ours['IoU'] > papers['IoU']
    assert ours['xyz mm'] < 0.12 and ours['false frames'] == ours['refused'] == 0


def test_each_of_two_objects_sticks_or_slips_by_its_own_motion():
    found = rows('scene:two_objects', methods={'membrane': {}})['membrane']
    assert found['contact F1'] > 0.95 and found['stick F1'] > 0.95 and found['slip F1'] > 0.8 and found['IoU'] > 0.8


def test_the_table_and_its_files(tmp_path):
    score = pipeline.Score()
    assert np.isnan(score.row()['contact F1']) and np.isnan(score.row()['total ms'])
    score.times = [[0.001, 0.002, 0.003]] * 3
    score.counts['contact'] = np.array([8, 2, 2])
    row = {'source': 'a', 'method': 'm', **score.row()}
    assert row['contact F1'] == pytest.approx(0.8) and row['total ms'] == pytest.approx(6)
    pipeline.write([row, *pipeline.means([row, {**row, 'source': 'b', 'contact F1': np.nan}])], tmp_path)
    kept = json.loads((tmp_path / 'pipeline.json').read_text())
    assert kept['rows'][1]['contact F1'] == pytest.approx(0.8) and kept['rows'][0]['stick F1'] is None
    assert '| a | m | 0.8 | - |' in (tmp_path / 'pipeline.md').read_text() and (tmp_path / 'pipeline.png').stat().st_size > 2000


def test_an_unknown_source_is_named():
    with pytest.raises(BadArgument, match='scene'):
        pipeline.sources.open_source('scene:none')
    with pytest.raises(BadArgument, match='TACTILE_RECORDINGS'):
        pipeline.sources.open_source('none')
