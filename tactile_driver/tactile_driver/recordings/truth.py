# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Ground truth as it was recorded. Drivers import it at every start, and rosbag2 only for a bag."""
from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class RecordedTruth:
    """messages: (name of the topic under ground_truth/, serialised message), as recorded with one raw message."""

    messages: tuple[tuple[str, bytes], ...]
