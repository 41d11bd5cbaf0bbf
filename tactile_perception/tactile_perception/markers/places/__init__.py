# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Where markers are in 3D, frame by frame."""
