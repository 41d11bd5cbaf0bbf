# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Geometry of a taxel array and its pad; untouched values and noise of the taxels; dead taxels."""
from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from ..common.statistics import SIGMA_PER_MAD, upper_median
from ..errors import BadArgument, BadFrame

LARGEST = 256  # rows or columns: the largest size that the tests cover
_FULL_SCALES = tuple(2.0**bits - 1 for bits in range(8, 17))
_QUANTUM = 0.29  # standard deviation of rounding to whole numbers: 1 / sqrt(12)
_AROUND = 3  # taxels around a quiet one that must be untouched: the pad spreads pressure over its thickness, 2 taxels in the paper
_SETTLED = 5  # quiet frames of a taxel before it contributes to the noise: its mean is then known better than its noise
_NOISE_FRAMES, _NOISE_INTERVAL = 50, 10  # frames: length of the noise's average; once full, one frame in so many updates it
_SAMPLE = 2000  # taxels used for the noise: the error of a standard deviation, 1 / sqrt(2 N), is then under 2 percent
_LOOKS_PRESSED = 0.1  # of the full scale: range of a smoothed first frame from which it may hold a contact; offsets vary by less
_SILENT = 0.1  # of both neighbours, up to which a taxel is silent: pressure blurred by the pad does not fall so far
_PRESSED = 12.0  # standard deviations of the noise, from which a taxel is pressed
_SILENT_FRAMES = 10  # without any response before, after which a taxel is dead


@dataclass(frozen=True)
class SoftPad:
    """The pad on the array.

    thickness: m (default: 2 mm of the paper); stiffness: Pa, pressure under a wide flat plate over depth / thickness (E of eq 5);
    shear_modulus: Pa; friction: coefficient between pad and object. Raises BadArgument for values that are not positive and finite.
    """

    thickness: float = 0.002
    stiffness: float = 3e5
    shear_modulus: float = 1e5
    friction: float = 0.6

    def __post_init__(self):
        for name in ('thickness', 'stiffness', 'shear_modulus', 'friction'):
            if not 0 < getattr(self, name) < np.inf:
                raise BadArgument(f'pad: {name} must be positive and finite, got {getattr(self, name)}')

    @property
    def shear_stiffness(self) -> float:
        """Pa/m: traction per m of tangential displacement of the pad's surface."""
        return self.shear_modulus / self.thickness


@dataclass(frozen=True)
class TaxelArray:
    """rows x columns taxels, pitch m apart along both; the sensor frame's origin is in the middle, x along columns, y along rows.

    full_scale: largest value of a taxel, inf where it is not known. Raises BadArgument for sizes out of range.
    """

    rows: int
    columns: int
    pitch: float
    full_scale: float = 255.0

    def __post_init__(self):
        if not (1 <= self.rows <= LARGEST and 1 <= self.columns <= LARGEST and 0 < self.pitch < 1 and self.full_scale > 0):
            raise BadArgument(f'taxel array: need 1 to {LARGEST} rows and columns, a pitch of 0 to 1 m and a positive full scale, got '
                              f'{self.rows} x {self.columns}, {self.pitch} m, {self.full_scale}')

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, columns)."""
        return self.rows, self.columns

    @property
    def taxel_area(self) -> float:
        """m^2."""
        return self.pitch**2

    @cached_property
    def x(self) -> np.ndarray:
        """(columns,) m."""
        return (np.arange(self.columns) - 0.5 * (self.columns - 1)) * self.pitch

    @cached_property
    def y(self) -> np.ndarray:
        """(rows,) m."""
        return (np.arange(self.rows) - 0.5 * (self.rows - 1)) * self.pitch

    def frame(self, values: np.ndarray) -> np.ndarray:
        """values (rows, columns) of any real type as float32; values out of range become NaN. Raises BadFrame for another shape or type."""
        values = np.asarray(values)
        if values.shape != self.shape:
            raise BadFrame(f'taxel image is {" x ".join(map(str, values.shape))}, the sensor has {self.rows} x {self.columns} taxels')
        if values.dtype.kind not in 'uifb':
            raise BadFrame(f'taxel image of type {values.dtype}; expected integers or floats')
        frame = values.astype(np.float32)
        if values.dtype.kind == 'f':
            frame[~(np.abs(frame) <= min(self.full_scale, np.finfo(np.float32).max))] = np.nan
        return frame

    def scale_of(self, values: np.ndarray) -> float:
        """Full scale of an image (rows, columns): the known one; else 255 of 8 bits; else the image's largest value, if that is the largest
        of so many bits; else inf."""
        if math.isfinite(self.full_scale):
            return self.full_scale
        if values.dtype == np.uint8:
            return _FULL_SCALES[0]
        return next((full for full in _FULL_SCALES if full == values.max()), math.inf)

    def dead(self, taxels: Sequence[int]) -> np.ndarray:
        """(rows, columns) bool from indices row * columns + column. Raises BadArgument for an index out of range."""
        mask, numbers = np.zeros(self.rows * self.columns, bool), np.asarray(taxels, int).ravel()
        if numbers.size and (numbers.min() < 0 or numbers.max() >= mask.size):
            raise BadArgument(f'dead taxels: indices must be 0 to {mask.size - 1} (row * columns + column), got {numbers.tolist()}')
        mask[numbers] = True
        return mask.reshape(self.shape)


def grown(mask: np.ndarray, around: int) -> np.ndarray:
    """(rows, columns) bool: mask (rows, columns) bool and the taxels within around of it along both axes."""
    return cv2.dilate(mask.view(np.uint8), np.ones((2 * around + 1,) * 2, np.uint8)).view(bool) if around else mask


class Baseline:
    """Untouched value and noise of each taxel: averaged, tracked as they drift, tared on request.

    frames: number of quiet frames that are averaged; time_constant: s, of drift after that, tracked only where no taxel nearby is touched,
    so that a persistent contact stays; start: (rows, columns) from calibration, None to use the first frame; zeroed: a first frame most of
    whose values are 0 is of a sensor that subtracts its untouched values itself, so that they are 0. Raises BadArgument for frames below 1
    or a time constant that is not positive.
    """

    def __init__(self, frames: int, time_constant: float, start: np.ndarray | None = None, zeroed: bool = False):
        if frames < 1 or not time_constant > 0:
            raise BadArgument(f'baseline: need frames >= 1 and a positive time constant, got {frames}, {time_constant}')
        self._frames, self._time_constant = frames, time_constant
        self._start = None if start is None else np.asarray(start, np.float32)
        self._zeroed = zeroed
        self.reset()

    def reset(self, start: bool = True) -> None:
        """The next frame is the new baseline, or, with start, the one from calibration if there is one."""
        self.values = self._start.copy() if start and self._start is not None else None
        self._count = None if self.values is None else np.ones(self.values.shape, np.float32)
        self._zeroes = self._zeroed and start  # whether a first frame of zeros stands for zeros
        self._variance = 0.0
        self._noise_count = self._frame = 0
        self._last: np.ndarray | None = None
        self._settled = False  # whether any taxel has been quiet for _SETTLED frames
        self.warning = ''

    @property
    def sigma(self) -> float:
        """Standard deviation of a taxel's noise, at least that of rounding; 1 before the first estimate."""
        return max(_QUANTUM, math.sqrt(self._variance) if self._noise_count else 1.0)

    def change(self, frame: np.ndarray, full_scale: float = np.inf) -> np.ndarray:
        """frame (rows, columns) float32 minus the baseline; a first frame becomes the baseline if there is none. full_scale: of a taxel,
        inf where it is not known."""
        if self.values is None:
            zeroed = self._zeroes and np.count_nonzero(frame == 0) > 0.5 * frame.size
            self.values, self._count = np.zeros_like(frame) if zeroed else frame.copy(), np.ones(frame.shape, np.float32)
            smooth = cv2.medianBlur(np.nan_to_num(frame), 3)
            if not zeroed and np.ptp(smooth) > _LOOKS_PRESSED * full_scale:
                self.warning = 'the reference may contain a contact: release the sensor and call set_reference'
        fresh = np.isnan(self.values)
        if fresh.any():
            self.values[fresh] = frame[fresh]
        return frame - self.values

    def follow(self, change: np.ndarray, touched: np.ndarray, interval_s: float) -> None:
        """Track with the quiet part of a frame's change (rows, columns; NaN is skipped), interval_s after the last frame; touched: (rows,
        columns) bool."""
        quiet = ~grown(touched, _AROUND) & np.isfinite(change)
        self._count += quiet
        gain = np.where(self._count <= self._frames, 1 / self._count, np.float32(min(interval_s / self._time_constant, 1 / self._frames)))
        np.add(self.values, change * gain, out=self.values, where=quiet)
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
            self._variance = (self._variance * keep + new) / (keep + 1)
            self._noise_count = min(keep + 1, _NOISE_FRAMES)


def fill(values: np.ndarray, dead: np.ndarray) -> np.ndarray:
    """values (rows, columns) float32 with dead (rows, columns) bool filled by the mean of live neighbours, from the rim of a gap inwards; 0
    where all are dead."""
    if not dead.any():
        return values
    known = (~dead).astype(np.float32)
    filled = np.where(dead, np.float32(0), values)
    for _ in range(max(values.shape)):
        weight = cv2.boxFilter(known, -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT)
        total = cv2.boxFilter(filled, -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT)
        new = (known == 0) & (weight > 0.5)
        if not new.any():
            break
        filled[new] = total[new] / weight[new]
        known[new] = 1
    return filled


class DeadTaxels:
    """Fills dead taxels and detects those that are silent between two pressed neighbours along a row or a column.

    known: (rows, columns) bool, dead from the start.
    """

    def __init__(self, known: np.ndarray):
        self.dead = known.copy()
        self._silent = np.zeros(known.shape, np.uint8)
        self._responded = np.zeros(known.shape, bool)

    def repaired(self, change: np.ndarray, sigma: float) -> np.ndarray:
        """change (rows, columns) float32 from the baseline with dead and NaN taxels filled; sigma: its noise."""
        loud = change > _PRESSED * sigma
        if loud.any():
            self._responded |= loud
            self._detect(np.where(loud, change, 0), change)
        return fill(change, self.dead | np.isnan(change))

    def _detect(self, pressed: np.ndarray, change: np.ndarray) -> None:
        """Count the frames in which a taxel that never responded is silent; pressed: change where it is large, else 0."""
        between = np.zeros_like(pressed)
        between[1:-1] = np.minimum(pressed[:-2], pressed[2:])
        between[:, 1:-1] = np.maximum(between[:, 1:-1], np.minimum(pressed[:, :-2], pressed[:, 2:]))
        silent = (between > 0) & (change < _SILENT * between) & ~self._responded
        if silent.any():
            self._silent[silent] = np.minimum(self._silent[silent] + 1, _SILENT_FRAMES)
            self.dead |= self._silent >= _SILENT_FRAMES
