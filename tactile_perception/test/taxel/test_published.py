# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.estimates import GROSS, NONE
from tactile_perception.taxel.published import PaperMethod, image_moments
from tactile_perception.taxel.pressure import TaxelArray
from taxel_pictures import ARRAY, bar, picture


def test_every_taxel_that_is_not_zero_is_contact():
    regions, _ = PaperMethod(ARRAY).regions(picture(bar()), 0.5)
    assert regions.total.area > 1.3 * 160e-6
    assert regions.total.centroid[:2] == pytest.approx([0, 0], abs=0.1e-3)


def test_flow_of_features_is_slip():
    paper = PaperMethod(ARRAY)
    for k, x in enumerate((0, 0, 0.4)):
        image = picture(bar(x))
        slip, _ = paper.slip(paper.regions(image, 0.5)[0], image, 0.1 * k)
        assert slip.state == (NONE, NONE, GROSS)[k]
    assert slip.linear[0] == pytest.approx(4e-3, rel=0.3)


def test_nothing_and_constant_images_have_no_features():
    paper = PaperMethod(ARRAY)
    for k, image in enumerate([np.zeros((44, 44), np.float32), np.full((44, 44), 9, np.float32)] * 2):
        assert paper.slip(paper.regions(image, 0.5)[0], image, float(k))[0].state == NONE


def test_place_and_angle_are_those_of_the_values():
    array = TaxelArray(20, 30, 0.001, 255.0)
    image = np.zeros((20, 30))
    for k in range(8):
        image[4 + k, 6 + 2 * k:8 + 2 * k] = 10.0
    place, angle = image_moments(image, array)
    assert np.degrees(angle) == pytest.approx(26.6, abs=1.0)
    assert place == pytest.approx([13.5e-3 - 14.5e-3, 7.5e-3 - 9.5e-3], abs=1e-9)
    assert image_moments(100 * image, array)[0] == pytest.approx(place)
    assert np.isnan(image_moments(np.zeros((20, 30)), array)[1])
