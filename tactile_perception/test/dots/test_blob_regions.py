# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import cv2
import numpy as np

from tactile_perception.dots.blob_regions import cut_necks, find_regions, median


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
    assert np.all(regions.labels[20, [11, 20]] == regions.label[0])  # grown by a pixel
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


def test_the_middle_of_values_is_the_upper_of_two():
    values = np.random.default_rng(0).normal(0, 1, 117)
    assert median(values) == np.median(values) and median(np.array([3.0, 1.0])) == 3.0
