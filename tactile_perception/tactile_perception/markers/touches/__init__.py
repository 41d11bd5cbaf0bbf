# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What a method says of a frame, presses with known truth, cross-validation, tracks and regions of touches."""
