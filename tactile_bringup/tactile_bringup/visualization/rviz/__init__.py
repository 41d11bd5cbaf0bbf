# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""RViz configurations, made from the sensors' own sizes. No ROS here."""
