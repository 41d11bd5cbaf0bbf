# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""ROS nodes of the drivers: the only place here that imports ROS."""
