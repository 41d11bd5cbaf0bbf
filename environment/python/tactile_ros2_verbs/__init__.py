# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Verbs of the ros2 command that the fallback environment has no package for."""
