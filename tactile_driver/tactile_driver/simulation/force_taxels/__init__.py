# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Simulated taxels that measure a force vector each."""
