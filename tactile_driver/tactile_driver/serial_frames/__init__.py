# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Serial protocols of the sensors: binary frames, CSV lines and the sampling times of their values. No ROS here."""
