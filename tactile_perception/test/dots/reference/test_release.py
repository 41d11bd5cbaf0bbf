# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np

from tactile_perception.dots.reference.release import SETTLED_S, Release

ID, UV = np.arange(50), np.random.default_rng(0).uniform(0, 100, (50, 2))
SIGMA = np.full(50, 0.01)


def test_small_after_large_and_still_for_a_while_is_a_residue():
    release = Release()
    assert not release.is_residue(4.0, ID, UV + 4, SIGMA, 0.0)
    assert not release.is_residue(0.5, ID, UV, SIGMA, 0.1)
    assert not release.is_residue(0.5, ID, UV, SIGMA, 0.1 + 0.9 * SETTLED_S)
    assert release.is_residue(0.5, ID, UV, SIGMA, 0.2 + SETTLED_S)
    assert not release.is_residue(0.9, ID, UV, SIGMA, 0.3 + SETTLED_S)  # it grows: a touch again


def test_what_moves_is_none():
    release = Release()
    release.is_residue(4.0, ID, UV, SIGMA, 0.0)
    assert not any(release.is_residue(0.5, ID, UV + 0.05 * k, SIGMA, 1.0 + k) for k in range(10))


def test_what_is_small_from_the_first_or_large_for_ever_is_none():
    release = Release()
    assert not any(release.is_residue(0.5, ID, UV, SIGMA, k) for k in range(10))
    release = Release()
    release.is_residue(20.0, ID, UV + 9, SIGMA, 0.0)
    assert not any(release.is_residue(1.5, ID, UV, SIGMA, 1.0 + k) for k in range(10))
