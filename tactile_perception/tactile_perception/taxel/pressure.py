# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Geometry of a taxel array and its pad."""
from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from ..errors import BadArgument, BadFrame

LARGEST = 256  # rows or columns: the largest size that the tests cover
_FULL_SCALES = tuple(2.0**bits - 1 for bits in range(8, 17))


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
