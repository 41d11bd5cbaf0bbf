# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A video file or a folder of images as a source, and two of them as two cameras."""
from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from itertools import chain
from pathlib import Path

import cv2
import numpy as np

from ..errors import BadFrame, BadRecording
from ..frame import Frame, PairFrame, frame_of
from ..sources.source import NS, Clock, PlayedSource, natural_key
from .constants import CAMERA

IMAGE_ENDINGS = ('.bmp', '.jpeg', '.jpg', '.pgm', '.png', '.ppm', '.tif', '.tiff', '.webp')
_REMEDY = 'where a player shows it: ffmpeg -i VIDEO -c:v mjpeg -q:v 2 press.avi'

#: Number of a frame, from 0, and what decodes it, before the next one is asked for: the image, or None, and its name
Item = tuple[int, Callable[[], tuple[np.ndarray | None, str]]]


class FileSource(PlayedSource):
    """A video or a folder of images.

    values: as of PlayedSource; a rate of -1 is that of the video (30 for a folder); at 0 frames are stamped at that rate.
    """

    def __init__(self, values: Mapping, clock: Clock):
        super().__init__(values, clock)
        self._number = 0

    def open(self) -> None:
        """Open the recording at its start. Raises BadRecording if it is missing, empty or unreadable."""
        self._number = 0
        super().open()

    def _items(self) -> Iterator[Item]:
        return self._frames(self._path)

    def _frames(self, path: Path) -> Iterator[Item]:
        """The frames of a recording. Raises BadRecording."""
        if not path.exists():
            raise BadRecording(f'path: {path} does not exist; give a video or a folder of images')
        return self._images(path) if path.is_dir() else self._video(path)

    def _images(self, path: Path) -> Iterator[Item]:
        files = sorted((p for p in path.iterdir() if p.suffix.lower() in IMAGE_ENDINGS), key=natural_key)
        if not files:
            raise BadRecording(f'path: {path} holds no image; known endings are {" ".join(IMAGE_ENDINGS)}')
        self._set_rate(CAMERA.default_rate)
        return ((k, lambda file=file: (cv2.imread(str(file), cv2.IMREAD_UNCHANGED), f'image {file}')) for k, file in enumerate(files))

    def _video(self, path: Path) -> Iterator[Item]:
        capture = cv2.VideoCapture(str(path))
        if not capture.isOpened() or not capture.get(cv2.CAP_PROP_FRAME_WIDTH):
            raise BadRecording(f'path: {path} is neither a video that OpenCV can read nor a folder of images; {_REMEDY}')
        rate = capture.get(cv2.CAP_PROP_FPS)
        self._set_rate(rate if 0 < rate < 1e4 else CAMERA.default_rate)
        frames = self._grabbed(capture, str(path))
        first = next(frames, None)
        if first is None:
            raise BadRecording(f'path: {path} is a video without a frame that can be decoded; {_REMEDY}')
        return chain([first], frames)

    def _grabbed(self, capture: cv2.VideoCapture, name: str) -> Iterator[Item]:
        """The frames that can be decoded; the others are counted."""
        def retrieve() -> tuple[np.ndarray | None, str]:
            good, image = capture.retrieve()
            return image if good else None, f'frame {number} of {name}'

        number = 0
        while True:
            # grab fails both at a corrupt frame and at the end: the frame count of the container distinguishes them.
            while not capture.grab():
                if number >= capture.get(cv2.CAP_PROP_FRAME_COUNT):
                    return
                number += 1
                self.corrupt += 1
            yield number, retrieve
            number += 1

    def _set_rate(self, rate: float) -> None:
        """Play at the rate of the recording, Hz, unless another one is asked for."""
        self.rate = self.rate if self.rate > 0 else rate

    def _recorded(self, item: Item) -> tuple[int, Callable]:
        recorded_ns = int(self._number * NS / self.rate)
        self._number += 1
        return recorded_ns, item[1]

    def _frame(self, retrieve: Callable, stamp_ns: int) -> Frame | PairFrame:
        return frame_of(*retrieve(), stamp_ns)


class TwoFilesSource(FileSource):
    """Pairs of the frames of equal number of two recordings. values: as of FileSource, and right_path. Ends with the shorter file."""

    def __init__(self, values: Mapping, clock: Clock):
        super().__init__(values, clock)
        self._right = Path(values['right_path']).expanduser()

    def _items(self) -> Iterator[tuple[int, tuple[Callable, Callable]]]:
        return self._joined(self._frames(self._path), self._frames(self._right))

    def _joined(self, *sides: Iterator[Item]) -> Iterator[tuple[int, tuple[Callable, Callable]]]:
        """The frames of both sides; one whose counterpart is missing is skipped."""
        left, right = (next(side, None) for side in sides)
        while left and right:
            if left[0] == right[0]:
                yield left[0], (left[1], right[1])
            else:
                self.skipped += 1
            first = min(left[0], right[0])
            left = next(sides[0], None) if left[0] == first else left
            right = next(sides[1], None) if right[0] == first else right

    def _frame(self, retrieve: tuple[Callable, Callable], stamp_ns: int) -> PairFrame:
        try:
            return PairFrame(*(frame_of(*each(), stamp_ns) for each in retrieve))
        except BadFrame:
            self.skipped += 1
            raise

    def describe(self) -> dict:
        """Both paths, the rate, Hz, and the number of unpaired frames."""
        return {**super().describe(), 'path': f'{self._path} + {self._right}', 'unpaired': self.skipped}
