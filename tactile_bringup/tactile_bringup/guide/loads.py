# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The loads of an array or a gel in a guided calibration: known weights, or those that a force sensor measures."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from .constants import GUIDE
from .session import Press, Sample


class Loads:
    """Judges samples as Session does: an untouched second, loads, and an untouched time after them are one press.

    weights: N, laid on one after the other, each announced by next_weight; none: a force sensor measures them. how: how they load the
    sensor, as in SensorType.loaded. done: one entry a press; tip: none.
    """

    tip = np.full(3, np.nan)

    def __init__(self, weights: Sequence[float] = (), how: str = ''):
        self.weights, self.done, self._how = list(weights), [], how
        self._press, self._forces = Press([]), []
        self._number, self._since = 0, None  # of the next weight, and when the present one was laid on
        self._loaded_s: float | None = None
        self._tare: np.ndarray | None = None  # wrench without load

    @property
    def open_positions(self) -> list[int]:
        """[0] until there is a press."""
        return [] if self.done else [0]

    @property
    def advice(self) -> str:
        """What to do next."""
        if self.done:
            return 'all loads are recorded'
        if not self._was_untouched:
            return f'touch nothing for {GUIDE.untouched_s:g} s'
        if self.weights:
            return (f'weight {self._number + 1} of {len(self.weights)}: lay {self.weights[self._number]:g} N on, {self._how}, then '
                    'call ~/next')
        return (f'press {self._how}, in four steps or more, {GUIDE.weight_s:g} s each, first rising, then falling; lift, and wait '
                f'{GUIDE.released_s:g} s')

    @property
    def _was_untouched(self) -> bool:
        rest = self._press.rest
        return bool(rest) and rest[-1].stamp_s - rest[0].stamp_s >= GUIDE.untouched_s

    def keep(self, press: Press) -> None:
        """Count a press."""
        self.done.append((np.zeros(2), []))
        self.drop('')

    def next_weight(self) -> str:
        """The next weight is on the sensor; returns a message for the operator."""
        if self.weights and self._was_untouched and self._since is None and not self.done:
            self._since = self._press.rest[-1].stamp_s if not self._forces else self._forces[-1][0]
            return f'hold still: {self.weights[self._number]:g} N'
        return self.advice

    def add(self, sample: Sample) -> tuple[Press | None, str]:
        """Judge a sample; returns a press that counts, or None, and a message for the operator, or ''."""
        if self.weights:
            return self._weighed(replace(sample, wrench=np.zeros(6)))
        return self._felt(sample) if np.isfinite(sample.wrench).all() else (None, '')

    def drop(self, why: str) -> str:
        """Restart; returns the reason."""
        self._press, self._loaded_s, self._number, self._since, self._tare = Press([]), None, 0, None, None
        return why

    def _weighed(self, sample: Sample) -> tuple[Press | None, str]:
        """Keep the samples at a known force: untouched, and with each weight."""
        self._forces.append((sample.stamp_s, 0.0))
        if not self._was_untouched:
            self._press.rest.append(sample)
            return None, self.advice if self._was_untouched else ''
        if self._since is None:
            return None, ''
        weight, last = self.weights[self._number], self._number == len(self.weights) - 1
        if sample.stamp_s - self._since <= (GUIDE.released_s if weight == 0 else GUIDE.weight_s):
            self._press.touched.append(replace(sample, wrench=np.array([0, 0, -weight, 0, 0, 0])))
            self._forces[-1] = sample.stamp_s, weight
            return None, ''
        self._since, self._number = None, self._number + 1
        return (self._press, 'taken') if last else (None, f'taken. {self.advice}')

    def _felt(self, sample: Sample) -> tuple[Press | None, str]:
        """Keep everything from the untouched second to the time after the last load."""
        press = self._press
        if not self._was_untouched:
            press.rest.append(sample)
            return None, self.advice if self._was_untouched else ''
        if self._tare is None:
            self._tare = np.mean([each.wrench for each in press.rest], axis=0)
            self._loaded_from = max(GUIDE.load_sigmas * np.std([each.to_sensor(each.wrench)[2] for each in press.rest]), GUIDE.min_load)
        force = abs(float(sample.to_sensor(sample.wrench - self._tare)[2]))
        loaded = force > self._loaded_from
        self._forces.append((sample.stamp_s, force))
        if loaded and sample.stamp_s - sample.changed_s > GUIDE.stuck_s:
            return None, 'dropped: ' + self.drop('the wrench does not change: the force sensor is saturated or has stopped')
        if loaded:
            self._loaded_s = sample.stamp_s
        if self._loaded_s is None:
            return None, ''
        press.touched.append(sample if loaded else replace(sample, wrench=self._tare))  # without load the wrench is the tare
        return (press, 'taken') if sample.stamp_s - self._loaded_s > GUIDE.released_s else (None, '')

    def picture(self) -> np.ndarray:
        """(240, 480, 3) BGR: the force over the time."""
        image = np.full((240, 480, 3), 255, np.uint8)
        times, forces = np.array(self._forces or [(0.0, 0.0)]).T
        across, up = np.ptp(times) or 1.0, max(forces.max(), 1e-9)
        line = np.column_stack([20 + 440 * (times - times[0]) / across, 220 - 180 * forces / up])
        cv2.polylines(image, [line.astype(np.int32)], False, (60, 160, 60), 2, cv2.LINE_AA)
        cv2.putText(image, f'{forces[-1]:.2f} of {forces.max():.2f} N', (12, 24), cv2.FONT_HERSHEY_SIMPLEX, 0.6, (0, 0, 0), 1, cv2.LINE_AA)
        return image
