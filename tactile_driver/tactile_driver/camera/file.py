# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A video file or a folder of images as a source, and two of them as two cameras."""
from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from ..errors import BadArgument, BadFrame, BadRecording
from ..frame import Frame, PairFrame, frame_of
from ..sources.source import NS, Clock, EndOfSource, EvenPace, Source, stamp_of, wait_until
from .pairs import DualSource

IMAGE_ENDINGS = ('.bmp', '.jpeg', '.jpg', '.pgm', '.png', '.ppm', '.tif', '.tiff', '.webp')
_REMEDY = 'where a player shows it: ffmpeg -i VIDEO -c:v mjpeg -q:v 2 press.avi'
_FOLDER_RATE = 30.0  # Hz, for a folder and for a video without a rate; chosen: the rate of most cameras


def natural_key(path: Path) -> list:
    """Sort key for natural order: frame_2 before frame_10."""
    return [(0, int(part), '') if part.isdigit() else (1, 0, part.lower()) for part in re.split(r'(\d+)', path.name) if part]


class _Folder:
    """The images of a folder in natural order."""

    rate = _FOLDER_RATE

    def __init__(self, path: Path):
        self._files = sorted((p for p in path.iterdir() if p.suffix.lower() in IMAGE_ENDINGS), key=natural_key)
        if not self._files:
            raise BadRecording(f'path: {path} holds no image; known endings are {" ".join(IMAGE_ENDINGS)}')
        self._at = -1
        self.lost = 0

    @property
    def number(self) -> int:
        return self._at

    def grab(self) -> bool:
        """Advance to the next decodable frame; False at the end."""
        self._at += 1
        return self._at < len(self._files)

    def retrieve(self) -> tuple[np.ndarray | None, str]:
        return cv2.imread(str(self._files[self._at]), cv2.IMREAD_UNCHANGED), f'image {self._files[self._at]}'

    def close(self) -> None:
        self._files = []


class _Video:
    """The frames of a video file."""

    def __init__(self, path: Path):
        self._path = path
        self._capture = cv2.VideoCapture(str(path))
        if not self._capture.isOpened() or not self._capture.get(cv2.CAP_PROP_FRAME_WIDTH):
            raise BadRecording(f'path: {path} is neither a video that OpenCV can read nor a folder of images; {_REMEDY}')
        rate = self._capture.get(cv2.CAP_PROP_FPS)
        self.rate = rate if 0 < rate < 1e4 else _FOLDER_RATE
        self._count = max(int(self._capture.get(cv2.CAP_PROP_FRAME_COUNT)), 0)
        self._at = 0
        self.lost = 0
        self._ahead = False  # whether the next frame is grabbed already
        if not self.grab():
            raise BadRecording(f'path: {path} is a video without a frame that can be decoded; {_REMEDY}')
        self._ahead = True

    @property
    def number(self) -> int:
        return self._at - 1

    def grab(self) -> bool:
        """Advance to the next decodable frame; False at the end."""
        if self._ahead:
            self._ahead = False
            return True
        # grab fails both at a corrupt frame and at the end: the frame count of the container distinguishes them.
        while not self._capture.grab():
            if self._at >= self._count:
                return False
            self._at += 1
            self.lost += 1
        self._at += 1
        return True

    def retrieve(self) -> tuple[np.ndarray | None, str]:
        good, image = self._capture.retrieve()
        return image if good else None, f'frame {self._at - 1} of {self._path}'

    def close(self) -> None:
        self._capture.release()


class FileSource(Source):
    """A video or a folder of images.

    rate: Hz; -1: rate of the video (30 for a folder); 0: as fast as consumed, stamped at the rate of the video; loop: restart at the end;
    clock: returns the time for the stamps, ns. Raises BadArgument for an empty path.
    """

    def __init__(self, path: str, rate: float, loop: bool, clock: Clock):
        if not path:
            raise BadArgument('path: source file needs the path of a video or of a folder of images')
        self.on_demand = rate == 0
        self._path, self._asked_rate, self._loop, self._clock = Path(path).expanduser(), rate, loop, clock
        self._reader = self._pace = self._first_stamp = None
        self._number = 0

    @property
    def rate(self) -> float:
        """Frame rate of the recording, Hz."""
        return self._asked_rate if self._asked_rate > 0 else self._reader.rate if self._reader else _FOLDER_RATE

    @property
    def number(self) -> int:
        """Index of the last frame read, from 0; undecodable frames are counted."""
        return self._reader.number

    def open(self) -> None:
        """Open the recording at its start. Raises BadRecording if it is missing, empty or unreadable."""
        self.close()
        self._start()
        self._pace = None if self.on_demand else EvenPace(self.rate, skip=False)
        self._first_stamp, self._number = None, 0

    def rewind(self) -> None:
        """Return to the start; due times and stamps continue. Raises as open does."""
        self._reader.close()
        self._start()

    def _start(self) -> None:
        if not self._path.exists():
            raise BadRecording(f'path: {self._path} does not exist; give a video or a folder of images')
        self._reader = _Folder(self._path) if self._path.is_dir() else _Video(self._path)
        self.corrupt += self._reader.lost

    def read(self, wanted: bool = True) -> Frame | None:
        """The next frame, decoded ahead and returned when it is due; None if not wanted. Raises EndOfSource, or BadFrame for an undecodable
        image."""
        self._advance()
        self._number += 1
        due = self._pace.next() if self._pace is not None else 0
        image = self._reader.retrieve() if wanted else None
        wait_until(due)
        return frame_of(*image, self._stamp(due)) if image is not None else None

    def _advance(self) -> None:
        if self._reader is None or not self._grab():
            if self._reader is None or not self._loop:
                raise EndOfSource(f'{self._path} is over after {self._number} frames')
            self.rewind()
            if not self._grab():
                raise BadRecording(f'path: no frame of {self._path} can be decoded')

    def _grab(self) -> bool:
        lost = self._reader.lost
        good = self._reader.grab()
        self.corrupt += self._reader.lost - lost
        return good

    def _stamp(self, due: int) -> int:
        if self._pace is not None:
            return stamp_of(due, self._clock)
        if self._first_stamp is None:
            self._first_stamp = self._clock() - int((self._number - 1) * NS / self.rate)
        return self._first_stamp + int((self._number - 1) * NS / self.rate)

    def close(self) -> None:
        """Close the recording."""
        if self._reader is not None:
            self._reader.close()
        self._reader = None

    def describe(self) -> dict:
        """The path and the rate."""
        return {'source': 'file', 'path': str(self._path), 'rate': self.rate, 'loop': self._loop}


class TwoFilesSource(DualSource):
    """Pairs of two files. left, right: paths; rate, loop, clock: as in FileSource, rate -1 is that of the left file. Ends with the shorter
    file."""

    def __init__(self, left: str, right: str, rate: float, loop: bool, clock: Clock):
        self._left = FileSource(left, rate, False, clock)
        self._right = FileSource(right, 0, False, clock)
        self.on_demand, self._loop, self._unpaired, self._read = self._left.on_demand, loop, 0, False

    def open(self) -> None:
        """Open both at the start. Raises BadRecording as FileSource.open does."""
        self._left.open()
        self._right.open()
        self._read = False

    def read(self, wanted: bool = True) -> PairFrame | None:
        """The next pair, when it is due; None if not wanted. Raises EndOfSource, or BadFrame if one of the two cannot be decoded."""
        try:
            pair = self._next(wanted)
        except EndOfSource:
            if not self._loop or not self._read:
                raise
            self._left.rewind()
            self._right.rewind()
            pair = self._next(wanted)
        self._read = True
        return pair

    def _next(self, wanted: bool) -> PairFrame | None:
        """The next two frames of equal number; a frame whose counterpart is corrupt is skipped."""
        right = self._right.read(wanted)  # first, because only the left read waits until the frame is due
        try:
            left = self._left.read(wanted)
        except BadFrame:
            self._unpaired += 1
            raise
        while self._left.number != self._right.number:
            self._unpaired += 1
            if self._left.number < self._right.number:
                left = self._left.read(wanted)
            else:
                right = self._right.read(wanted)
        return PairFrame(left, replace(right, stamp_ns=left.stamp_ns)) if wanted else None

    def close(self) -> None:
        """Close both."""
        self._left.close()
        self._right.close()

    @property
    def skipped(self) -> int:
        """Number of unpaired frames."""
        return self._unpaired

    @property
    def corrupt(self) -> int:
        """Number of frames of both files that could not be decoded."""
        return self._left.corrupt + self._right.corrupt

    def describe(self) -> dict:
        """Both paths, the rate, Hz, and the number of unpaired frames."""
        left, right = self._left.describe(), self._right.describe()
        return {**left, 'path': f'{left["path"]} + {right["path"]}', 'unpaired': self._unpaired}
