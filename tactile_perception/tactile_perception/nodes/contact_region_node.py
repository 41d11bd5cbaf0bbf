# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""contact_region_node: dots -> contact_region, contacts, slip, wrench, points."""
from __future__ import annotations

import sys
from collections.abc import Collection

from tactile_driver.nodes.runtime.host import Host
from tactile_driver.nodes.runtime.ros_defaults import STREAM_QOS
from tactile_driver.nodes.runtime.run import run_node
from tactile_msgs.msg import DotTracks

from .messages.point_cloud import POINTS
from ..parameters.touchpad import REGION_PARAMETERS
from .stage_node import StageNode
from .stages.touchpad import RESULTS, ContactMessages


class ContactRegionNode(StageNode):
    """Estimates which dots are in contact, stick and slip; from them region, contacts, slip and wrench."""

    def __init__(self, host: Host | None = None):
        super().__init__('contact_region_node', REGION_PARAMETERS, ContactMessages, ('dots', DotTracks, STREAM_QOS), RESULTS | POINTS, host)

    def on_message(self, message: DotTracks, topics: Collection[str]) -> dict[str, object]:
        """The results of the dots of one frame."""
        return self.stage.on_dots(message, topics)


def main(args: list[str] | None = None) -> None:
    """The process contact_region_node."""
    sys.exit(run_node(ContactRegionNode, args))


if __name__ == '__main__':
    main()
