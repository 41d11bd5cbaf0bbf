# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The launch files' content: arguments, nodes of each sensor, processes."""
