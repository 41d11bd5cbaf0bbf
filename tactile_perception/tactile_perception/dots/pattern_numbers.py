# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers for patterns that are no grid: those of the pattern's own dots, found from each image alone."""
from __future__ import annotations

import numpy as np

from tactile_perception.dots.register import Pattern
from tactile_perception.errors import BadArgument, BadFrame


class PatternNumbers:
    """Gives each dot the number that it has in the pattern: calibrated places uv (K, 2) px, or None for the first frame's dots.

    Unlike tracks, numbers do not depend on the frames in between, so independent presses and recordings share them. Raises
    BadArgument for a pattern of too few dots.
    """

    def __init__(self, uv: np.ndarray | None = None):
        self._pattern = None if uv is None else Pattern(uv)

    def update(self, uv: np.ndarray, stamp_s: float) -> np.ndarray:
        """Number (N,) int64 of each dot at uv (N, 2) px, -1 where not certain; stamp_s is not used. Raises BadFrame where the first
        frame's dots make no pattern."""
        if self._pattern is None:
            try:
                self._pattern = Pattern(uv)
            except BadArgument as error:
                raise BadFrame(f'no pattern to number dots by: {error}') from error
        return self._pattern.match(uv)
