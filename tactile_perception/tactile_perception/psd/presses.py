# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration presses at known positions: outputs during each press, relative to the untouched outputs just before it."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import BadCalibration
from .geometry import MIX, TOTAL

_REST_S, _CLEAR_S, _AFTER_S = 0.6, 0.03, 0.1  # s, untouched time before a press: its length, gap to the press, gap to the last one. Chosen
_FEWEST_REST, _FEWEST_LINE = 5, 4  # untouched samples before a press, and presses for a line of the offset. Chosen
_AROUND_S = 2.0  # s around a press in which untouched samples tell its offset. Chosen: drift of a room is straight within it
_STRAIGHT = 3.0  # mean squared deviation from a straight line, of its noise, up to which the offset drifts evenly. Chosen
_SAME_PLACE = 0.005  # rad within which normals count as one position. Chosen: 0.3 degrees, under the error of a map
_LONGEST_S = 0.05  # s, longest segment. Chosen: force changes little within it
_DARK = 4.0  # standard deviations above the darkest samples within which samples count as untouched. Chosen
_BRIGHT = 5.0  # standard deviations of the total, from which light counts as contact. Chosen


@dataclass(frozen=True)
class Recording:
    """Samples (N,) with ground truth. volts: (N, 4); touching: (N,) bool; normal: (N, 3), force: (N,) N, depth: (N,) m, NaN where unknown;
    times: (N,) s, None for multiples of period_s; name: for messages."""

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

    sums: (N, 4) mean net voltages @ MIX; count: (N,) samples; normal: (N, 3); force, depth: (N,) means; scatter: (N,) V^2, variance of an
    output from sample to sample, and output: (N,) V, its mean; when: (N,) names by recording and time.
    """

    sums: np.ndarray
    count: np.ndarray
    normal: np.ndarray
    force: np.ndarray
    depth: np.ndarray
    scatter: np.ndarray
    output: np.ndarray
    when: np.ndarray


@dataclass(frozen=True)
class Onsets:
    """One for each press. sums: (N, 4) mean of its segments; level: (N,) V, light as contact begins; brightest: (N,) V."""

    sums: np.ndarray
    level: np.ndarray
    brightest: np.ndarray


@dataclass(frozen=True)
class Presses:
    """Presses of all recordings; noise: (4, 4) covariance of the untouched sums, V^2; room: (4,) V, their mean outputs; left_out: one note
    per press that was skipped; lights: (s between samples, (N,) V light) of each press, from the sample before it."""

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
        runs = _runs(recording.touching)
        untouched = [_rest_before(recording, begin) for begin, _ in runs]
        for k, (begin, end) in enumerate(runs):
            offset = _offset(recording, runs, untouched, k)
            if offset is None:
                left_out.append(f'press in {recording.when(begin)}: no untouched samples before it')
                continue
            sums = (recording.volts - offset)[max(begin - 1, 0):end] @ MIX
            segments = _segments(recording, sums[-(end - begin):], begin, end, saturation)
            if not segments:
                left_out.append(f'press in {recording.when(begin)}: no light, or saturated')
                continue
            rows += segments
            light = np.mean([row[0] for row in segments], axis=0)
            onsets.append((light, sums[:2, TOTAL].mean() if begin else np.nan, sums[:, TOTAL].max()))
            lights.append((recording.period_s, sums[:, TOTAL]))
        known = [rest for rest in untouched if len(rest) >= _FEWEST_REST]
        rests += [(rest - rest.mean(0)) @ MIX for rest in known]
        rooms += [rest.mean(0) for rest in known]
    if not any(recording.touching.any() for recording in recordings):
        raise BadCalibration('no usable press: the ground truth holds no contact')
    if not rests:
        raise BadCalibration('no untouched samples before the presses: begin each recording, and each press, with nothing touching')
    if not rows:
        raise BadCalibration('no usable press at a known position: ' + '; '.join(left_out[:3]))
    noise = np.concatenate(rests)
    return Presses(Segments(*map(np.array, zip(*rows))), Onsets(*map(np.array, zip(*onsets))), noise.T @ noise / len(noise),
                   np.mean(rooms, axis=0), left_out, lights)


def _runs(touching: np.ndarray) -> list[tuple[int, int]]:
    """(begin, end) of each press."""
    edges = np.flatnonzero(np.diff(np.r_[False, touching, False].astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist()))


def _offset(recording: Recording, runs: list[tuple[int, int]], untouched: list[np.ndarray], press: int) -> np.ndarray | None:
    """Untouched outputs (4,), V, at a press: a line through the means of the untouched samples before the presses around, if they drift
    evenly, else the mean before it; None where nothing precedes it."""
    known = [k for k, rest in enumerate(untouched) if len(rest) >= _FEWEST_REST]
    if not known or known[0] > press:
        return None
    own = untouched[max(k for k in known if k <= press)].mean(0)
    times = np.array([runs[k][0] - runs[press][0] for k in known]) * recording.period_s
    near = [(t, untouched[k]) for t, k in zip(times, known) if abs(t) < _AROUND_S]
    if len(near) < _FEWEST_LINE:
        return own
    count = np.array([len(rest) for _, rest in near])
    means = np.array([rest.mean(0) for _, rest in near])
    noise = np.mean([rest.var(0) for _, rest in near])
    basis = np.column_stack([np.ones(len(near)), [t for t, _ in near]])
    line = np.linalg.lstsq(basis * np.sqrt(count)[:, None], means * np.sqrt(count)[:, None], rcond=None)[0]
    off = (count[:, None] * (means - basis @ line) ** 2).sum() / (means.size - line.size)
    return line[0] if off < _STRAIGHT * noise else own


def _rest_before(recording: Recording, begin: int) -> np.ndarray:
    """The darkest finite samples (N, 4) between the last press and this one. A stage reports contact once it stands still, so the object
    may touch earlier than labelled."""
    long, clear, after = (int(seconds / recording.period_s) for seconds in (_REST_S, _CLEAR_S, _AFTER_S))
    before = np.flatnonzero(recording.touching[:begin])
    first = max(begin - long, before[-1] + 1 + after if len(before) else 0)
    rest = recording.volts[first:max(begin - clear, first)]
    rest = rest[np.isfinite(rest).all(1)]
    if len(rest) < _FEWEST_REST:
        return rest
    total = rest.sum(1)
    noise = 1.05 * np.median(np.abs(np.diff(total)))  # standard deviation from sample to sample: 1.4826 / sqrt(2) times the median
    return rest[total <= np.percentile(total, 20) + _DARK * noise]


def _segments(recording: Recording, sums: np.ndarray, begin: int, end: int, saturation: float) -> list[tuple]:
    """Rows of Segments of one press."""
    volts, normal = recording.volts[begin:end], recording.normal[begin:end]
    floor = _BRIGHT * max(np.std(np.diff(sums[:, TOTAL])) / np.sqrt(2), 1e-9)
    with np.errstate(invalid='ignore'):
        good = (volts < saturation).all(1) & np.isfinite(normal).all(1) & np.isfinite(sums).all(1) & (sums[:, TOTAL] > 0)
    good &= sums[:, TOTAL] > min(floor, 0.5 * np.nanmax(sums[:, TOTAL]))
    longest = max(int(_LONGEST_S / recording.period_s), 1)
    rows, place = [], np.flatnonzero(good)
    while len(place):
        near = np.linalg.norm(normal[place] - normal[place[0]], axis=1) < _SAME_PLACE
        chosen = place[:longest][np.logical_and.accumulate(near[:longest])]
        rows.append(_row(recording, sums, volts, chosen, begin))
        place = place[len(chosen):]
    return rows


def _row(recording: Recording, sums: np.ndarray, volts: np.ndarray, chosen: np.ndarray, begin: int) -> tuple:
    mean = recording.normal[begin + chosen].mean(0)
    scatter = np.var(np.diff(volts[chosen], n=2, axis=0)) / 6 if len(chosen) > 8 else np.nan
    return (sums[chosen].mean(0), len(chosen), mean / np.linalg.norm(mean), recording.force[begin + chosen].mean(),
            recording.depth[begin + chosen].mean(), scatter, sums[chosen, TOTAL].mean() / 4, recording.when(begin + int(chosen[0])))
