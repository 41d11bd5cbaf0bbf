# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings: read as far as they go, written, replayed. One thread each, as tactile_driver.nodes says."""
import tactile_driver.nodes  # noqa: F401
