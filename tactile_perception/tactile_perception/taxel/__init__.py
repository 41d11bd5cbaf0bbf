# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Taxel arrays: contact regions, motion, slip and wrench from pressure images."""
