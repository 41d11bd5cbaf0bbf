# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Taxel arrays: pressure images, their contact regions, motion, slip and wrench. Arrays and numbers only."""
