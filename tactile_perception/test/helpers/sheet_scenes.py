# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A small, coarse library of presses, and fields of presses that the mechanics work out on a mesh of their own."""
import functools

import numpy as np

from tactile_perception.common.marker_sensor import MARKER_SENSORS
from tactile_perception.press.field import MarkerField
from tactile_perception.press.sheet.library import LibraryPlan, build_library, field_appearance
from tactile_perception.press.sheet.mechanics import SheetMaterial, SheetMesh, press_sheet, uniform

SENSOR = MARKER_SENSORS['areal_single']
GRID = SENSOR.grid()
EYE = np.tile([0.0, 0.0, -0.062], (len(GRID), 1))
PLAN = LibraryPlan((0.030, 0.0225), 7e-3, 8e-3, n=7, order=3, levels=6, substeps=2)
MATERIAL = SheetMaterial(1.03, 2e-7, 0.6)
MARKER = 1.2e-3
PX = 9000.0


@functools.cache
def library():
    return build_library(PLAN, MATERIAL)


def field_of(seen, noise=0.0, growth_noise=0.0, seed=0):
    """The MarkerField of shift and growth (K, 3), with noise, m and 1."""
    rng = np.random.default_rng(seed)
    shift = seen[:, :2] + rng.normal(0, 1, (len(GRID), 2)) * noise
    growth = seen[:, 2] + rng.normal(0, 1, len(GRID)) * growth_noise
    area = np.pi * (MARKER * PX)**2 * np.exp(growth)
    return MarkerField(GRID, shift, growth, EYE, (GRID + shift) * PX, shift * PX, area)


@functools.cache
def pressed(x, y, depth, radius=7e-3, material=MATERIAL):
    """(K, 3) shift and growth of one press, on a finer mesh and in finer steps than the library's."""
    plan = LibraryPlan(PLAN.half, 7e-3, depth, n=9, levels=12)
    mesh = SheetMesh((x, y), plan.half, plan.scale, plan.n)
    solved = press_sheet(mesh, plan.load_steps(np.array([depth])), radius, material)[0][-1]
    field = uniform(solved.reshape(mesh.side, mesh.side, 3)).reshape(-1, 3)
    return field_appearance(field, plan, (x, y), GRID, EYE, MARKER)
