# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The commands that work on recordings. One thread each, as tactile_driver.nodes says."""
import tactile_driver.nodes  # noqa: F401
