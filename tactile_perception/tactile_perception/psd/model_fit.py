# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Fit of a finger's model to calibration presses; what they do not determine keeps its default, with a note."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..common.statistics import robust_sigma
from ..errors import BadCalibration
from .creep import fit_creep
from .geometry import CROSS, TOTAL, error_angle, log_map, position, position_covariance
from .light_shift import fit_light_shift
from .maps import fit_smooth_map
from .model import FingerModel, cross_basis
from .equidistant_map import fit_equidistant_map
from .presses import Presses, Segments
from .response import fit_load, fit_touch_level

_SAME_PLACE = 0.006  # rad within which presses count as one position. Chosen: a little more than one segment spans (presses._SAME_PLACE)
_RADIAL, _SMOOTH = 16, 8  # positions needed for the radial trend, and for a Gaussian process. Chosen: about 3 for each trend coefficient
_MOST = 250  # positions: bounds the time of the fit, which grows with their cube. Chosen
_MOST_LOADS = 600  # segments: bounds the memory of the leave-one-out errors. Chosen
_CROSS_LEAST = 0.1  # part of the cross term's variance that is not noise, at least. Chosen: the noise is known to a tenth
_CROSS_FEWEST = 12  # segments. Chosen: two for each of the 6 coefficients
# half widths, see _reach. Chosen: 1.5 spacings of the calibration close its gaps, within fixed bounds.
_REACH_SPACINGS, _REACH_LEAST, _REACH_MOST = 1.5, 0.02, 0.25


@dataclass(frozen=True)
class FingerFit:
    """model; places: number of positions; errors: (N,) rad, leave-one-out errors, NaN where undetermined; paper_errors: (N,) rad, of the
    equidistant map; residuals: name -> number for the file; span: name -> [lowest, highest]; notes: on what was not determined; normal:
    (N, 3) of the positions; when: (N,) their recordings and times."""

    model: FingerModel
    places: int
    errors: np.ndarray
    paper_errors: np.ndarray
    residuals: dict
    span: dict
    notes: list[str]
    normal: np.ndarray
    when: np.ndarray


def fit_finger(presses: Presses) -> FingerFit:
    """The model fitted to presses. Raises BadCalibration without a usable press."""
    segments = presses.segments
    place, normal, noise, light, when = _places(segments, presses.noise)
    paper, notes = fit_equidistant_map(place, normal)
    paper_errors = error_angle(paper.normals(place), normal)
    smooth, shift, errors, more = _smooth(place, normal, noise * paper.beta, light, paper_errors)
    if smooth is None:
        errors = _leave_one_out_equidistant(place, normal)
    shot = _shot(segments, presses.noise)
    level, level_limits, level_notes = _level(presses)
    cross, cross_volts = _cross(segments, presses.noise[CROSS, CROSS])
    force, force_error, force_notes = _load(segments, segments.force, 'force')
    depth, depth_error, depth_notes = _load(segments, segments.depth, 'depth')
    creep = fit_creep(presses.lights)
    creep_notes = [] if creep else ['creep of the cover: the presses do not show it; a contact that slides is told behind the object']
    model = FingerModel(paper, smooth, shift, float(np.sqrt(np.mean(paper_errors**2) + 1e-8)), _reach(place), level, level_limits, cross,
                        cross_volts, force, depth, shot, presses.room, creep)
    theta = np.linalg.norm(log_map(normal), axis=1)
    residuals = {'places': len(place), 'left_out_mean': float(errors.mean()), 'left_out_largest': float(errors.max()),
                 'paper_mean': float(paper_errors.mean()), 'paper_largest': float(paper_errors.max()),
                 'force_relative': force_error, 'depth_relative': depth_error}
    span = {'theta': [float(theta.min()), float(theta.max())],
            'light': [float(segments.sums[:, TOTAL].min()), float(segments.sums[:, TOTAL].max())]}
    return FingerFit(model, len(place), errors, paper_errors, residuals, span, [*notes, *more, *level_notes, *force_notes, *depth_notes,
                                                                   *creep_notes],
                     normal, when)


def _places(segments: Segments, noise: np.ndarray) -> tuple[np.ndarray, ...]:
    """Detector positions (N, 2), normals (N, 3), standard deviations (N,), half widths, light (N,), V, and times (N,); near presses are
    averaged."""
    free = np.ones(len(segments.normal), bool)
    found = []
    while free.any():
        first = np.flatnonzero(free)[0]
        same = free & (error_angle(segments.normal, segments.normal[first]) < _SAME_PLACE)
        weight = segments.count[same]
        sums = np.average(segments.sums[same], axis=0, weights=weight)[None]
        place = position(sums)
        normal = np.average(segments.normal[same], axis=0, weights=weight)
        covariance = position_covariance(place[0], float(sums[0, TOTAL]), noise, 0.0) / weight.sum()
        found.append((place[0], normal / np.linalg.norm(normal), np.sqrt(0.5 * np.trace(covariance)),
                      sums[0, TOTAL], segments.when[first]))
        free &= ~same
    chosen = np.unique(np.linspace(0, len(found) - 1, min(len(found), _MOST)).round().astype(int))
    return tuple(np.array(part) for part in zip(*(found[k] for k in chosen)))


def _smooth(place, normal, noise, light, paper_errors):
    """(SmoothMap, LightShift, leave-one-out errors (N,), notes); None in place of the map where the equidistant one predicts as well, and
    in place of the shift where the light tells nothing."""
    count = len(place)
    if count < _SMOOTH or np.linalg.matrix_rank(place - place.mean(0), tol=0.05) < 2:
        return None, None, paper_errors, [f'{count} positions: too few for a map of the distortion; using offset and scale of the paper']
    terms = 5 if count >= _RADIAL else 3
    smooth, shift, errors = _with_shift(place, log_map(normal), noise, light, terms)
    if errors.mean() > paper_errors.mean():
        return None, None, paper_errors, [
            f'{count} positions: a map of the distortion predicts no better than offset and scale of the paper']
    notes = [] if terms == 5 else [f'{count} positions: affine trend; {_RADIAL} allow a radial one']
    return smooth, shift, errors, notes


def _with_shift(place, values, noise, light, terms):
    """(SmoothMap, LightShift or None, leave-one-out errors (N,)): the shift stays if it lowers the criterion of Akaike."""
    smooth, left_out = fit_smooth_map(place, values, noise, terms)
    shift = fit_light_shift(place, values, light, smooth)
    better, left = fit_smooth_map(place, values - shift.values(place, light), noise, terms)
    if left_out.size * np.log((left**2).sum() / (left_out**2).sum()) + 2 * shift.slopes.size < 0:
        return better, shift, np.linalg.norm(left, axis=1)
    return smooth, None, np.linalg.norm(left_out, axis=1)


def _leave_one_out_equidistant(place: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(N,) rad: leave-one-out errors of the equidistant map; NaN where the other positions do not determine one."""
    errors = np.full(len(place), np.nan)
    for k in range(len(place)):
        others = np.arange(len(place)) != k
        try:
            paper, _ = fit_equidistant_map(place[others], normal[others])
        except BadCalibration:
            continue
        errors[k] = error_angle(paper.normals(place[k:k + 1]), normal[k:k + 1])[0]
    return errors


def _reach(place: np.ndarray) -> float:
    """Half widths within which a calibrated position covers its surroundings: 1.5 times the median distance to the third neighbour."""
    if len(place) < 4:
        return _REACH_MOST
    distance = np.sort(np.linalg.norm(place[:, None] - place[None], axis=-1), axis=1)
    return float(np.clip(_REACH_SPACINGS * np.median(distance[:, 3]), _REACH_LEAST, _REACH_MOST))


def _shot(segments: Segments, noise: np.ndarray) -> float:
    """V: variance of an output per V of its signal."""
    known = np.isfinite(segments.scatter)
    if known.sum() < 5:
        return 0.0
    output = segments.output[known]
    return float(max((output @ (segments.scatter[known] - noise[TOTAL, TOTAL] / 4)) / (output @ output), 0.0))


def _level(presses: Presses):
    onsets = presses.onsets
    sigma = float(np.sqrt(presses.noise[TOTAL, TOTAL]))
    try:
        level, limits = fit_touch_level(position(onsets.sums), onsets.level, onsets.brightest, sigma)
    except BadCalibration as error:
        return None, FingerModel.level_limits, [f'contact is detected by the noise threshold alone: {error}']
    return level, limits, []


def _cross(segments: Segments, noise: float) -> tuple[np.ndarray | None, float]:
    """Coefficients of the cross term over the total, and the standard deviation, V, of the cross term about them beyond that of samples of
    variance noise, V^2."""
    if len(segments.count) < _CROSS_FEWEST:
        return None, 0.0
    total = segments.sums[:, TOTAL]
    basis = cross_basis(position(segments.sums))
    weight = total * np.sqrt(segments.count)
    found = segments.sums[:, 3] / total
    fitted = np.linalg.lstsq(basis * weight[:, None], found * weight, rcond=None)[0]
    whole, part = robust_sigma((found - basis @ fitted) * total) ** 2, float(np.median(noise / segments.count))
    return fitted, float(np.sqrt(max(whole - part, _CROSS_LEAST * whole)))


def _load(segments: Segments, known: np.ndarray, name: str) -> tuple[np.ndarray | None, float, list[str]]:
    usable = np.flatnonzero(np.isfinite(known) & (known > 0))
    usable = usable[np.unique(np.linspace(0, max(len(usable) - 1, 0), min(len(usable), _MOST_LOADS)).round().astype(int))]
    try:
        fitted, error = fit_load(position(segments.sums[usable]), segments.sums[usable, TOTAL], known[usable])
    except BadCalibration as problem:
        return None, float('nan'), [f'{name} is not estimated: {problem}']
    return fitted, error, []
