# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Taxels that measure a force vector each: driver, perception, markers; RViz and a recording where asked for."""
from functools import partial

from tactile_bringup.launch.arguments import sensor_description

generate_launch_description = partial(sensor_description, 'force_taxels')
