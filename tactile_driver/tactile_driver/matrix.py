# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Matrices of counts as they come from a taxel array: their type, and their order in rows and columns."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .errors import BadFrame
from .frame import Frame


@dataclass(frozen=True)
class MatrixOrder:
    """What has to be done with a matrix for its rows to run along the sensor's y axis and its columns along x: transposed first, then
    flipped."""

    transposed: bool = False
    flip_rows: bool = False
    flip_columns: bool = False

    def ordered(self, values: np.ndarray) -> np.ndarray:
        """values (rows, columns) in the sensor's order."""
        if self.transposed:
            values = values.T
        return np.ascontiguousarray(values[::-1 if self.flip_rows else 1, ::-1 if self.flip_columns else 1])


def matrix_frame(values: np.ndarray, shape: tuple[int, int], stamp_ns: int, place: str, truth: object = None) -> Frame:
    """A Frame, mono8 or mono16, of whole numbers values (rows, columns). Raises BadFrame for another shape (0: any) or other numbers."""
    values = np.asarray(values)
    if values.ndim != 2 or any(wanted not in (0, found) for wanted, found in zip(shape, values.shape)) or not values.size:
        raise BadFrame(f'{place} is {" x ".join(map(str, values.shape))}, parameters rows and columns say {shape[0]} x {shape[1]}; '
                       'it is skipped')
    if values.dtype.kind not in 'ui':
        if not np.isfinite(values).all() or (values != np.round(values)).any():
            raise BadFrame(f'{place} has values that are no whole numbers; it is skipped')
    if values.min() < 0 or values.max() >= 2**16:
        raise BadFrame(f'{place} has values from {values.min()} to {values.max()}; 0 to 65535 can be published; it is skipped')
    small = values.dtype == np.uint8
    return Frame(values.astype(np.uint8 if small else np.uint16), stamp_ns, 'mono8' if small else 'mono16', truth)
