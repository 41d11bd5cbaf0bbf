# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Reading of rosbag2 recordings, damaged ones as far as they go."""
