# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Tactile perception: algorithms that see arrays and numbers, and thin ROS nodes over them."""
