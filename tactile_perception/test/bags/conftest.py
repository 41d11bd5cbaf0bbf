# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Bags of simulated touchpads, made once a session, and the parameter file that describes the specimen."""
from touchpad_bags import dual_folder, pressed_bag, recording_folder, sphere_bag  # noqa: F401
