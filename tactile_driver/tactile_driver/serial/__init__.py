# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Sensors on serial ports: protocols, clocks, sources. No ROS here."""
