# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Skins, tools, motions and contact mechanics."""
