# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Emulators of sensor firmware on pseudo-terminals."""
