# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Estimates against what is true: errors, overlaps, confusions, and whether stated covariances are honest."""
