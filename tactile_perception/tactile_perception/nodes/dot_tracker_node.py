# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""dot_tracker_node: image_raw -> dots, with the reference and its service."""
from __future__ import annotations

import sys
from collections.abc import Callable, Collection

from sensor_msgs.msg import Image, TimeReference
from tactile_driver.frame_names import sensor_frame
from tactile_driver.nodes.messages.conversions import RIGHT_TIME
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.nodes.runtime.run import run_node
from tactile_msgs.msg import DotTracks

from ..parameters.touchpad import DOT_PARAMETERS
from .stage_node import CAMERA_QUEUE, StageNode
from .stages.touchpad import DotMessages


class DotTrackerNode(StageNode):
    """Detects and indexes the printed dots and places them in 3D; while nobody subscribes to dots it keeps its reference."""

    def __init__(self, host: Host | None = None):
        super().__init__('dot_tracker_node', DOT_PARAMETERS, self._made, ('image_raw', Image, CAMERA_QUEUE), {'dots': DotTracks}, host)
        self.offer_reference(lambda: self.stage.set_reference())

    def _made(self, values: dict) -> DotMessages:
        return DotMessages({**values, 'frame_id': values['frame_id'] or sensor_frame(self.get_namespace())})

    def listen_beside(self) -> list[Callable[[], None]]:
        """Of two cameras: when the right view of each picture was exposed."""
        if not self.stage.two_cameras:
            return []
        return [self._host.listen(self, TimeReference, RIGHT_TIME, self._take_right_time, CAMERA_QUEUE)]

    def _take_right_time(self, message: TimeReference, _received_ns: int) -> None:
        with self._host.lock:
            self.try_to(lambda: self.stage.on_right_time(message), RIGHT_TIME)

    def on_message(self, message: Image, topics: Collection[str]) -> dict[str, object]:
        """The dots of one image."""
        dots = self.stage.on_image(message)
        if self.stage.suspicion:
            self.say.warning('reference', self.stage.suspicion)
        else:
            self.say.forget('reference')
        return {'dots': dots}

    def remarks(self) -> tuple[str, dict]:
        """Warns of a reference that may have been taken under a touch."""
        suspicion = self.stage.suspicion
        return suspicion, {'reference': suspicion or 'in order'}


def main(args: list[str] | None = None) -> None:
    """The process dot_tracker_node."""
    sys.exit(run_node(DotTrackerNode, args))


if __name__ == '__main__':
    main()
