# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Untouched value and noise of each taxel: averaged, tracked as they drift, tared on request."""
from __future__ import annotations

import cv2
import numpy as np

from .._core import taxel_follow
from ..common.statistics import SIGMA_PER_MAD, upper_median
from ..errors import BadArgument

_QUANTUM = 0.29  # standard deviation of rounding to whole numbers: 1 / sqrt(12)
# taxels around a quiet one that must be untouched. Chosen: the pad spreads pressure over its thickness, 2 mm of 1 mm taxels in the paper
_AROUND = 3
_SETTLED = 5  # quiet frames of a taxel before it contributes to the noise. Chosen: the tests pass at 2 and fail at 10
_NOISE_FRAMES, _NOISE_INTERVAL = 50, 10  # frames: length of the noise's average; once full, one frame in so many updates it. Chosen
_SAMPLE = 2000  # taxels used for the noise. Chosen: the error of a standard deviation, 1 / sqrt(2 N), is then under 2 percent
_LOOKS_PRESSED = 0.1  # of the full scale: range of a smoothed first frame from which it may hold a contact. Chosen


class Baseline:
    """Baseline (rows, columns) of raw values.

    frames: number of quiet frames that are averaged; time_constant: s, of drift after that, tracked only where no taxel nearby is touched,
    so that a lasting contact stays; start: (rows, columns) from calibration, None to use the first frame; full_scale: of a taxel. Raises
    BadArgument for frames below 1 or a time constant that is not positive.
    """

    def __init__(self, frames: int, time_constant: float, start: np.ndarray | None = None, full_scale: float = np.inf):
        if frames < 1 or not time_constant > 0:
            raise BadArgument(f'baseline: need frames >= 1 and a positive time constant, got {frames}, {time_constant}')
        self._frames, self._time_constant, self._full_scale = frames, time_constant, full_scale
        self._start = None if start is None else np.asarray(start, np.float32)
        self.reset()

    def reset(self, start: bool = True) -> None:
        """Forget; the next frame is the new baseline, or, with start, the one from calibration if there is one."""
        self.values = self._start.copy() if start and self._start is not None else None
        self._count = None if self.values is None else np.ones(self.values.shape, np.float32)
        self._square, self._gaps = 0.0, True
        self._noise_count = self._frame = 0
        self._last: np.ndarray | None = None
        self._settled = False  # whether any taxel has been quiet for _SETTLED frames
        self.suspicion = ''

    @property
    def sigma(self) -> float:
        """Standard deviation of a taxel's noise, at least that of rounding; 1 before the first estimate."""
        return max(_QUANTUM, float(np.sqrt(self._square)) if self._noise_count else 1.0)

    def change(self, frame: np.ndarray) -> np.ndarray:
        """frame (rows, columns) float32 minus the baseline; a first frame becomes the baseline if there is none."""
        if self.values is None:
            self.values = frame.copy()
            self._count = np.ones(frame.shape, np.float32)
            self._check_untouched(frame)
        if self._gaps:
            fresh = np.isnan(self.values)
            self.values[fresh] = frame[fresh]
            self._gaps = bool(np.isnan(self.values).any())
        return frame - self.values

    def follow(self, change: np.ndarray, touched: np.ndarray | None, interval_s: float) -> None:
        """Track with the quiet part of a frame's change (rows, columns; NaN is skipped), interval_s after the last frame; touched: (rows,
        columns) bool, None without contact."""
        gain = min(interval_s / self._time_constant, 1 / self._frames)
        self.values, self._count, quiet = taxel_follow(self.values, self._count, change,
                                                       np.zeros(change.shape, bool) if touched is None else touched, around=_AROUND,
                                                       frames=self._frames, gain=gain)
        if self._noise_count < _NOISE_FRAMES or self._frame % _NOISE_INTERVAL == 0:
            settled = quiet & (self._count > _SETTLED)
            self._settled = self._settled or bool(settled.any())
            self._update_noise(change[settled] if self._settled else self._step(change))
        self._frame += 1

    def _step(self, change: np.ndarray) -> np.ndarray:
        """(M,) noise from the difference of two frames, without its median. Used at the start, where strong noise looks like contact
        everywhere and no taxel is quiet."""
        last, self._last = self._last, change
        step = change[:0].ravel() if last is None else ((change - last) * np.float32(0.5**0.5)).ravel()
        step = step[np.isfinite(step)]
        return step - np.median(step) if len(step) else step

    def _update_noise(self, residual: np.ndarray) -> None:
        """Average the noise with the normalised median absolute deviation of residuals (M,)."""
        size = np.abs(residual[::1 + len(residual) // _SAMPLE])
        if len(size):
            new, keep = (SIGMA_PER_MAD * upper_median(size))**2, self._noise_count
            self._square = (self._square * keep + new) / (keep + 1)
            self._noise_count = min(keep + 1, _NOISE_FRAMES)

    def _check_untouched(self, frame: np.ndarray) -> None:
        """Note if a first baseline may hold a contact."""
        smooth = cv2.medianBlur(np.nan_to_num(frame), 3)
        if np.isfinite(self._full_scale) and np.ptp(smooth) > _LOOKS_PRESSED * self._full_scale:
            self.suspicion = 'the reference may contain a contact: release the sensor and call set_reference'
