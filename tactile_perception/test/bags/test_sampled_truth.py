# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""True contacts between stamps."""
import numpy as np
import pytest
from tactile_perception.bags.sampled_truth import SampledTruth
from tactile_perception.common.estimates import ContactEstimate

MS = 10**6


def contact(x, number=1):
    return ContactEstimate(number, np.array([x, 0.0, 0.0]), np.array([0.0, x, 1.0]), 0.1 * x, x, np.zeros((3, 3)), 0, np.zeros(0, bool))


def test_a_contact_that_lasts_moves_evenly():
    truth = SampledTruth()
    truth.add(40 * MS, [contact(3.0)])
    truth.add(20 * MS, [contact(1.0)])
    found, = truth.at(25 * MS)
    assert found.position[0] == found.force == pytest.approx(1.5) and found.depth == pytest.approx(0.15)
    assert np.linalg.norm(found.normal) == pytest.approx(1) and found.normal[1] / found.normal[2] == pytest.approx(1.5)
    assert truth.used == {20 * MS, 40 * MS}


def test_another_contact_begins_at_its_stamp():
    truth = SampledTruth()
    for stamp, known in ((0, []), (20, [contact(1.0)]), (30, [contact(2.0, 2)])):
        truth.add(stamp * MS, known)
    assert truth.at(19 * MS) == [] and truth.at(29 * MS)[0].position[0] == 1.0


def test_beyond_what_is_known_nothing_is():
    truth = SampledTruth()
    assert truth.at(5) is None
    truth.add(10 * MS, [])
    truth.add(100 * MS, [])
    assert [truth.at(stamp * MS) for stamp in (5, 50, 101)] == [None] * 3 and truth.used == set()
