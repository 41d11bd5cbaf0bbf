# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The paper's map from the detector to the sphere: an offset and one factor (Maekawa et al., eqs 2 to 5)."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import BadCalibration
from .geometry import bent, flat

#: rad for a half width: the rim on the detector's edge. What a fibre plate is made for, where nothing is measured.
NOMINAL_BETA = np.pi / 2
AT_POLE = 0.05  # rad
_LEAST_AWAY = 1e-6  # half widths: less is no distance


@dataclass(frozen=True)
class PaperMap:
    """offset: (2,) of the detector in half widths (x_c0 of eq 2); beta: rad for a half width (beta_c of eq 5)."""

    offset: np.ndarray
    beta: float

    def normals(self, place: np.ndarray) -> np.ndarray:
        """Unit normals (N, 3) for places (N, 2) on the detector in half widths (eqs 3, 4, 7)."""
        return bent(self.beta * (place - self.offset))


def fit_paper(place: np.ndarray, normal: np.ndarray) -> tuple[PaperMap, list[str]]:
    """The map from contacts at places (N, 2) with known normals (N, 3), and what had to be assumed, a line each.

    The contact nearest to the pole gives the offset (eq 2), all others the factor (eq 5, the mean over them weighted by their angle).
    Raises BadCalibration without a contact, for places that are no numbers, and where all contacts are at one place.
    """
    if not len(place):
        raise BadCalibration('no contact at a known place; press the finger at its pole and at one more known place')
    if not (np.isfinite(place).all() and np.isfinite(normal).all()):
        raise BadCalibration('a contact\'s place or normal is no number; leave it out of the recording')
    theta = np.linalg.norm(flat(normal), axis=1)
    pole, others = theta <= max(AT_POLE, 0.0), theta > AT_POLE
    said = []
    if pole.any():
        offset = place[pole].mean(axis=0)
    elif len(place) > 2:
        offset = _offset_of_slanted(place, flat(normal))
        said.append('no contact at the pole: the offset follows from the others')
    else:
        offset = np.zeros(2)
        said.append('no contact at the pole: the offset of the detector is taken for 0')
    if not others.any():
        said.append(f'no contact away from the pole: the factor is the nominal {NOMINAL_BETA:.3f} rad for a half width')
        return PaperMap(offset, NOMINAL_BETA), said
    away = float(np.linalg.norm(place[others] - offset, axis=1).sum())
    if not _LEAST_AWAY * others.sum() < away < np.inf:
        raise BadCalibration('contacts away from the pole are where those at the pole are: does the light reach the detector?')
    return PaperMap(offset, float(theta[others].sum()) / away), said


def _offset_of_slanted(place: np.ndarray, plane: np.ndarray) -> np.ndarray:
    """(2,) where a straight map through places puts the pole."""
    basis = np.column_stack([plane, np.ones(len(plane))])
    return np.linalg.lstsq(basis, place, rcond=None)[0][2]
