# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""SORT, by which the paper air_cushion_contact follows markers.

Bewley, Ge, Ott, Ramos, Upcroft: Simple online and realtime tracking, 2016. A Kalman filter of constant velocity follows the box of each
marker; boxes are assigned to tracks by their overlap.
"""
from __future__ import annotations

import numpy as np
import scipy

from ..common.dots import Dots
from .constants import SORT


class SortNumbers:
    """Numbers of markers: those of the positions at which their tracks began.

    The box of a marker is the square around a circle of its area, so the filter needs no ratio of sides. A track that has ended does not
    come back: its marker begins another track, and has no number.

    Parameters
    ----------
    pattern : ndarray, shape (K, 2), optional
        Undeformed positions, px, by number; None for those of the first frame.
    """

    def __init__(self, pattern: np.ndarray | None = None):
        self._pattern, self._stamp_s = pattern, -np.inf
        self._mean, self._covariance = np.zeros((0, 3, 2)), np.zeros((0, 3, 2, 2))  # of column, row, area, and their velocities a frame
        self._id, self._age = np.zeros(0, int), np.zeros(0, int)  # age: frames since the marker was seen

    def update(self, dots: Dots, stamp_s: float, size: tuple | None = None) -> np.ndarray:
        """Numbers of the markers of one frame.

        Parameters
        ----------
        dots : Dots
            The markers.
        stamp_s : float
            Time of the frame, s, later than the last.
        size : tuple, optional
            Of the image; SORT does not use it.

        Returns
        -------
        ndarray of int, shape (N,)
            -1 for a marker whose track began after the first frame.
        """
        boxes = np.column_stack([dots.uv, dots.area * (4 / np.pi)])
        if self._stamp_s == -np.inf:
            uv = dots.uv if self._pattern is None else np.asarray(self._pattern, float)
            self._begin(np.column_stack([uv, np.full(len(uv), np.median(boxes[:, 2]))]), np.arange(len(uv)))
        else:
            self._predict((stamp_s - self._stamp_s) / SORT.frame_s)
        overlap = self._overlap(boxes)
        track, dot = scipy.optimize.linear_sum_assignment(overlap, maximize=True)
        is_same = overlap[track, dot] >= SORT.min_overlap
        track, dot = track[is_same], dot[is_same]
        self._correct(track, boxes[dot])
        self._stamp_s = stamp_s
        self._age += 1
        self._age[track] = 0
        id = np.full(len(boxes), -1)
        id[dot] = self._id[track]
        kept = self._age <= SORT.max_age
        self._mean, self._covariance, self._id, self._age = (values[kept] for values in (self._mean, self._covariance, self._id, self._age))
        new = np.delete(boxes, dot, axis=0)
        self._begin(new, np.full(len(new), -1))
        return id

    def _begin(self, boxes: np.ndarray, id: np.ndarray) -> None:
        """Begin a track at each of boxes (N, 3)."""
        self._mean = np.concatenate([self._mean, np.stack([boxes, np.zeros_like(boxes)], axis=2)])
        self._covariance = np.concatenate([self._covariance, np.broadcast_to(np.diag(SORT.initial_variance), (len(boxes), 3, 2, 2))])
        self._id, self._age = np.append(self._id, id), np.append(self._age, np.zeros(len(boxes), int))

    def _predict(self, frames: float) -> None:
        step = np.array([[1.0, frames], [0.0, 1.0]])
        self._mean = self._mean @ step.T
        self._covariance = step @ self._covariance @ step.T + frames * np.array([*map(np.diag, SORT.process_variance)])

    def _correct(self, track: np.ndarray, boxes: np.ndarray) -> None:
        mean, covariance = self._mean[track], self._covariance[track]
        gain = covariance[..., 0] / (covariance[..., 0, :1] + np.array(SORT.measurement_variance)[:, None])
        self._mean[track] = mean + gain * (boxes - mean[..., 0])[..., None]
        self._covariance[track] = covariance - gain[..., None] * covariance[..., :1, :]

    def _overlap(self, boxes: np.ndarray) -> np.ndarray:
        """Intersection over union (T, N) of each track's box with each of boxes (N, 3)."""
        predicted, seen = self._mean[:, None, :, 0], boxes[None]
        area = np.maximum(predicted[..., 2], 0), seen[..., 2]
        side = [np.sqrt(one)[..., None] for one in area]
        common = np.clip((side[0] + side[1]) / 2 - np.abs(predicted[..., :2] - seen[..., :2]), 0, np.minimum(*side)).prod(axis=2)
        return np.nan_to_num(common / (area[0] + area[1] - common))
