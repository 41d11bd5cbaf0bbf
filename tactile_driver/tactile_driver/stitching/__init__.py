# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Stitching of two camera views of one sheet."""
