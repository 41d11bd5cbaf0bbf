# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dots detected in one image, and their tracks."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass
class Dots:
    """Dots detected in one image, unordered.

    uv: (N, 2) float64, image positions, px (column, row); area: (N,) float64, px^2;
    sigma: (N,) float64, standard deviation of a position per axis, px.
    """

    uv: np.ndarray
    area: np.ndarray
    sigma: np.ndarray

    def __len__(self) -> int:
        return len(self.uv)

    def take(self, some: np.ndarray) -> Dots:
        """A subset; some: (N,) bool, indices, or a slice."""
        return Dots(self.uv[some], self.area[some], self.sigma[some])


_REAL = frozenset(('uv', 'area', 'sigma', 'duv', 'xyz'))  # of DotTracks, in double precision


@dataclass
class DotTracks:
    """Dots with persistent ids; entry k of each array belongs to the same dot.

    rows, columns: of the printed grid (0 for an irregular pattern); id: (N,) int64, row * columns + column on a grid, a track
    number elsewhere;
    uv, duv: (N, 2) float64, position and displacement from the untouched reference, px; area: (N,) px^2; sigma: (N,) px per axis;
    xyz: (N, 3) float64, sensor frame, m, or None without a surface model. Dots that are not seen are absent. Numbers of single precision
    are taken, too, and kept in double.
    """

    rows: int
    columns: int
    id: np.ndarray
    uv: np.ndarray
    area: np.ndarray
    sigma: np.ndarray
    duv: np.ndarray
    xyz: np.ndarray | None = None

    def __setattr__(self, name: str, value) -> None:
        object.__setattr__(self, name, np.asarray(value, float) if name in _REAL and value is not None else value)

    def __len__(self) -> int:
        return len(self.id)

    @property
    def rest_uv(self) -> np.ndarray:
        """(N, 2) positions of the same dots in the untouched reference, px."""
        return self.uv - self.duv

    def rest_moved(self, known: np.ndarray, limit: float) -> bool:
        """Whether a dot's untouched position is farther than limit, px, along an axis from known[id], (K, 2) px, or that is NaN."""
        rest = self.rest_uv
        stayed = np.abs(rest - known.take(self.id, axis=0)) <= limit
        return not stayed.all() and bool((np.isfinite(rest).all(1) & ~stayed.all(1)).any())

    def take(self, some: np.ndarray) -> DotTracks:
        """A subset of the dots; some: (N,) bool, or indices."""
        xyz = None if self.xyz is None else self.xyz[some]
        return DotTracks(self.rows, self.columns, self.id[some], self.uv[some], self.area[some], self.sigma[some], self.duv[some], xyz)
