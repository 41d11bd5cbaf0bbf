# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_perception.psd.touch import TouchDecision

SIGMA, PERIOD = 0.02, 1e-3


def press():
    """Light that rises slowly to touch, 0.3 V after 300 ms, then strongly, and back."""
    up = np.r_[np.linspace(0, 0.3, 300), 0.3 + 0.05 * np.arange(60)]
    return np.r_[np.zeros(500), up, np.full(200, up[-1]), up[::-1], np.zeros(300)] + np.random.default_rng(0).normal(0, SIGMA, 1720)


@pytest.mark.parametrize('size', [1, 7, 5000])
def test_contact_begins_and_ends_where_the_waveguide_is_touched(size):
    decision, total, contact = TouchDecision(), press(), []
    for k in range(0, len(total), size):
        some = total[k:k + size]
        contact += decision.process(some, np.full(len(some), 0.3), SIGMA, PERIOD)[0].tolist()
    edges = np.flatnonzero(np.diff(np.array(contact, int)))
    assert len(edges) == 2 and abs(edges[0] - 800) <= 15 and abs(edges[1] - 1120) <= 15  # 1 mV a sample


def test_without_a_known_level_whatever_is_near_touches():
    contact, _ = TouchDecision().process(press(), None, SIGMA, PERIOD)
    assert 550 < contact.argmax() < 660 and contact[700:1200].all()


def test_levels_under_the_noise_are_not_believed():
    total = np.random.default_rng(1).normal(0, SIGMA, 200_000)
    assert not TouchDecision().process(total, np.full(len(total), 0.001), SIGMA, PERIOD)[0].any()
