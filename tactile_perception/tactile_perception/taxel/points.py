# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Surface points of a taxel array: force and indentation at each taxel."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .array import SoftPad, TaxelArray
from ..common.estimates import NONE, SlipEstimate
from ..common.surface_points import SLIPPING, STICKING, UNKNOWN, SurfacePoints
from .imprint import ImprintMotion
from .regions import Regions


def taxel_points(array: TaxelArray, pad: SoftPad, surface: np.ndarray, known: bool, forces: np.ndarray, state: np.ndarray) -> SurfacePoints:
    """Points of all taxels on the untouched surface.

    surface: (rows, columns) pressure, in Pa if known; forces: (rows, columns) N (taxel_forces); state: (rows, columns) (taxel_states).
    Tangential forces and displacements are NaN: the array measures pressure only.
    """
    places = np.zeros((array.rows, array.columns, 3))
    places[..., 0], places[..., 1] = array.x, array.y[:, None]
    depth = surface * (pad.thickness / pad.stiffness) if known else np.full(array.shape, np.nan)
    return SurfacePoints(array.shape, places.reshape(-1, 3), np.tile([0.0, 0.0, 1.0], (array.rows * array.columns, 1)), _along_z(-depth),
                         _along_z(-forces), forces.ravel(), state.ravel())


def taxel_forces(regions: Regions, surface: np.ndarray, normal: Sequence[float], known: bool) -> np.ndarray:
    """(rows, columns) N: each region's normal force, N, distributed by pressure; 0 outside the regions. All NaN if not known."""
    forces = np.full(surface.shape, 0.0 if known else np.nan)
    if not known or not regions.all:
        return forces
    load = np.maximum(surface, 0)
    for region, force in zip(regions.all, normal):
        own = regions.near == region.label
        total = float(load[own].sum())
        forces[own] = load[own] * (force / total) if total > 0 else np.nan
    return forces


def taxel_states(regions: Regions, slip: SlipEstimate, motion: ImprintMotion | None) -> np.ndarray:
    """(rows, columns) uint8 state of each taxel; UNKNOWN in contact where slip is detected but not localised."""
    state = np.where(regions.touched, STICKING, 0).astype(np.uint8)
    if motion is not None:
        state[regions.touched & motion.slipping] = SLIPPING
    elif slip.state != NONE:
        state[regions.touched] = UNKNOWN
    return state


def _along_z(values: np.ndarray) -> np.ndarray:
    """(K, 3) with values (rows, columns) along z and NaN along x and y."""
    vectors = np.full((values.size, 3), np.nan)
    vectors[:, 2] = values.ravel()
    return vectors
