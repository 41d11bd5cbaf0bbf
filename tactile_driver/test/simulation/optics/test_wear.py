# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_driver.simulation.optics.wear import Wear, WornPrint, WornSkin, glare

STEPS = np.arange(-20, 21)


def print_left(wear, count=40, radius=16.0):
    """Ink left on markers of 16 px radius, and the mask of their discs."""
    which, off = np.arange(count), np.zeros((count, 2))
    left = WornPrint(wear, count).left(which, off, np.tile(np.eye(2) / radius, (count, 1, 1)), STEPS, 0.5)
    return left, np.hypot(STEPS[:, None], STEPS) < radius - 1


def test_as_printed_all_ink_is_there():
    left, _ = print_left(Wear.of(0.0))
    np.testing.assert_allclose(left, 1)
    assert WornSkin(Wear.of(0.0), 0.03).grit.max() == 0 and WornSkin(Wear.of(0.0), 0.03).light.min() == 1
    assert glare(Wear.of(0.0), 64, 48, 5.0).max() == 0


@pytest.mark.parametrize('missing', [0.1, 0.3])
def test_chips_take_their_share(missing):
    left, disc = print_left(Wear(missing=missing))
    assert 1 - left[:, disc].mean() == pytest.approx(missing, abs=0.05)


def test_speckle_leaves_its_share_in_grains_of_their_size():
    fine, disc = print_left(Wear(speckle=0.8, grain=0.12))
    coarse, _ = print_left(Wear(speckle=0.8, grain=0.35))
    assert fine[:, disc].mean() == pytest.approx(1 - 0.8 * 0.29, abs=0.04)
    assert np.abs(np.diff(fine, axis=2))[:, disc[:, 1:]].mean() > 1.3 * np.abs(np.diff(coarse, axis=2))[:, disc[:, 1:]].mean()


def test_wear_goes_with_the_marker_and_is_its_own():
    wear = Wear.of(1.0, 3)
    worn = WornPrint(wear, 2)
    turned = np.array([[[0, 1], [-1, 0]], [[1, 0], [0, 1]]]) / 16.0
    left = worn.left(np.array([0, 0]), np.zeros((2, 2)), turned, STEPS, 0.5)
    np.testing.assert_allclose(left[0], np.rot90(left[1], -1), atol=0.05)
    other = worn.left(np.array([1]), np.zeros((1, 2)), turned[1:], STEPS, 0.5)
    assert np.abs(other[0] - left[1]).mean() > 0.1


def test_dirt_grit_weave_and_glare():
    wear = Wear.of(1.0, 5)
    skin = WornSkin(wear, 0.03)
    assert 0 < (skin.grit > 0.2).mean() < 0.05
    assert 0.01 < (skin.light < 0.6).mean() < 0.06 and 0.05 < skin.light.std() < 0.3
    assert 5 < glare(wear, 640, 480, 12.0).max() < 300
