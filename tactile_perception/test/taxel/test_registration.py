# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.taxel.pressure import SoftPad
from tactile_perception.taxel.motion import CentroidKeyframe, EdgeKeyframe
from tactile_perception.taxel.region import ContactScore
from taxel_pictures import ARRAY, bar, picture

SCORE = ContactScore(ARRAY, SoftPad())


def score(inside, load=60.0):
    return SCORE.compute(picture(inside, load), 0.05)


@pytest.mark.parametrize('shift, turn', [((0.3, 0.1), 0.0), ((-0.5, 0.4), 0.02), ((0.0, 0.0), -0.05), ((0.0, 0.0), 0.0)])
def test_shift_and_turn_of_a_bar(shift, turn):
    key = EdgeKeyframe(score(bar(angle=0.3)))
    seen = key.motion(score(bar(*shift, 0.3 + turn)))
    about_origin = seen.fit[:2] - seen.turn * np.array([-(key.middle - 21.5)[1], (key.middle - 21.5)[0]])
    assert about_origin == pytest.approx(shift, abs=0.04) and seen.turn == pytest.approx(turn, abs=0.004)


def test_a_contact_of_few_taxels_moves_as_its_pressure_does():
    values = np.zeros((13, 6), np.float32)
    values[4:6, 2:4] = 100
    key = CentroidKeyframe(values, values > 0)
    later = np.roll(values, 2, axis=0)
    assert key.motion(later, later > 0).fit[:2] == pytest.approx([0, 2])
    far = np.roll(values, 7, axis=0)
    assert key.motion(far, far > 0) is None


def test_a_taxel_that_comes_into_contact_moves_no_centroid():
    values = np.zeros((13, 6), np.float32)
    values[4:8, 2] = 100, 200, 100, 49
    key = CentroidKeyframe(values, values > 50)
    assert key.motion(values * 1.04, values > 48).fit[:2] == pytest.approx([0, 0], abs=1e-6)
