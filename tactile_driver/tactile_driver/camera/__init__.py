# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Cameras as sources, one or two: device, file, simulation."""
