# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Marker positions in 3D."""
