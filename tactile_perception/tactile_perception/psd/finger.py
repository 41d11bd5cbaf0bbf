# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From voltages to contacts: the core of the PSD finger, on arrays of one to a million samples."""
from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .ambient_light import StepWatch, TouchDecision
from .baseline import Reference
from ..errors import BadArgument, BadFrame
from .geometry import CROSS as CROSS_SUM, MIX, TOTAL, position_covariance
from .model import CROSS, DEVIATION, INSIDE, LEVEL, LOADS, NORMAL, FingerModel

OUT_OF_RANGE, AMBIGUOUS, SATURATED = 1, 4, 8
_CHUNK_S, _CHUNK = 0.1, 250  # the reference is followed in steps of so long, and of so many samples at least
_LAMP_S = 0.01  # of a lamp's light tell how much it is: a period at 100 Hz
_LIT = 3.0  # standard deviations of the total: less tells no place
_TOUCHED = 5.0  # standard deviations of the total: more is an object's light
_STUCK = 50  # samples: an output that gives the same count so often does not work
_DOUBTFUL = 6.0  # standard deviations of the fourth combination that no single contact makes

_EYE = np.eye(3)


@dataclass(frozen=True)
class FingerSettings:
    """radius: m, of the cover's outside; saturation: V, from which an output tells no more; reference_seconds, fastest_drift (V/s): see
    Reference."""

    radius: float = 0.016
    saturation: float = 4.9
    reference_seconds: float = 0.2
    fastest_drift: float = 0.1


@dataclass(frozen=True)
class Touch:
    """One contact over some samples. id: kept while it lasts; position (3,), m; normal (3,); force, N, depth, m: NaN where not
    calibrated; covariance (3, 3) of position, m^2; flags: sum of OUT_OF_RANGE, AMBIGUOUS, SATURATED."""

    id: int
    position: np.ndarray
    normal: np.ndarray
    force: float
    depth: float
    covariance: np.ndarray
    flags: int


@dataclass(frozen=True)
class Samples:
    """What samples (N,) tell. known: whether the reference was there and the voltages were numbers; contact: whether something touches; id:
    of the contact, 0 for none; sums: (N, 4) net voltages @ MIX; place: (N, 2) half widths, NaN without contact; saturated: (N,)."""

    known: np.ndarray
    contact: np.ndarray
    id: np.ndarray
    sums: np.ndarray
    place: np.ndarray
    saturated: np.ndarray

    def runs(self) -> Iterator[slice]:
        """The stretches of samples in which one contact lasts, or nothing touches; samples that tell nothing belong to the one before."""
        if np.count_nonzero(self.known) == np.count_nonzero(self.id == self.id[0]) == len(self.id):
            yield slice(0, len(self.id))
            return
        places = np.flatnonzero(self.known)
        changes = np.flatnonzero(np.diff(self.id[places]))
        ends = [*places[changes + 1].tolist(), len(self.id)]
        begin = int(places[0]) if len(places) else len(self.id)
        for end in ends:
            if end > begin:
                yield slice(begin, end)
            begin = end


class PsdFinger:
    """Samples in, contacts out, in any portions. model: of the finger; decision: what tells contact, None for TouchDecision."""

    def __init__(self, model: FingerModel, settings: FingerSettings = FingerSettings(), decision: TouchDecision | None = None):
        if not (settings.radius > 0 and settings.saturation > 0):
            raise BadArgument(f'PSD finger: radius {settings.radius} m and saturation {settings.saturation} V must be positive')
        self.model, self.settings = model, settings
        self._table = model.table
        self.reference = Reference(settings.reference_seconds, settings.fastest_drift)
        self._touch, self._id, self._steps = decision or TouchDecision(), 0, StepWatch()
        self._last, self._same = [math.nan] * 4, [0] * 4

    def set_reference(self) -> None:
        """Take the next samples for the untouched state."""
        self.reference.begin()
        self._touch.begin()
        self._steps.begin()

    @property
    def stuck(self) -> np.ndarray:
        """(4,) bool: outputs that do not change any more."""
        return np.array(self._same) >= _STUCK

    def process(self, volts: np.ndarray, period_s: float) -> Samples:
        """What samples (N, 4), V, period_s apart tell. Raises BadFrame for another shape, or a period that is none."""
        volts = np.asarray(volts)
        if volts.ndim != 2 or volts.shape[1] != 4 or not len(volts):
            raise BadFrame(f'voltages have shape {volts.shape}; four a sample are needed')
        if not 0 < period_s < np.inf:
            raise BadFrame(f'sample period is {period_s} s; it must be above 0')
        volts = volts.astype(float)
        if np.isfinite(volts.sum()):
            return self._finite(volts, period_s)
        good = np.isfinite(volts).all(axis=1)
        found = _nothing(volts)
        if good.any():
            some = self._finite(volts[good], period_s)
            for name in found.__dataclass_fields__:
                getattr(found, name)[good] = getattr(some, name)
        return found

    def _finite(self, volts: np.ndarray, period_s: float) -> Samples:
        self._watch_outputs(volts)
        chunk = max(int(_CHUNK_S / period_s), _CHUNK)
        parts, begin = [], 0
        while begin < len(volts):
            some = volts[begin:begin + chunk]
            if not self.reference.ready:
                used = self.reference.take(some, period_s)
                parts.append(_nothing(some[:used]))
            else:
                parts.append(self._chunk(some, period_s))
                used = len(parts[-1].id)
            begin += used
        return parts[0] if len(parts) == 1 else Samples(*(np.concatenate([getattr(p, name) for p in parts])
                                                          for name in Samples.__dataclass_fields__))

    def _chunk(self, volts: np.ndarray, period_s: float) -> Samples:
        sums = (volts - self.reference.offset) @ MIX
        step = self._step(sums, period_s)
        if step is None:
            return self._steady(volts, sums, period_s)
        samples = self._steady(volts[:step[0]], sums[:step[0]], period_s)
        if len(samples.id) == step[0] and self._touch.touching:
            self.reference.shift(MIX @ step[1] / 4)
        return samples

    def _step(self, sums: np.ndarray, period_s: float) -> tuple[int, np.ndarray] | None:
        """A lamp that was switched while something touches; see StepWatch."""
        if not self._touch.touching:
            self._steps.begin()
            return None
        sigma = self.reference.sigma  # the offset is held while something touches
        return self._steps.find(sums, _TOUCHED * sigma, sigma, period_s)

    def _steady(self, volts: np.ndarray, sums: np.ndarray, period_s: float) -> Samples:
        total, sigma = sums[:, TOTAL], self.reference.sigma
        place, level = self._looked_at(sums, total > _LIT * sigma)
        was = self._touch.touching
        contact, seen = self._touch.process(total, level, sigma, period_s)
        used = len(contact)
        sums, place = sums[:used], place[:used]
        if not contact.all():
            waiting = ~contact & (seen.rest | seen.near)
            if waiting.any():
                self.reference.follow(sums[waiting], period_s)
            place[~contact] = np.nan
        if seen.lamp:
            tail = sums[-max(int(_LAMP_S / period_s), 3):]
            self.reference.shift(MIX @ tail.mean(0) / 4)
        number = self._numbered(contact, was)
        saturated = (volts[:used] >= self.settings.saturation).any(axis=1)
        return Samples(np.ones(used, bool), contact, number, sums, place, saturated)

    def _looked_at(self, sums: np.ndarray, lit: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
        """Places (N, 2), NaN where it is not lit, and the light at touch there (N,), infinite where it is not lit, None where not known."""
        if np.count_nonzero(lit) == len(lit):
            place = _clipped(sums)
            return place, None if self.model.level is None else self._table.look_up_one(place, LEVEL)
        place, level = np.full((len(sums), 2), np.nan), None if self.model.level is None else np.full(len(sums), np.inf)
        if lit.any():
            place[lit] = _clipped(sums[lit])
            if level is not None:
                level[lit] = self._table.look_up_one(place[lit], LEVEL)
        return place, level

    def _numbered(self, contact: np.ndarray, was: bool) -> np.ndarray:
        if was and contact.all():
            return np.full(len(contact), self._id)
        if not contact.any():
            return np.zeros(len(contact), np.int64)
        begins = contact & ~np.r_[was, contact[:-1]]
        number = self._id + np.cumsum(begins)
        self._id = int(number[-1])
        return np.where(contact, number, 0)

    def _watch_outputs(self, volts: np.ndarray) -> None:
        before, first, self._last = self._last, volts[0].tolist(), volts[-1].tolist()
        for k in range(4):
            same = first[k] == self._last[k] and np.count_nonzero(volts[:, k] == first[k]) == len(volts)
            self._same[k] = (self._same[k] * (first[k] == before[k]) + len(volts)) if same else 0

    def touch(self, samples: Samples, run: slice) -> Touch:
        """The contact of a run of samples: what their mean tells. Raises BadArgument for one in which nothing touches."""
        inside = samples.contact[run]
        count = int(np.count_nonzero(inside))
        if not count:
            raise BadArgument(f'samples {run.start} to {run.stop} are not in contact')
        chosen = run if count == len(inside) else np.flatnonzero(inside) + run.start
        sums = np.add.reduce(samples.sums[chosen], axis=0) / count
        light, place = float(sums[TOTAL]), _clipped(sums[None])[0]
        row, slopes = self._table.with_slopes(place)
        normal = row[NORMAL] / math.sqrt(row[NORMAL] @ row[NORMAL])
        place_noise = position_covariance(place, light, self.reference.noise, self.model.shot) / count
        across = _EYE - normal[:, None] * normal
        led = across @ slopes[NORMAL]
        spread = led @ place_noise @ led.T + row[DEVIATION] ** 2 * across
        flags = SATURATED if np.count_nonzero(samples.saturated[chosen]) else 0
        if row[INSIDE] < 0.5 or max(map(abs, place.tolist())) >= 1:
            flags |= OUT_OF_RANGE
        if self._is_doubtful(sums, row[CROSS], count):
            flags |= AMBIGUOUS
        if max(self._same) >= _STUCK:
            flags, normal, spread = flags | AMBIGUOUS, np.full(3, np.nan), np.full((3, 3), np.nan)
        radius = self.settings.radius
        force, depth = self.model.loads(row[LOADS], place, light)
        number = samples.id[run.start] or samples.id[run].max()
        return Touch(int(number), radius * normal, normal, force, depth, radius**2 * spread, flags)

    def _is_doubtful(self, sums: np.ndarray, expected: float, count: int) -> bool:
        """Whether the fourth combination is not that of a single contact; it says nothing where it was not calibrated."""
        if math.isnan(expected):
            return False
        noise = math.sqrt(self.reference.noise[CROSS_SUM, CROSS_SUM] / count) / sums[TOTAL]
        return abs(sums[CROSS_SUM] / sums[TOTAL] - expected) > _DOUBTFUL * math.hypot(noise, self.model.cross_sigma)

    def normals(self, samples: Samples) -> np.ndarray:
        """Unit normals (N, 3) of each sample by itself, NaN without contact."""
        found = np.full((len(samples.id), 3), np.nan)
        if samples.contact.any():
            rows = self._table.look_up(samples.place[samples.contact])[:, NORMAL]
            found[samples.contact] = rows / np.linalg.norm(rows, axis=1, keepdims=True)
        return found


def _clipped(sums: np.ndarray) -> np.ndarray:
    """Places (N, 2) on the detector of sums (N, 4) with light in them."""
    return np.minimum(np.maximum(sums[:, :TOTAL] / sums[:, TOTAL:CROSS_SUM], -1.0), 1.0)


def _nothing(volts: np.ndarray) -> Samples:
    count = len(volts)
    no = np.zeros(count, bool)
    return Samples(no, no.copy(), np.zeros(count, np.int64), np.full((count, 4), np.nan), np.full((count, 2), np.nan), no.copy())
