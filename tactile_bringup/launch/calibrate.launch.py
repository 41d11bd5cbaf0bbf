# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A sensor and the node that leads through its calibration; further arguments go to the sensor's own launch file."""
from tactile_bringup.launch.calibrate import calibrate_description as generate_launch_description  # noqa: F401
