# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A press, and how the markers of a sheet appear on the viewing plane."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ... import _core
from .reduced_model import LibraryPlan


@dataclass(frozen=True)
class Press:
    """A round tip on the sheet. place: (2,) m, of the tip; depth: m, as if it were alone; log_radius: log of its radius over the
    calibrated one; drag: (2,) tangential over normal force, beyond that of a tip that came straight down.
    """

    place: np.ndarray
    depth: float
    log_radius: float = 0.0
    drag: tuple[float, float] = (0.0, 0.0)

    @property
    def vector(self) -> np.ndarray:
        """(6,) place, depth, log radius, drag."""
        return np.array([*self.place, self.depth, self.log_radius, *self.drag])

    @classmethod
    def of(cls, vector: np.ndarray) -> Press:
        """Inverse of vector."""
        return cls(vector[:2], float(vector[2]), float(vector[3]), (float(vector[4]), float(vector[5])))


def field_appearance(field: np.ndarray, plan: LibraryPlan, place: np.ndarray, rest: np.ndarray, eye: np.ndarray,
                     marker_radius: float) -> np.ndarray:
    """Shift, m, and growth (K, 3) in the plane z = 0 of discs of marker_radius, m, at rest (K, 2), m, seen from eye (K, 3), m.

    field: coefficients (side * side, 3), m, on uniform B-splines, of the sheet pressed at place (2,) m. Growth is the log of the ratio of
    the areas as imaged.
    """
    return _core.show_field(field.astype(np.float32), rest, eye, place=tuple(place), half=plan.half, scale=plan.scale,
                            marker_radius=marker_radius)
