# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""simulate: scenes of simulated sensors as recordings with ground truth."""
