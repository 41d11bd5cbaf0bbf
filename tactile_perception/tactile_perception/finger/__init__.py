# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The PSD finger: four voltages become a position and a normal on a hemisphere. No ROS here."""
