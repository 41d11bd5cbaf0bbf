# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from taxel_pictures import ARRAY, bar, disc, picture, ring
from tactile_perception.taxel.pressure import SoftPad
from tactile_perception.taxel.region import LEVEL, ContactScore

SCORE = ContactScore(ARRAY, SoftPad())


@pytest.mark.parametrize('load', [10.0, 60.0, 250.0])
def test_border_does_not_depend_on_the_load(load):
    assert (SCORE.compute(picture(bar(), load), 0.05) > LEVEL).sum() == pytest.approx(160, abs=16)


def test_tilted_face_keeps_its_border():
    y, x = np.mgrid[:44, :44]
    tilted = picture(bar()) * (1 + 0.03 * (x - 21.5)).astype(np.float32)
    level, tilt = (SCORE.compute(image, 0.05) > LEVEL for image in (picture(bar()), tilted))
    assert (level ^ tilt).sum() <= 8


def test_ring_has_a_hole_and_a_rough_face_none():
    assert SCORE.compute(picture(ring()), 0.05)[21, 21] < 0.2
    y, x = np.mgrid[:44, :44]
    rough = picture(disc()) * (1 + 0.3 * np.cos(2 * x) * np.cos(2 * y)).astype(np.float32)
    assert (SCORE.compute(rough, 0.05)[17:27, 17:27] > LEVEL).all()
