# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Presses with ground truth, to which methods are fitted, and their errors at held-out presses."""
from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..common.marker_sensor import MarkerSensor
from ..common.residuals import Residuals
from ..core.errors import BadArgument, BadCalibration
from .constants import PRESS
from .estimate import TouchEstimate, TouchMethod
from .field import MarkerField


@dataclass(frozen=True)
class Presses:
    """M frames with the ground truth of the positioning stage.

    Attributes
    ----------
    fields : tuple of MarkerField
        The M fields.
    position : ndarray, shape (M, 3)
        Position of the tip in m; NaN without contact.
    depth : ndarray, shape (M,)
        Depth in m; 0 without contact.
    segment : ndarray, shape (M,), int
        Number of the press; by default each frame is a press.
    wrench : ndarray, shape (M, 6)
        Wrench in N and N m; NaN if unknown, by default everywhere.
    plate : Presses or None
        Presses of a plate onto all markers, which is not a tip.

    Raises
    ------
    BadArgument
        If lengths differ.
    """

    fields: tuple[MarkerField, ...]
    position: np.ndarray
    depth: np.ndarray
    segment: np.ndarray = None
    wrench: np.ndarray = None
    plate: Presses | None = None

    def __post_init__(self):
        count = len(self.fields)
        for name, default in (('segment', np.arange(count)), ('wrench', np.full((count, 6), np.nan))):
            if getattr(self, name) is None:
                object.__setattr__(self, name, default)
        shapes = {'position': (count, 3), 'depth': (count,), 'segment': (count,), 'wrench': (count, 6)}
        for name, shape in shapes.items():
            if np.shape(getattr(self, name)) != shape:
                raise BadArgument(f'presses: {name} must have shape {shape}, got {np.shape(getattr(self, name))}')

    def __len__(self) -> int:
        return len(self.fields)

    @property
    def touching(self) -> np.ndarray:
        """Mask (M,) of the frames with contact."""
        return (self.depth > 0) & np.isfinite(self.position).all(1)

    def select(self, keep: np.ndarray) -> Presses:
        """Select frames by a mask (M,) or by indices."""
        return Presses(tuple(self.fields[k] for k in np.arange(len(self))[keep]), self.position[keep], self.depth[keep],
                       self.segment[keep], self.wrench[keep], self.plate)

    def position_labels(self, mirrored: bool = False) -> np.ndarray:
        """Label (M,) int of the pressed position, from 0 in order of appearance; -1 without contact.

        mirrored: whether mirror images along x and y share a label.
        """
        labels, known = np.full(len(self), -1), np.zeros((0, 2))
        for k in np.flatnonzero(self.touching):
            xy = np.abs(self.position[k, :2]) if mirrored else self.position[k, :2]
            near = np.flatnonzero(np.hypot(*(known - xy).T) < PRESS.same_position)
            labels[k] = near[0] if len(near) else len(known)
            known = known if len(near) else np.vstack([known, xy])
        return labels

    def straight(self) -> np.ndarray:
        """Mask (M,) of the frames with contact in which the tool has not moved laterally since first contact."""
        straight, before, start = self.touching.copy(), -1, np.zeros(2)
        for k in np.flatnonzero(self.touching):
            xy = self.position[k, :2]
            step = np.hypot(*(xy - self.position[k - 1, :2]))
            is_new = before != k - 1 or self.depth[k] < PRESS.lift_ratio * self.depth[k - 1] or step > PRESS.max_drag_step
            start, before = xy if is_new else start, k
            straight[k] = np.hypot(*(xy - start)) <= PRESS.max_straight_travel
        return straight

    def loading(self) -> np.ndarray:
        """Mask (M,) of the frames with contact in which the tool is as deep as ever in its segment."""
        loading = self.touching.copy()
        for number in np.unique(self.segment[loading]):
            mine = np.flatnonzero((self.segment == number) & self.touching)
            loading[mine] = self.depth[mine] > np.maximum.accumulate(self.depth[mine]) - PRESS.depth_tolerance
        return loading

    def some(self, positions: int, depths: int) -> list[Presses]:
        """Select presses at up to so many positions, each with up to so many rising depths.

        Positions are spread evenly over their distances from the centre. Frames of the tip's retreat, when friction has reversed, are left
        out.
        """
        label, loading, distance = self.position_labels(), self.loading(), np.hypot(*self.position[:, :2].T)
        order = sorted(range(label.max() + 1), key=lambda k: distance[label == k].mean())
        selected = []
        for k in [order[i] for i in _evenly(len(order), positions)]:
            mine = np.flatnonzero((label == k) & loading)
            mine = mine[np.unique(np.round(self.depth[mine], 5), return_index=True)[1]]
            selected.append(self.select(mine[_evenly(len(mine) + 1, depths + 1)[1:] - 1]))
        return selected

    def folds(self, count: int = 3) -> Iterator[np.ndarray]:
        """Yield masks (M,) of the frames that are held out for cross-validation by position.

        A position is held out together with its mirror images, from which a method that uses the sensor's symmetry would learn it.
        Untouched frames are never held out.
        """
        label = self.position_labels(mirrored=True)
        label = label if label.max(initial=-1) > 0 else self.position_labels()
        for fold in range(count):
            held = (label >= 0) & (label % count == fold)
            if held.any() and (self.touching & ~held).any():
                yield held


def _evenly(count: int, maximum: int) -> np.ndarray:
    """Evenly spaced indices below count, at most maximum, with the first and the last."""
    return np.unique(np.linspace(0, count - 1, maximum).round().astype(int))


Found = list[list[TouchEstimate] | None]  # the contacts at each of M presses; None at presses that are not evaluated


def score(found: Found, presses: Presses) -> dict[str, float]:
    """Errors over presses by name; NaN if no press was detected.

    place_mean, place_95, depth_mean, depth_95: mean and 95th percentile of the errors of position (x and y) and depth, m; squares: mean
    normalised squared error of position and depth (1 for a consistent covariance); place_median, depth_median: m, robust to presses too
    shallow to be located, averaged over straight presses and drags if there are both; presses, missed, split: number of presses, of those
    not detected, and of those detected as several contacts.
    """
    judged, errors = _compared(found, presses)
    numbers = {'presses': len(judged), 'missed': sum(not found[k] for k in judged), 'split': sum(len(found[k]) > 1 for k in judged)}
    straight, errors = (part[np.isfinite(errors[:, 0])] for part in (presses.straight()[judged], np.abs(errors)))
    if not len(errors):
        return numbers | dict.fromkeys(('place_mean', 'place_95', 'depth_mean', 'depth_95', 'squares', 'place_median', 'depth_median'),
                                       float('nan'))
    middle = np.mean([np.median(errors[straight == down], axis=0) for down in set(straight)], axis=0)
    (xy_mean, depth_mean, squares), (xy_95, depth_95, _) = errors.mean(0).tolist(), np.percentile(errors, 95, axis=0).tolist()
    return numbers | {'place_mean': xy_mean, 'place_95': xy_95, 'depth_mean': depth_mean, 'depth_95': depth_95, 'squares': squares,
                      'place_median': float(middle[0]), 'depth_median': float(middle[1])}


def _compared(found: Found, presses: Presses) -> tuple[np.ndarray, np.ndarray]:
    """Compare contacts with the truth.

    Returns the indices (J,) of the evaluated presses and, for the nearest contact at each, (J, 3), the errors of position and of depth, m,
    and the normalised squared error of all three coordinates; NaN without a contact.
    """
    judged = np.array([k for k in np.flatnonzero(presses.touching) if found[k] is not None], int)
    errors = np.full((len(judged), 3), np.nan)
    for row, k in enumerate(judged):
        xy_errors = [(touch.position - presses.position[k])[:2] for touch in found[k]]
        if xy_errors:
            nearest = int(np.argmin(np.linalg.norm(xy_errors, axis=1)))
            xy_error, touch = xy_errors[nearest], found[k][nearest]
            depth_error = touch.depth - presses.depth[k]
            squares = xy_error @ np.linalg.solve(touch.covariance[:2, :2], xy_error) + (depth_error / touch.depth_sigma)**2
            errors[row] = np.hypot(*xy_error), depth_error, squares / 3
    return judged, errors


def held_out(method, presses: Presses, sensor: MarkerSensor, fitted: Mapping | None = None) -> Found:
    """Contacts that a method of methods.py finds at presses whose positions are held out of its fit.

    fitted: result of the fit to all presses, whose simulated library a model reuses. Raises BadCalibration if no position can be held out.
    """
    found: Found = [None] * len(presses)
    for held in presses.folds():
        fresh = method.from_fitted(method.fit(presses.select(~held), sensor, fitted), sensor)
        for k in np.flatnonzero(held):
            if k == 0 or not held[k - 1]:  # a new press: the previous frames are not part of its motion
                fitted_to = copy.deepcopy(fresh)
            found[k] = fitted_to.estimate(presses.fields[k])
    if all(touches is None for touches in found):
        raise BadCalibration('all presses are at one position, so that none can be held out; add presses at other positions')
    return found


def rms_errors(method: TouchMethod, presses: Presses) -> dict[str, float]:
    """RMS errors, m, of a method's position (per axis) and depth at the detected presses, as place_sigma and depth_sigma.

    NaN if it detects none.
    """
    errors = _compared([method.estimate(field) for field in presses.fields], presses)[1]
    squares = errors[np.isfinite(errors[:, 0]), :2]**2
    return dict(zip(('place_sigma', 'depth_sigma'), np.sqrt(squares.mean(0) / [2, 1]).tolist() if len(squares) else [np.nan] * 2))


_AXES = ('x (mm)', 'y (mm)')


def require_coverage(presses: Presses) -> None:
    """Raise BadCalibration, saying what to add, for too few positions, a single depth, or no untouched frame."""
    touching = presses.touching
    positions, depth = int(presses.position_labels().max() + 1), presses.depth[touching]
    if positions < PRESS.min_positions:
        raise BadCalibration(f'{touching.sum()} presses at {positions} positions; at least {PRESS.min_positions} are needed, a dozen over '
                             'the whole surface are good: add presses at other positions')
    if np.ptp(depth) < PRESS.min_depth_span * depth.max():
        raise BadCalibration(f'all presses are {depth.min() * 1e3:.2f} to {depth.max() * 1e3:.2f} mm deep: one depth does not determine '
                             'how markers move with depth; add presses of other depths, three per position are good')
    if touching.all():
        raise BadCalibration('no untouched frame among the presses; begin each recording with one second without contact')


def marker_residuals(found: Found, presses: Presses, names: Sequence[str]) -> list[Residuals]:
    """Cross-validation errors of position and depth, mm, over the surface; NaN for a press without an estimate.

    names: recording and time of each press.
    """
    judged, errors = _compared(found, presses)
    positions, when = 1e3 * presses.position[judged, :2], [names[k] for k in judged]
    return [Residuals(name, 'mm', 1e3 * errors[:, column], positions, _AXES, when) for column, name in enumerate(('position', 'depth'))]
