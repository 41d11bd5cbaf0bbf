# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Wrench of a round tip pressed straight down on a clamped sheet, from membrane mechanics, for any place, depth and tip radius.

Simulated for a set of places, depths and tips and interpolated by polynomials, in units of shear modulus times thickness; recorded wrenches
determine that scale.
"""
from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from itertools import product

import numpy as np

from ...common.parallel import in_parallel
from ...errors import BadCalibration
from ..mechanics.membrane_fem import SheetMaterial, press_sheet
from ..mechanics.mesh import SheetMesh, least_length

NODES, LEVELS, SUBSTEPS = 4, 8, 3   # simulated places along a quarter of the sheet; depths; load steps between depths. Chosen
DEGREES = (3, 3, 5)                 # of the polynomials in nearness to the clamp along x, y, and in the root of depth. Chosen
TIPS = 0.25                         # simulated log radii, over the calibrated tip's, to either side. Chosen
DEEPER = 1.08                       # simulated depth over the deepest calibrated press. Chosen
SPANS, SCALE = 7, 8e-3              # of the mesh: spans from the tip to the clamp; m, span at the tip, less on a small sheet. Chosen
SOLVED, RIDGE = 0.9, 1e-7           # least share of converged simulations; ridge of the polynomial fit. Chosen
_NUMBERS = ('half', 'reach', 'deepest', 'radius', 'weights')


class SheetWrench:
    """half: (2,) m, half sides of the sheet; reach: (2,) m, farthest place from the centre; deepest: m; radius: m, of the calibrated tip;
    weights: (P, 6) of the polynomials for log stiffness, lateral force and moment. Arguments outside the range are clamped to it.
    """

    def __init__(self, half: np.ndarray, reach: np.ndarray, deepest: float, radius: float, weights: np.ndarray):
        self.half, self.reach, self.deepest, self.radius = np.array(half, float), np.array(reach, float), float(deepest), float(radius)
        self.weights = np.array(weights, float)
        self._far = _nearness(self.reach / self.half)

    def __call__(self, place: np.ndarray, depth: float, radius: float = float('nan')) -> np.ndarray:
        """(6,) force and moment about the tip at place (2,) and depth m, in the units of press_sheet; radius: m, NaN the calibrated."""
        x, y = share = np.clip(place, -self.reach, self.reach) / self.half
        tip = np.log(radius / self.radius) if radius > 0 else 0.0
        stiff, way_x, way_y, off_x, off_y, twist = self._basis(share, np.array([depth]), tip)[0] @ self.weights
        return np.array([way_x * x, way_y * y, 1.0, off_y * y, off_x * x, twist * x * y]) * (-depth * np.exp(stiff))

    def _basis(self, share: np.ndarray, depths: np.ndarray, tip: float) -> np.ndarray:
        """(D, P) polynomials at a place (2,) over half, even in x and y, depths (D,) m and the log of a tip over the calibrated one."""
        x, y = 2 * _nearness(share) / self._far - 1
        down = 2 * np.sqrt(np.clip(depths / self.deepest, 0, 1)) - 1
        across = np.outer(x**np.arange(DEGREES[0] + 1), y**np.arange(DEGREES[1] + 1)).ravel()
        across = np.concatenate([across, min(max(tip / TIPS, -1.5), 1.5) * across])
        return (across[:, None] * (down[:, None] ** np.arange(DEGREES[2] + 1))[:, None]).reshape(len(depths), -1)

    @classmethod
    def simulate(cls, size: np.ndarray, reach: np.ndarray, deepest: float, radius: float, material: SheetMaterial) -> SheetWrench:
        """Simulate a sheet of size (2,) m, presses up to reach (2,) m from the centre, down to deepest, m, by tips of about radius, m.

        Raises BadCalibration where the simulation does not converge.
        """
        half = np.asarray(size, float) / 2
        scale = min(SCALE, 0.4 * float(half.min()))
        table = cls(half, np.minimum(reach, half - 1.01 * least_length(scale)), DEEPER * deepest, radius, np.zeros((0, 6)))
        nodes = (1 - np.cos((2 * np.arange(NODES) + 1) * np.pi / (2 * NODES))) / 2
        shares = [np.sqrt(1 - np.exp(-nodes * far)) for far in table._far]
        presses = [(np.array(share), tip) for share in product(*shares) for tip in (-TIPS, TIPS)]
        work = partial(table._press, scale=scale, material=material)
        rows, values, solved = zip(*in_parallel(work, presses, 'presses simulated for the wrench'))
        if np.mean(solved) < SOLVED:
            raise BadCalibration(f'simulated presses to {deepest * 1e3:.1f} mm with {material} do not converge; check size and depths')
        rows, values = np.vstack(rows), np.vstack(values)
        table.weights = np.linalg.solve(rows.T @ rows + RIDGE * np.eye(rows.shape[1]), rows.T @ values)
        return table

    def _press(self, where: tuple[np.ndarray, float], scale: float, material: SheetMaterial) -> tuple[np.ndarray, np.ndarray, float]:
        """Rows and targets of the polynomial fit, and the share of converged depths, for a press at a share (2,) of half by a tip of a log
        radius over the calibrated one. Deeper than the last converged depth, targets are extrapolated linearly.
        """
        share, tip = where
        mesh = SheetMesh(self.half * share, self.half, scale, SPANS)
        way = self.deepest * (np.arange(1, LEVELS * SUBSTEPS + 1) / (LEVELS * SUBSTEPS))**1.5
        wrench = press_sheet(mesh, way, self.radius * np.exp(tip), material)[1][SUBSTEPS - 1::SUBSTEPS]
        depths, (x, y) = way[SUBSTEPS - 1::SUBSTEPS], share
        stiff, force = np.log(np.maximum(-wrench[:, 2], 1e-12) / depths), wrench / wrench[:, 2:3]
        values = np.stack([stiff, force[:, 0] / x, force[:, 1] / y, force[:, 4] / x, force[:, 3] / y, force[:, 5] / (x * y)], axis=1)
        found = np.isfinite(values).all(1)
        if found[:2].all():
            for k in np.flatnonzero(~found):
                values[k] = 2 * values[k - 1] - values[k - 2]
            return self._basis(share, depths, tip), values, float(found.mean())
        return np.zeros((0, self._basis(share, depths, tip).shape[1])), np.zeros((0, 6)), 0.0

    def numbers(self) -> dict:
        """For the calibration file."""
        return {name: np.asarray(getattr(self, name)).tolist() for name in _NUMBERS}

    @classmethod
    def from_numbers(cls, numbers: Mapping) -> SheetWrench:
        """From the calibration file. Raises KeyError, TypeError or ValueError for what is no such mapping."""
        return cls(*(numbers[name] for name in _NUMBERS))


def _nearness(share: np.ndarray) -> np.ndarray:
    """Nearness to the clamp of places at a share of the half side: minus the log of the distance, in which stiffness is nearly linear."""
    return -np.log(1 - share**2)
