# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Touches by regression on the displacement field, for sheets and domes."""
