# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact point and depth from the dots in a contact region."""
from __future__ import annotations

import numpy as np

from ... import _core
from ...common.region_moments import joined
from ...common.spherical_cap import Cap
from .region import ContactDots, Region


def contact_point(dots: ContactDots, region: Region) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Contact point (3,), m, on the deformed surface, its covariance (3, 3), m^2, and the unit normal (3,) of the surface there.

    The dots of the region lie on the object. Along a principal direction in which they curve like a fingertip, the contact point is the
    lowest point of the fitted curve; along one without curvature (a face, an edge), it is the area centroid of the region. With too few
    dots for a fit the covariance covers both cases.
    """
    points, moments = np.asarray(dots.xyz[region.members], float), region.moments
    return _core.contact_point(points, *joined(region.outline.loops), region.surface.wide, moments.centroid, moments.normal,
                               area=moments.area, pitch=region.pitch, sigma=dots.sigma)


def contact_depth(dots: ContactDots, region: Region, cap: Cap) -> float:
    """Depth, m: the distance along z by which the object must retract to just touch the surface at rest.

    The largest height of the rest shape above the deformed surface at the region's dots, by a quadratic fitted around the deepest one.
    """
    points = np.asarray(dots.xyz[region.members], float)
    return _core.contact_depth(points, centre_z=cap.centre_z, radius=cap.curvature_radius, pitch=region.pitch)
