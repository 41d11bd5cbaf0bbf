# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Estimates of touch methods, presses with ground truth, cross-validation, tracking and contact regions."""
