# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The PSD finger: voltages in, contacts out, in batches of any size."""
from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .._core import count_repeats, finger_samples, finger_touch, held_before, held_begin, held_follow, held_interrupt, place_values
from ..errors import BadArgument, BadFrame
from .ambient_light import ContactDetector, Light, LightState, filled
from .baseline import Reference
from .geometry import MIX, TOTAL
from .model import BEND, LEVEL, LIGHT, NORMAL, FingerModel

OUT_OF_RANGE, AMBIGUOUS, SATURATED = 1, 4, 8
_CHUNK_S = 0.01  # s, longest time that is judged at once. Derived: one period of lamps on 50 Hz mains
_LIT = 3.0  # standard deviations of the total, from which a position is computed. Chosen
_LEAST = 4.0  # standard deviations of the total, lowest threshold of contact. Chosen
_STUCK = 50  # equal samples in a row that mark an output as stuck. Chosen: noise of one count makes 50 in a row very unlikely
_GAP_S = 0.003  # s without samples, beyond which neighbours are not compared. Chosen: an object moves little in it
_APART_S = 0.02  # s without contact, after which it is a new one for the light that it holds. Chosen: less is noise about the threshold
_LOST_S = 0.1  # s without samples, after which a contact is a new one. Chosen: shorter than two touches of a finger


@dataclass(frozen=True)
class FingerSettings:
    """radius: m, outer radius of the cover; saturation: V, at which an output saturates; reference_seconds, fastest_drift (V/s): see
    Reference."""

    radius: float = 0.016
    saturation: float = 4.9
    reference_seconds: float = 0.2
    fastest_drift: float = 0.1


@dataclass(slots=True)
class Touch:
    """One contact, averaged over some samples. id: constant while it lasts; position: (3,) m; normal: (3,); force: N, depth: m, NaN where
    not calibrated; covariance: (3, 3) of position, m^2; flags: sum of OUT_OF_RANGE, AMBIGUOUS, SATURATED (as in src/psd/finger.hpp)."""

    id: int
    position: np.ndarray
    normal: np.ndarray
    force: float
    depth: float
    covariance: np.ndarray
    flags: int


@dataclass(slots=True)
class Samples:
    """Results for samples (N,). known: whether the reference was available and the voltages were finite; contact: whether something
    touches; id: of the contact, 0 for none; sums: (N, 4) net voltages @ MIX; place: (N, 2) half widths, NaN without contact; saturated:
    (N,); one_run: all are known to be of one contact, or of none."""

    known: np.ndarray
    contact: np.ndarray
    id: np.ndarray
    sums: np.ndarray
    place: np.ndarray
    saturated: np.ndarray
    one_run: bool = False

    def runs(self) -> Iterator[slice]:
        """Slices of samples with one contact, or with none; unknown samples belong to the slice before them."""
        if self.one_run:
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

    #: whether ambient light that changes during a contact is told from the contact's
    holds_light = True

    def __init__(self, model: FingerModel, settings: FingerSettings = FingerSettings(), detector: ContactDetector | None = None):
        if not (settings.radius > 0 and settings.saturation > 0):
            raise BadArgument(f'PSD finger: radius {settings.radius} m and saturation {settings.saturation} V must be positive')
        self.model, self.settings = model, settings
        self.reference = Reference(settings.reference_seconds, settings.fastest_drift)
        self._touch, self._id = detector or ContactDetector(), 0
        self._held, self._apart_s = held_before(), math.inf  # light of the contact, see src/psd/held_light.hpp; s since it ended
        self._last, self._same = np.full(4, np.nan), np.zeros(4)

    def set_reference(self) -> None:
        """Measure the untouched state anew from the next samples."""
        self.reference.begin()
        self._touch.begin()

    def interrupt(self, seconds: float) -> None:
        """Samples are missing for so many seconds: what is known of a movement, and of a contact if they are many, ends here."""
        if seconds > _GAP_S:
            self._touch.interrupt()
            self._last, self._same = np.full(4, np.nan), np.zeros(4)
            self._held, self._apart_s = held_interrupt(self._held), math.inf
        if seconds > _LOST_S:
            self._touch.begin()

    @property
    def stuck(self) -> np.ndarray:
        """(4,) bool: outputs that have stopped changing."""
        return self._same >= _STUCK

    def process(self, volts: np.ndarray, period_s: float) -> Samples:
        """Results for samples (N, 4), V, period_s apart. Raises BadFrame for another shape or a period that is not positive and finite."""
        volts = np.ascontiguousarray(volts, float)
        if volts.ndim != 2 or volts.shape[1] != 4 or not len(volts):
            raise BadFrame(f'voltages have shape {volts.shape}; expected (N, 4), N > 0')
        if not 0 < period_s < np.inf:
            raise BadFrame(f'sample period is {period_s} s; it must be positive and finite')
        self._last, self._same = count_repeats(volts, self._last, self._same, saturation=self.settings.saturation)
        count, chunk, begin, parts = len(volts), max(int(_CHUNK_S / period_s), 1), 0, []
        while begin < count:
            parts.append(self._chunk(volts[begin:begin + chunk], period_s))
            begin += len(parts[-1].id)
        return parts[0] if len(parts) == 1 else _joined(parts)

    def _chunk(self, volts: np.ndarray, period_s: float) -> Samples:
        """Results for the first samples, at least one."""
        reference, was_touching = self.reference, self._touch.touching
        sigma = reference.sigma
        sums, place, over, saturated, finite, *span = finger_samples(
            volts, reference.offset, self.model.table, lit=_LIT * sigma, least=_LEAST * sigma, saturation=self.settings.saturation,
            level=LEVEL)
        if finite < len(volts):
            return self._with_unknown(volts, period_s)
        if not reference.ready:
            return _unknown(volts[:reference.take(volts, period_s)])
        contact, state = self._touch.process(Light(sums[:, TOTAL], over, *span), sigma, period_s)
        used, inside = len(contact), int(np.count_nonzero(contact))
        if inside < used:
            sums, place, saturated = sums[:used], place[:used], saturated[:used]
            self._wait(sums, contact, state, period_s)
            place[~contact] = np.nan
        if inside and self.holds_light:
            sums = self._hold(sums, contact, saturated, was_touching, period_s)
        self._apart_s = 0.0 if inside else self._apart_s + used * period_s
        one_run = inside == 0 or (inside == used and was_touching)
        ids = filled(used, np.int64, self._id if inside else 0) if one_run else self._contact_ids(contact, was_touching)
        return Samples(contact if inside == used else filled(used, bool, True), contact, ids, sums, place, saturated, one_run)

    def _with_unknown(self, volts: np.ndarray, period_s: float) -> Samples:
        """Results for samples some of which are not finite: up to the first of them, or those that begin the batch."""
        good = np.isfinite(volts).all(axis=1)
        changes = np.flatnonzero(good != good[0])
        end = int(changes[0]) if len(changes) else len(volts)
        if good[0]:
            return self._chunk(volts[:end], period_s)
        self.interrupt(end * period_s)
        return _unknown(volts[:end])

    def _wait(self, sums: np.ndarray, contact: np.ndarray, state: LightState, period_s: float) -> None:
        """The reference follows sums (N, 4) outside contact."""
        waiting = ~contact if state.settled is None else ~contact & state.settled
        if waiting.any():
            self.reference.follow(sums[waiting], period_s)
        if state.ambient_step:
            self.reference.shift(MIX @ sums[-max(int(_CHUNK_S / period_s), 3):].mean(0) / 4)

    def _hold(self, sums: np.ndarray, contact: np.ndarray, saturated: np.ndarray, was_touching: bool, period_s: float) -> np.ndarray:
        """Sums (N, 4) corrected in contact for ambient light that changes during it; the offset follows what is certain."""
        reference = self.reference
        reference.hold(len(contact) * period_s)
        if not (was_touching and contact[0]) and self._apart_s > _APART_S:
            before = reference.offset
            reference.recall()
            sums += (before - reference.offset) @ MIX
            self._held = held_begin(self._held, reference.offset, reference.offset if self.model.room is None else self.model.room)
        self._held, sums, shift = held_follow(self._held, sums, contact, saturated, self.model.table, reference.noise,
                                              cross_volts=math.hypot(self.model.cross_volts, reference.uncertainty_across), period=period_s)
        if shift is not None:
            reference.shift(shift)
        return sums

    def _contact_ids(self, contact: np.ndarray, was_touching: bool) -> np.ndarray:
        begins = contact & ~np.r_[was_touching, contact[:-1]]
        number = self._id + np.cumsum(begins)
        self._id = int(number[-1])
        return np.where(contact, number, 0)

    def touch(self, samples: Samples, run: slice) -> Touch:
        """The contact over a slice of samples, from the mean of those that are not saturated. NaN where an output is saturated throughout,
        or stuck. Raises BadArgument for a slice without contact."""
        model = self.model
        found = finger_touch(samples.sums[run], samples.contact[run], samples.saturated[run], model.table, self.reference.noise,
                             model.load_terms, self._held, shot=model.shot, cross_volts=model.cross_volts,
                             offset_volts=2 * self.reference.uncertainty, radius=self.settings.radius,
                             stuck=max(self._same.tolist()) >= _STUCK)
        if found is None:
            raise BadArgument(f'samples {run.start} to {run.stop} are not in contact')
        return Touch(int(samples.id[run.start]) or int(samples.id[run].max()), *found)

    def normals(self, samples: Samples) -> np.ndarray:
        """Unit normals (N, 3) of single samples; NaN without contact."""
        values = place_values(samples.place, self.model.table)
        relative = np.clip(samples.sums[:, TOTAL] / values[:, LIGHT] - 1, -1, 1)
        rows = values[:, NORMAL] + relative[:, None] * values[:, BEND]
        return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def _joined(parts: list[Samples]) -> Samples:
    return Samples(*(np.concatenate([getattr(part, name) for part in parts]) for name in Samples.__slots__[:-1]))


def _unknown(volts: np.ndarray) -> Samples:
    count = len(volts)
    no = np.zeros(count, bool)
    return Samples(no, no.copy(), np.zeros(count, np.int64), np.full((count, 4), np.nan), np.full((count, 2), np.nan), no.copy())
