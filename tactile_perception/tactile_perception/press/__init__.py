# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Sheets and domes with markers: contact point, depth, wrench."""
