# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of force_contact_node."""
from __future__ import annotations

from ..dots.parameters import fixed

SENSOR, FORCE_NODE = 'force_taxels', 'force_contact_node'

FORCE_SENSOR_PARAMETERS = (
    fixed('sensor_type', str, SENSOR, '', 'sensor type; a calibration file must be for the same type', choices=(SENSOR,)),
    fixed('force_unit', float, 0.0, 'N', 'force of one unit of fx, fy and fz, of a sensor that its maker has calibrated (1 for newtons); '
          '0: unknown. A calibration replaces it', 0.0, 1e6),
    fixed('calibration', str, '', '', 'calibration file from calibrate; empty: by force_unit'),
)
FORCE_PARAMETERS = FORCE_SENSOR_PARAMETERS
