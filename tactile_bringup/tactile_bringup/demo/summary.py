# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The demo's numbers: of each frame, as statistics and lines of text, and the frames that become pictures and a video."""
from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
from tactile_driver.errors import BadArgument

from ..parameters.table import VIDEO_RATE
from ..visualization.annotation import contact_line, text_of
from ..visualization.markers import touch_words

_NAN = float('nan')
_RECENT = 90  # frames, 3 s at 30 Hz
_LONGEST_LATENCY_S = 60.0  # chosen: older stamps are those of a recording, of which no latency is known
#: Value of a frame -> name of the picture of the frame where it is largest; unit, factor and format of the value in the report.
VALUES = {'displacement': ('largest_displacement', 'px', 1.0, '.1f'), 'area': ('largest_contact', 'mm2', 1e6, '.0f'),
          'depth': ('deepest_contact', 'mm', 1e3, '.1f')}


@dataclass(frozen=True)
class Reading:
    """The results of one frame.

    stamp_s: of exposure; latency_s: from exposure to receipt of the last result, NaN unknown; words: the results as text; values: those of
    VALUES that are known: largest displacement, px, area, m^2, depth of the deepest contact, m.
    """

    stamp_s: float
    latency_s: float = _NAN
    words: tuple[str, ...] = ()
    values: Mapping[str, float] = field(default_factory=dict)


class Summary:
    """Rate, latency and maxima of the readings so far, as lines of text. refused: number of messages that failed their check."""

    def __init__(self):
        self.frames = self.refused = 0
        self.first_s = self.last_s = _NAN
        self._largest: dict[str, float] = {}
        self._latencies: list[float] = []
        self._stamps: deque[float] = deque(maxlen=_RECENT)

    def add(self, reading: Reading) -> None:
        """Add one frame."""
        if not self.frames:
            self.first_s = reading.stamp_s
        self.frames, self.last_s = self.frames + 1, reading.stamp_s
        self._stamps.append(reading.stamp_s)
        self._latencies.append(reading.latency_s)
        for name, value in reading.values.items():
            if value > self._largest.get(name, 0.0):
                self._largest[name] = value

    @property
    def rate(self) -> float:
        """Frames per second over the last 90 frames, by their stamps; NaN before the third."""
        span = self._stamps[-1] - self._stamps[0] if len(self._stamps) > 2 else 0.0
        return (len(self._stamps) - 1) / span if span > 0 else _NAN

    def latency_ms(self, percent: float, lately: bool = True) -> float:
        """Percentile of the latency, ms, over the last 90 frames or over all."""
        kept = self._latencies[-_RECENT:] if lately else self._latencies
        kept = [x for x in kept if abs(x) < _LONGEST_LATENCY_S]  # NaN is not
        return 1e3 * float(np.percentile(kept, percent)) if kept else _NAN

    def line(self, reading: Reading) -> str:
        """One line for a log."""
        parts = [f'{reading.stamp_s - self.first_s:5.1f} s', *reading.words, f'{number(self.rate, ".0f")} Hz, '
                 f'{number(self.latency_ms(50), ".0f")} ms']
        return ' | '.join(filter(None, parts))

    def report(self) -> list[str]:
        """The last lines: frames, rate, latency, maxima, refused messages."""
        largest = [f'{name} {factor * self._largest[name]:{form}} {unit}' for name, (_, unit, factor, form) in VALUES.items()
                   if name in self._largest]
        mean = (self.frames - 1) / (self.last_s - self.first_s) if self.last_s > self.first_s else _NAN
        return [f'{self.frames} frames, {number(mean, ".1f")} Hz, latency {number(self.latency_ms(50, False), ".0f")} ms '
                f'(95 %: {number(self.latency_ms(95, False), ".0f")} ms)', 'largest ' + (', '.join(largest) or 'values unknown'),
                *([f'refused messages: {self.refused}, see above'] if self.refused else [])]


def number(value: float, form: str) -> str:
    """The value formatted, or '-' when unknown."""
    return format(value, form) if math.isfinite(value) else '-'


def reading_of(found: Mapping, stamp_s: float, latency_s: float) -> Reading:
    """The numbers of a frame. found: topic (dots, contact_region, contacts, slip, wrench) -> message that passed check_message; any may
    be missing."""
    words, values = text_of(found) if 'dots' in found else [], {}
    if 'dots' in found:
        values['displacement'] = np.nanmax(np.hypot(found['dots'].du, found['dots'].dv), initial=0.0)
    elif 'contact_region' in found:
        words = [contact_line(found, found['contact_region'])]
    elif 'contacts' in found:
        words = [', '.join(touch_words(found)) or ('touched' if found['contacts'].contacts else 'nothing touches')]
    if 'contact_region' in found:
        values['area'] = found['contact_region'].area
    if 'contacts' in found:
        values['depth'] = max((c.depth for c in found['contacts'].contacts if np.isfinite(c.depth)), default=0.0)
    return Reading(stamp_s, latency_s, tuple(words), values)


class Moments:
    """The first and the last frame, and the one where each of VALUES is largest. kept: name of the picture -> (stamp s, image)."""

    def __init__(self):
        self.kept: dict[str, tuple[float, np.ndarray]] = {}
        self._largest: dict[str, float] = {}

    def add(self, reading: Reading, image: np.ndarray) -> None:
        """Add one frame with its annotated image (H, W, 3) uint8; the image is kept, not copied."""
        for name, value in reading.values.items():
            if value > self._largest.get(name, 0.0):
                self._largest[name], self.kept[VALUES[name][0]] = value, (reading.stamp_s, image)
        self.kept.setdefault('first', (reading.stamp_s, image))
        self.kept['last'] = reading.stamp_s, image

    def pictures(self) -> dict[str, tuple[float, np.ndarray]]:
        """Those kept, in the order of time; a frame kept under several names appears once."""
        once = {stamp: name for name, (stamp, _) in reversed(self.kept.items())}
        return {name: self.kept[name] for _, name in sorted(once.items())}


_LONGEST_STILL = 30  # frames, 2 s: a longer gap in the stamps is cut to this


class Video:
    """Writes frames by their stamps at 15 frames/s as MP4, path, once there is one."""

    def __init__(self, path: Path):
        self.path = path
        self._writer: cv2.VideoWriter | None = None
        self._size: tuple[int, int] | None = None
        self._first_s = 0.0
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
        self._writer = cv2.VideoWriter(str(self.path), cv2.VideoWriter_fourcc(*'mp4v'), VIDEO_RATE, self._size)
        if not self._writer.isOpened():
            raise BadArgument(f'video: OpenCV cannot write {self.path}; see whether there is room')
