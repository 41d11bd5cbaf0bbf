# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A guided calibration: which presses count, what comes next, where the probe is."""
