# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""psd_contact_node: voltages of a PSD finger -> contacts, with the reference and its service."""
from __future__ import annotations

import sys
from collections.abc import Collection

from rclpy.qos import QoSProfile
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.nodes.runtime.run import run_node
from tactile_msgs.msg import Contacts, PsdVoltages

from ..parameters.psd import PSD_PARAMETERS
from .stage_node import StageNode
from .stages.psd import PsdMessages

_QUEUE = QoSProfile(depth=200)  # a second of blocks: no sample may be lost; chosen
_LONGEST_S = 3600.0  # of a block: a longer one has no valid sample_period; chosen


class PsdContactNode(StageNode):
    """Estimates the contacts of a PSD finger and their covariances."""

    with_camera = False

    def __init__(self, host: Host | None = None):
        super().__init__('psd_contact_node', PSD_PARAMETERS, PsdMessages, ('voltages', PsdVoltages, _QUEUE), {'contacts': Contacts}, host)
        self.offer_reference(lambda: self.stage.stage.set_reference())

    def on_message(self, message: PsdVoltages, topics: Collection[str]) -> dict[str, object]:
        """The contacts of one block."""
        return {'contacts': self.stage.on_voltages(message)}

    def covered_ns(self, message: PsdVoltages) -> int:
        """Duration of a block, ns; 0 where sample_period is not valid."""
        seconds = len(message.voltages) / 4 * message.sample_period
        return round(seconds * 1e9) if 0 < seconds < _LONGEST_S else 0

    def remarks(self) -> tuple[str, dict]:
        """Warns of outputs that are stuck."""
        suspicion, reference = self.stage.stage.suspicion, self.stage.stage.finger.reference
        return suspicion, {'reference': 'in order' if reference.ready else 'being taken', 'noise of the sum (V)': reference.sigma}


def main(args: list[str] | None = None) -> None:
    """The process psd_contact_node."""
    sys.exit(run_node(PsdContactNode, args))


if __name__ == '__main__':
    main()
