# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""contact_point_node: dots of a sheet or a dome -> contacts, contact_region, wrench, points."""
from __future__ import annotations

import sys
from collections.abc import Collection

from tactile_driver.nodes.runtime.host import Host
from tactile_driver.nodes.runtime.ros_defaults import STREAM_QOS
from tactile_driver.nodes.runtime.run import run_node
from tactile_msgs.msg import DotTracks

from .messages.point_cloud import POINTS
from ..press.parameters import POINT_PARAMETERS
from .stage_node import StageNode
from .stages.markers import RESULTS, TouchMessages


class ContactPointNode(StageNode):
    """Estimates the touches of a sheet or a dome: positions, depths, covariances, wrench."""

    def __init__(self, host: Host | None = None):
        super().__init__('contact_point_node', POINT_PARAMETERS, TouchMessages, ('dots', DotTracks, STREAM_QOS), RESULTS | POINTS, host)

    def on_message(self, message: DotTracks, topics: Collection[str]) -> dict[str, object]:
        """The results of the markers of one frame."""
        return self.stage.on_dots(message, topics)


def main(args: list[str] | None = None) -> None:
    """The process contact_point_node."""
    sys.exit(run_node(ContactPointNode, args))


if __name__ == '__main__':
    main()
