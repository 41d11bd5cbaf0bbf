# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Skins, the objects that touch them, and the mechanics of contact."""
