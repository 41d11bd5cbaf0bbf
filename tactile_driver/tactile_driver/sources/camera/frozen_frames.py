# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Tells pictures that no camera sends which works: the same one again and again, or black ones."""
from __future__ import annotations

import time

import numpy as np

_FROZEN_S = 1.0  # noise changes every picture, also of what does not move
_BLACK_S = 0.3  # the first pictures after the start may be
_UNSEEN_S = 2.0
_DARKEST = 8.0  # mean of 0 to 255
_STEP = 8  # every so many rows are looked at: a picture that changes does so in each


class FrameWatch:
    """Follows the frames of one camera; what is wrong stands in remark until they are right again."""

    def __init__(self):
        self.begin()

    def begin(self) -> None:
        """Forget what has been seen: the camera was opened anew."""
        self._last: np.ndarray | None = None
        self._seen_s = self._changed_s = self._bright_s = time.monotonic()

    def add(self, image: np.ndarray) -> None:
        """The next frame's image, uint8 (H, W) or (H, W, 3)."""
        self._seen_s, rows = time.monotonic(), image[::_STEP]
        if self._last is None or not np.array_equal(rows, self._last):
            self._last, self._changed_s = rows.copy(), self._seen_s
        if rows.mean() > _DARKEST:
            self._bright_s = self._seen_s

    @property
    def remark(self) -> str:
        """What is wrong and what to do, '' where nothing is or no frames are looked at."""
        if self._last is None or time.monotonic() - self._seen_s > _UNSEEN_S:
            return ''
        if self._seen_s - self._bright_s > _BLACK_S:
            return 'the pictures are black; check lamps, exposure and what covers the lens'
        same_s = self._seen_s - self._changed_s
        return f'the camera has repeated one picture for {same_s:.1f} s; it hangs, pull it out and plug it in again' \
            if same_s > _FROZEN_S else ''
