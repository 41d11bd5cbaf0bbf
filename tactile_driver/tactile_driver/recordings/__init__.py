# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""rosbag2 recordings, read and written by rosbag2_py, and their messages as bytes."""
