# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Several sensors at once, as a YAML file lists them: drivers, perception, markers, frames; RViz and recordings where asked for."""
from tactile_bringup.launch.hand import hand_description as generate_launch_description  # noqa: F401
