# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What each taxel reads while nothing presses it: learnt, followed as it drifts, tared on request."""
from __future__ import annotations

import cv2
import numpy as np

from ..common.statistics import SIGMA_PER_MAD, upper_median
from ..errors import BadArgument

_QUANTUM = 0.29  # standard deviation of what rounding to whole numbers adds
_REACHED = (7, 7)  # taxels, of which none may be touched: a contact's pressure, blurred by the pad, reaches to those around
_SETTLED = 5  # quiet frames of a taxel after which it tells of the noise
_JUDGED, _SELDOM = 50, 10  # frames over which the noise is learnt, then in one of so many
_SAMPLE = 2000  # taxels of a frame that tell of the noise
_LOOKS_PRESSED = 0.1  # of the full scale: a smooth part of a first baseline that is this far over the rest


class Baseline:
    """Baseline (rows, columns) of raw values.

    frames: quiet ones that are averaged; time_constant: s, with which slow drift is followed after that, taxel by taxel and only while it
    and what is around it is not touched, so that a lasting contact is not eaten; start: (rows, columns) from calibration, None for the
    first frame. sigma: standard deviation of a taxel's noise, at least that of rounding.
    """

    def __init__(self, frames: int, time_constant: float, start: np.ndarray | None = None, full_scale: float = np.inf):
        if frames < 1 or not time_constant > 0:
            raise BadArgument(f'baseline: need frames >= 1 and a positive time constant, got {frames}, {time_constant}')
        self._frames, self._time_constant, self._full_scale = frames, time_constant, full_scale
        self._start = None if start is None else np.asarray(start, np.float32)
        self.reset()

    def reset(self, start: bool = True) -> None:
        """Forget; the next frame is the new baseline. start: go on from the calibration's."""
        self.values = self._start.copy() if start and self._start is not None else None
        self._count = None if self.values is None else np.ones(self.values.shape, np.float32)
        self._square, self._gaps, self._learning = 0.0, True, True
        self._judged = self._frame = 0
        self._last: np.ndarray | None = None
        self._settled = False  # whether a taxel has been quiet for long
        self.suspicion = ''

    @property
    def sigma(self) -> float:
        """Of the noise of a taxel, as far as it is known."""
        return max(_QUANTUM, float(np.sqrt(self._square)) if self._judged else 1.0)

    def change(self, frame: np.ndarray) -> np.ndarray:
        """frame (rows, columns) float32 less the baseline; the first one is the baseline itself, where none is known."""
        if self.values is None:
            self.values = frame.copy()
            self._count = np.ones(frame.shape, np.float32)
            self._suspect(frame)
        if self._gaps:
            fresh = np.isnan(self.values)
            self.values[fresh] = frame[fresh]
            self._gaps = bool(np.isnan(self.values).any())
        return frame - self.values

    def follow(self, change: np.ndarray, touched: np.ndarray | None, interval_s: float) -> None:
        """Take the quiet part of a frame's change (rows, columns; NaN is passed over) interval_s after the last; touched: (rows, columns)
        bool, None where nothing is."""
        quiet = np.isfinite(change)
        if touched is not None:
            quiet &= cv2.boxFilter(touched.view(np.uint8), -1, _REACHED, normalize=False, borderType=cv2.BORDER_CONSTANT) == 0
        self._count += quiet
        if self._judged < _JUDGED or self._frame % _SELDOM == 0:
            settled = quiet & (self._count > _SETTLED)
            self._settled = self._settled or bool(settled.any())
            self._judge(change[settled] if self._settled else self._step(change))
        self._frame += 1
        gain = np.float32(min(interval_s / self._time_constant, 1 / self._frames))
        if self._learning:
            gain = np.where(self._count <= self._frames, 1 / self._count, gain)
            self._learning = bool((self._count <= self._frames).any())
        np.add(self.values, change * gain, out=self.values, where=quiet)

    def _step(self, change: np.ndarray) -> np.ndarray:
        """(M,) by how much the taxels differ from the last frame, beyond what is common to them, as noise: all that tells it while none has
        been quiet for long, as at the start, where noise louder than expected looks like touch everywhere."""
        last, self._last = self._last, change
        step = change[:0].ravel() if last is None else ((change - last) * np.float32(0.5**0.5)).ravel()
        step = step[np.isfinite(step)]
        return step - np.median(step) if len(step) else step

    def _judge(self, residual: np.ndarray) -> None:
        """Learn the noise from residuals (M,) of quiet taxels."""
        size = np.abs(residual[::1 + len(residual) // _SAMPLE])
        if len(size):
            new, keep = (SIGMA_PER_MAD * upper_median(size))**2, self._judged
            self._square = (self._square * keep + new) / (keep + 1)
            self._judged = min(keep + 1, _JUDGED)

    def _suspect(self, frame: np.ndarray) -> None:
        """A baseline with a smooth hill in it may have been taken while something pressed."""
        smooth = cv2.medianBlur(np.nan_to_num(frame), 3)
        if np.isfinite(self._full_scale) and np.ptp(smooth) > _LOOKS_PRESSED * self._full_scale:
            self.suspicion = 'the reference looks pressed: free the sensor and call set_reference'
