# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Wrench of a touch: a model gives it over the stiffness of the skin (shear modulus times thickness), which recorded wrenches determine."""
from __future__ import annotations

import numpy as np

from ..errors import BadCalibration
from .presses import Presses
from .estimate import TouchMethod

FEWEST = 6     # presses needed for a fit. Chosen
SHALLOWEST = 0.02  # of the deepest press: shallower presses are left out. Chosen


def fit_stiffness(presses: Presses, method: TouchMethod) -> tuple[float, dict]:
    """The stiffness, N/m, and the median relative errors of force and moment at the presses with a recorded wrench. Raises BadCalibration
    for fewer than FEWEST of these that the method estimates as one touch."""
    deepest = float(presses.depth.max(initial=0.0))
    known = presses.touching & np.isfinite(presses.wrench).all(1) & (presses.wrench[:, 2] < 0) & (presses.depth > SHALLOWEST * deepest)
    presses = presses.select(known)
    found = [(touches[0].wrench, wrench) for touches, wrench in zip(map(method.estimate, presses.fields), presses.wrench)
             if len(touches) == 1 and np.isfinite(touches[0].wrench).all()]
    if len(found) < FEWEST:
        raise BadCalibration(f'{len(found)} presses with a recorded wrench are too few for the stiffness; {FEWEST} are needed')
    estimated, truth = np.swapaxes(found, 0, 1)
    stiffness = float(np.median(truth[:, 2] / estimated[:, 2]))
    return stiffness, {name: _relative(stiffness * estimated[:, part] - truth[:, part], truth[:, part])
                       for name, part in (('force', slice(3)), ('moment', slice(3, 6)))}


def _relative(error: np.ndarray, truth: np.ndarray) -> float:
    """Median relative error over the samples whose truth is at least 5 % of the largest."""
    size = np.linalg.norm(truth, axis=1)
    good = size > 0.05 * size.max()
    return float(np.median(np.linalg.norm(error[good], axis=1) / size[good])) if good.any() else float('nan')
