# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""PSD stage: contacts from a block of voltages; run by psd_contact_node and process_bag."""
from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from ..errors import BadFrame
from ..psd.creep import TYPICAL, CreepCorrection
from ..psd.finger import Samples, Touch
from ..psd.methods import make_finger
from ..psd.model import FingerModel
from ..psd.sphere_filter import SphereFilter

_OUTPUTS = ('x1', 'y1', 'x2', 'y2')
_SURE = 0.3  # of the creep that is taken off, its standard deviation. Chosen: a place may lag by another share than light
_SLIGHT = 0.01  # of the covariance: a smaller square of the creep is left alone. Chosen: a tenth of the standard deviation
_UNIT = np.eye(3)
_LONGEST_STEP_S = 1.0  # s between single samples of unknown rate. Chosen, as in check_block


class PsdStage:
    """Estimates contacts block by block. model: of the finger; values: of PSD_PARAMETERS. Raises BadArgument for an unknown method."""

    def __init__(self, model: FingerModel, values: Mapping):
        self.finger = make_finger(values['method'], model, values)
        self._each = values['results'] == 'sample'
        self._radius = values['radius']
        self._filter = SphereFilter(values['filter.acceleration']) if values['filter'] else None
        self._filtered: tuple[int, float] = (0, 0.0)  # contact, s
        creep = self.finger.model.creep
        self._creep, self._sure = CreepCorrection(creep or TYPICAL), _SURE if creep else None
        self._last_s = self._next_s = math.nan  # stamps: of the last block, and of the sample after it

    def set_reference(self) -> None:
        """Use the next samples as the untouched reference."""
        self.finger.set_reference()

    @property
    def suspicion(self) -> str:
        """Why results may be wrong; '' without suspicion."""
        stuck = [name for name, dead in zip(_OUTPUTS, self.finger.stuck) if dead]
        return f'output {", ".join(stuck)} is stuck; check its amplifier and cable' if stuck else ''

    def process(self, volts: np.ndarray, stamp_s: float, period_s: float) -> list[tuple[float, list[Touch]]]:
        """[(mean index of the samples, contacts), ...] of a block of voltages.

        volts: (N, 4) V; stamp_s: time of the first sample, s; period_s: s between samples, NaN for a single sample of unknown rate. One
        result for each run of samples with one contact or with none; with parameter results `sample`, one for each sample; none for
        samples without a reference. Raises BadFrame for an invalid shape or period.
        """
        period_s = self._period(len(volts), stamp_s, period_s)
        samples = self.finger.process(volts, period_s)
        found = []
        for run in samples.runs():
            for part in self._parts(samples, run):
                touches = [self.finger.touch(samples, part)] if samples.id[part.start] else []
                known = samples.known[part]
                middle = 0.5 * (len(known) - 1) if np.count_nonzero(known) == len(known) else float(np.flatnonzero(known).mean())
                middle += part.start
                at_s = stamp_s + middle * period_s
                found.append((middle, [self._smoothed(self._crept(t, at_s), at_s) for t in touches]))
        self._next_s = stamp_s + len(volts) * period_s
        return found

    def _parts(self, samples: Samples, run: slice) -> Iterator[slice]:
        if not self._each:
            yield run
            return
        for k in np.flatnonzero(samples.known[run]).tolist():
            yield slice(run.start + k, run.start + k + 1)

    def _period(self, count: int, stamp_s: float, period_s: float) -> float:
        """The block's sample period, s; for a single sample of unknown rate, the time since the last one. A gap before it interrupts the
        finger."""
        since, self._last_s = stamp_s - self._last_s, stamp_s
        if period_s > 0:
            if stamp_s > self._next_s + period_s:
                self.finger.interrupt(stamp_s - self._next_s)
            return period_s
        if count != 1 or not math.isnan(period_s):
            raise BadFrame(f'sample_period is {period_s} s; it must be above 0 (NaN only for a single sample)')
        if not 0 < since < _LONGEST_STEP_S:
            self.finger.interrupt(math.inf)
            raise BadFrame('a single sample without a sample_period; its period is known from the second one on')
        return since

    def _crept(self, touch: Touch, at_s: float) -> Touch:
        """Takes the creep of the cover off a touch; where it is not calibrated, the covariance holds what a typical cover would creep."""
        shown, spread = touch.normal.tolist(), touch.covariance
        found = self._creep.update(touch.id, shown, at_s)
        away = self._radius * math.dist(found, shown)
        if not away * away > _SLIGHT * (spread[0, 0] + spread[1, 1] + spread[2, 2]):
            return touch
        if self._sure is not None:
            touch.normal = np.array(found) / math.hypot(*found)
            touch.position = self._radius * touch.normal
            away *= self._sure
        along = _UNIT - touch.normal[:, None] * touch.normal  # the covariance stays along the surface where the normal has moved
        touch.covariance = along @ touch.covariance @ along + away * away * along
        return touch

    def _smoothed(self, touch: Touch, at_s: float) -> Touch:
        if self._filter is None or not np.isfinite(touch.normal).all():
            return touch
        number, last_s = self._filtered
        if number != touch.id:
            self._filter.begin()
        self._filtered = touch.id, at_s
        normal, spread = self._filter.update(touch.normal, touch.covariance / self._radius**2, at_s - last_s)
        return replace(touch, normal=normal, position=self._radius * normal, covariance=self._radius**2 * spread)
