# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What several rooms need: geometry, statistics, polygons, the types of estimates. Arrays and numbers only."""
