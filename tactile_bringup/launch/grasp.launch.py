# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A simulated gripper that holds an object by the slip that its array reports. Needs MuJoCo, an optional extra."""
from tactile_bringup.launch.grasp import grasp_description as generate_launch_description  # noqa: F401
