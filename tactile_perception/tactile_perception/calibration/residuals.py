# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What a calibration gets wrong at presses that it was not fitted to, and which of them stand out."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

_FAR = 6.0  # robust standard deviations beyond the usual error
_FEWEST = 5  # presses, of less nothing is usual
_MOST = 20  # lines


@dataclass(frozen=True)
class Residuals:
    """One quantity's errors. name, unit: as they are shown; value: (N,) in that unit, NaN where not known; place: (N, 2) where on the
    sensor, along axes (two names with their units); when: N names of presses by recording and time."""

    name: str
    unit: str
    value: np.ndarray
    place: np.ndarray
    axes: tuple[str, str]
    when: Sequence[str]


def outliers(found: Sequence[Residuals]) -> list[str]:
    """A line for each press whose error stands out from those of the others, largest first."""
    lines = []
    for residuals in found:
        size = np.abs(np.asarray(residuals.value, float))
        known = np.flatnonzero(np.isfinite(size))
        if len(known) < _FEWEST:
            continue
        middle = float(np.median(size[known]))
        limit = middle + _FAR * 1.4826 * float(np.median(np.abs(size[known] - middle)))
        far = [k for k in known[np.argsort(-size[known])] if size[k] > limit]
        lines += [f'{residuals.when[k]}: {residuals.name} {size[k]:.3g} {residuals.unit} off, {middle:.2g} {residuals.unit} is usual'
                  for k in far[:_MOST]]
    return lines
