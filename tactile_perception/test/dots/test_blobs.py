# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from tactile_perception.dots.detect import DotDetector
from tactile_perception.errors import BadFrame

SIMULATED = Path(os.environ.get('TACTILE_RECORDINGS', '')) / 'simulated'
SHAPE = (200, 260)


@pytest.fixture
def markers():
    """(30, 2) places off the pixel grid at a pitch of 40 px, and (30,) diameters of 18 to 22 px."""
    rng = np.random.default_rng(3)
    row, column = np.divmod(np.arange(30), 6)
    return np.stack([29 + 40.2 * column, 21 + 39.7 * row], 1) + rng.uniform(-0.5, 0.5, (30, 2)), rng.uniform(18, 22, 30)


def noisy(image, noise, seed=0):
    return np.clip(np.rint(image + np.random.default_rng(seed).normal(0, noise, image.shape)), 0, 255).astype(np.uint8)


def errors(dots, uv):
    """(N, 2) px of the dots from the nearest of places uv, and which of them that is."""
    nearest = np.hypot(*(dots.uv[:, None] - uv).transpose(2, 0, 1)).argmin(1)
    return dots.uv - uv[nearest], nearest


def check(dots, uv, area, limit, share):
    error, nearest = errors(dots, uv)
    assert len(np.unique(nearest)) == len(dots) == len(uv)
    assert np.sqrt((error**2).sum(1).mean()) < limit
    assert np.abs(dots.area / area[nearest] - 1).max() < share
    assert 0.2 < ((error / dots.sigma[:, None])**2).mean() < 1.6


@pytest.mark.parametrize('polarity, ground, contrast', [('bright', 15.0, 180.0), ('dark', 220.0, -180.0)])
def test_places_areas_and_sigma_in_uneven_light(draw_dots, markers, polarity, ground, contrast):
    uv, diameter = markers
    light = np.linspace(1, 1 / 3, SHAPE[1])  # three to one
    image = (ground + contrast * draw_dots(uv, diameter, SHAPE, 1.0, 0.0, 1.0)) * light
    check(DotDetector(polarity, 'blobs').detect(noisy(image, 2.0)), uv, np.pi / 4 * diameter**2, 0.05, 0.025)


def test_the_channel_with_the_contrast_is_taken(draw_dots, markers):
    uv, diameter = markers
    inside = draw_dots(uv, diameter, SHAPE, 1.0, 0.0, 1.0)
    for channel in range(3):
        image = np.dstack([noisy(15 + (180 if k == channel else 20) * inside, 2.0, k) for k in range(3)])
        dots, alone = DotDetector('bright', 'blobs').detect(image), DotDetector('bright', 'blobs').detect(image[:, :, channel].copy())
        assert np.array_equal(dots.uv, alone.uv)
    grey = np.dstack([noisy(15 + 180 * inside, 12.0, k) for k in range(3)])
    error = [errors(DotDetector('bright', 'blobs').detect(image), uv)[0].std() for image in (grey, grey[:, :, 1].copy())]
    assert error[0] < 0.8 * error[1]  # the channels' noise is their own


def test_cut_hidden_and_false_ones_are_left_out(draw_dots, markers):
    uv, diameter = markers[0] - [29, 0], markers[1]  # the first column lies on the border
    image = 15 + 180 * draw_dots(uv, diameter, SHAPE, 1.0, 0.0, 1.0)
    image[int(uv[9, 1]) - 15: int(uv[9, 1]) + 15, int(uv[9, 0]) + 1: int(uv[9, 0]) + 15] = 15  # half hidden
    image[90:112, 58:61] = 255  # a scratch
    image[:, 250:] = 60  # something at the border
    error, nearest = errors(DotDetector('bright', 'blobs').detect(noisy(image, 2.0)), uv)
    assert set(nearest) == set(np.flatnonzero(uv[:, 0] > 20)) - {9}
    assert np.hypot(*error.T).max() < 0.1


def test_glare_on_a_marker_moves_it_little(draw_dots, markers):
    uv, diameter = markers
    y, x = np.mgrid[:SHAPE[0], :SHAPE[1]]
    image = 15 + 150 * draw_dots(uv, diameter, SHAPE, 1.0, 0.0, 1.0)
    image += 150 * np.exp(-((x - uv[14, 0] - 3)**2 + (y - uv[14, 1])**2) / 9)
    error, nearest = errors(DotDetector('bright', 'blobs').detect(noisy(image, 2.0)), uv)
    assert len(error) >= 29
    assert np.hypot(*error.T).max() < 0.4


def test_frames_without_markers():
    detector = DotDetector('bright', 'blobs')
    for image in (np.full(SHAPE, 90.0), np.where(np.arange(SHAPE[1]) < 100, 40.0, 160.0) * np.ones(SHAPE)):
        with pytest.raises(BadFrame):
            detector.detect(noisy(image, 1.0))


@pytest.mark.skipif(not (SIMULATED / 'as_test').is_dir(), reason='TACTILE_RECORDINGS holds no simulated/as_test')
@pytest.mark.parametrize('name, side, limit, of_area', [('as_test', '', 0.02, 0.005), ('ad_test', '_left', 0.015, 0.005),
                                                       ('ad_test', '_right', 0.015, 0.005), ('ac_test', '', 0.04, 0.012)])
def test_recorded_markers(name, side, limit, of_area):
    truth = np.load(SIMULATED / name / 'truth.npz')
    detector, all_errors, normal, ratio, found = DotDetector('bright', 'blobs'), [], [], [], 0
    for k in range(len(truth['timestamps'])):
        seen = truth['visible' + side][k]
        dots = detector.detect(cv2.imread(str(SIMULATED / name / f'frames{side}' / f'{k:03d}.webp')))
        error, nearest = errors(dots, truth['uv' + side][k][seen])
        found += len(np.unique(nearest))
        all_errors.append(error)
        normal.append(error / dots.sigma[:, None])
        ratio.append(dots.area / truth['area_px' + side][k][seen][nearest])
    assert found == sum(map(len, all_errors)) >= truth['visible' + side].sum() - 1
    assert np.sqrt((np.vstack(all_errors)**2).sum(1).mean()) < limit
    assert 0.5 < (np.vstack(normal)**2).mean() < 1.5
    assert np.percentile(np.abs(np.concatenate(ratio) - 1), 95) < of_area
