# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The node that runs a Stage: its input, outputs, parameters, reference service and health."""
from __future__ import annotations

from collections.abc import Collection
from typing import ClassVar

from rclpy.qos import QoSProfile
from tactile_driver.nodes.runtime.host import Host

from .nodes.shedding import LONGEST_S
from .nodes.stage_node import StageNode
from .stage import Stage


class PerceptionNode(StageNode):
    """Runs stage_type. A sensor's node is this class with its stage."""

    stage_type: ClassVar[type[Stage]]

    def __init__(self, host: Host | None = None):
        stage = self.stage_type
        self.with_camera, self.patience_s = stage.takes_camera, stage.input.patience_s or LONGEST_S
        source = stage.input.topic, stage.input.type, QoSProfile(depth=stage.input.depth)
        super().__init__(stage.node, stage.parameters, stage, source, dict(stage.outputs), host)
        self.offer_reference(lambda: self.stage.set_reference())

    def on_message(self, message, topics: Collection[str]) -> dict[str, list]:
        """The stage's estimates."""
        return self.stage.process(message, topics)

    def covered_ns(self, message) -> int:
        """See Stage."""
        return self.stage.covered_ns(message)

    def remarks(self) -> tuple[str, dict]:
        """The stage's health."""
        return self.stage.health()

    def reset_stage(self) -> None:
        """Drop all earlier messages."""
        self.stage.reset()
