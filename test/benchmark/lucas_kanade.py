# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Slip on a taxel array by plain optical flow, as a baseline: corners of the pressure image tracked over time."""
from __future__ import annotations

from collections import deque

import cv2
import numpy as np
from tactile_perception.common.estimates import GROSS, INCIPIENT, NONE, SlipEstimate

_SCALE = 4  # pixels per taxel, for corners of contacts of a few taxels. Chosen
_CORNERS, _QUALITY, _APART = 60, 0.05, 4
_WINDOW_S = 0.06  # s between the compared frames. Chosen: between consecutive frames, a slow slip moves by less than the noise
_MOVES = 1e-3  # m/s, slowest slip of a corner. Chosen
_TOUCHED = 10  # counts over rest. Chosen
_INCIPIENT_FROM, _GROSS_FROM = 0.05, 0.9  # share of the corners that slip. Chosen


class LucasKanade:
    """Frames go in one by one; the first is the untouched one. pitch: m from taxel to taxel."""

    def __init__(self, pitch: float = 1e-3):
        self._pitch, self._rest, self._seen = pitch, None, deque()

    def process(self, values: np.ndarray, stamp: float) -> SlipEstimate:
        """The slip at a stamp, s; values: (rows, columns)."""
        if self._rest is None:
            self._rest = values.astype(np.float32)
        over = np.clip(values - self._rest, 0, 255)
        image = cv2.resize(over.astype(np.uint8), None, fx=_SCALE, fy=_SCALE, interpolation=cv2.INTER_LINEAR)
        self._seen.append((stamp, image))
        while len(self._seen) > 2 and stamp - self._seen[1][0] >= _WINDOW_S:
            self._seen.popleft()
        before, earlier = self._seen[0]
        if over.max() < _TOUCHED or stamp <= before:
            return SlipEstimate()
        velocity = self._flow(earlier, image) / (stamp - before)
        if not len(velocity):
            return SlipEstimate()
        fraction = float((np.hypot(*velocity.T) > _MOVES).mean())
        state = GROSS if fraction >= _GROSS_FROM else INCIPIENT if fraction >= _INCIPIENT_FROM else NONE
        middle = np.median(velocity, axis=0) if state else np.zeros(2)
        return SlipEstimate(state, fraction, np.array([*middle, 0.0]), np.zeros(3))

    def _flow(self, earlier: np.ndarray, image: np.ndarray) -> np.ndarray:
        """(N, 2) m by which corners have moved."""
        corners = cv2.goodFeaturesToTrack(earlier, _CORNERS, _QUALITY, _APART)
        if corners is None:
            return np.zeros((0, 2))
        found, status, _ = cv2.calcOpticalFlowPyrLK(earlier, image, corners, None, winSize=(21, 21), maxLevel=2)
        return (found - corners)[status.ravel() > 0].reshape(-1, 2) * (self._pitch / _SCALE)
