# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Takes rows and columns further, over gaps that no link between neighbours bridges: where many dots are missing.

Near a dot, row and column are nearly a linear function of the place in the image. Fitted to the nearest numbered dots it tells a loose
dot's number; one that comes out far from a whole number, or from a fit that reaches too far, stays loose. So it goes on wave by wave.
"""
from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

_NEAREST = 8  # numbered dots that a fit is made to
_REACH = 2.9  # pitches: further ones do not count
_LEVERAGES = (1.0, 3.0)  # variance of what a fit says, per variance of the dots it is made to: far-fetched ones only if there are no others
_BENT = 0.15  # rows, root mean square that a fit may be off at its own dots
_OFF = 0.25  # rows from a whole number
_LAST_OFF = 0.3  # the same for a dot that has its number, in the end


def grow(uv: np.ndarray, rc: np.ndarray, member: np.ndarray, pitch: float) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns rc (N, 2) int64 of dots at uv (N, 2) px, valid where member (N,) bool, for more dots; dots that do not fit among
    their neighbours in the end are members no longer."""
    rc, member = rc.copy(), member.copy()
    while any(_wave(uv, rc, member, pitch, leverage) for leverage in _LEVERAGES):
        pass
    return rc, _confirmed(uv, rc, member, pitch)


def _wave(uv, rc, member, pitch, leverage) -> bool:
    """Make dots members, in place, whose numbers fits of at most this leverage tell; whether there are any."""
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
    """(L, 2) rows and columns at uv (L, 2) by fits to the nearest known dots but the first `skip`, and whether these can be relied on."""
    distance, near = cKDTree(known_uv).query(uv, _NEAREST + skip)
    distance, near = distance[:, skip:], near[:, skip:]
    weight = (distance < _REACH * pitch)[:, :, None].astype(float)
    basis = np.concatenate([weight, (known_uv[near] - uv[:, None]) / pitch * weight], axis=2)
    values = known_rc[near] - known_rc[near[:, :1]]  # small numbers, so that the ridge does not draw them to zero
    inverse = np.linalg.inv(basis.transpose(0, 2, 1) @ basis + 1e-6 * np.eye(3))
    fit = inverse @ (basis.transpose(0, 2, 1) @ (values * weight))
    off = ((basis @ fit - values * weight) ** 2).sum(axis=(1, 2)) / np.maximum(weight.sum(axis=(1, 2)) - 3, 1)
    return fit[:, 0] + known_rc[near[:, 0]], (inverse[:, 0, 0] < leverage) & (off < 2 * _BENT**2) & (weight.sum(axis=(1, 2)) > 3.5)


def _confirmed(uv, rc, member, pitch):
    """(N,) bool members whose numbers are those that their neighbours tell."""
    known = np.flatnonzero(member)
    if len(known) <= _NEAREST + 1:
        return member
    said, sure = _said(uv[known], uv[known], rc[known], pitch, _LEVERAGES[-1], 1)
    member = member.copy()
    member[known] = sure & (np.abs(said - rc[known]).max(axis=1) < _LAST_OFF)
    return member
