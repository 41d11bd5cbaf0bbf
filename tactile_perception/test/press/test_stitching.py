# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Two cameras are found from exact and from noisy image positions; shared markers connect them."""
import json
import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from sheet_pair import DISTORTION, MATRIX, SENSOR, SIZE, picture, pose, printed

from tactile_driver.stitching.methods import make_stitcher
from tactile_perception.common.marker_sensor import MARKER_SENSORS, MarkerSensor
from tactile_perception.core.errors import BadArgument, BadCalibration, BadFrame
from tactile_perception.dots.detect import DotDetector
from tactile_perception.dots.number import number_grid
from tactile_perception.press.stitching import SideMarkers, fit_sides, fit_stitching

GRID = SENSOR.grid()
COLUMN = np.arange(len(GRID)) % SENSOR.columns


def seen(side, positions, noise=0.0, seed=0):
    """View of a camera on the five columns of its side."""
    rotation, camera_centre = pose(side)
    id = np.flatnonzero(COLUMN < 5 if side == 'left' else COLUMN > 2)
    points = np.column_stack([positions[id], np.zeros(len(id))])
    uv = cv2.projectPoints(points, rotation, -rotation @ camera_centre, MATRIX, DISTORTION)[0].reshape(-1, 2)
    return SideMarkers(SIZE, id, uv + np.random.default_rng(seed).normal(0, noise, uv.shape), (MATRIX, DISTORTION))


def test_an_irregular_print_is_averaged_and_both_views_agree():
    positions = printed()
    found = [seen('left', positions, noise=0.03), seen('right', positions, noise=0.03, seed=1)]
    sides = fit_sides(found, GRID)
    off = np.concatenate([side.place(m.uv) - positions[m.id] for side, m in zip(sides, found)])
    assert np.linalg.norm(off, axis=1).mean() < 0.035e-3
    _, left, right = np.intersect1d(found[0].id, found[1].id, return_indices=True)
    assert np.abs(sides[0].place(found[0].uv[left]) - sides[1].place(found[1].uv[right])).max() < 0.03e-3


def test_too_few_markers_and_markers_that_form_no_grid_are_refused():
    left, right = seen('left', GRID), seen('right', GRID)
    with pytest.raises(BadCalibration, match='5 markers'):
        fit_sides([SideMarkers(SIZE, left.id[:5], left.uv[:5], left.camera), right], GRID)
    shuffled = np.random.default_rng(0).permutation(left.uv)
    with pytest.raises(BadCalibration, match='grid'):
        fit_sides([SideMarkers(SIZE, left.id, shuffled, left.camera), right], GRID)


KNOWN = (MATRIX, DISTORTION)


@pytest.fixture(scope='module')
def pair():
    positions = printed()
    return picture('left', positions), picture('right', positions, brightness=190.0, seed=1)


def errors(found, images, truth, sensor, method='plane'):
    """Distance, m, of each marker in the stitched image from its true position; all must be visible."""
    dots = DotDetector('bright', 'blobs').detect(make_stitcher(method, found.stitching).stitch(*images))
    numbers = number_grid(dots.uv, sensor.rows, sensor.columns)
    assert sorted(numbers.id.tolist()) == list(range(sensor.rows * sensor.columns))
    return np.linalg.norm(found.stitching.place(dots.uv) - truth[numbers.id], axis=1)


def test_stitched_markers_are_at_their_printed_positions(pair):
    found = fit_stitching(pair, (KNOWN, KNOWN), SENSOR)
    off = errors(found, pair, printed(), SENSOR)
    assert off.mean() < 0.03e-3 and off.max() < 0.06e-3
    for side, camera_centre in zip(('left', 'right'), found.stitching.camera_centres):
        np.testing.assert_allclose(camera_centre, pose(side)[1], atol=3e-4)
    assert found.overlap < 0.015e-3 and found.markers == 40 and len(found.shared) >= 2
    assert found.residual == pytest.approx(6e-5 * np.sqrt(2), rel=0.3)


def test_views_cut_at_the_middle_of_their_overlap_have_one_scale_that_fits_the_grid_best(pair):
    found = fit_stitching(pair, (KNOWN, KNOWN), SENSOR, method='middle')
    off = errors(found, pair, printed(), SENSOR, 'middle')
    assert 0.1e-3 < off.mean() < 1e-3  # turned and tilted views that are not rectified
    assert make_stitcher('middle', found.stitching).size == found.stitching.size
    assert found.stitching.scale == pytest.approx(286 / 0.046, rel=0.03)


def test_the_seam_is_midway_between_two_shared_columns(pair):
    found = fit_stitching(pair, (KNOWN, KNOWN), SENSOR)
    x = found.stitching.place([[found.stitching.seam, 0]])[0, 0]
    column = x / SENSOR.pitch[0] + (SENSOR.columns - 1) / 2
    assert column % 1 == pytest.approx(0.5, abs=0.02)
    assert {int(column), int(column) + 1} <= set(found.shared)


def test_insufficient_pairs_are_refused(pair):
    black = np.zeros_like(pair[0])
    with pytest.raises(BadFrame, match='left image'):
        fit_stitching((black, pair[1]), (KNOWN, KNOWN), SENSOR)
    covered = pair[0].copy()
    covered[:120] = 12
    with pytest.raises(BadCalibration, match='left image.*rows'):
        fit_stitching((covered, pair[1]), (KNOWN, KNOWN), SENSOR)
    wide = MarkerSensor(5, 14, SENSOR.pitch, (0.133, 0.046), type='areal_dual')
    with pytest.raises(BadCalibration, match='gap'):
        fit_stitching(pair, (KNOWN, KNOWN), wide)
    with pytest.raises(BadArgument, match='no|not'):
        fit_stitching(pair, (KNOWN, KNOWN), MARKER_SENSORS['air_cushion'])


@pytest.mark.skipif('TACTILE_RECORDINGS' not in os.environ, reason='TACTILE_RECORDINGS is not set: no recordings')
@pytest.mark.parametrize('name', ['ad_calib_small', 'ad_test'])
def test_on_recorded_pairs_untouched_markers_are_within_40_um(name):
    folder = Path(os.environ['TACTILE_RECORDINGS']) / 'simulated' / name
    cameras = [(np.array(c['K'], float), np.array(c['dist_k1_k2_p1_p2_k3'], float))
               for c in json.loads((folder / 'sensor.json').read_text())['cameras']]
    pairs = [tuple(cv2.imread(str(folder / f'frames_{side}' / f'{k:03}.webp')) for side in ('left', 'right')) for k in range(3)]
    truth, sensor = np.load(folder / 'truth.npz')['dot_rest_xyz'][:, :2].astype(float), MARKER_SENSORS['areal_dual']
    found = fit_stitching(pairs[0], tuple(cameras), sensor)
    off = np.concatenate([errors(found, pair, truth, sensor) for pair in pairs])
    assert off.mean() < 0.02e-3 and off.max() < 0.04e-3
