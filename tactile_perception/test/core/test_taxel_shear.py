# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernels taxel_move and taxel_pull_pressure (src/taxel/taxel_shear.cpp) against a slow fixed point and SciPy."""
import numpy as np
import pytest
from scipy import ndimage
from tactile_perception._core import taxel_move, taxel_pull_pressure

PAD = {'pitch': 1e-3, 'thickness': 2.0, 'coupling': 2.0, 'limit': 1e-8, 'on_top': 1.2, 'sharp': 1.0}


def settled(drag, touched, pressure, shift):
    """Fields after a motion, by many plain sweeps over the whole array."""
    rows, columns = touched.shape
    y, x = 1e-3 * (np.mgrid[:rows, :columns] - 0.5 * np.array([rows - 1, columns - 1])[:, None, None])
    carried = drag + np.array([shift[0] - shift[2] * y, shift[1] + shift[2] * x]) * touched
    smooth = ndimage.gaussian_filter(pressure, PAD['sharp'], mode='nearest', truncate=4.0)
    limit = np.maximum(pressure + PAD['on_top'] * (pressure - smooth), 0) * PAD['limit'] * touched
    found = carried.copy()
    for _ in range(300):
        wide = np.pad(found, ((0, 0), (1, 1), (1, 1)), mode='edge')
        others = PAD['coupling'] * (wide[:, :-2, 1:-1] + wide[:, 2:, 1:-1] + wide[:, 1:-1, :-2] + wide[:, 1:-1, 2:])
        pull = (1 + 4 * PAD['coupling']) * carried - others
        pull *= np.minimum(limit / (np.hypot(*pull) + 1e-12), 1)
        found = (pull + others) / (1 + 4 * PAD['coupling'])
    return found, pull, (carried - found) * touched


@pytest.mark.parametrize('shift', [(5e-5, 0.0, 0.0), (3e-4, -2e-4, 0.0), (0.0, 1e-4, 0.05), (0.0, 0.0, 0.0)])
def test_fields_are_those_of_many_plain_sweeps(shift):
    touched = np.zeros((20, 24), bool)
    touched[2:18, 2:22] = True  # the box of the contact with its margin is the whole array
    pressure = ndimage.gaussian_filter(3e4 * touched.astype(np.float32), 1.0)
    drag = np.zeros((2, 20, 24), np.float32)
    for _ in range(8):  # the kernel goes on where it stopped
        *fields, pulled = taxel_move(drag, touched, pressure, np.array(shift), **PAD)
        assert pulled == pytest.approx(fields[1].sum(axis=(1, 2), dtype=float), rel=1e-9, abs=1e-12)
        for field, expected in zip(fields, settled(drag, touched, pressure, shift)):
            np.testing.assert_allclose(field, expected, atol=2e-6)
        drag, pull, _, _ = taxel_move(drag, touched, pressure, np.array(shift) * 0.3, **PAD)
    assert np.hypot(*pull).max() <= PAD['limit'] * 1.5 * pressure.max()


def test_pull_presses_where_it_converges():
    rng = np.random.default_rng(0)
    pull = np.zeros((2, 30, 26), np.float32)
    pull[:, 10:20, 8:18] = rng.normal(0, 1, (2, 10, 10))
    change = np.zeros((30, 26))
    change[:, 1:-1] += pull[0, :, :-2] - pull[0, :, 2:]
    change[1:-1] += pull[1, :-2] - pull[1, 2:]
    expected = sum(3.0 * share * ndimage.gaussian_filter(change, width, mode='constant', truncate=4.0)
                   for share, width in ((0.4, 1.2), (0.6, 2.5)))
    found = taxel_pull_pressure(pull, gain=3.0, spreads=np.array([[0.4, 1.2], [0.6, 2.5]]))
    np.testing.assert_allclose(found, expected, atol=1e-3)
    assert not taxel_pull_pressure(np.zeros((2, 0, 4), np.float32), gain=3.0, spreads=np.ones((2, 2))).size


def test_without_a_contact_nothing_pulls():
    drag = np.ones((2, 5, 6), np.float32)
    for field in taxel_move(drag, np.zeros((5, 6), bool), np.ones((5, 6), np.float32), np.ones(3), **PAD):
        assert not field.any()
