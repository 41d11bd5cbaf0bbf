# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Relative rows and columns of grids that are known."""
import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st
from tactile_perception.dots.number import find_lattice


def printed(rows, columns, pitch=20.0, degrees=0.0):
    """Places (N, 2) of a grid's dots and their indices (N, 2), row after row."""
    rc = np.stack(np.divmod(np.arange(rows * columns), columns), axis=1)
    z = pitch * (rc[:, 1] + 1j * rc[:, 0]) * np.exp(1j * np.deg2rad(degrees))
    return np.stack([z.real, z.imag], axis=1) + 200, rc


def offsets(found, rc):
    """The different offsets between found indices and true ones, of members."""
    return np.unique(found.rc[found.member] - rc[found.member], axis=0)


@given(seed=st.integers(0, 2**32 - 1), rows=st.integers(6, 12), columns=st.integers(6, 12), degrees=st.floats(-40, 40),
       noise=st.floats(0, 1.5), lost=st.floats(0, 0.15))
@example(seed=11, rows=4, columns=11, degrees=0.0, noise=0.0, lost=0.078125)  # three lost dots leave no closed cell between two columns
@settings(max_examples=80, deadline=None)
def test_indices_of_a_turned_grid_with_gaps(seed, rows, columns, degrees, noise, lost):
    rng = np.random.default_rng(seed)
    uv, rc = printed(rows, columns, degrees=degrees)
    kept = rng.permutation(len(uv))[:len(uv) - int(lost * len(uv))]
    found = find_lattice(uv[kept] + rng.normal(0, noise, (len(kept), 2)))
    assert found is not None
    assert len(offsets(found, rc[kept])) == 1
    assert found.member.mean() > 0.75 - 2 * lost
    assert np.degrees(found.angle) == pytest.approx(degrees, abs=1.5 + noise)
    assert found.pitch == pytest.approx(20.0, abs=0.5 + 2.5 * noise)


def test_a_bulge_and_a_compressed_band_are_followed():
    uv, rc = printed(23, 23, 18.0)
    x, y = (uv - uv.mean(axis=0)).T
    gain = 1 + 0.12 * np.exp(-(x**2 + y**2) / 100.0**2)
    bent = np.stack([x * gain - 24 * np.tanh(x / 60), y * gain], axis=1)
    found = find_lattice(bent)
    assert found.member.all()
    assert len(offsets(found, rc)) == 1


def test_the_hint_chooses_among_four_directions():
    uv, _ = printed(6, 8)
    found = find_lattice(uv, np.pi / 2)
    assert found.angle == pytest.approx(np.pi / 2)
    assert np.ptp(found.rc[:, 0]) == 7


def test_a_hole_is_walked_around():
    uv, rc = printed(9, 9)
    keep = (np.abs(rc - 4) > 1).any(axis=1)
    found = find_lattice(np.ascontiguousarray(uv[keep]))
    assert found.member.all() and len(offsets(found, rc[keep])) == 1


@pytest.mark.parametrize('places', [np.zeros((0, 2)), np.zeros((3, 2)), np.zeros((10, 2)), np.zeros((10_000, 2)),
                                    np.random.default_rng(0).uniform(0, 1, (300, 2)), np.stack([np.arange(50.0), np.zeros(50)], axis=1)])
def test_no_grid(places):
    found = find_lattice(places)
    assert found is None or not found.member.all()
