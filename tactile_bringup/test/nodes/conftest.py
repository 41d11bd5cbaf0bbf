# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A node that draws, somebody who looks at it, and the time that both need."""
from node_bench import bench, beside  # noqa: F401
