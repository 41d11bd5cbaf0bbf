# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The drivers' parameter tables. No ROS here."""
