# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What sensors send over a serial port: binary frames and CSV lines, and the time at which their values were sampled. No ROS here."""
