# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Writes a video with the timing of the stamps. No ROS here."""
from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from tactile_driver.errors import BadArgument

from ..parameters.table import VIDEO_RATE

_LONGEST_STILL = 30  # frames, 2 s: a longer gap in the stamps is cut to this
_FORMS = (('.mp4', 'mp4v'), ('.avi', 'MJPG'))


class Video:
    """Writes frames by their stamps at 15 frames/s as MP4, or as AVI where OpenCV cannot write MP4. path: without extension."""

    def __init__(self, path: Path):
        self._base = path
        self._writer: cv2.VideoWriter | None = None
        self._size: tuple[int, int] | None = None
        self._first_s = 0.0
        self.path: Path | None = None
        self.frames = 0

    def add(self, stamp_s: float, image: np.ndarray) -> None:
        """Add a frame (H, W, 3) uint8 BGR; it is skipped when the video has a frame of that time. Raises BadArgument without a codec."""
        if self._writer is None:
            self._open(image, stamp_s)
        due = int((stamp_s - self._first_s) * VIDEO_RATE + 0.5) + 1
        if image.shape[1::-1] != self._size or due <= self.frames:
            return
        for _ in range(min(due - self.frames, _LONGEST_STILL)):
            self._writer.write(image)
        self.frames = due

    def close(self) -> None:
        """Finish the file."""
        if self._writer is not None:
            self._writer.release()

    def _open(self, image: np.ndarray, stamp_s: float) -> None:
        self._size, self._first_s = image.shape[1::-1], stamp_s
        for ending, code in _FORMS:
            self.path = self._base.with_suffix(ending)
            self._writer = cv2.VideoWriter(str(self.path), cv2.VideoWriter_fourcc(*code), VIDEO_RATE, self._size)
            if self._writer.isOpened():
                return
        raise BadArgument(f'video: OpenCV can write neither {" nor ".join(code for _, code in _FORMS)} to {self._base.parent}')
