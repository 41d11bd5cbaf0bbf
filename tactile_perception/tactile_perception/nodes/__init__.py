# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""ROS nodes over the algorithms: the only place here that imports ROS. One thread each, as tactile_driver.nodes says."""
import tactile_driver.nodes  # noqa: F401
