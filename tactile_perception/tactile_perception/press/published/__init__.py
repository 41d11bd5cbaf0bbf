# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The published methods: areal_sensor_contact_position for sheets, air_cushion_contact for domes."""
