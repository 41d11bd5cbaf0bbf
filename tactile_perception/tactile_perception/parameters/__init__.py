# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Parameter tables of perception, and parameter files as ROS reads them. No ROS here."""
