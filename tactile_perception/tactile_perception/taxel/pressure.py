# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Geometry of a taxel array and its pad."""
from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .._core.taxel import Pad
from ..core.errors import BadArgument, BadFrame

MAX_SIZE = 256  # rows or columns; the largest size that the tests cover
_FULL_SCALES = tuple(2.0**bits - 1 for bits in range(8, 17))


@dataclass(frozen=True)
class SoftPad:
    """The soft pad on the array.

    Parameters
    ----------
    thickness : float
        Thickness in m; by default the 2 mm of the paper.
    stiffness : float
        Pressure under a wide flat plate over depth / thickness, in Pa (E of eq 5).
    shear_modulus : float
        Shear modulus in Pa.
    friction : float
        Friction coefficient between pad and object.

    Raises
    ------
    BadArgument
        If a value is not positive and finite.
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
        """Traction per tangential displacement of the pad's surface, in Pa/m."""
        return self.shear_modulus / self.thickness


@dataclass(frozen=True)
class TaxelArray:
    """Geometry of a taxel array. The sensor frame has its origin in the middle, x along columns and y along rows.

    Parameters
    ----------
    rows, columns : int
        Numbers of taxels.
    pitch : float
        Distance between taxels along rows and columns in m.
    full_scale : float
        Largest value of a taxel; inf if unknown.

    Raises
    ------
    BadArgument
        If a size is out of range.
    """

    rows: int
    columns: int
    pitch: float
    full_scale: float = 255.0

    def __post_init__(self):
        if not (1 <= self.rows <= MAX_SIZE and 1 <= self.columns <= MAX_SIZE and 0 < self.pitch < 1 and self.full_scale > 0):
            raise BadArgument(f'taxel array: need 1 to {MAX_SIZE} rows and columns, a pitch of 0 to 1 m and a positive full scale, got '
                              f'{self.rows} x {self.columns}, {self.pitch} m, {self.full_scale}')

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of rows and columns."""
        return self.rows, self.columns

    @property
    def taxel_area(self) -> float:
        """Area of a taxel in m^2."""
        return self.pitch**2

    @cached_property
    def x(self) -> np.ndarray:
        """Coordinates (columns,) of the columns in m."""
        return (np.arange(self.columns) - 0.5 * (self.columns - 1)) * self.pitch

    @cached_property
    def y(self) -> np.ndarray:
        """Coordinates (rows,) of the rows in m."""
        return (np.arange(self.rows) - 0.5 * (self.rows - 1)) * self.pitch

    @cached_property
    def xyz(self) -> np.ndarray:
        """Positions (rows * columns, 3) of the taxels on the untouched surface in m."""
        x, y = np.meshgrid(self.x, self.y)
        return np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])

    def frame(self, values: np.ndarray) -> np.ndarray:
        """Convert values of any real type to float32.

        Parameters
        ----------
        values : ndarray, shape (rows, columns)
            Values of the taxels.

        Returns
        -------
        ndarray, shape (rows, columns), float32
            The values; NaN where they are out of range.

        Raises
        ------
        BadFrame
            If shape or type are wrong.
        """
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
        """Full scale of an image (rows, columns).

        It is the known one; else 255 for 8 bits; else the largest value of the image, if that is 2^n - 1; else inf.
        """
        if math.isfinite(self.full_scale):
            return self.full_scale
        if values.dtype == np.uint8:
            return _FULL_SCALES[0]
        return next((full for full in _FULL_SCALES if full == values.max()), math.inf)

    def dead(self, taxels: Sequence[int]) -> np.ndarray:
        """Mask (rows, columns) bool of the indices row * columns + column. Raises BadArgument for an index out of range."""
        mask, numbers = np.zeros(self.rows * self.columns, bool), np.asarray(taxels, int).ravel()
        if numbers.size and (numbers.min() < 0 or numbers.max() >= mask.size):
            raise BadArgument(f'dead taxels: indices must be 0 to {mask.size - 1} (row * columns + column), got {numbers.tolist()}')
        mask[numbers] = True
        return mask.reshape(self.shape)


def pad_on(array: TaxelArray, pad: SoftPad) -> Pad:
    """Make the pad on the array for the kernels."""
    return Pad(rows=array.rows, columns=array.columns, pitch=array.pitch, thickness=pad.thickness / array.pitch,
               stiffness=pad.shear_stiffness, friction=pad.friction)
