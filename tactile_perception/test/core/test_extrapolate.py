# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernel extrapolate_indices (src/dots/index/extrapolate.cpp) against NumPy and a tree of neighbours."""
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from tactile_perception._core import extrapolate_indices

_NEAREST = 8
_REACH = 2.9
_LEVERAGES = (1.0, 3.0)
_BENT = 0.15
_OFF = 0.25
_LAST_OFF = 0.3


def grow(uv: np.ndarray, rc: np.ndarray, member: np.ndarray, pitch: float) -> tuple[np.ndarray, np.ndarray]:
    """The same as the kernel, fit after fit by matrices."""
    rc, member = rc.copy(), member.copy()
    while any(_wave(uv, rc, member, pitch, leverage) for leverage in _LEVERAGES):
        pass
    return rc, _confirmed(uv, rc, member, pitch)


def _wave(uv, rc, member, pitch, leverage) -> bool:
    """Add dots, in place, that fits of at most this leverage predict; returns whether any were added."""
    known, loose = np.flatnonzero(member), np.flatnonzero(~member)
    if len(known) <= _NEAREST or not len(loose):
        return False
    said, sure = _said(uv[loose], uv[known], rc[known], pitch, leverage)
    whole = np.rint(said).astype(np.int64)
    sure &= np.abs(said - whole).max(axis=1) < _OFF
    loose, whole = loose[sure], whole[sure]
    taken = {tuple(place) for place in rc[known].tolist()}
    places, count = np.unique(whole, axis=0, return_counts=True)
    free = {tuple(p) for p, n in zip(places.tolist(), count) if n == 1} - taken
    fits = np.array([tuple(place) in free for place in whole.tolist()], bool)
    rc[loose[fits]], member[loose[fits]] = whole[fits], True
    return bool(fits.any())


def _said(uv, known_uv, known_rc, pitch, leverage, skip=0):
    """Predicted indices (L, 2) at uv (L, 2) px, from fits to the nearest known dots after the first `skip`; and (L,) bool, reliable."""
    distance, near = cKDTree(known_uv).query(uv, _NEAREST + skip)
    distance, near = distance[:, skip:], near[:, skip:]
    weight = (distance < _REACH * pitch)[:, :, None].astype(float)
    basis = np.concatenate([weight, (known_uv[near] - uv[:, None]) / pitch * weight], axis=2)
    values = known_rc[near] - known_rc[near[:, :1]]
    inverse = np.linalg.inv(basis.transpose(0, 2, 1) @ basis + 1e-6 * np.eye(3))
    fit = inverse @ (basis.transpose(0, 2, 1) @ (values * weight))
    off = ((basis @ fit - values * weight) ** 2).sum(axis=(1, 2)) / np.maximum(weight.sum(axis=(1, 2)) - 3, 1)
    return fit[:, 0] + known_rc[near[:, 0]], (inverse[:, 0, 0] < leverage) & (off < 2 * _BENT**2) & (weight.sum(axis=(1, 2)) > 3.5)


def _confirmed(uv, rc, member, pitch):
    """(N,) bool, members whose indices match the prediction from their neighbours."""
    known = np.flatnonzero(member)
    if len(known) <= _NEAREST + 1:
        return member
    said, sure = _said(uv[known], uv[known], rc[known], pitch, _LEVERAGES[-1], 1)
    member = member.copy()
    member[known] = sure & (np.abs(said - rc[known]).max(axis=1) < _LAST_OFF)
    return member


@given(seed=st.integers(0, 2**32 - 1), rows=st.integers(2, 14), columns=st.integers(3, 14), known=st.floats(0.1, 0.9),
       noise=st.floats(0.01, 3), wrong=st.integers(0, 3))
@settings(max_examples=40, deadline=None)
def test_indices_are_those_of_plain_fits(seed, rows, columns, known, noise, wrong):
    rng = np.random.default_rng(seed)
    rc = np.stack(np.divmod(np.arange(rows * columns), columns), axis=1)
    uv = 20.0 * rc[:, ::-1] + rng.normal(0, noise, rc.shape) + 0.2 * rc**2
    kept = rng.uniform(size=len(rc)) > 0.15
    member = (rc[:, 1] < known * columns)[kept]
    rc, uv = rc[kept], uv[kept]
    rc[rng.integers(len(rc), size=wrong)] += 1
    found, members = extrapolate_indices(uv, rc, member, pitch=20.0)
    expected, expected_members = grow(uv, rc, member, 20.0)
    np.testing.assert_array_equal(members, expected_members)
    np.testing.assert_array_equal(found[members], expected[members])
