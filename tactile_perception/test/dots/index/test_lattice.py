# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.dots.index.lattice import find_lattice


def square(rows=6, columns=8, pitch=20.0, angle=0.0):
    row, column = np.divmod(np.arange(rows * columns), columns)
    z = pitch * (column + 1j * row) * np.exp(1j * angle)
    return np.stack([z.real, z.imag], axis=1) + 200, row, column


@pytest.mark.parametrize('degrees', [-30.0, 0.0, 20.0])
def test_angle_pitch_and_numbers(degrees):
    uv, row, column = square(angle=np.deg2rad(degrees))
    lattice = find_lattice(uv)
    assert np.degrees(lattice.angle) == pytest.approx(degrees, abs=1e-6)
    assert lattice.pitch == pytest.approx(20.0)
    assert lattice.member.all()
    np.testing.assert_array_equal(lattice.rc - lattice.rc.min(axis=0), np.stack([row, column], axis=1))


def test_the_hint_chooses_among_four_directions():
    uv, _, _ = square()
    lattice = find_lattice(uv, angle_hint=np.pi / 2)
    assert lattice.angle == pytest.approx(np.pi / 2)
    assert np.ptp(lattice.rc[:, 0]) == 7


def test_a_hole_is_walked_around():
    uv, row, column = square(9, 9)
    keep = (abs(row - 4) > 1) | (abs(column - 4) > 1)
    lattice = find_lattice(uv[keep])
    assert lattice.member.all()
    np.testing.assert_array_equal(lattice.rc - lattice.rc.min(axis=0), np.stack([row, column], axis=1)[keep])


def test_no_grid():
    assert find_lattice(np.zeros((0, 2))) is None
    assert find_lattice(np.random.default_rng(0).uniform(0, 1, (3, 2))) is None
    assert find_lattice(np.zeros((10, 2))) is None
