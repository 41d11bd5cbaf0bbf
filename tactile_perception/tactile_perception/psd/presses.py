# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Presses at known places: what the outputs were while each lasted, over what they were just before it."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import BadCalibration
from .geometry import MIX, TOTAL

_REST_S, _CLEAR_S, _AFTER_S = 0.6, 0.03, 0.1  # of the untouched stretch before a press: how long, how far from the press, from the last one
_SAME_PLACE = 0.005  # rad: a contact that moves is many places
_LONGEST_S = 0.05  # of a stretch whose mean light belongs to its mean load
_DARK = 4.0  # standard deviations over the darkest samples that count as untouched
_BRIGHT = 5.0  # standard deviations of the total


@dataclass(frozen=True)
class Recording:
    """Samples (N,) with what is known of each. volts (N, 4); period_s; touching (N,) bool; normal (N, 3), force (N,) N, depth (N,) m:
    NaN where not known; times: (N,) s, None for even ones from 0 on; name: for messages."""

    volts: np.ndarray
    period_s: float
    touching: np.ndarray
    normal: np.ndarray
    force: np.ndarray
    depth: np.ndarray
    times: np.ndarray | None = None
    name: str = 'recording'

    def when(self, sample: int) -> str:
        """Where and when, for messages."""
        return f'{self.name} at {sample * self.period_s if self.times is None else self.times[sample]:.3f} s'


@dataclass(frozen=True)
class Stretches:
    """Short stretches of contact at one place each.

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
    """One a press. sums: (N, 4) of its stretches; level: (N,) V, light as the contact begins; brightest: (N,) V."""

    sums: np.ndarray
    level: np.ndarray
    brightest: np.ndarray


@dataclass(frozen=True)
class Presses:
    """All of some recordings; noise: (4, 4) covariance of the sums at rest, V^2; left_out: a line each."""

    stretches: Stretches
    onsets: Onsets
    noise: np.ndarray
    left_out: list[str]


def find_presses(recordings: list[Recording], saturation: float) -> Presses:
    """The presses in recordings; samples from saturation, V, on are left out. Raises BadCalibration where nothing is untouched, or nothing
    touches."""
    rows, onsets, rests, left_out = [], [], [], []
    for recording in recordings:
        offset = None
        for begin, end in _runs(recording.touching):
            rest = _rest_before(recording, begin)
            if len(rest) >= 5:
                offset = rest.mean(0)
                rests.append((rest - offset) @ MIX)
            if offset is None:
                left_out.append(f'press in {recording.when(begin)}: nothing untouched before it')
                continue
            sums = (recording.volts - offset)[max(begin - 1, 0):end] @ MIX
            stretches = _stretches(recording, sums[-(end - begin):], begin, end, saturation)
            if not stretches:
                left_out.append(f'press in {recording.when(begin)}: no light, or saturated')
                continue
            rows += stretches
            light = np.mean([row[0] for row in stretches], axis=0)
            onsets.append((light, sums[:2, TOTAL].mean() if begin else np.nan, sums[:, TOTAL].max()))
    if not any(recording.touching.any() for recording in recordings):
        raise BadCalibration('no usable press: the ground truth says that nothing touches')
    if not rests:
        raise BadCalibration('no untouched stretch before the presses; begin each recording, and each press, with nothing touching')
    if not rows:
        raise BadCalibration('no usable press at a known place: ' + '; '.join(left_out[:3]))
    noise = np.concatenate(rests)
    return Presses(Stretches(*map(np.array, zip(*rows))), Onsets(*map(np.array, zip(*onsets))), noise.T @ noise / len(noise), left_out)


def _runs(touching: np.ndarray) -> list[tuple[int, int]]:
    """(begin, end) of each press."""
    edges = np.flatnonzero(np.diff(np.r_[False, touching, False].astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist()))


def _rest_before(recording: Recording, begin: int) -> np.ndarray:
    """Finite samples (N, 4) before a press and after the last one, the darkest of them: a stage tells of its presses when they stand, and
    the object may have touched before."""
    long, clear, after = (int(seconds / recording.period_s) for seconds in (_REST_S, _CLEAR_S, _AFTER_S))
    before = np.flatnonzero(recording.touching[:begin])
    first = max(begin - long, before[-1] + 1 + after if len(before) else 0)
    rest = recording.volts[first:max(begin - clear, first)]
    rest = rest[np.isfinite(rest).all(1)]
    if len(rest) < 5:
        return rest
    total = rest.sum(1)
    noise = 1.05 * np.median(np.abs(np.diff(total)))  # a standard deviation, of what does not last
    return rest[total <= np.percentile(total, 20) + _DARK * noise]


def _stretches(recording: Recording, sums: np.ndarray, begin: int, end: int, saturation: float) -> list[tuple]:
    """Rows of Stretches for one press."""
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
