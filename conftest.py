# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Bind the packages' names before pytest does: it would take the source folders of the same names for them (import mode importlib)."""
import tactile_bringup  # noqa: F401
import tactile_driver  # noqa: F401
import tactile_perception  # noqa: F401
