# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""demo: prints the results of one sensor in the terminal, writes annotated pictures and a video, and ends by itself."""
from __future__ import annotations

import math
import sys
import time
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
from geometry_msgs.msg import WrenchStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Image

from tactile_driver.errors import BadArgument, TactileError
from tactile_driver.nodes.messages.conversions import stamp_ns_of
from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.nodes.runtime.diagnostics import LogOnce
from tactile_driver.nodes.runtime.parameter_server import NodeParameters
from tactile_driver.nodes.runtime.ros_defaults import steady_timer
from tactile_driver.nodes.runtime.run import exit_process, run_node
from tactile_msgs.msg import ContactRegion, Contacts, DotTracks, Slip
from tactile_perception.core.messages import check_message, stamp_seconds

from .constants import DEMO
from .nodes.drawing_node import StampSync
from .parameters.table import DEMO_PARAMETERS, VIDEO_RATE
from .visualization.pictures import lines_of

_TOPICS = {'dots': DotTracks, 'contact_region': ContactRegion, 'contacts': Contacts, 'slip': Slip, 'wrench': WrenchStamped}
_PICTURE, _READING = 'image_annotated', 'reading'
#: Value of a frame -> name of the picture of the frame where it is largest; unit, factor and format of the value in the report.
VALUES = {'displacement': ('largest_displacement', 'px', 1.0, '.1f'), 'area': ('largest_contact', 'mm2', 1e6, '.0f'),
          'depth': ('deepest_contact', 'mm', 1e3, '.1f')}


@dataclass(frozen=True)
class Reading:
    """The results of one frame.

    stamp_s: of exposure; latency_s: from exposure to receipt of the last result; words: the results as text; values: those of VALUES that
    are known: largest displacement, px, area, m^2, depth of the deepest contact, m.
    """

    stamp_s: float
    latency_s: float
    words: list[str] = field(default_factory=list)
    values: Mapping[str, float] = field(default_factory=dict)


def reading_of(found: Mapping, stamp_s: float, latency_s: float) -> Reading:
    """The numbers of a frame. found: topic (dots, contact_region, contacts, slip, wrench) -> message that passed check_message; any may
    be missing."""
    values = {}
    if 'dots' in found:
        values['displacement'] = np.nanmax(np.hypot(found['dots'].du, found['dots'].dv), initial=0.0)
    if 'contact_region' in found:
        values['area'] = found['contact_region'].area
    if 'contacts' in found:
        values['depth'] = max((c.depth for c in found['contacts'].contacts if np.isfinite(c.depth)), default=0.0)
    return Reading(stamp_s, latency_s, lines_of(found), values)


class Summary:
    """Rate, latency and maxima of the readings so far as lines of text, with pictures.

    The pictures are the first, the last and those where one of VALUES is largest. refused: number of messages that failed their check.
    """

    def __init__(self):
        self.frames = self.refused = 0
        self.first_s = self.last_s = math.nan
        self._largest: dict[str, float] = {}
        self._latencies: list[float] = []
        self._stamps: deque[float] = deque(maxlen=DEMO.recent_frames)
        self._shown: dict[str, float] = {}  # as _largest, of the frames with a picture
        self._kept: dict[str, tuple[float, np.ndarray]] = {}

    def add(self, reading: Reading) -> None:
        """Add one frame."""
        self.first_s = self.first_s if self.frames else reading.stamp_s
        self.frames, self.last_s = self.frames + 1, reading.stamp_s
        self._stamps.append(reading.stamp_s)
        self._latencies.append(reading.latency_s if abs(reading.latency_s) < DEMO.max_latency_s else math.nan)
        self._larger(self._largest, reading)

    def add_picture(self, reading: Reading, image: np.ndarray) -> None:
        """Add the annotated image (H, W, 3) uint8 of a frame; it is kept, not copied."""
        for name in self._larger(self._shown, reading):
            self._kept[VALUES[name][0]] = reading.stamp_s, image
        self._kept.setdefault('first', (reading.stamp_s, image))
        self._kept['last'] = reading.stamp_s, image

    @staticmethod
    def _larger(largest: dict[str, float], reading: Reading) -> list[str]:
        """The values that are larger than before; they are the largest now."""
        larger = {name: value for name, value in reading.values.items() if value > largest.get(name, 0.0)}
        largest.update(larger)
        return list(larger)

    def line(self, reading: Reading) -> str:
        """One line for a log, with rate and latency of the last 90 frames."""
        span = self._stamps[-1] - self._stamps[0]
        rate = (len(self._stamps) - 1) / span if span > 0 else math.nan
        return ' | '.join([f'{reading.stamp_s - self.first_s:5.1f} s', *filter(None, reading.words),
                           f'{_number(rate, ".0f")} Hz, {_milliseconds(self._latencies[-DEMO.recent_frames:], 50)} ms'])

    def report(self) -> list[str]:
        """The last lines: frames, rate, latency, maxima, refused messages."""
        largest = [f'{name} {factor * self._largest[name]:{form}} {unit}' for name, (_, unit, factor, form) in VALUES.items()
                   if name in self._largest]
        rate = (self.frames - 1) / (self.last_s - self.first_s) if self.last_s > self.first_s else math.nan
        return [f'{self.frames} frames, {_number(rate, ".1f")} Hz, latency {_milliseconds(self._latencies, 50)} ms '
                f'(95 %: {_milliseconds(self._latencies, 95)} ms)', 'largest ' + (', '.join(largest) or 'values unknown'),
                *([f'refused messages: {self.refused}, see above'] if self.refused else [])]

    def pictures(self) -> dict[str, tuple[float, np.ndarray]]:
        """Name -> (stamp s, image), in the order of time; a frame kept under several names appears once."""
        once = {stamp: name for name, (stamp, _) in reversed(self._kept.items())}
        return {name: self._kept[name] for _, name in sorted(once.items())}


def _number(value: float, form: str) -> str:
    """The value formatted, or '-' when unknown."""
    return format(value, form) if math.isfinite(value) else '-'


def _milliseconds(latencies: list[float], percent: float) -> str:
    """Percentile of those that are known."""
    known = [latency for latency in latencies if not math.isnan(latency)]
    return f'{1e3 * np.percentile(known, percent):.0f}' if known else '-'


class Video:
    """Writes frames by their stamps at 15 frames/s as MP4, path, once there is one."""

    def __init__(self, path: Path):
        self.path, self.frames = path, 0
        self._writer: cv2.VideoWriter | None = None

    def add(self, stamp_s: float, image: np.ndarray) -> None:
        """Add a frame (H, W, 3) uint8 BGR; it is skipped when the video has a frame of that time. Raises BadArgument without a codec."""
        if self._writer is None:
            self._size, self._first_s = image.shape[1::-1], stamp_s
            self._writer = cv2.VideoWriter(str(self.path), cv2.VideoWriter_fourcc(*'mp4v'), VIDEO_RATE, self._size)
            if not self._writer.isOpened():
                raise BadArgument(f'video: OpenCV cannot write {self.path}; check that there is room on the disk')
        due = int((stamp_s - self._first_s) * VIDEO_RATE + 0.5) + 1
        if image.shape[1::-1] != self._size or due <= self.frames:
            return
        for _ in range(min(due - self.frames, DEMO.max_still_frames)):
            self._writer.write(image)
        self.frames = due

    def close(self) -> None:
        """Finish the file."""
        if self._writer is not None:
            self._writer.release()


class DemoNode(Node):
    """Shows one sensor until `seconds` have passed or no frame has come for 3 s.

    failed: why no frame was shown; '' when one was, or when the demo was interrupted before the first. Raises BadArgument for a wrong
    parameter or a folder that cannot be made.
    """

    def __init__(self):
        super().__init__('demo')
        self._settings = NodeParameters(self, DEMO_PARAMETERS)
        if self._settings.problems:
            raise BadArgument('demo: ' + '; '.join(self._settings.problems.values()))
        self._out = Path(self._settings['out']).expanduser().absolute()
        try:
            self._out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise BadArgument(f'parameter out: {self._out} cannot be made: {error}') from error
        self.failed, self._over = '', False
        self._summary, self._video = Summary(), Video(self._out / 'demo.mp4')
        self._reading: Reading | None = None
        self._arrival_s = time.monotonic()
        self._drawn_s, self._shown = -math.inf, None
        self._expected: set[str] = set()
        self._sync = StampSync(self._on_results, lambda: self._expected or _TOPICS)
        self._picture_sync = StampSync(self._on_picture, lambda: (_READING, _PICTURE))
        self._log = LogOnce(self)
        for topic, kind in {**_TOPICS, _PICTURE: Image}.items():
            self.create_subscription(kind, topic, lambda message, topic=topic: self._on_message(topic, message), QoSProfile(depth=30))
        steady_timer(self, DEMO.check_s, self._check)

    def destroy_node(self) -> None:
        """Print the summary and write the pictures first."""
        self._finish()
        super().destroy_node()

    def _on_message(self, topic: str, message) -> None:
        """Show a message; one that fails its check is counted, logged once and skipped."""
        try:
            check_message(message)
            if topic == _PICTURE:
                self._picture_sync.add(topic, stamp_ns_of(message.header), image_to_array(message))
            else:
                self._sync.add(topic, stamp_ns_of(message.header), message)
        except TactileError as error:
            self._summary.refused += 1
            self._log.error(topic, f'message of {topic} refused: {error}')
        else:
            self._log.settle(topic)

    def _on_results(self, found: dict) -> None:
        header = next(iter(found.values())).header
        stamp_s = stamp_seconds(header)
        self._reading = reading_of(found, stamp_s, 1e-9 * self.get_clock().now().nanoseconds - stamp_s)
        self._arrival_s = time.monotonic()
        self._summary.add(self._reading)
        self._picture_sync.add(_READING, stamp_ns_of(header), self._reading)

    def _on_picture(self, found: dict) -> None:
        """Keep a picture with the numbers of its frame; not every frame has one."""
        if len(found) == 2:
            self._summary.add_picture(found[_READING], found[_PICTURE])
            self._video.add(found[_READING].stamp_s, found[_PICTURE])

    def _check(self) -> None:
        """Print the numbers; end the demo when its time is over or the source has ended."""
        self._expected = {topic for topic in _TOPICS if self.count_publishers(topic)}
        now, reading, limit = time.monotonic(), self._reading, self._settings['seconds']
        if reading is not None and now - self._drawn_s >= DEMO.line_s and reading is not self._shown:
            print(self._summary.line(reading), flush=True)
            self._drawn_s, self._shown = now, reading
        if now - self._arrival_s > (DEMO.silence_s if reading else self._settings['patience']) or (
                reading and 0 < limit <= self._summary.last_s - self._summary.first_s):
            self._over = True
            raise KeyboardInterrupt  # ends run_node's spinning as Ctrl-C does

    def _finish(self) -> None:
        self._video.close()
        if self._reading is None and self._over:
            missing = [t for t in (*_TOPICS, _PICTURE) if not self.count_publishers(t)] if self.context.ok() else []
            self.failed = (f'no frame arrived within {time.monotonic() - self._arrival_s:.0f} s; see the messages above, and check the '
                           'source and whether the parameters rows, columns and polarity fit the images.'
                           + (f' No publisher of {", ".join(missing)}.' if missing else ''))
            print(f'demo: {self.failed}', file=sys.stderr, flush=True)
        if self._reading is None:
            return
        print('\n'.join(self._summary.report()), flush=True)
        for name, (stamp_s, image) in self._summary.pictures().items():
            path = self._out / f'{name}.png'
            cv2.imwrite(str(path), image)
            print(f'{stamp_s - self._summary.first_s:5.1f} s  {name:21s} {path}', flush=True)
        if self._video.frames:
            print(f'         video                 {self._video.path}', flush=True)


def main(args: list[str] | None = None) -> None:
    """The process demo; exit code 1 when no frame was shown."""
    exit_process(lambda: _run(args))


def _run(args: list[str] | None) -> int:
    made = []

    def make() -> DemoNode:
        made.append(DemoNode())
        return made[0]

    code = run_node(make, args)
    return code or (1 if made and made[0].failed else 0)
