# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From a touch and the field of markers about it to the wrench, fitted where the wrench was recorded.

How hard a tip presses follows from where it stands and how deep: of a sheet by its mechanics (wrench.membrane), else by what was recorded.
What it drags shows in the field: by how much the markers about it are displaced to one side. So normal force (its logarithm), the force's
direction and where it stands beside the tip are told by factors that vary smoothly with place and depth (varying_coefficients), times
place and
dragging, each as the sensor's mirrors ask for. The moment is the force's at its place.
"""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...errors import BadCalibration
from .membrane import SheetWrench
from ..touches.presses import Presses
from ..touches.touch import TouchEstimate
from .varying_coefficients import VaryingFactors
from ..view.marker_field import MarkerField
from ..view.sensor import MarkerSensor

FEWEST = 6             # presses that a map is fitted to, at the least
MOST = 250             # presses kept; of more, evenly spread ones
ABOUT = 1.5            # marker pitches: about a tip, whose markers tell how it drags
SHALLOW = 0.1          # of the deepest press: what is less deep is less sure by its square
FLOOR = 0.02           # of the deepest press: less deep ones are not fitted to, and dragging is told over no less
BEYOND = 3.0           # times the deepest press: nothing is known of so deep ones
EXCITED = 0.01         # of the largest force or moment: an axis whose values spread less is refused
PLACES = 3             # with fewer (mirror images counted once) those left out cannot tell what an axis is worth
AXES = ('Fx', 'Fy', 'Fz', 'Mx', 'My', 'Mz')
_FEATURES = (3, 2, 2, 2, 2, 3)  # of each part: normal force, its way along x and y, and the moment about the tip, over the normal force
_PARTS = len(_FEATURES)


def fit_wrench_map(presses: Presses, sensor: MarkerSensor, mechanics: SheetWrench | None = None) -> dict:
    """Numbers of a map, fitted to the presses whose wrench is known; mechanics: of a sheet, if known, which are taken where they tell
    presses at places left out better than none.

    Among the numbers: held_out_force and held_out_moment, median relative errors at places left out with their mirror images; told: which
    axes are. Raises BadCalibration for too few presses.
    """
    deepest = float(presses.depth.max(initial=0.0))
    known = presses.touching & np.isfinite(presses.wrench).all(1) & (presses.wrench[:, 2] < 0) & (presses.depth > FLOOR * deepest)
    if known.sum() < FEWEST:
        raise BadCalibration(f'{known.sum()} presses with a recorded wrench are too few for a wrench map; {FEWEST} are needed')
    kept = np.flatnonzero(known)[np.unique(np.linspace(0, known.sum() - 1, min(MOST, known.sum())).astype(int))]
    keep = np.zeros(len(presses), bool)
    keep[kept] = True
    presses = presses.select(keep)
    fits = [_Fit(presses, sensor, base) for base in ([mechanics] if mechanics else []) + [None]]
    return min(fits, key=lambda fit: fit.force_error + fit.moment_error).numbers()


class _Features:
    """What the factors depend on, and what they are multiplied with. half: (2,) m, by which places are told; width: m, about a tip."""

    def __init__(self, half, deepest: float, width: float, is_sheet: bool, base: SheetWrench | None):
        self.half, self.deepest, self.width, self.is_sheet, self.base = np.array(half, float), deepest, width, is_sheet, base

    def __call__(self, field: MarkerField, place: np.ndarray, depth: float) -> tuple[np.ndarray, list[np.ndarray]]:
        """State (D,), and features of each part; NaN where too few markers are seen about the tip."""
        away = np.exp(np.sum((field.rest - place[:2])**2, axis=1) / (-2 * self.width**2))
        away[~(field.seen & np.isfinite(away))] = 0.0
        weight = away.sum()
        dragged = away @ np.nan_to_num(field.shift) / weight if weight > 1 else np.full(2, np.nan)
        x, y = place[:2] / self.half
        a, b = dragged / max(depth, FLOOR * self.deepest)
        folded = (x * x, y * y) if self.is_sheet else (x * x + y * y,)
        along, across = np.array([x, a]), np.array([y, b])
        parts = [np.array([1.0, a * x + b * y, a * a + b * b]), along, across, across, along, np.array([x * y, x * b, y * a])]
        return np.array([*folded, np.sqrt(depth / self.deepest)]), parts

    def plain(self, place: np.ndarray, depth: float, radius: float = float('nan')) -> np.ndarray:
        """(6,) wrench about the tip by the mechanics, or one that is in proportion to the depth."""
        return self.base(place[:2], depth, radius) if self.base else np.array([0.0, 0.0, -depth, 0.0, 0.0, 0.0])


class WrenchMap:
    """A fitted map. numbers: as fit_wrench_map makes them. Raises BadCalibration where something is missing."""

    def __init__(self, numbers: Mapping):
        try:
            base = SheetWrench.from_numbers(numbers['mechanics']) if 'mechanics' in numbers else None
            self._features = _Features(numbers['half'], float(numbers['deepest']), float(numbers['width']), bool(numbers['is_sheet']), base)
            self._scale, self._told = float(numbers['scale']), np.array(numbers['told'], bool)
            self._states, self._lengths = np.array(numbers['states'], float), np.array(numbers['lengths'], float)
            duals = [np.array(dual, float) for dual in numbers['duals']]
            shapes = [dual.shape for dual in duals] + [self._lengths.shape, self._told.shape]
            count, inputs = self._states.shape
            if shapes != [(count, features) for features in _FEATURES] + [(_PARTS, inputs), (_PARTS,)]:
                raise ValueError('shapes do not agree')
        except (KeyError, TypeError, ValueError, IndexError) as wrong:
            raise BadCalibration(f'the wrench map cannot be read from the calibration ({wrong!r}); calibrate anew') from wrong
        self._part, self._dual = np.repeat(np.arange(_PARTS), _FEATURES), np.hstack(duals)
        self._starts = np.searchsorted(self._part, np.arange(_PARTS))
        self._widths = 1 / self._lengths**2

    def wrench(self, field: MarkerField, touch: TouchEstimate) -> np.ndarray:
        """(6,) N and N m at the sensor frame's origin, of a frame with this touch alone; NaN for an axis that the calibration did not
        excite, where too few markers are seen about the touch, and far beyond the calibrated depth."""
        if not 0 < touch.depth < BEYOND * self._features.deepest:
            return np.full(6, np.nan)
        place = np.asarray(touch.position, float)
        state, parts = self._features(field, place, touch.depth)
        near = np.exp(-0.5 * (self._states - state)**2 @ self._widths.T)
        factors = np.einsum('nf,nf->f', near[:, self._part], self._dual)
        told = np.add.reduceat(factors * np.concatenate(parts), self._starts)
        told[0] += self._scale
        wrench = _assembled(told, self._features.plain(place, touch.depth, touch.radius), place)
        return np.where(self._told, wrench, np.nan)


def _taken_apart(wrench: np.ndarray, plain: np.ndarray, place: np.ndarray) -> np.ndarray:
    """(6,) parts that make a wrench of the plain one."""
    about = wrench[3:] - np.cross(place, wrench[:3])
    over, plainly = np.array([*wrench[:2], *about]) / wrench[2], np.array([*plain[:2], *plain[3:]]) / plain[2]
    return np.append(np.log(wrench[2] / plain[2]), over - plainly)


def _assembled(told: np.ndarray, plain: np.ndarray, place: np.ndarray) -> np.ndarray:
    """The wrench (6,) at the origin that has these parts."""
    normal = plain[2] * np.exp(told[0])
    way_x, way_y, *about = told[1:] * normal + np.array([*plain[:2], *plain[3:]]) / plain[2] * normal
    x, y, z = place
    return np.array([way_x, way_y, normal, y * normal - z * way_y + about[0], z * way_x - x * normal + about[1],
                     x * way_y - y * way_x + about[2]])


class _Fit:
    """A map fitted to presses, and its relative errors of force and moment at places left out."""

    def __init__(self, presses: Presses, sensor: MarkerSensor, base: SheetWrench | None):
        half = np.array(sensor.size) / 2 if sensor.is_sheet else np.full(2, sensor.rim_radius)
        self._features = _Features(half, float(presses.depth.max()), ABOUT * max(sensor.pitch), sensor.is_sheet, base)
        told = [self._features(field, place, depth) for field, place, depth in zip(presses.fields, presses.position, presses.depth)]
        seen = np.array([np.isfinite(np.concatenate(parts)).all() for _, parts in told])
        presses, told = presses.select(seen), [row for row, good in zip(told, seen) if good]
        if len(told) < FEWEST:
            raise BadCalibration(f'markers about the tip are seen in {len(told)} presses only, too few for a wrench map')
        self._states = np.array([state for state, _ in told])
        plain = np.array([self._features.plain(place, depth) for place, depth in zip(presses.position, presses.depth)])
        apart = np.array([_taken_apart(*row) for row in zip(presses.wrench, plain, presses.position)])
        self._scale = float(np.median(apart[:, 0]))
        apart[:, 0] -= self._scale
        unsure = 1 + (SHALLOW * self._features.deepest / presses.depth)**2
        self._factors = [VaryingFactors(self._states, np.array([parts[k] for _, parts in told]), apart[:, k], unsure)
                         for k in range(_PARTS)]
        self._judge(presses, plain, _mirror_groups(presses.position[:, :2], max(sensor.pitch)))

    def _judge(self, presses: Presses, plain: np.ndarray, groups: np.ndarray) -> None:
        held = np.stack([factors.left_out(groups) for factors in self._factors], axis=1)
        held[:, 0] += self._scale
        error = np.array([_assembled(*row) for row in zip(held, plain, presses.position)]) - presses.wrench
        spread, largest = presses.wrench.std(axis=0), np.repeat(np.abs(presses.wrench).reshape(-1, 2, 3).max(axis=(0, 2)), 3)
        self._told = spread > EXCITED * largest
        self._told[2] = True
        if len(np.unique(groups)) >= PLACES:
            self._told &= np.mean(error**2, axis=0) < np.mean(presses.wrench**2, axis=0)
        self.force_error, self.moment_error = (_relative(error[:, part], presses.wrench[:, part])
                                               for part in (slice(3), slice(3, 6)))

    def numbers(self) -> dict:
        """For a calibration file."""
        base = self._features.base
        return {'half': self._features.half.tolist(), 'deepest': self._features.deepest, 'width': self._features.width,
                'is_sheet': int(self._features.is_sheet), 'scale': self._scale, 'told': self._told.astype(int).tolist(),
                'states': self._states.tolist(), 'lengths': [factors.lengths.tolist() for factors in self._factors],
                'duals': [factors.dual.tolist() for factors in self._factors],
                'held_out_force': self.force_error, 'held_out_moment': self.moment_error} | (
                    {'mechanics': base.numbers()} if base else {})


def _relative(error: np.ndarray, truth: np.ndarray) -> float:
    """Median of the errors' sizes over the truth's, of those with a truth of 5 % of the largest and more."""
    size = np.linalg.norm(truth, axis=1)
    good = size > 0.05 * size.max()
    return float(np.median(np.linalg.norm(error[good], axis=1) / size[good])) if good.any() else float('nan')


def _mirror_groups(places: np.ndarray, pitch: float) -> np.ndarray:
    """(N,) the same number for places (N, 2) m within one square of a pitch, and for their mirror images."""
    _, group = np.unique(np.round(np.abs(places) / pitch), axis=0, return_inverse=True)
    return group.ravel()
