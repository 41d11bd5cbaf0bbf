# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What presses while it moves: drags, pairs of objects, random cushions, cameras that run free."""
import dataclasses
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from judged import Case, calibrated, judge

from tactile_bringup import share
from tactile_bringup.simulate.bags import write_opened, write_scene
from tactile_driver.simulation.scene.specimen import Script, Shutters, drag, one_after_the_other
from tactile_driver.simulation.sensors.air_cushion import air_cushion
from tactile_driver.simulation.sensors.scenes import SCENES, open_dual_scene, open_scene
from tactile_perception.core.parameter_files import write_parameters
from tactile_perception.press.calibration import read_touch

TRACE = 0.3e-3  # m: a shallower tip stands on one node of the simulated sheet, up to 0.7 mm beside its position
MIN_DEPTH, APART = 5e-4, 0.0145  # m: two tips count from this depth, and this far apart


def judged(folder, scene, rate=30.0, shutters=None, tips=1, frames=0):
    """What `evaluate` finds in the frames with so many tips, and in untouched ones but for traces. Scenes are named after the sensor."""
    params, calibration = (Path(share(kind, '_'.join(scene.split('_')[:2]) + '_sim.yaml')) for kind in ('params', 'calibration'))
    opened = open_dual_scene(scene, rate, shutters=shutters) if scene.startswith('areal_dual') else open_scene(scene, rate)
    write_opened(folder / 'bag', opened, frames=frames)

    def counts(estimated, true):
        there = true.contacts
        if not there:
            return not any(touch.depth <= TRACE for touch in estimated.contacts)
        return len(there) == tips and min(tip.depth for tip in there) > (TRACE if tips == 1 else MIN_DEPTH) and (
            tips == 1 or np.hypot(*(there[0].position - there[1].position)[:2]) >= APART)
    return judge([Case(folder / 'bag', params)], calibration, counts=counts)


def check(found, position, depth, squared=2.0, whole=0.9, beside=np.inf):
    """Check the errors of a run.

    position, depth: mm, maximum of the mean error and of its 95 % quantile; squared: maximum of the mean normalised squared error; whole:
    minimum share of frames in which all tips are found; beside: maximum number of untouched frames with a contact."""
    errors, summary = found.evaluation.errors(), found.evaluation.summary()
    for name, limits in (('position', position), ('depth', depth)):
        errors_mm = 1e3 * np.abs(errors[name][:, 3])
        assert errors_mm.mean() < limits[0] and np.percentile(errors_mm, 95) < limits[1]
    frames = summary['frames']
    assert summary['covariance']['mean'] < squared and frames['false'] <= beside
    assert 1 - (frames['missed'] + frames['too_few'] + frames['too_many']) / frames['touched'] > whole


@pytest.mark.parametrize('friction, position, depth', [(0.2, (0.2, 0.4), (0.1, 0.2)), (1.0, (0.25, 0.7), (0.35, 0.8))])
def test_a_drag_over_a_sheet_whatever_the_friction(tmp_path, monkeypatch, friction, position, depth):
    name = 'areal_single_drag'
    monkeypatch.setitem(SCENES, name, dataclasses.replace(SCENES[name], friction=friction))
    check(judged(tmp_path, name, 15.0), position, depth, beside=0)


@pytest.mark.parametrize('friction', [0.2, 1.0])
def test_a_drag_over_the_dome_whatever_the_friction(tmp_path, monkeypatch, friction):
    act = partial(drag, 'ball_30mm', (0.02, -0.01), 0.022, (-0.021, 0.021), duration=2.0)
    monkeypatch.setitem(SCENES, 'air_cushion_any', Script(air_cushion, one_after_the_other([act]), friction=friction))
    check(judged(tmp_path, 'air_cushion_any', 5.0), (2.0, 6.0), (2.0, 4.0), 3.0)  # the first frame of a drag may be a centimetre off


# Largest errors of position and depth, mean and 95 %, mm: of a sheet with one camera, and with two.
TWO = {'areal_single_two': ((0.25, 0.6), (0.1, 0.3)), 'areal_single_two_unlike': ((0.25, 0.6), (0.3, 0.7)),
       'areal_dual_two': ((0.3, 0.6), (0.08, 0.2)), 'areal_dual_two_unlike': ((0.7, 1.3), (0.08, 0.2))}


@pytest.mark.parametrize('name', TWO)
def test_two_tips_are_two_where_they_touch(tmp_path, name):
    check(judged(tmp_path, name, 5.0, tips=2), *TWO[name], whole=0.85)


@pytest.mark.parametrize('scene, shutters, position, depth', [
    ('areal_dual_fast', Shutters(-0.0164, jitter=2e-4), (0.25, 0.5), (0.12, 0.3)),
    ('areal_dual_fast_drag', Shutters(0.003, 0.009, 2e-4), (0.45, 1.0), (0.06, 0.15))])
def test_fast_presses_and_drags_by_cameras_that_run_free(tmp_path, scene, shutters, position, depth):
    check(judged(tmp_path, scene, shutters=shutters, frames=180), position, depth, beside=0)  # six seconds


@pytest.mark.slow
def test_presses_on_a_random_print_are_found_in_another_recording(tmp_path):
    params = write_parameters(tmp_path / 'params.yaml', {'rows': 0, 'columns': 0}, Path(share('params', 'air_cushion_sim.yaml')))
    presses, demo = (Case(tmp_path / name, params) for name in ('calibration', 'demo'))
    write_scene(presses.bag, 'air_cushion_random_calibration', rate=1.5, frames=70)
    write_scene(demo.bag, 'air_cushion_random_demo', rate=2.0, frames=16)
    file = calibrated(presses, 'air_cushion', tmp_path / 'cushion.yaml')
    assert 150 < len(read_touch(file, 'air_cushion').pattern) < 400
    found = judge([demo], file, counts=lambda _estimated, true: not true.contacts or true.contacts[0].depth > 0.008)
    frames = found.evaluation.summary()['frames']
    assert frames['touched'] and frames['untouched'] and frames['missed'] == frames['false'] == found.refused == 0
    assert found.medians()['position'] < 8.0  # mm
