# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Extrapolates row and column indices over gaps that no link between neighbours bridges, where many dots are missing.

Locally, row and column are nearly linear in image position. A linear fit to the nearest indexed dots predicts the index of a dot without
one. A prediction far from a whole number, or with a high leverage, is rejected. This repeats until no dot is added.
"""
from __future__ import annotations

import numpy as np
import scipy

_NEAREST = 8  # indexed dots in a fit. Chosen
_REACH = 2.9  # pitches, dots further away are excluded. Chosen
_LEVERAGES = (1.0, 3.0)  # largest variance of a prediction per variance of a dot: the second only if the first adds none. Chosen
_BENT = 0.15  # rows, largest RMS residual of a fit. Chosen
_OFF = 0.25  # rows, largest distance of a prediction from a whole number. Chosen
_LAST_OFF = 0.3  # rows, the same for an indexed dot in the final check. Chosen


def grow(uv: np.ndarray, rc: np.ndarray, member: np.ndarray, pitch: float) -> tuple[np.ndarray, np.ndarray]:
    """Indices rc (N, 2) int64 and membership (N,) bool, extended to more dots and checked; dots inconsistent with their neighbours lose
    membership.

    uv: (N, 2) px; rc: (N, 2) int64, row and column, valid where member (N,) bool; pitch: px.
    """
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
    distance, near = scipy.spatial.cKDTree(known_uv).query(uv, _NEAREST + skip)
    distance, near = distance[:, skip:], near[:, skip:]
    weight = (distance < _REACH * pitch)[:, :, None].astype(float)
    basis = np.concatenate([weight, (known_uv[near] - uv[:, None]) / pitch * weight], axis=2)
    values = known_rc[near] - known_rc[near[:, :1]]  # relative indices, which the ridge hardly biases to zero
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
