# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Where the cameras really stand.

A pose from untouched printed markers is off sideways, by more than the print is, and so would be every touch.
"""
from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .field import MarkerField


@dataclass(frozen=True)
class EyeShifts:
    """eyes: (G, 3) m, one for each camera, as the views say; shifts: (G, 2) m, how far from there over x and y they stand."""

    eyes: np.ndarray
    shifts: np.ndarray

    @classmethod
    def of(cls, field: MarkerField) -> EyeShifts:
        """No shifts yet, for the eyes of a field; those nearer to each other than a tenth of their distance to the sheet are one."""
        eyes: list[np.ndarray] = []
        for eye in field.eye[np.isfinite(field.eye).all(1)]:
            if not any(np.linalg.norm(eye - known) < 0.1 * abs(eye[2]) for known in eyes):
                eyes.append(eye)
        return cls(np.array(eyes).reshape(-1, 3), np.zeros((len(eyes), 2)))

    def shifted(self, field: MarkerField) -> MarkerField:
        """The field as seen from where the eyes really stand."""
        distance = np.linalg.norm(field.eye[:, None] - self.eyes, axis=2)
        eye = field.eye.copy()
        eye[:, :2] += self.shifts[np.argmin(np.nan_to_num(distance), axis=1)]
        return replace(field, eye=eye)
