# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The elastic layer: exact responses, and stick and slip under an object."""
import numpy as np
import pytest
from tactile_driver.simulation.taxel.layer import BondedLayer

PULL, REACH = 5e7, 4.0  # N/m^3; thickness in cells
FREE = np.full((64, 64), 1e9)  # Pa, friction that holds everything


def dragged(limit, wanted, steps=1):
    layer = BondedLayer(limit.shape, REACH, PULL)
    for k in range(1, steps + 1):
        layer.move(wanted * k / steps, limit)
    return layer


def face(half=12):
    limit = np.zeros((64, 64))
    limit[32 - half:32 + half, 32 - half:32 + half] = 1e4
    return limit


def test_shear_waves_are_as_stiff_as_elasticity_says():
    wave = np.zeros((64, 64, 2))
    for length in (16, 8):
        wave[:, :, 0] = 1e-6 * np.cos(2 * np.pi / length * np.arange(64))[:, None]
        middle = dragged(FREE, wave).traction[24:40, 24:40, 0] / wave[24:40, 24:40, 0]
        depth = 2 * np.pi / length * REACH
        assert np.median(middle) == pytest.approx(PULL * depth / np.tanh(depth), rel=0.03)


def test_the_border_of_what_sticks_carries_most_and_the_rubber_around_goes_along():
    layer = dragged(face() * 1e5, np.full((64, 64, 2), [1e-5, 0.0]))
    assert layer.traction[32, 32, 0] == pytest.approx(PULL * 1e-5, rel=0.05) and layer.traction[32, 20, 0] > 2 * layer.traction[32, 32, 0]
    assert np.abs(layer.shift[20:44, 20:44] - [1e-5, 0]).max() < 1e-7
    assert 0.3e-5 < layer.shift[32, 45, 0] < 0.9e-5 and abs(layer.shift[32, 52, 0]) < 1e-6


def test_traction_stays_within_friction_and_slip_begins_at_the_border():
    slipping = []
    for way in (0.6e-4, 1.2e-4, 3e-4):  # friction over pull is 2e-4 m
        layer = dragged(face(), np.full((64, 64, 2), [way, 0.0]), steps=10)
        length = np.hypot(*layer.traction.transpose(2, 0, 1))
        assert (length <= 1e4 * (1 + 1e-6)).all() and not length[face() == 0].any()
        slips = np.abs(layer.shift[20:44, 20:44, 0] - way) > 0.02 * way
        slipping.append(slips.mean())
        assert slips.all() or slips[0, 0] and not slips[12, 12]
    assert slipping[0] < 0.1 < slipping[1] < 0.6 and slipping[2] == 1


def test_nothing_touched_moves_nothing():
    layer = dragged(face(), np.full((64, 64, 2), [1e-4, 0.0]))
    layer.move(np.zeros((64, 64, 2)), np.zeros((64, 64)))
    assert not layer.traction.any() and not layer.shift.any()
