# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What every sensor's stage builds on: Stage and its node, the table of sensor types, parameter and calibration files, clock, errors."""
