# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The radius of the sphere that was pressed, where nobody has measured it: the one with which the dots on it fit best."""
from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import minimize_scalar

from ..errors import BadCalibration

SMALLEST, LARGEST = 2e-3, 30e-3  # m
TOLERANCE = 0.01  # of the radius


def find_sphere_radius(misfit: Callable[[float], float]) -> float:
    """Radius, m, at which misfit(radius), m, is least. Raises BadCalibration where it has no least value between 2 and 30 mm."""
    def at(log_radius: float) -> float:
        """The misfit at exp(log_radius), m; 1 where there is none."""
        try:
            return misfit(float(np.exp(log_radius)))
        except BadCalibration:
            return 1.0
    coarse = np.linspace(np.log(SMALLEST), np.log(LARGEST), 9)
    values = [at(x) for x in coarse]
    best = int(np.argmin(values))
    if best in (0, len(coarse) - 1) or values[best] >= 1.0:
        raise BadCalibration(f'touchpad calibration: no sphere of {SMALLEST * 1e3:.0f} to {LARGEST * 1e3:.0f} mm radius fits the presses; '
                             'give its radius with --sphere-radius, and check that ground_truth/contacts holds the tips of sphere presses')
    found = minimize_scalar(at, bounds=(coarse[best - 1], coarse[best + 1]), method='bounded', options={'xatol': TOLERANCE})
    return float(np.exp(found.x))
