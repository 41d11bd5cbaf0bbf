# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The demo's numbers: of each frame, as statistics and lines of text, and the frames that become pictures and a video."""
from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from tactile_driver.errors import BadArgument
from tactile_msgs.msg import ContactRegion

from ..parameters.table import VIDEO_RATE
from ..visualization.annotation import contact_line, text_of
from ..visualization.markers import touch_words

_NAN = float('nan')
_RECENT = 90  # frames, 3 s at 30 Hz
_LONGEST_LATENCY_S = 60.0  # chosen: older stamps are those of a recording, of which no latency is known


@dataclass(frozen=True)
class Reading:
    """The results of one frame; unknown is NaN.

    stamp_s: of exposure; latency_s: from exposure to receipt of the last result; words: the results as text; displacement: largest, px;
    area: m^2; depth: m, deepest contact; force: N; slipping: number of slipping dots, of an array the slipping fraction.
    """

    stamp_s: float
    latency_s: float = _NAN
    words: tuple[str, ...] = ()
    displacement: float = _NAN
    area: float = _NAN
    depth: float = _NAN
    force: float = _NAN
    slipping: float = _NAN


class Summary:
    """Rate, latency and maxima of the readings so far, as lines of text. refused: number of messages that failed their check."""

    def __init__(self):
        self.frames = self.refused = 0
        self.first_s = self.last_s = _NAN
        self.largest: dict[str, float] = {}
        self._latencies: list[float] = []
        self._stamps: deque[float] = deque(maxlen=_RECENT)

    def add(self, reading: Reading) -> None:
        """Add one frame."""
        if not self.frames:
            self.first_s = reading.stamp_s
        self.frames, self.last_s = self.frames + 1, reading.stamp_s
        self._stamps.append(reading.stamp_s)
        self._latencies.append(reading.latency_s)
        for name in ('displacement', 'area', 'depth', 'force'):
            value = getattr(reading, name)
            if value > self.largest.get(name, 0.0):
                self.largest[name] = value

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
        units = {'displacement': ('px', 1.0, '.1f'), 'area': ('mm2', 1e6, '.0f'), 'depth': ('mm', 1e3, '.1f'), 'force': ('N', 1.0, '.1f')}
        largest = [f'{name} {factor * self.largest[name]:{form}} {unit}'
                   for name, (unit, factor, form) in units.items() if name in self.largest]
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
        moved = np.hypot(found['dots'].du, found['dots'].dv)
        values['displacement'] = float(np.nanmax(moved)) if np.isfinite(moved).any() else _NAN
    elif 'contact_region' in found:
        words = [contact_line(found, found['contact_region'])]
    elif 'contacts' in found:
        words = [', '.join(touch_words(found)) or ('touched' if found['contacts'].contacts else 'nothing touches')]
    if 'contact_region' in found:
        slipping = np.count_nonzero(np.asarray(found['contact_region'].dot_state) == ContactRegion.SLIPPING)
        values.update(area=found['contact_region'].area, slipping=float(slipping))
    if 'contacts' in found and found['contacts'].contacts:
        values['depth'] = max((c.depth for c in found['contacts'].contacts if np.isfinite(c.depth)), default=_NAN)
        if 'wrench' in found:
            force = found['wrench'].wrench.force
            values['force'] = float(np.linalg.norm((force.x, force.y, force.z)))
        if 'slip' in found and 'dots' not in found:
            values['slipping'] = found['slip'].slipping_fraction
    return Reading(stamp_s, latency_s, tuple(words), **values)


_GAIN = 1.05  # chosen: a frame replaces a picture only if its value is 5 % larger, which spares most copies while a value grows


#: Name of the picture -> value of a frame; the frame with the largest value above 0 is kept.
MOMENTS: dict[str, Callable[[Reading], float]] = {
    'largest_displacement': lambda reading: reading.displacement if reading.displacement > 1.0 else 0.0,
    'largest_contact': lambda reading: reading.area,
    'deepest_contact': lambda reading: reading.depth,
    'most_slip': lambda reading: reading.slipping,
}


@dataclass
class Picture:
    """A frame that is kept. value: that it was selected by; stamp_s: of exposure; image: (H, W, 3) uint8 BGR."""

    value: float
    stamp_s: float
    image: np.ndarray


class Moments:
    """Keeps the frame with the largest value of each of MOMENTS, and the first and the last frame."""

    def __init__(self):
        self.kept: dict[str, Picture] = {}

    def add(self, reading: Reading, image: np.ndarray) -> None:
        """Add one frame with its annotated image (H, W, 3) uint8; the image is kept, not copied."""
        for name, value_of in MOMENTS.items():
            value = float(value_of(reading))
            if math.isfinite(value) and value > 0 and (name not in self.kept or value > _GAIN * self.kept[name].value):
                self.kept[name] = Picture(value, reading.stamp_s, image)
        if 'first' not in self.kept:
            self.kept['first'] = Picture(0.0, reading.stamp_s, image)
        self.kept['last'] = Picture(0.0, reading.stamp_s, image)

    def pictures(self) -> dict[str, Picture]:
        """Name -> picture in the order of time; a frame kept under several names appears once."""
        found: dict[float, str] = {}
        for name, picture in self.kept.items():
            found.setdefault(picture.stamp_s, name)
        return {name: self.kept[name] for _, name in sorted(found.items())}


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
