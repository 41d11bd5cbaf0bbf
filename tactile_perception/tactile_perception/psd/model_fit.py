# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A finger's model from presses at known places: as much as they can tell, and a line for each thing that they cannot."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..common.statistics import robust_sigma
from ..errors import BadCalibration
from .geometry import TOTAL, error_angle, flat, position, position_covariance
from .maps import fit_smooth_map
from .model import FingerModel, cross_basis
from .offset_map import fit_paper
from .presses import Presses, Stretches
from .response import fit_load, fit_touch_level

_SAME_PLACE = 0.006  # rad: presses nearer than that count as one place
_BENT, _SMOOTH = 16, 8  # places from which on the trend has a bend, and there is a smooth map at all
_MOST = 250  # places: more cost time and tell no more
_MOST_LOADS = 600
_CROSS_FEWEST = 12


@dataclass(frozen=True)
class FingerFit:
    """model; places: how many it was fitted to; errors: rad, (N,) that each place had, left out of the fit, NaN where the others tell
    nothing; paper_errors: rad, of the paper's map; residuals: name -> number for the file; span: name -> [lowest, highest]; said: a line
    each; normal: (N, 3) of the places; when: (N,) names by recording and time."""

    model: FingerModel
    places: int
    errors: np.ndarray
    paper_errors: np.ndarray
    residuals: dict
    span: dict
    said: list[str]
    normal: np.ndarray
    when: np.ndarray


def fit_finger(presses: Presses) -> FingerFit:
    """The model. Raises BadCalibration without a usable press."""
    stretches = presses.stretches
    place, normal, noise, when = _places(stretches, presses.noise)
    paper, said = fit_paper(place, normal)
    paper_errors = error_angle(paper.normals(place), normal)
    smooth, errors, more = _smooth(place, normal, noise * paper.beta, paper_errors)
    if smooth is None:
        errors = _left_out_of_paper(place, normal)
    shot = _shot(stretches, presses.noise)
    level, level_limits, level_said = _level(presses)
    cross, cross_sigma = _cross(stretches)
    force, force_error, force_said = _load(stretches, stretches.force, 'force')
    depth, depth_error, depth_said = _load(stretches, stretches.depth, 'depth')
    model = FingerModel(paper, smooth, float(np.sqrt(np.mean(paper_errors**2) + 1e-8)), _reach(place), level, level_limits, cross,
                        cross_sigma, force, depth, shot)
    theta = np.linalg.norm(flat(normal), axis=1)
    residuals = {'places': len(place), 'left_out_mean': float(errors.mean()), 'left_out_largest': float(errors.max()),
                 'paper_mean': float(paper_errors.mean()), 'paper_largest': float(paper_errors.max()),
                 'force_relative': force_error, 'depth_relative': depth_error}
    span = {'theta': [float(theta.min()), float(theta.max())],
            'light': [float(stretches.sums[:, TOTAL].min()), float(stretches.sums[:, TOTAL].max())]}
    return FingerFit(model, len(place), errors, paper_errors, residuals, span, [*said, *more, *level_said, *force_said, *depth_said],
                     normal, when)


def _places(stretches: Stretches, noise: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Detector places (N, 2), normals (N, 3), standard deviations (N,), half widths, and times (N,) of what was pressed, near ones taken
    together."""
    free = np.ones(len(stretches.normal), bool)
    found = []
    while free.any():
        first = np.flatnonzero(free)[0]
        same = free & (error_angle(stretches.normal, stretches.normal[first]) < _SAME_PLACE)
        weight = stretches.count[same]
        sums = np.average(stretches.sums[same], axis=0, weights=weight)[None]
        place = position(sums)
        normal = np.average(stretches.normal[same], axis=0, weights=weight)
        covariance = position_covariance(place[0], float(sums[0, TOTAL]), noise, 0.0) / weight.sum()
        found.append((place[0], normal / np.linalg.norm(normal), np.sqrt(0.5 * np.trace(covariance)), stretches.when[first]))
        free &= ~same
    chosen = np.unique(np.linspace(0, len(found) - 1, min(len(found), _MOST)).round().astype(int))
    return tuple(np.array(part) for part in zip(*(found[k] for k in chosen)))


def _smooth(place, normal, noise, paper_errors):
    """(SmoothMap or None, errors (N,), lines) of whichever predicts places better that were left out."""
    count = len(place)
    if count < _SMOOTH or np.linalg.matrix_rank(place - place.mean(0), tol=0.05) < 2:
        return None, paper_errors, [f'{count} places: too few for a map of the distortion, the offset and factor of the paper are used']
    terms = 5 if count >= _BENT else 3
    smooth, left_out = fit_smooth_map(place, flat(normal), noise, terms)
    errors = np.linalg.norm(left_out, axis=1)
    if errors.mean() > paper_errors.mean():
        return None, paper_errors, [f'{count} places: a map of the distortion would predict no better than the paper\'s offset and factor']
    said = [] if terms == 5 else [f'{count} places: a straight map and what bends it near them; {_BENT} allow more']
    return smooth, errors, said


def _left_out_of_paper(place: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """rad, (N,): the error that the paper's map fitted to all other places has at each; NaN where those do not determine one."""
    errors = np.full(len(place), np.nan)
    for k in range(len(place)):
        others = np.arange(len(place)) != k
        try:
            paper, _ = fit_paper(place[others], normal[others])
        except BadCalibration:
            continue
        errors[k] = error_angle(paper.normals(place[k:k + 1]), normal[k:k + 1])[0]
    return errors


def _reach(place: np.ndarray) -> float:
    """Half widths: 1.5 times the usual distance from a place to its nearest neighbours."""
    if len(place) < 4:
        return 0.25
    distance = np.sort(np.linalg.norm(place[:, None] - place[None], axis=-1), axis=1)
    return float(np.clip(1.5 * np.median(distance[:, 3]), 0.02, 0.25))


def _shot(stretches: Stretches, noise: np.ndarray) -> float:
    """V: how much the variance of an output grows with the light on it."""
    known = np.isfinite(stretches.scatter)
    if known.sum() < 5:
        return 0.0
    output = stretches.output[known]
    return float(max((output @ (stretches.scatter[known] - noise[TOTAL, TOTAL] / 4)) / (output @ output), 0.0))


def _level(presses: Presses):
    onsets = presses.onsets
    sigma = float(np.sqrt(presses.noise[TOTAL, TOTAL]))
    try:
        level, limits = fit_touch_level(position(onsets.sums), onsets.level, onsets.brightest, sigma)
    except BadCalibration as error:
        return None, FingerModel.level_limits, [f'contact is told by the noise alone: {error}']
    return level, limits, []


def _cross(stretches: Stretches) -> tuple[np.ndarray | None, float]:
    """Coefficients of the fourth combination and what it scatters by besides the noise."""
    if len(stretches.count) < _CROSS_FEWEST:
        return None, 0.0
    total = stretches.sums[:, TOTAL]
    basis = cross_basis(position(stretches.sums))
    weight = total * np.sqrt(stretches.count)
    found = stretches.sums[:, 3] / total
    fitted = np.linalg.lstsq(basis * weight[:, None], found * weight, rcond=None)[0]
    return fitted, float(robust_sigma(found - basis @ fitted))


def _load(stretches: Stretches, known: np.ndarray, name: str) -> tuple[np.ndarray | None, float, list[str]]:
    usable = np.flatnonzero(np.isfinite(known) & (known > 0))
    usable = usable[np.unique(np.linspace(0, max(len(usable) - 1, 0), min(len(usable), _MOST_LOADS)).round().astype(int))]
    try:
        fitted, error = fit_load(position(stretches.sums[usable]), stretches.sums[usable, TOTAL], known[usable])
    except BadCalibration as problem:
        return None, float('nan'), [f'{name} is not told: {problem}']
    return fitted, error, []
