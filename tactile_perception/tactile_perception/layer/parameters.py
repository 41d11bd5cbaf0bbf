# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of an elastic layer with dots. docs/gel.md says how they are measured."""
from __future__ import annotations

from ..dots.parameters import fixed

LAYER_PARAMETERS = (
    fixed('gel.thickness', float, 0.0, 'm',
          'thickness of the elastic layer, from its rigid base to its free surface; 0: unknown, depth by dots is NaN', 0.0, 1.0),
    fixed('gel.dot_depth', float, 0.0, 'm', 'depth of the dots under the free surface; areas and forces depend on it', 0.0, 1.0),
    fixed('gel.poisson_ratio', float, 0.48, '', "Poisson's ratio; silicones and gels have 0.47 to 0.5", 0.0, 0.5),
    fixed('gel.friction', float, 0.0, '', 'coefficient of friction between object and gel; 0: unknown, slip is not published', 0.0, 10.0),
)
