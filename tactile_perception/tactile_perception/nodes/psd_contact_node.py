# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""psd_contact_node: voltages of a PSD finger -> contacts."""
from __future__ import annotations

import sys

from tactile_driver.nodes.runtime.run import run_node

from ..finger.stage import FingerStage
from ..node import PerceptionNode


class PsdContactNode(PerceptionNode):
    """Estimates the contacts of a PSD finger and their covariances."""

    stage_type = FingerStage


def main(args: list[str] | None = None) -> None:
    """The process psd_contact_node."""
    sys.exit(run_node(PsdContactNode, args))


if __name__ == '__main__':
    main()
