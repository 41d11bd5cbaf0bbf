# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Readers of rosbag2 recordings; damaged files are read as far as possible."""
