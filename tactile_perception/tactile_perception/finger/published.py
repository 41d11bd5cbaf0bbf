# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The published method (Maekawa et al., section 5).

An equidistant projection from the detector to the sphere by offset and scale (eqs 2 to 5), an offset that is stored once, and a
fixed threshold.
"""
from __future__ import annotations

from dataclasses import replace

import numpy as np

from .._core import finger
from ..errors import BadCalibration
from .map import NOMINAL_BETA, EquidistantMap, log_map
from .model import FingerModel

_POLE_RADIUS = 0.05  # rad: contacts within it count as at the pole. Chosen: 0.8 mm on the surface of the paper's finger
_MIN_DISTANCE = 1e-6  # half widths, mean distance from the pole: guards the division of eq 5


def fit_equidistant_map(place: np.ndarray, normal: np.ndarray) -> tuple[EquidistantMap, list[str]]:
    """The map fitted to contacts at detector positions (N, 2), half widths, with known normals (N, 3), and notes on what was assumed.

    Contacts at the pole give the offset (eq 2), all others the scale: eq 5, averaged with the distances as weights. Raises BadCalibration
    without contacts, for non-finite values, and where all positions coincide.
    """
    if not len(place):
        raise BadCalibration('no contact at a known position: press the finger at its pole and at one more known position')
    if not (np.isfinite(place).all() and np.isfinite(normal).all()):
        raise BadCalibration('a contact\'s position or normal is not finite: leave it out of the recording')
    theta = np.linalg.norm(log_map(normal), axis=1)
    pole, others = theta <= _POLE_RADIUS, theta > _POLE_RADIUS
    notes = []
    if pole.any():
        offset = place[pole].mean(axis=0)
    elif len(place) > 2:
        offset = _extrapolated_offset(place, log_map(normal))
        notes.append('no contact at the pole: the offset is extrapolated from the others')
    else:
        offset = np.zeros(2)
        notes.append('no contact at the pole: the detector\'s offset is assumed to be 0')
    if not others.any():
        notes.append(f'no contact away from the pole: the scale is the nominal {NOMINAL_BETA:.3f} rad per half width')
        return EquidistantMap(offset, NOMINAL_BETA), notes
    away = float(np.linalg.norm(place[others] - offset, axis=1).sum())
    if not _MIN_DISTANCE * others.sum() < away < np.inf:
        raise BadCalibration('contacts away from the pole have the detector position of the pole: check that light reaches the detector')
    return EquidistantMap(offset, float(theta[others].sum()) / away), notes


def _extrapolated_offset(place: np.ndarray, plane: np.ndarray) -> np.ndarray:
    """(2,) position of the pole by a linear fit of positions to tangent vectors."""
    basis = np.column_stack([plane, np.ones(len(plane))])
    return np.linalg.lstsq(basis, place, rcond=None)[0][2]


def paper_finger(model: FingerModel, threshold: float, **settings) -> finger.PsdFinger:
    """A PsdFinger with the paper's map, in contact where the total exceeds threshold, V; settings: of FingerSettings.

    Raises BadArgument for a threshold that is not positive.
    """
    paper = replace(model, smooth=None, level=None, cross=None, creep=None)
    return finger.PsdFinger(paper, finger.FingerSettings(threshold=threshold, **settings))
