# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A sensor's launch file plus numbers in the terminal, pictures and a video; ends by itself."""
from tactile_bringup.launch.demo import demo_description as generate_launch_description  # noqa: F401
