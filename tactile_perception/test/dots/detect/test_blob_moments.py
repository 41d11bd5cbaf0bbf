# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import cv2
import numpy as np
import pytest
from tactile_perception.dots.detect.blob_moments import cut_necks, find_regions, fit_blobs


def discs(places, radius=8):
    mask = np.zeros((80, 120), np.uint8)
    for place in places:
        cv2.circle(mask, place, radius, 255, -1)
    return mask


def test_regions_of_markers_size_that_the_border_does_not_cut():
    mask = discs([(20, 20), (60, 20), (60, 60), (118, 40), (100, 0)])
    mask[70:72, 10:13] = 255  # a speck
    mask[36:43, 1:119] = mask[36:80, 90:110] = 255  # a band
    regions = find_regions(mask)
    assert regions.centre[np.argsort(regions.centre @ [1, 1])].tolist() == [[20, 20], [60, 20], [60, 60]]
    assert regions.box[0].tolist() == [12, 12, 17, 17]
    assert np.all(regions.labels[20, [12, 20]] == regions.label[0]) and regions.labels[20, 11] == 0
    assert not len(find_regions(np.zeros((80, 120), np.uint8)))


def test_only_what_has_a_neck_is_cut():
    mask = discs([(30, 20), (46, 22), (90, 50)])
    cv2.ellipse(mask, (40, 60), (16, 8), 0, 0, 360, 255, -1)
    regions = find_regions(mask)
    assert len(regions) == 3
    assert sorted(cut_necks(mask, box) for box in regions.box) == [False, False, True]
    centre = find_regions(mask).centre
    assert len(centre) == 4
    assert np.abs(centre[centre[:, 1] < 30] - [[30, 20], [46, 22]]).max() < 1


SHAPE = (100, 160)
UV = np.array([[30.25, 31.4], [81.6, 30.2], [120.3, 66.8]])


def fit(image, step):
    small = cv2.resize(image, None, fx=1 / step, fy=1 / step, interpolation=cv2.INTER_AREA)
    blobs = fit_blobs(image, small, step, find_regions(cv2.threshold(small, 60, 255, cv2.THRESH_BINARY)[1]))
    order = np.argsort(blobs.uv[:, 0])
    return blobs.uv[order], blobs.area[order], blobs.sigma[order], blobs


@pytest.mark.parametrize('step', [1, 2])
@pytest.mark.parametrize('blur', [0.8, 1.2, 2.0])
def test_place_area_amplitude_and_blur_without_noise(draw_dots, step, blur):
    image = np.rint(20 + 150 * draw_dots(UV, [18.0, 20.0, 25.0], SHAPE, blur, 0.0, 1.0)).astype(np.uint8)
    uv, area, _, blobs = fit(image, step)
    assert np.abs(uv - UV).max() < (0.01 if blur < 2 else 0.03)
    assert np.abs(area / (np.pi / 4 * np.array([18, 20, 25])**2) - 1).max() < (0.005 if blur < 2 else 0.012)
    assert np.abs(blobs.amplitude - 150).max() <= (1 if blur < 2 else 5)
    assert blobs.blur == pytest.approx(np.hypot(blur, 12**-0.5), rel=0.05)  # the pixels' own width is part of it
    assert np.abs(blobs.solidity - 1).max() < 0.02


def test_light_that_slopes_over_a_marker_moves_it_little(draw_dots):
    inside = draw_dots(UV, [20.0, 20.0, 20.0], SHAPE, 1.0, 0.0, 1.0)
    u = np.arange(SHAPE[1])
    image = np.rint(np.clip(20 + inside * (180 - 1.0 * u), 0, 255)).astype(np.uint8)  # 1.7 % a pixel at the last
    uv, _, sigma, _ = fit(image, 2)
    assert np.abs(uv - UV).max() < 0.06  # the brightness's centre of gravity is off by up to 0.4 px
    assert np.all(np.abs(uv - UV).max(1) < 4 * sigma)


def test_sigma_grows_with_noise_as_errors_do(draw_dots):
    clean = 20 + 150 * draw_dots(UV, [18.0, 20.0, 25.0], SHAPE, 1.0, 0.0, 1.0)
    rng = np.random.default_rng(2)
    for noise in (3.0, 8.0):
        normal = []
        for _ in range(40):
            uv, _, sigma, _ = fit(np.clip(np.rint(clean + rng.normal(0, noise, SHAPE)), 0, 255).astype(np.uint8), 2)
            normal.append((uv - UV) / sigma[:, None])
        assert 0.5 < np.mean(np.square(normal)) < 1.6
