# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A small library of simulated presses on a dome, and fields of its presses, for tests of what inverts it."""
import functools

import numpy as np
from dome_scenes import DOME, EYE, NOISE, PX, markers, seen

from tactile_perception.press.dome.library import DomePlan, build_library
from tactile_perception.press.dome.mechanics import DomeMaterial, MeshPlan, OnMesh
from tactile_perception.press.dome.model import DomeInverse, FieldNoise
from tactile_perception.press.field import MarkerField

MATERIAL = DomeMaterial(0.7, 60.0, 0.5)
MESH = MeshPlan(even=9, rings=16, width=0.016, harmonics=3, around=8)
PLAN = DomePlan(DOME.rim_radius, DOME.height, 0.025, 0.04, 0.09, 0.004, EYE[2], order=3, levels=5, substeps=2)
POINTS, EYES = np.ascontiguousarray(markers()), np.tile(EYE, (len(markers()), 1))


def evaluate(field, mesh, points, odd=False):
    """(K, 3) m, displacement of points (K, 3), m, by a field."""
    return OnMesh(mesh, points).displaced(field, odd)


@functools.cache
def small_library():
    """The library; some seconds for the first call."""
    return build_library(PLAN, MATERIAL, MESH)


@functools.cache
def inverse():
    """The fit to its fields."""
    return DomeInverse(small_library(), FieldNoise(NOISE, 0.001, 0.0005), POINTS, EYES, DOME.plane_z, max(DOME.pitch))


def press(x, y, depth, radius=0.0, friction=0.0, drag=(0.0, 0.0)):
    """The seven numbers of a press; x, y, depth: m."""
    return np.array([x, y, np.log(depth), radius, friction, *drag])


def library_field(*presses, noise=NOISE, seed=0):
    """The MarkerField of presses of the library."""
    moved = small_library().moved(POINTS, np.array(presses).reshape(-1, 7))
    rest = seen(POINTS)
    shift = seen(POINTS + moved) - rest + np.random.default_rng([seed, len(presses)]).normal(0, noise, rest.shape)
    plain = np.full(len(rest), np.nan)
    return MarkerField(rest, shift, plain, EYES, rest * PX, shift * PX, plain)
