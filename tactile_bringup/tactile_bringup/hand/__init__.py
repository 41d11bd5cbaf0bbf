# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A hand of several sensors: its description, and what is made of it."""
