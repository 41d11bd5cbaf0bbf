# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The touchpad: range by absorption, the membrane, contact, slip."""
