# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np

from tactile_driver.simulation.truth import NON_CONTACT, NO_SLIP, TruthFrame


def test_a_frame_without_contact_says_so():
    truth = TruthFrame(np.arange(2), np.zeros((2, 2)), np.zeros((2, 3)), np.full(2, NON_CONTACT, np.uint8))
    assert truth.outlines == [] and truth.holes == [] and truth.contacts == [] and truth.area == 0.0
    assert np.isnan(truth.centroid).all() and np.isnan(truth.normal).all() and np.isnan(truth.rotation_center).all()
    assert truth.slip_state == NO_SLIP and truth.slipping_fraction == 0.0
    assert np.isnan(truth.velocity).all() and np.isnan(truth.motion).all() and (truth.wrench == 0).all()


def test_frames_share_no_arrays():
    first, second = (TruthFrame(np.arange(1), np.zeros((1, 2)), np.zeros((1, 3)), np.zeros(1, np.uint8)) for _ in range(2))
    first.wrench[0] = 1.0
    assert second.wrench[0] == 0.0
