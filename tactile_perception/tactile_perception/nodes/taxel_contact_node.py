# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""taxel_contact_node: taxel images -> contact_region, contacts, slip, wrench, with the reference and its service."""
from __future__ import annotations

import sys

from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Image
from std_srvs.srv import Trigger
from tactile_driver.nodes.run import run_node

from ..pipeline.taxel_parameters import TAXEL_PARAMETERS, grasped_object
from .stage_node import StageNode
from .taxel_stages import RESULTS, TaxelMessages

_STALE_S = 2.0
_QUEUE = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)  # slip is told from motion: frames should not be lost


class TaxelContactNode(StageNode):
    """Tells where and how an object lies in the grasp, whether it slips, and its wrench."""

    with_camera = False

    def __init__(self):
        super().__init__('taxel_contact_node', TAXEL_PARAMETERS, ('image_raw', Image, _QUEUE), RESULTS)
        self.messages = TaxelMessages(self.settings.values())
        self._service = self.create_service(Trigger, 'set_reference', self._set_reference)

    def on_message(self, message: Image) -> dict[str, object]:
        """The contact that one image shows."""
        return self.messages.on_image(message)

    def remarks(self) -> tuple[str, dict]:
        """Whether the reference can be trusted."""
        baseline = self.messages.estimator.baseline
        return baseline.suspicion, {'reference': baseline.suspicion or 'in order', 'noise (values)': baseline.sigma}

    def check_change(self, changes: dict) -> None:
        """The object must stay one. Raises BadArgument."""
        grasped_object(self.settings.values() | changes)

    def apply_change(self, changes: dict) -> None:
        """Take what has become known of the object."""
        self.messages.set_object(changes)

    def _set_reference(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success = self.log.done > 0 and not self.log.age > _STALE_S
        if response.success:
            self.messages.estimator.set_reference()
        response.message = 'the next frame is the new reference; nothing may touch the sensor now' if response.success else \
            'no image comes, so there is nothing to take: subscribe to contacts, and see that image_raw is published'
        return response


def main(args: list[str] | None = None) -> None:
    """The process taxel_contact_node."""
    sys.exit(run_node(TaxelContactNode, args))


if __name__ == '__main__':
    main()
