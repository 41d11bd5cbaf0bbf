# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A simulated gel: an elastic layer by finite elements, and balls that are pressed into it and dragged over it."""
