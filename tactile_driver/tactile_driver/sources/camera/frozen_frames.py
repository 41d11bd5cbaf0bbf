# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Detects a faulty camera: frozen or black images."""
from __future__ import annotations

import time

import numpy as np

_FROZEN_S = 1.0  # duration of identical images that counts as frozen: noise changes every image, even of a still scene; chosen
_BLACK_S = 0.3  # duration of black images that is reported; the first images after the start may be black; chosen
_UNSEEN_S = 2.0  # without a frame for longer, remark is empty; chosen
_DARKEST = 8.0  # grey levels of 255, largest mean of a black image; chosen
_STEP = 8  # only every 8th row is compared, because noise changes every row; chosen


class FrameWatch:
    """Watches the frames of one camera; remark describes a fault for as long as it lasts."""

    def __init__(self):
        self.begin()

    def begin(self) -> None:
        """Reset, after the camera was reopened."""
        self._last: np.ndarray | None = None
        self._seen_s = self._changed_s = self._bright_s = time.monotonic()

    def add(self, image: np.ndarray) -> None:
        """Add the image of the next frame, uint8 (H, W) or (H, W, 3)."""
        self._seen_s, rows = time.monotonic(), image[::_STEP]
        if self._last is None or not np.array_equal(rows, self._last):
            self._last, self._changed_s = rows.copy(), self._seen_s
        if rows.mean() > _DARKEST:
            self._bright_s = self._seen_s

    @property
    def remark(self) -> str:
        """The fault and its remedy; '' without a fault or without recent frames."""
        if self._last is None or time.monotonic() - self._seen_s > _UNSEEN_S:
            return ''
        if self._seen_s - self._bright_s > _BLACK_S:
            return 'the pictures are black; check lamps, exposure and what covers the lens'
        same_s = self._seen_s - self._changed_s
        return f'the camera has repeated one picture for {same_s:.1f} s; it hangs, pull it out and plug it in again' \
            if same_s > _FROZEN_S else ''
