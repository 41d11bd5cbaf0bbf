# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""How far a method errs at places that it was not fitted to: what methods without a covariance of their own state as theirs."""
from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..errors import BadCalibration
from .estimate import TouchMethod
from .presses import Presses


def held_out_spread(make: Callable[[Presses], TouchMethod], presses: Presses) -> tuple[float, float]:
    """Root mean square errors, m, of place (each of x and y) and of depth over places left out; NaN where presses are at one place only.

    make: fits a method to presses.
    """
    place, depth = [], []
    for fitting, held in presses.held_out():
        try:
            method = make(fitting)
        except BadCalibration:  # what is left is too little
            continue
        for field, position, deep in zip(held.fields, held.position, held.depth):
            for touch in method.estimate(field)[:1]:
                place.append((touch.position - position)[:2])
                depth.append(touch.depth - deep)
    if not place:
        return float('nan'), float('nan')
    return float(np.sqrt(np.mean(np.square(place)))), float(np.sqrt(np.mean(np.square(depth))))
