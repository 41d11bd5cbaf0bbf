# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The PSD finger: voltages in, contacts out, in batches of any size."""
from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .ambient_light import AmbientStepDetector, ContactDetector
from .baseline import Reference
from ..errors import BadArgument, BadFrame
from .geometry import CROSS as CROSS_SUM, MIX, TOTAL, position_covariance
from .model import CROSS, DEVIATION, INSIDE, LEVEL, LOADS, NORMAL, FingerModel

OUT_OF_RANGE, AMBIGUOUS, SATURATED = 1, 4, 8
_CHUNK_S, _CHUNK = 0.1, 250  # s and samples at least between updates of the reference. Chosen: well under its time constant of 0.5 s
_STEP_S = 0.01  # over which a step of ambient light is averaged. Derived: one period of lamps on 50 Hz mains
_LIT = 3.0  # standard deviations of the total, from which a position is computed. Chosen
_TOUCHED = 5.0  # standard deviations of the total, from which an object is there. Chosen: as _ON of ambient_light
_STUCK = 50  # equal samples in a row that mark an output as stuck. Chosen: noise of one count makes 50 in a row very unlikely
_CROSS_LIMIT = 6.0  # standard deviations of the cross term for one contact; more are several contacts. Chosen

_EYE = np.eye(3)


@dataclass(frozen=True)
class FingerSettings:
    """radius: m, outer radius of the cover; saturation: V, at which an output saturates; reference_seconds, fastest_drift (V/s): see
    Reference."""

    radius: float = 0.016
    saturation: float = 4.9
    reference_seconds: float = 0.2
    fastest_drift: float = 0.1


@dataclass(frozen=True)
class Touch:
    """One contact, averaged over some samples. id: constant while it lasts; position: (3,) m; normal: (3,); force: N, depth: m, NaN where
    not calibrated; covariance: (3, 3) of position, m^2; flags: sum of OUT_OF_RANGE, AMBIGUOUS, SATURATED."""

    id: int
    position: np.ndarray
    normal: np.ndarray
    force: float
    depth: float
    covariance: np.ndarray
    flags: int


@dataclass(frozen=True)
class Samples:
    """Results for samples (N,). known: whether the reference was available and the voltages were finite; contact: whether something
    touches; id: of the contact, 0 for none; sums: (N, 4) net voltages @ MIX; place: (N, 2) half widths, NaN without contact; saturated:
    (N,)."""

    known: np.ndarray
    contact: np.ndarray
    id: np.ndarray
    sums: np.ndarray
    place: np.ndarray
    saturated: np.ndarray

    def runs(self) -> Iterator[slice]:
        """Slices of samples with one contact, or with none; unknown samples belong to the slice before them."""
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
    """The finger's state between batches. detector: of contact, None for ContactDetector. Raises BadArgument for a radius or saturation
    that is not positive."""

    def __init__(self, model: FingerModel, settings: FingerSettings = FingerSettings(), detector: ContactDetector | None = None):
        if not (settings.radius > 0 and settings.saturation > 0):
            raise BadArgument(f'PSD finger: radius {settings.radius} m and saturation {settings.saturation} V must be positive')
        self.model, self.settings = model, settings
        self._table = model.table
        self.reference = Reference(settings.reference_seconds, settings.fastest_drift)
        self._touch, self._id, self._steps = detector or ContactDetector(), 0, AmbientStepDetector()
        self._last, self._same = [math.nan] * 4, [0] * 4

    def set_reference(self) -> None:
        """Measure the untouched state anew from the next samples."""
        self.reference.begin()
        self._touch.begin()
        self._steps.begin()

    @property
    def stuck(self) -> np.ndarray:
        """(4,) bool: outputs that have stopped changing."""
        return np.array(self._same) >= _STUCK

    def process(self, volts: np.ndarray, period_s: float) -> Samples:
        """Results for samples (N, 4), V, period_s apart. Raises BadFrame for another shape or a period that is not positive and finite."""
        volts = np.asarray(volts)
        if volts.ndim != 2 or volts.shape[1] != 4 or not len(volts):
            raise BadFrame(f'voltages have shape {volts.shape}; expected (N, 4), N > 0')
        if not 0 < period_s < np.inf:
            raise BadFrame(f'sample period is {period_s} s; it must be positive and finite')
        volts = volts.astype(float)
        if np.isfinite(volts.sum()):
            return self._finite(volts, period_s)
        good = np.isfinite(volts).all(axis=1)
        found = _unknown(volts)
        if good.any():
            some = self._finite(volts[good], period_s)
            for name in found.__dataclass_fields__:
                getattr(found, name)[good] = getattr(some, name)
        return found

    def _finite(self, volts: np.ndarray, period_s: float) -> Samples:
        self._count_repeats(volts)
        chunk = max(int(_CHUNK_S / period_s), _CHUNK)
        parts, begin = [], 0
        while begin < len(volts):
            some = volts[begin:begin + chunk]
            if not self.reference.ready:
                used = self.reference.take(some, period_s)
                parts.append(_unknown(some[:used]))
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
        """A step of ambient light during a contact; see AmbientStepDetector.find."""
        if not self._touch.touching:
            self._steps.begin()
            return None
        sigma = self.reference.sigma  # the offset is held while something touches
        return self._steps.find(sums, _TOUCHED * sigma, sigma, period_s)

    def _steady(self, volts: np.ndarray, sums: np.ndarray, period_s: float) -> Samples:
        total, sigma = sums[:, TOTAL], self.reference.sigma
        place, level = self._positions_and_levels(sums, total > _LIT * sigma)
        was_touching = self._touch.touching
        contact, light = self._touch.process(total, level, sigma, period_s)
        used = len(contact)
        sums, place = sums[:used], place[:used]
        if not contact.all():
            waiting = ~contact & (light.rest | light.near)
            if waiting.any():
                self.reference.follow(sums[waiting], period_s)
            place[~contact] = np.nan
        if light.ambient_step:
            tail = sums[-max(int(_STEP_S / period_s), 3):]
            self.reference.shift(MIX @ tail.mean(0) / 4)
        ids = self._contact_ids(contact, was_touching)
        saturated = (volts[:used] >= self.settings.saturation).any(axis=1)
        return Samples(np.ones(used, bool), contact, ids, sums, place, saturated)

    def _positions_and_levels(self, sums: np.ndarray, lit: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
        """Positions (N, 2), NaN where not lit, and the light at first contact there (N,), infinite where not lit; None without
        calibration."""
        if np.count_nonzero(lit) == len(lit):
            place = _clipped_positions(sums)
            return place, None if self.model.level is None else self._table.look_up_one(place, LEVEL)
        place, level = np.full((len(sums), 2), np.nan), None if self.model.level is None else np.full(len(sums), np.inf)
        if lit.any():
            place[lit] = _clipped_positions(sums[lit])
            if level is not None:
                level[lit] = self._table.look_up_one(place[lit], LEVEL)
        return place, level

    def _contact_ids(self, contact: np.ndarray, was_touching: bool) -> np.ndarray:
        if was_touching and contact.all():
            return np.full(len(contact), self._id)
        if not contact.any():
            return np.zeros(len(contact), np.int64)
        begins = contact & ~np.r_[was_touching, contact[:-1]]
        number = self._id + np.cumsum(begins)
        self._id = int(number[-1])
        return np.where(contact, number, 0)

    def _count_repeats(self, volts: np.ndarray) -> None:
        before, first, self._last = self._last, volts[0].tolist(), volts[-1].tolist()
        for k in range(4):
            same = first[k] == self._last[k] and np.count_nonzero(volts[:, k] == first[k]) == len(volts)
            self._same[k] = (self._same[k] * (first[k] == before[k]) + len(volts)) if same else 0

    def touch(self, samples: Samples, run: slice) -> Touch:
        """The contact over a slice of samples, from their mean. Raises BadArgument for a slice without contact."""
        inside = samples.contact[run]
        count = int(np.count_nonzero(inside))
        if not count:
            raise BadArgument(f'samples {run.start} to {run.stop} are not in contact')
        chosen = run if count == len(inside) else np.flatnonzero(inside) + run.start
        sums = np.add.reduce(samples.sums[chosen], axis=0) / count
        light, place = float(sums[TOTAL]), _clipped_positions(sums[None])[0]
        row, slopes = self._table.with_slopes(place)
        normal = row[NORMAL] / math.sqrt(row[NORMAL] @ row[NORMAL])
        place_noise = position_covariance(place, light, self.reference.noise, self.model.shot) / count
        across = _EYE - normal[:, None] * normal
        jacobian = across @ slopes[NORMAL]
        spread = jacobian @ place_noise @ jacobian.T + row[DEVIATION] ** 2 * across
        flags = SATURATED if np.count_nonzero(samples.saturated[chosen]) else 0
        if row[INSIDE] < 0.5 or max(map(abs, place.tolist())) >= 1:
            flags |= OUT_OF_RANGE
        if self._is_ambiguous(sums, row[CROSS], count):
            flags |= AMBIGUOUS
        if max(self._same) >= _STUCK:
            flags, normal, spread = flags | AMBIGUOUS, np.full(3, np.nan), np.full((3, 3), np.nan)
        radius = self.settings.radius
        force, depth = self.model.loads(row[LOADS], place, light)
        number = samples.id[run.start] or samples.id[run].max()
        return Touch(int(number), radius * normal, normal, force, depth, radius**2 * spread, flags)

    def _is_ambiguous(self, sums: np.ndarray, expected: float, count: int) -> bool:
        """Whether the cross term is not that of a single contact; False without calibration."""
        if math.isnan(expected):
            return False
        noise = math.sqrt(self.reference.noise[CROSS_SUM, CROSS_SUM] / count) / sums[TOTAL]
        return abs(sums[CROSS_SUM] / sums[TOTAL] - expected) > _CROSS_LIMIT * math.hypot(noise, self.model.cross_sigma)

    def normals(self, samples: Samples) -> np.ndarray:
        """Unit normals (N, 3) of single samples; NaN without contact."""
        found = np.full((len(samples.id), 3), np.nan)
        if samples.contact.any():
            rows = self._table.look_up(samples.place[samples.contact])[:, NORMAL]
            found[samples.contact] = rows / np.linalg.norm(rows, axis=1, keepdims=True)
        return found


def _clipped_positions(sums: np.ndarray) -> np.ndarray:
    """Positions (N, 2) on the detector for sums (N, 4) with a positive total."""
    return np.minimum(np.maximum(sums[:, :TOTAL] / sums[:, TOTAL:CROSS_SUM], -1.0), 1.0)


def _unknown(volts: np.ndarray) -> Samples:
    count = len(volts)
    no = np.zeros(count, bool)
    return Samples(no, no.copy(), np.zeros(count, np.int64), np.full((count, 4), np.nan), np.full((count, 2), np.nan), no.copy())
