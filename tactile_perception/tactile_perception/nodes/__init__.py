# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""ROS nodes over the algorithms; no other folder of live code imports ROS. Each node runs in one thread, see tactile_driver.nodes."""
import tactile_driver.nodes  # noqa: F401
