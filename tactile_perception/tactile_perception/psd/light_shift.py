# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""How a contact's place on the detector moves with its light.

The patch of a stronger contact is larger and reaches farther to either side. More light arrives from the side of the pole than from that of
the rim, so the centroid moves to the pole as the light grows.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .maps import SmoothMap, trend
from .response import level_basis

_TERMS = 5  # of the logarithm of the typical light
_LARGEST = 1.0  # relative light that is corrected for at most: a calibration with a few forces tells no more. Chosen
_LARGEST_LOG = 20.0  # keeps the exponential finite far from calibrated places


@dataclass(frozen=True)
class LightShift:
    """typical: (5,) coefficients of the logarithm of the light, V, of a typical contact at a position; slopes: (4, 2), rad for a contact of
    twice that light, of the four terms that grow with the distance from the detector's centre."""

    typical: np.ndarray
    slopes: np.ndarray

    def light(self, place: np.ndarray) -> np.ndarray:
        """Light (N,), V, of a typical contact at positions (N, 2), half widths."""
        return np.exp(np.clip(level_basis(place, _TERMS) @ self.typical, -_LARGEST_LOG, _LARGEST_LOG))

    def relative(self, place: np.ndarray, light: np.ndarray) -> np.ndarray:
        """Light (N,), V, over the typical one, less 1 and at most 1 in size."""
        return np.clip(light / self.light(place) - 1, -_LARGEST, _LARGEST)

    def bend(self, place: np.ndarray) -> np.ndarray:
        """What a contact of twice the typical light adds to the map, (N, 2) rad."""
        return trend(place, 5)[:, 1:] @ self.slopes

    def values(self, place: np.ndarray, light: np.ndarray) -> np.ndarray:
        """What contacts at positions (N, 2), half widths, with light (N,), V, add to the map, (N, 2) rad."""
        return self.relative(place, light)[:, None] * self.bend(place)


def fit_light_shift(place: np.ndarray, values: np.ndarray, light: np.ndarray, smooth: SmoothMap) -> LightShift:
    """The shift that remains of values (N, 2), rad, at positions (N, 2) with light (N,), V, beside a map of the positions: generalised
    least squares with the covariance of that map."""
    typical = np.linalg.lstsq(level_basis(place, _TERMS), np.log(light), rcond=None)[0]
    found = LightShift(typical, np.zeros((4, 2)))
    basis = found.relative(place, light)[:, None] * trend(place, 5)[:, 1:]
    weight = smooth.precision()
    return LightShift(typical, np.linalg.lstsq(basis.T @ weight @ basis, basis.T @ weight @ values, rcond=None)[0])
