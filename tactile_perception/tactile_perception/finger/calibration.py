# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration of a finger: presses at known positions, and the model that is fitted to them.

What the presses do not determine keeps its default, with a note.
"""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .._core import finger
from ..common.geometry import error_angle
from ..common.statistics import robust_sigma
from ..core.errors import BadCalibration
from .constants import FINGER
from .map import CROSS, MIX, TOTAL, centroid, fit_equidistant_map, fit_light_shift, fit_smooth_map, level_basis, log_map
from .model import Creep, FingerFit, FingerModel, cross_basis, features

# Untouched samples before a press
# Segments of a press
# Map, light and cross term
# Range of a calibrated position (_reach), half widths: 1.5 spacings of the calibration close its gaps, within bounds.
# Creep of the cover


@dataclass(frozen=True)
class Recording:
    """Samples (N,) with ground truth.

    volts: (N, 4); touching: (N,) bool; normal: (N, 3), force: (N,) N, depth: (N,) m, NaN where unknown; times: (N,) s, None for multiples
    of period_s; name: for messages.
    """

    volts: np.ndarray
    period_s: float
    touching: np.ndarray
    normal: np.ndarray
    force: np.ndarray
    depth: np.ndarray
    times: np.ndarray | None = None
    name: str = 'recording'

    def when(self, sample: int) -> str:
        """Name and time of a sample, for messages."""
        return f'{self.name} at {sample * self.period_s if self.times is None else self.times[sample]:.3f} s'


@dataclass(frozen=True)
class Segments:
    """Short segments of contact, each at one position.

    sums: (N, 4) mean net voltages @ MIX; count: (N,) samples; normal: (N, 3); force, depth: (N,) means; when: (N,) names by recording and
    time.
    """

    sums: np.ndarray
    count: np.ndarray
    normal: np.ndarray
    force: np.ndarray
    depth: np.ndarray
    when: np.ndarray


@dataclass(frozen=True)
class Onsets:
    """Begin of contact of each press. sums: (N, 4) mean of its segments; level: (N,) V, light at the onset; brightest: (N,) V."""

    sums: np.ndarray
    level: np.ndarray
    brightest: np.ndarray


@dataclass(frozen=True)
class Presses:
    """Presses of all recordings.

    noise: (4, 4) covariance of the untouched sums, V^2; room: (4,) V, their mean outputs; left_out: one note per press that was skipped;
    lights: (s between samples, (N,) V light) of each press, from the sample before it.
    """

    segments: Segments
    onsets: Onsets
    noise: np.ndarray
    room: np.ndarray
    left_out: list[str]
    lights: list[tuple[float, np.ndarray]]


def find_presses(recordings: list[Recording], saturation: float) -> Presses:
    """The presses in recordings; samples at or above saturation, V, are skipped. Raises BadCalibration without untouched samples or without
    a usable press."""
    rows, onsets, rests, rooms, left_out, lights = [], [], [], [], [], []
    for recording in recordings:
        runs = runs_of(recording.touching)
        untouched = [_rest_before(recording, begin) for begin, _ in runs]
        for k, (begin, end) in enumerate(runs):
            offset = _offset(recording, runs, untouched, k)
            if offset is None:
                left_out.append(f'press in {recording.when(begin)}: no untouched samples before it; lift for a third of a second')
                continue
            sums = (recording.volts - offset)[max(begin - 1, 0):end] @ MIX
            segments = _segments(recording, sums[-(end - begin):], begin, end, saturation)
            if not segments:
                left_out.append(f'press in {recording.when(begin)}: no light, or every sample is saturated')
                continue
            rows += segments
            light = np.mean([row[0] for row in segments], axis=0)
            onsets.append((light, sums[:2, TOTAL].mean() if begin else np.nan, sums[:, TOTAL].max()))
            lights.append((recording.period_s, sums[:, TOTAL]))
        known = [rest for rest in untouched if len(rest) >= FINGER.min_rest_samples]
        rests += [(rest - rest.mean(0)) @ MIX for rest in known]
        rooms += [rest.mean(0) for rest in known]
    if not any(recording.touching.any() for recording in recordings):
        raise BadCalibration('no usable press: the ground truth holds no contact; record ground_truth/contacts beside the voltages')
    if not rests:
        raise BadCalibration('no untouched samples before the presses: begin each recording, and each press, with nothing touching')
    if not rows:
        raise BadCalibration('no usable press at a known position: ' + '; '.join(left_out[:3]))
    noise = np.concatenate(rests)
    return Presses(Segments(*map(np.array, zip(*rows))), Onsets(*map(np.array, zip(*onsets))), noise.T @ noise / len(noise),
                   np.mean(rooms, axis=0), left_out, lights)


def runs_of(touching: np.ndarray) -> list[tuple[int, int]]:
    """(begin, end) of each press among samples (N,) bool."""
    edges = np.flatnonzero(np.diff(np.r_[False, touching, False].astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist()))


def _offset(recording: Recording, runs: list[tuple[int, int]], untouched: list[np.ndarray], press: int) -> np.ndarray | None:
    """Untouched outputs (4,), V, at a press.

    A line through the means of the untouched samples before the presses nearby, if they drift evenly, else the mean before this press; None
    where nothing precedes it.
    """
    known = [k for k, rest in enumerate(untouched) if len(rest) >= FINGER.min_rest_samples]
    if not known or known[0] > press:
        return None
    own = untouched[max(k for k in known if k <= press)].mean(0)
    times = np.array([runs[k][0] - runs[press][0] for k in known]) * recording.period_s
    near = [(t, untouched[k]) for t, k in zip(times, known) if abs(t) < FINGER.drift_window_s]
    if len(near) < FINGER.min_line_rests:
        return own
    count = np.array([len(rest) for _, rest in near])
    means = np.array([rest.mean(0) for _, rest in near])
    noise = np.mean([rest.var(0) for _, rest in near])
    basis = np.column_stack([np.ones(len(near)), [t for t, _ in near]])
    line = np.linalg.lstsq(basis * np.sqrt(count)[:, None], means * np.sqrt(count)[:, None], rcond=None)[0]
    misfit = (count[:, None] * (means - basis @ line) ** 2).sum() / (means.size - line.size)
    return line[0] if misfit < FINGER.max_line_misfit * noise else own


def _rest_before(recording: Recording, begin: int) -> np.ndarray:
    """The darkest finite samples (N, 4) between the last press and this one.

    A stage reports contact once it stands still, so the object may touch earlier than labelled.
    """
    rest_length, gap, recovery = (int(seconds / recording.period_s) for seconds in (FINGER.rest_s, FINGER.gap_s, FINGER.recovery_s))
    before = np.flatnonzero(recording.touching[:begin])
    first = max(begin - rest_length, before[-1] + 1 + recovery if len(before) else 0)
    rest = recording.volts[first:max(begin - gap, first)]
    rest = rest[np.isfinite(rest).all(1)]
    if len(rest) < FINGER.min_rest_samples:
        return rest
    total = rest.sum(1)
    noise = 1.05 * np.median(np.abs(np.diff(total)))  # standard deviation from sample to sample: 1.4826 / sqrt(2) times the median
    return rest[total <= np.percentile(total, 20) + FINGER.rest_sigmas * noise]


def _segments(recording: Recording, sums: np.ndarray, begin: int, end: int, saturation: float) -> list[tuple]:
    """Rows of Segments of one press."""
    volts, normal = recording.volts[begin:end], recording.normal[begin:end]
    floor = FINGER.contact_sigmas * max(np.std(np.diff(sums[:, TOTAL])) / np.sqrt(2), 1e-9)
    with np.errstate(invalid='ignore'):
        is_usable = (volts < saturation).all(1) & np.isfinite(normal).all(1) & np.isfinite(sums).all(1) & (sums[:, TOTAL] > 0)
    is_usable &= sums[:, TOTAL] > min(floor, 0.5 * np.nanmax(sums[:, TOTAL]))
    longest = max(int(FINGER.segment_s / recording.period_s), 1)
    rows, remaining = [], np.flatnonzero(is_usable)
    while len(remaining):
        is_near = np.linalg.norm(normal[remaining] - normal[remaining[0]], axis=1) < FINGER.segment_rad
        samples = remaining[:longest][np.logical_and.accumulate(is_near[:longest])]
        rows.append(_row(recording, sums, samples, begin))
        remaining = remaining[len(samples):]
    return rows


def _row(recording: Recording, sums: np.ndarray, samples: np.ndarray, begin: int) -> tuple:
    mean = recording.normal[begin + samples].mean(0)
    return (sums[samples].mean(0), len(samples), mean / np.linalg.norm(mean), recording.force[begin + samples].mean(),
            recording.depth[begin + samples].mean(), recording.when(begin + int(samples[0])))


def fit_finger(presses: Presses) -> FingerFit:
    """The model fitted to presses. Raises BadCalibration without a usable press."""
    segments, onsets = presses.segments, presses.onsets
    spot, normal, noise, light, when = _positions(segments, presses.noise)
    paper, notes = fit_equidistant_map(spot, normal)

    def determined(without: tuple, effect: str, fit: Callable[..., tuple], *given) -> tuple:
        """The result of fit(*given); `without`, and a note on the effect, where the presses do not determine it."""
        try:
            return fit(*given)
        except BadCalibration as error:
            notes.append(f'{effect}: {error}')
            return without
    paper_errors = error_angle(paper.normals(spot), normal)
    smooth, shift, errors, more = _smooth(spot, normal, noise * paper.beta, light, paper_errors)
    notes += more
    sigma = float(np.sqrt(presses.noise[TOTAL, TOTAL]))
    level, limits = determined((None, FingerModel.level_limits), 'contact is detected by the noise threshold alone', fit_touch_level,
                               centroid(onsets.sums), onsets.level, onsets.brightest, sigma)
    force, force_error = determined((None, np.nan), 'force is not estimated', fit_load, *_loads(segments, segments.force))
    depth, depth_error = determined((None, np.nan), 'depth is not estimated', fit_load, *_loads(segments, segments.depth))
    cross, cross_volts = _cross(segments, presses.noise[CROSS, CROSS])
    creep = fit_creep(presses.lights)
    notes += [] if creep else ['creep of the cover: no press rests long enough to show it; a sliding contact is reported behind the object']
    model = FingerModel(paper, smooth, shift, float(np.sqrt(np.mean(paper_errors**2) + 1e-8)), _reach(spot), level, limits, cross,
                        cross_volts, force, depth, presses.room, creep)
    theta, bright = np.linalg.norm(log_map(normal), axis=1), segments.sums[:, TOTAL]
    residuals = {'positions': len(spot), 'left_out_mean': float(errors.mean()), 'left_out_largest': float(errors.max()),
                 'paper_mean': float(paper_errors.mean()), 'paper_largest': float(paper_errors.max()),
                 'force_relative': force_error, 'depth_relative': depth_error}
    span = {name: [float(values.min()), float(values.max())] for name, values in (('theta', theta), ('light', bright))}
    return FingerFit(model, len(spot), errors, paper_errors, residuals, span, notes, normal, when)


def _positions(segments: Segments, noise: np.ndarray) -> tuple[np.ndarray, ...]:
    """Spots (N, 2), normals (N, 3), standard deviations (N,), half widths, light (N,), V, and times (N,) of the calibrated positions.

    Presses at the same position are averaged.
    """
    free = np.ones(len(segments.normal), bool)
    found = []
    while free.any():
        first = np.flatnonzero(free)[0]
        same = free & (error_angle(segments.normal, segments.normal[first]) < FINGER.same_position_rad)
        weight = segments.count[same]
        sums = np.average(segments.sums[same], axis=0, weights=weight)[None]
        spot = centroid(sums)
        normal = np.average(segments.normal[same], axis=0, weights=weight)
        covariance = finger.centroid_covariance(spot[0], float(sums[0, TOTAL]), noise) / weight.sum()
        found.append((spot[0], normal / np.linalg.norm(normal), np.sqrt(0.5 * np.trace(covariance)),
                      sums[0, TOTAL], segments.when[first]))
        free &= ~same
    used = np.unique(np.linspace(0, len(found) - 1, min(len(found), FINGER.max_positions)).round().astype(int))
    return tuple(np.array(part) for part in zip(*(found[k] for k in used)))


def _smooth(spot, normal, noise, light, paper_errors):
    """(SmoothMap, LightShift, leave-one-out errors (N,), notes).

    The map is None where the equidistant one predicts as well, the shift where the presses do not show one.
    """
    count = len(spot)
    if count < FINGER.min_smooth or np.linalg.matrix_rank(spot - spot.mean(0), tol=0.05) < 2:
        return None, None, paper_errors, [f'{count} positions: too few for a map of the distortion; using offset and scale of the paper']
    terms = 5 if count >= FINGER.min_radial else 3
    smooth, shift, errors = _with_shift(spot, log_map(normal), noise, light, terms)
    if errors.mean() > paper_errors.mean():
        return None, None, paper_errors, [
            f'{count} positions: a map of the distortion predicts no better than offset and scale of the paper']
    notes = [] if terms == 5 else [f'{count} positions: affine trend; {FINGER.min_radial} allow a radial one']
    return smooth, shift, errors, notes


def _with_shift(spot, values, noise, light, terms):
    """(SmoothMap, LightShift or None, leave-one-out errors (N,)): the shift is used if it lowers Akaike's criterion."""
    smooth, left_out = fit_smooth_map(spot, values, noise, terms)
    shift = fit_light_shift(spot, values, light, smooth)
    shifted, residuals = fit_smooth_map(spot, values - shift.values(spot, light), noise, terms)
    if left_out.size * np.log((residuals**2).sum() / (left_out**2).sum()) + 2 * shift.slopes.size < 0:
        return shifted, shift, np.linalg.norm(residuals, axis=1)
    return smooth, None, np.linalg.norm(left_out, axis=1)


def _reach(spot: np.ndarray) -> float:
    """Half widths within which a calibrated spot covers its surroundings: 1.5 times the median distance to the third neighbour."""
    if len(spot) < 4:
        return FINGER.max_reach
    distance = np.sort(np.linalg.norm(spot[:, None] - spot[None], axis=-1), axis=1)
    return float(np.clip(FINGER.reach_spacings * np.median(distance[:, 3]), FINGER.min_reach, FINGER.max_reach))


def _cross(segments: Segments, noise: float) -> tuple[np.ndarray | None, float]:
    """Coefficients of the cross term over the total, and the standard deviation, V, of the cross term about them.

    The standard deviation is without that of the samples, whose variance is noise, V^2.
    """
    if len(segments.count) < FINGER.min_cross_segments:
        return None, 0.0
    total = segments.sums[:, TOTAL]
    basis = cross_basis(centroid(segments.sums))
    weight = total * np.sqrt(segments.count)
    found = segments.sums[:, CROSS] / total
    fitted = np.linalg.lstsq(basis * weight[:, None], found * weight, rcond=None)[0]
    whole, part = robust_sigma((found - basis @ fitted) * total) ** 2, float(np.median(noise / segments.count))
    return fitted, float(np.sqrt(max(whole - part, FINGER.min_cross_share * whole)))


def _loads(segments: Segments, known: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Spots (N, 2), light (N,), V, and loads of some of the segments with known loads (M,)."""
    usable = np.flatnonzero(np.isfinite(known) & (known > 0))
    usable = usable[np.unique(np.linspace(0, max(len(usable) - 1, 0), min(len(usable), FINGER.max_loads)).round().astype(int))]
    return centroid(segments.sums[usable]), segments.sums[usable, TOTAL], known[usable]


def fit_load(spot: np.ndarray, light: np.ndarray, known: np.ndarray) -> tuple[np.ndarray, float]:
    """Coefficients (8,) for known loads (N,), N or m, at spots (N, 2) with light (N,), V, and the median leave-one-out relative error.

    Raises BadCalibration for loads that are too few, too similar or not positive.
    """
    if len(known) < FINGER.min_loads or not (known > 0).all() or known.max() < FINGER.min_load_ratio * known.min():
        raise BadCalibration(f'{len(known)} contacts with known loads from {known.min(initial=np.inf):.3g} to {known.max(initial=0):.3g}; '
                             f'{FINGER.min_loads} are needed, the largest {FINGER.min_load_ratio} times the smallest')
    basis = features(spot, light)
    scale = FINGER.ridge * len(basis) * np.eye(FINGER.load_terms)
    scale[0, 0] = 0.0
    hat = basis @ np.linalg.solve(basis.T @ basis + scale, basis.T)
    fitted = np.linalg.solve(basis.T @ basis + scale, basis.T @ np.log(known))
    error = (np.log(known) - hat @ np.log(known)) / (1 - np.diag(hat)).clip(1e-3)
    return fitted, float(np.median(np.abs(np.expm1(error))))


def fit_touch_level(spot: np.ndarray, level: np.ndarray, brightest: np.ndarray, noise: float) -> tuple[np.ndarray, tuple]:
    """Coefficients (terms,) of the light at first contact; its 5th and 95th percentile, V, and the largest distance from the centre.

    level: (N,) V, light at each press's onset at spot (N, 2); brightest: (N,) V, of each press; noise: V, of the total. Raises
    BadCalibration where onsets were labelled too late or too early.
    """
    usable = (level > noise) & (level < FINGER.max_onset * brightest)
    if usable.sum() < max(3, FINGER.min_onsets * len(level)):
        raise BadCalibration(f'light at the onset: only {usable.sum()} of {len(level)} presses are labelled in time')
    terms = next(terms for presses, terms in {12: 5, 6: 3, 3: 1}.items() if usable.sum() >= presses)  # two presses or more for each
    basis = level_basis(spot[usable], terms)
    fitted = np.linalg.lstsq(basis, level[usable], rcond=None)[0]
    residual = level[usable] - basis @ fitted
    if np.std(residual) > max(2 * noise, 0.5 * np.median(level[usable])):
        raise BadCalibration(f'light at the onsets differs by {np.std(residual):.3f} V from press to press')
    low, high = np.percentile(level[usable], [5, 95]).tolist()
    return fitted, (low, high, float(np.hypot(*spot[usable].T).max()) + 1e-6)


def fit_creep(lights: list[tuple[float, np.ndarray]]) -> Creep | None:
    """The creep of presses that rest; None where they do not show it.

    lights: (s between samples, (N,) V light from before the press to its end) of each press.
    """
    held = [found for period, light in lights if (found := _held(period, light)) is not None]
    if len(held) < FINGER.min_creep_presses:
        return None
    times = np.geomspace(0.005, 0.12, 49)  # s: shorter time constants hardly matter, longer ones need long presses
    fits = [_best_share(held, seconds) for seconds in times]
    best = int(np.argmin([residual for _, _, residual in fits]))
    share, error, _ = fits[best]
    if not (0 < best < len(fits) - 1 and FINGER.creep_sigmas * error < share < FINGER.max_creep):
        return None
    return Creep(FINGER.creep_of_position * float(share), float(times[best]))


def _held(period: float, light: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Times (N,), s, since the middle of a press's rise, and its light (N,) over its mean, while it rests; None where that is too short."""
    light = light[np.isfinite(light)]
    if len(light) * period < FINGER.min_creep_s:
        return None
    level = float(np.median(light[len(light) // 2:]))
    if not level > 0:
        return None
    low, middle, high = (int(np.argmax(light > part * level)) for part in (0.1, 0.5, 0.9))
    begin = middle + max(high - low, 2)
    held = light > FINGER.release_light * level
    end = len(light) if held[-1] else int(np.flatnonzero(held)[-1]) - (high - low)
    if (end - begin) * period < FINGER.min_creep_s:
        return None
    return period * (np.arange(begin, end) - middle), light[begin:end] / light[begin:end].mean()


def _best_share(held: list[tuple[np.ndarray, np.ndarray]], seconds: float) -> tuple[float, float, float]:
    """Late share of the light with a time constant, its standard error by the scatter of the presses, and the residual sum of squares.

    Each press has its own level.
    """
    shares, weights, residual = np.zeros(len(held)), np.zeros(len(held)), 0.0
    for k, (times, light) in enumerate(held):
        late = np.exp(-times / seconds)
        late -= late.mean()
        weights[k] = late @ late
        shares[k] = -(late @ light) / weights[k]
        residual += float((light - light.mean()) @ (light - light.mean()))
    share = float(np.average(shares, weights=weights))
    residual -= share * float(weights @ shares)
    scatter = np.average((shares - share) ** 2, weights=weights)
    return share, float(np.sqrt(scatter / (len(held) - 1))), residual
