# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings replayed through the stages of a sensor and compared with their truth. One thread each, as tactile_driver.nodes says."""
import tactile_driver.nodes  # noqa: F401
