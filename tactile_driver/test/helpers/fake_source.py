# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A source that plays what a test wants, for the tests of this folder."""
import time

import cv2
import numpy as np

from tactile_driver.frame import Frame
from tactile_driver.sources.source import EndOfSource, Source


def frame(number, size=(4, 6)):
    """A frame of size (height, width) px whose stamp is its number."""
    return Frame(np.full((*size, 3), 9, np.uint8), number, 'bgr8')


def video_of(path, levels):
    """path, with a video of 64 x 48 px at 50 Hz whose frames have these brightnesses."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*'MJPG'), 50.0, (64, 48))
    for level in levels:
        writer.write(np.full((48, 64, 3), level, np.uint8))
    writer.release()
    return path


class FakeSource(Source):
    """Plays a script of frames, their numbers and errors, one in each period, s; then frame after frame where it is live, else it ends.

    make: of a number, what is read; about, known: what it says of itself, and its calibrations. asked: whether each frame that was read
    was wanted; calls: what else was asked of it; open_errors: raised by the next calls of open.
    """

    def __init__(self, script=(), live=True, on_demand=False, period=0.01, make=frame, about=(), known=(None, None)):
        self.script, self.live, self.on_demand, self.period, self.make = list(script), live, on_demand, period, make
        self.about, self.known = {'rate': 0.0, **dict(about)}, known  # Hz; none, which a busy machine would not reach
        self.asked, self.calls, self.open_errors = [], [], []

    def open(self):
        self.calls.append('open')
        if self.open_errors:
            raise self.open_errors.pop(0)

    def read(self, wanted=True):
        time.sleep(self.period)
        self.asked.append(wanted)
        step = self.script.pop(0) if self.script else (len(self.asked) if self.live else EndOfSource('over'))
        if isinstance(step, Exception):
            raise step
        return None if not wanted else self.make(step) if isinstance(step, int) else step

    def close(self):
        self.calls.append('close')

    def calibrations(self):
        return self.known

    def describe(self):
        return self.about

    def set_controls(self, values):
        self.calls.append(values)
