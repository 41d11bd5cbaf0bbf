# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact point, depth and force from the dots in a contact region."""
from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ... import _core
from ...common.surface import joined
from ...common.geometry import Cap
from .region import ContactDots, Region


_NO_FORCE = np.zeros((0, 3))


class FoundContact(NamedTuple):
    """position: (3,) m, on the deformed surface; covariance: (3, 3) m^2, of that; normal: (3,) unit, of the surface there; depth: m;
    force: N, along the region's mean normal, NaN where forces are unknown."""

    position: np.ndarray
    covariance: np.ndarray
    normal: np.ndarray
    depth: float
    force: float


def find_contact(dots: ContactDots, region: Region, cap: Cap) -> FoundContact:
    """The contact in a region of one frame. Kernel: src/touchpad/contact/region_contact.cpp.

    The dots of the region lie on the object. Along a principal direction in which they curve like a fingertip, the contact point is the
    lowest point of the fitted curve; along one without curvature (a face, an edge), it is the area centroid of the region. With too few
    dots for a fit the covariance covers both cases. The depth is the distance along z by which the object must retract to just touch the
    surface at rest: the largest height of the rest shape above the deformed surface at the region's dots, by a quadratic fitted around the
    deepest one. The force is the part along the region's normal of that on all dots to which the region is the nearest.
    """
    moments = region.moments
    return FoundContact(*_core.region_contact(
        dots.ids, dots.xyz, region.members, dots.score > 0.5, _carried(dots),
        *joined(region.outline.loops), region.surface.wide, moments.centroid, moments.normal, rows=dots.rows, columns=dots.columns,
        area=moments.area, pitch=region.pitch, sigma=dots.sigma, centre_z=cap.centre_z, radius=cap.curvature_radius))


def _carried(dots: ContactDots) -> np.ndarray:
    """(K, 3) N: force that all dots of the grid carry (DotLoads.carried); that on the seen dots where no more is known; (0, 3) without
    forces."""
    if dots.force is None:
        return _NO_FORCE
    if dots.all_dots is not None:
        return dots.all_dots[3]
    force = np.zeros((dots.rows * dots.columns, 3))
    force[dots.ids] = dots.force
    return force
