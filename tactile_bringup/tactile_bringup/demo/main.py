# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""demo: prints the results of one sensor in the terminal, writes annotated pictures and a video, and ends by itself."""
from __future__ import annotations

import math
import sys
import time
from pathlib import Path

import cv2
from geometry_msgs.msg import WrenchStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Image
from tactile_driver.errors import BadArgument, TactileError
from tactile_driver.nodes.messages.conversions import stamp_ns_of
from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.nodes.runtime.diagnostics import LogOnce
from tactile_driver.nodes.runtime.parameter_server import NodeParameters
from tactile_driver.nodes.runtime.run import run_node
from tactile_driver.nodes.runtime.ros_defaults import steady_timer
from tactile_msgs.msg import ContactRegion, Contacts, DotTracks, Slip
from tactile_perception.nodes.messages.conversions import check_message, stamp_seconds

from .summary import Moments, Reading, Summary, Video, reading_of
from ..parameters.table import DEMO_PARAMETERS
from ..nodes.drawing_node import StampSync

_TOPICS = {'dots': DotTracks, 'contact_region': ContactRegion, 'contacts': Contacts, 'slip': Slip, 'wrench': WrenchStamped}
_QUEUE = QoSProfile(depth=30)
_CHECK_S = 0.25  # between two checks for the end
_LINE_S = 1.0  # between two lines
_SILENCE_S = 3.0  # chosen: without a frame for so long the recording has ended or the device is lost
_PICTURE, _READING = 'image_annotated', 'reading'


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
        self._summary, self._moments, self._video = Summary(), Moments(), Video(self._out / 'demo.mp4')
        self._reading: Reading | None = None
        self._begin_s = self._arrival_s = time.monotonic()
        self._drawn_s, self._shown = -math.inf, None
        self._expected: set[str] = set()
        self._sync = StampSync(self._on_results, lambda: self._expected or _TOPICS)
        self._picture_sync = StampSync(self._on_picture, lambda: (_READING, _PICTURE))
        self._log = LogOnce(self)
        for topic, kind in {**_TOPICS, _PICTURE: Image}.items():
            self.create_subscription(kind, topic, lambda message, topic=topic: self._on_message(topic, message), _QUEUE)
        steady_timer(self, _CHECK_S, self._look)

    def destroy_node(self) -> None:
        """Print the summary and write the pictures first."""
        self._finish()
        super().destroy_node()

    def _on_message(self, topic: str, message) -> None:
        """Show a message; one that fails its check is counted, logged once and skipped."""
        try:
            check_message(message)
            self._add(topic, message)
        except TactileError as error:
            self._summary.refused += 1
            self._log.error(topic, f'message of {topic} refused: {error}')
        else:
            self._log.settle(topic)

    def _add(self, topic: str, message) -> None:
        stamp_ns = stamp_ns_of(message.header)
        if topic == _PICTURE:
            self._picture_sync.add(topic, stamp_ns, image_to_array(message))
        else:
            self._sync.add(topic, stamp_ns, message)

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
            self._moments.add(found[_READING], found[_PICTURE])
            self._video.add(found[_READING].stamp_s, found[_PICTURE])

    def _look(self) -> None:
        """Print the numbers; end the demo when its time is over or the source has ended."""
        self._expected = {topic for topic in _TOPICS if self.count_publishers(topic)}
        now = time.monotonic()
        if self._reading is not None:
            self._show(now)
        over = now - self._arrival_s > _SILENCE_S if self._reading else now - self._begin_s > self._settings['patience']
        limit = self._settings['seconds']
        if over or (self._reading and 0 < limit <= self._summary.last_s - self._summary.first_s):
            self._over = True
            raise KeyboardInterrupt  # ends run_node's spinning as Ctrl-C does

    def _show(self, now: float) -> None:
        if now - self._drawn_s >= _LINE_S and self._reading is not self._shown:
            print(self._summary.line(self._reading), flush=True)
            self._drawn_s, self._shown = now, self._reading

    def _finish(self) -> None:
        self._video.close()
        if self._reading is None and not self._over:
            return
        if self._reading is None:
            missing = [t for t in (*_TOPICS, _PICTURE) if not self.count_publishers(t)] if self.context.ok() else []
            self.failed = (f'no frame in {time.monotonic() - self._begin_s:.0f} s: see the messages above; check the source, and that the '
                           'parameters rows, columns and polarity fit the images.'
                           + (f' No publisher of {", ".join(missing)}.' if missing else ''))
            print(f'demo: {self.failed}', file=sys.stderr, flush=True)
            return
        print('\n'.join(self._summary.report()), flush=True)
        for name, (stamp_s, image) in self._moments.pictures().items():
            path = self._out / f'{name}.png'
            cv2.imwrite(str(path), image)
            print(f'{stamp_s - self._summary.first_s:5.1f} s  {name:21s} {path}', flush=True)
        if self._video.frames:
            print(f'         video                 {self._video.path}', flush=True)


def main(args: list[str] | None = None) -> None:
    """Run the process demo; exit code 1 when no frame was shown."""
    made = []

    def make() -> DemoNode:
        made.append(DemoNode())
        return made[0]

    code = run_node(make, args)
    sys.exit(code or (1 if made and made[0].failed else 0))


if __name__ == '__main__':
    main()
