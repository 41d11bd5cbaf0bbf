# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The benchmark of taxel arrays scores correctly, and reaches the required accuracy on an independent recording."""
import importlib.util
import os
from pathlib import Path

import numpy as np
import pytest
from tactile_perception.taxel.array import SoftPad, TaxelArray
from tactile_perception.taxel.estimator import TaxelEstimator

SPEC = importlib.util.spec_from_file_location('taxel_benchmark', Path(__file__).with_name('taxel.py'))
benchmark = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(benchmark)
FOLDER = Path(os.environ.get('TACTILE_RECORDINGS', 'nowhere'), 'simulated')
needs_recordings = pytest.mark.skipif(not (FOLDER / 'tac_cal_flat').is_dir(), reason='TACTILE_RECORDINGS names no folder with tac_cal_flat')


def test_mask_of_a_square():
    array = TaxelArray(20, 20, 1e-3)
    estimator = TaxelEstimator(array, SoftPad())
    image = np.zeros((20, 20))
    estimator.process(image, 0.0)
    image[5:15, 4:12] = 100
    mask = benchmark.mask_of(estimator.process(image, 1.0), array)
    assert mask[6:14, 5:11].all() and not np.delete(np.delete(mask, range(4, 16), 0), range(3, 13), 1).any()


@needs_recordings
def test_an_independent_grasp_by_its_shape_and_wrench():
    meta, known, truth = benchmark.read(FOLDER / 'tac_wrench_offset')
    array, _ = benchmark.sensor(meta)
    results, _ = benchmark.play(FOLDER / 'tac_wrench_offset', 'mechanics', benchmark.calibrate(FOLDER, array))
    shape = benchmark.shape_errors(results, meta, truth)
    assert np.median(shape['area']) < 0.05 and np.median(shape['centroid']) < 0.05 and np.median(shape['orientation']) < 0.2
    assert np.median(shape['overlap']) > 0.9
    wrench = benchmark.wrench_errors(results, meta, known, truth)
    assert np.median(wrench['force']) < 0.015 and np.median(wrench['moment']) < 0.02


@needs_recordings
def test_an_independent_slip_is_seen_before_all_slips():
    meta, _, truth = benchmark.read(FOLDER / 'tac_incipient_rect')
    array, _ = benchmark.sensor(meta)
    results, _ = benchmark.play(FOLDER / 'tac_incipient_rect', 'mechanics', benchmark.calibrate(FOLDER, array))
    states = np.array([result.slip.state for result in results])
    assert not states[truth['slip_fraction'] < 0.045].any()  # 0.05 makes it incipient
    assert np.flatnonzero(states == 1)[0] < np.flatnonzero(truth['slip_state'] == 2)[0]
    assert np.mean(states[truth['slip_state'] == 2] == 2) > 0.7
