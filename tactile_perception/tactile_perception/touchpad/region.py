# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact regions of one frame, and the contacts in them tracked from frame to frame: point, depth, force, id."""
from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from .. import _core
from .._core.common import ContactTracker
from ..common.constants import COMMON
from ..common.estimates import AMBIGUOUS, AT_EDGE, OUT_OF_RANGE, ContactEstimate, ContactRegionEstimate
from ..common.geometry import Cap, deepest_notch, quaternion
from ..common.surface import DotSurface, Moments, Outline, axes, joined, region_outlines, scatter, to_grid
from ..core.errors import BadArgument
from .constants import TOUCHPAD
from .contact import steps_from
from .pose import RigidMotion


@dataclass
class ContactDots:
    """The dots of one frame; entry k of each array belongs to the same dot.

    Parameters
    ----------
    rows, columns : int
        Size of the grid, which has K dots.
    ids : ndarray, shape (N,)
        Numbers row * columns + column of the dots.
    xyz : ndarray, shape (N, 3)
        Positions in m in the sensor frame.
    score : ndarray, shape (N,)
        Contact score; above 0.5 in contact.
    state : ndarray, shape (N,), uint8
        0 none, 1 sticking, 2 slipping.
    force : ndarray, shape (K, 3), optional
        Force in N of the object on the sensor at each dot of the grid.
    sigma : float
        Standard deviation of a coordinate of xyz in m.
    all_dots : sequence of ndarray, optional
        Positions (K, 3), m, and scores (K,) of all dots of the grid, with unseen ones interpolated.

    Raises
    ------
    BadArgument
        If shapes differ or numbers are not finite.
    """

    rows: int
    columns: int
    ids: np.ndarray
    xyz: np.ndarray
    score: np.ndarray
    state: np.ndarray
    force: np.ndarray | None = None
    sigma: float = 30e-6
    all_dots: Sequence[np.ndarray] | None = None

    def __post_init__(self):
        count = len(self.ids)
        shapes = {'xyz': (count, 3), 'score': (count,), 'force': (self.rows * self.columns, 3)}
        for name, shape in shapes.items():
            values = getattr(self, name)
            if values is None:
                continue
            if np.shape(values) != shape or not np.isfinite(np.asarray(values, float)).all():
                raise BadArgument(f'contact dots: {name} must be finite numbers of shape {shape}; leave out unknown dots')
            setattr(self, name, np.asarray(values, float))
        if np.shape(self.state) != (count,):
            raise BadArgument(f'contact dots: state must have shape ({count},), one number for each dot')
        if min(self.rows, self.columns) < 2 or not 0 < self.sigma < np.inf:
            raise BadArgument(f'contact dots: need a grid of 2 x 2 or more and sigma > 0, got {self.rows} x {self.columns}, {self.sigma}')

    def grids(self) -> tuple[np.ndarray, np.ndarray]:
        """Positions (rows, columns, 3), m, and scores (rows, columns) of all dots; NaN if unknown."""
        if self.all_dots is None:
            return to_grid(self.ids, self.xyz, self.rows, self.columns), to_grid(self.ids, self.score, self.rows, self.columns)
        return self.all_dots[0].reshape(self.rows, self.columns, 3), self.all_dots[1].reshape(self.rows, self.columns)


@dataclass(frozen=True)
class Region:
    """One separate region.

    Attributes
    ----------
    outline : Outline
        Its border and holes.
    moments : Moments
        Area, centroid, normal and second moments.
    members : ndarray, shape (N,), bool
        The dots of the frame that belong to it.
    pitch : float
        Distance between dots in m.
    surface : DotSurface
        The surface of this frame.
    """

    outline: Outline
    moments: Moments
    members: np.ndarray
    pitch: float
    surface: DotSurface


def find_regions(dots: ContactDots) -> list[Region]:
    """Find the separate contact regions of one frame.

    Parameters
    ----------
    dots : ContactDots
        The dots of the frame.

    Returns
    -------
    list of Region
        The regions, largest first.
    """
    if not len(dots.ids) or not (dots.score > 0.5).any():
        return []
    xyz, score = dots.grids()
    surface = DotSurface(xyz)
    outlines, moments, pitch = region_outlines(score, surface)
    members = [dots.score > 0.5] if len(outlines) == 1 else [_within(outline, dots) for outline in outlines]
    regions = [Region(*shape, pitch, surface) for shape in zip(outlines, moments, members)]
    # The interpolated score may exceed the threshold between two dots just below it, but a region without dots is no contact.
    return [region for region in regions if region.moments.area > 0 and region.members.any()]


def _within(outline: Outline, dots: ContactDots) -> np.ndarray:
    """Mask (N,) of the dots in contact that lie inside the outline and outside its holes."""
    scale = 8  # pixels per pitch
    mask = np.zeros(((dots.rows + 1) * scale, (dots.columns + 1) * scale), np.uint8)
    loops = [np.round((loop[:, ::-1] + 0.5) * scale).astype(np.int32) for loop in (outline.grid_points, *outline.grid_holes)]
    cv2.fillPoly(mask, loops, 1)
    row, column = np.stack(np.divmod(np.asarray(dots.ids), dots.columns)) * scale + scale // 2
    return (mask[row, column] > 0) & (dots.score > 0.5)


def describe(dots: ContactDots, regions: list[Region], motion: RigidMotion | None = None,
             interval: float = np.nan) -> ContactRegionEstimate:
    """Describe the contact region of one frame; motion: of the object over interval, s, None if unknown."""
    estimate = ContactRegionEstimate(np.asarray(dots.ids), np.asarray(dots.state))
    if motion is not None and np.isfinite(interval):
        estimate.motion_translation = motion.translation
        estimate.motion_rotation = quaternion(motion.rotation)
        estimate.motion_interval = float(interval)
    if not regions:
        return estimate
    total = sum((region.moments for region in regions[1:]), regions[0].moments)
    estimate.outlines = [region.outline.points for region in regions]
    estimate.holes = [hole for region in regions for hole in region.outline.holes]
    estimate.area, estimate.centroid, estimate.normal = total.area, total.centroid, total.normal
    estimate.major_axis, estimate.minor_axis, estimate.orientation = axes(total, estimate.outlines + estimate.holes, regions[0].pitch)
    return estimate


class RegionContact(NamedTuple):
    """The contact in one region; NaN if unknown.

    position: (3,) m; covariance: (3, 3) m^2; normal: (3,), unit normal of the surface there; depth: m; force: N, along the mean normal of
    the region.
    """

    position: np.ndarray
    covariance: np.ndarray
    normal: np.ndarray
    depth: float
    force: float


def find_contact(dots: ContactDots, region: Region, cap: Cap) -> RegionContact:
    """Find the contact in a region of one frame. Kernel: src/touchpad/contact_point.cpp.

    The dots of the region lie on the object. Along a principal direction in which they curve like a fingertip, the contact point is the
    lowest point of the fitted curve; along one without curvature (a face, an edge), it is the area centroid of the region. With too few
    dots for a fit the covariance covers both cases. The depth is the distance along z by which the object must retract to just touch the
    undeformed surface: the largest height of the undeformed above the deformed surface at the region's dots, by a quadratic fitted around
    the deepest one. The force is the component along the region's normal of the total force on all dots nearest to the region.
    """
    moments = region.moments
    shape = _core.touchpad.RegionShape(centroid=moments.centroid, normal=moments.normal, area=moments.area, pitch=region.pitch,
                                       sigma=dots.sigma)
    rest = _core.touchpad.RestCap(centre_z=cap.centre_z, radius=cap.curvature_radius)
    points = dots.xyz.compress(region.members, axis=0)
    found = _core.touchpad.contact_point(points, *joined(region.outline.loops), region.surface.wide, shape, rest)
    return RegionContact(found.position, found.covariance, found.normal, found.depth, _normal_force(dots, region))


def _normal_force(dots: ContactDots, region: Region) -> float:
    if dots.force is None:
        return np.nan
    own, others = (steps_from(scatter(some, dots.ids, len(dots.force), False), (dots.rows, dots.columns))
                   for some in (region.members, (dots.score > 0.5) & ~region.members))
    near = (own < _core.touchpad.ZERO_WEIGHT_STEPS) & (own <= others)
    return max(float(-region.moments.normal @ (near @ dots.force)), 0.0)


class ContactFinder:
    """Finds contacts frame by frame.

    A contact is AMBIGUOUS if its outline has a notch or contacts have merged into its region. calibrated_depth, calibrated_radius: m,
    largest calibrated depth and distance from the z axis; None if unknown.
    """

    def __init__(self, cap: Cap, calibrated_depth: float | None = None, calibrated_radius: float | None = None):
        self._cap, self._depth, self._radius = cap, calibrated_depth, calibrated_radius
        self._tracker = ContactTracker()

    def process(self, dots: ContactDots, regions: list[Region], stamp_s: float) -> list[ContactEstimate]:
        """Find one contact for each region of the frame at stamp_s, s, in the order of the regions."""
        labels = np.zeros(dots.rows * dots.columns, int)
        for k, region in enumerate(regions):
            labels[np.asarray(dots.ids)[region.members]] = k + 1
        tracked = self._tracker.assign(labels, [(k + 1, region.moments) for k, region in enumerate(regions)],
                                       COMMON.max_step * regions[0].pitch if regions else 0.0, stamp_s)
        contacts = []
        for region, one in zip(regions, tracked):
            found = find_contact(dots, region, self._cap)
            flags = self._flags(dots, region, found) | (AMBIGUOUS if one.merged else 0)
            contacts.append(ContactEstimate(one.number, found.position, found.normal, found.depth, found.force, found.covariance, flags,
                                            region.members))
        return contacts

    def _flags(self, dots: ContactDots, region: Region, found: RegionContact) -> int:
        border = region.outline.grid_points
        row, column = border.max(axis=0).tolist()
        flags = AT_EDGE if border.min() < 0.5 or row > dots.rows - 1.5 or column > dots.columns - 1.5 else 0
        if deepest_notch(border) > TOUCHPAD.notch_depth:
            flags |= AMBIGUOUS
        beyond = self._depth is not None and found.depth > self._depth
        outside = self._radius is not None and math.hypot(found.position[0], found.position[1]) > self._radius
        return flags | (OUT_OF_RANGE if beyond or outside else 0)
