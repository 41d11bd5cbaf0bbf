# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""taxel_contact_node: taxel images -> contact_region, contacts, slip, wrench, points, with the reference and its service."""
from __future__ import annotations

import sys
from collections.abc import Collection

from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import Image
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.nodes.runtime.run import run_node
from tf2_msgs.msg import TFMessage

from ..errors import BadFrame
from .messages.point_cloud import POINTS
from ..parameters.taxel import TAXEL_PARAMETERS, frames_of, grasped_object
from .stage_node import StageNode
from .stages.taxel import RESULTS, TaxelMessages

_QUEUE = QoSProfile(depth=100)  # chosen; slip is estimated from motion, so no frame should be lost


class TaxelContactNode(StageNode):
    """Estimates the contact regions of a grasped object, its contacts, slip and wrench."""

    with_camera = False
    patience_s = 0.15  # chosen; longer than LONGEST_S, since slip is estimated from frame to frame

    def __init__(self, host: Host | None = None):
        super().__init__('taxel_contact_node', TAXEL_PARAMETERS, TaxelMessages, ('image_raw', Image, _QUEUE), RESULTS | POINTS, host)
        self.offer_reference(lambda: self.stage.estimator.set_reference())
        if frames_of(self.settings.values()):
            latched = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
            for topic, qos in (('/tf', QoSProfile(depth=100)), ('/tf_static', latched)):
                self.create_subscription(TFMessage, topic, self._take_transforms, qos)

    def on_message(self, message: Image, topics: Collection[str]) -> dict[str, object]:
        """The results of one image."""
        return self.stage.on_image(message, topics)

    def remarks(self) -> tuple[str, dict]:
        """Warns of a reference that may have been taken under a touch, and of missing transforms."""
        baseline = self.stage.estimator.baseline
        return self.stage.suspicion, {'reference': baseline.suspicion or 'in order', 'noise (values)': baseline.sigma}

    def check_change(self, changes: dict) -> None:
        """Check that changes describe an object. Raises BadArgument."""
        grasped_object(self.settings.values() | changes)

    def apply_change(self, changes: dict) -> None:
        """Take new properties of the object."""
        self.stage.set_object(changes)

    def _take_transforms(self, message: TFMessage) -> None:
        with self._host.lock:
            try:
                self.stage.on_transforms(message)
            except BadFrame as error:
                self.say.warning('transform', str(error))
            except Exception as error:
                self.net.catch(error, 'tf')


def main(args: list[str] | None = None) -> None:
    """The process taxel_contact_node."""
    sys.exit(run_node(TaxelContactNode, args))


if __name__ == '__main__':
    main()
