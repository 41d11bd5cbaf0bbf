# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact regions of one frame, and the contacts in them from frame to frame: point, depth, force, id."""
from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from .. import _core
from ..common.contact_tracker import ContactTracker
from ..common.estimates import AMBIGUOUS, AT_EDGE, OUT_OF_RANGE, ContactEstimate, ContactRegionEstimate
from ..common.geometry import Cap, deepest_notch, quaternion
from ..common.surface import DotSurface, Moments, Outline, axes, joined, region_outlines, scatter, to_grid
from ..errors import BadArgument
from .contact import BEYOND, steps_from
from .pose import RigidMotion

_MASK_SCALE = 8  # pixels a pitch, of the mask that assigns dots to regions; chosen


@dataclass
class ContactDots:
    """The dots of one frame; entry k of each array belongs to the same dot.

    rows, columns: of the grid; ids: (N,) row * columns + column; xyz: (N, 3) m, sensor frame; score: (N,), above 0.5 in contact; state:
    (N,) uint8, 0 none, 1 sticking, 2 slipping; force: (K, 3) N, object on sensor, that all dots of the grid carry, or None; sigma: standard
    deviation of a coordinate of xyz, m; all_dots: positions (K, 3), m, and scores (K,) of all dots of the grid, unseen ones interpolated,
    or None. Raises BadArgument for shapes that differ or numbers that are not finite.
    """

    rows: int
    columns: int
    ids: np.ndarray
    xyz: np.ndarray
    score: np.ndarray
    state: np.ndarray
    force: np.ndarray | None = None
    sigma: float = 30e-6  # chosen
    all_dots: Sequence[np.ndarray] | None = None

    def __post_init__(self):
        count = len(self.ids)
        shapes = {'xyz': (count, 3), 'score': (count,), 'force': (self.rows * self.columns, 3)}
        for name, shape in shapes.items():
            values = getattr(self, name)
            if values is None:
                continue
            if np.shape(values) != shape or not np.isfinite(np.asarray(values, float)).all():
                raise BadArgument(f'contact dots: {name} must be {shape} finite numbers; leave out unknown dots')
            setattr(self, name, np.asarray(values, float))
        if np.shape(self.state) != (count,):
            raise BadArgument(f'contact dots: state must be ({count},), a number for each dot')
        if min(self.rows, self.columns) < 2 or not 0 < self.sigma < np.inf:
            raise BadArgument(f'contact dots: need a grid of 2 x 2 or more and sigma > 0, got {self.rows} x {self.columns}, {self.sigma}')

    def grids(self) -> tuple[np.ndarray, np.ndarray]:
        """Positions (rows, columns, 3), m, and scores (rows, columns) of all dots; NaN where unknown."""
        if self.all_dots is None:
            return to_grid(self.ids, self.xyz, self.rows, self.columns), to_grid(self.ids, self.score, self.rows, self.columns)
        return self.all_dots[0].reshape(self.rows, self.columns, 3), self.all_dots[1].reshape(self.rows, self.columns)


@dataclass(frozen=True)
class Region:
    """One separate region.

    members: (N,) bool, the frame's dots in it; pitch: of the dots, m; surface: of this frame.
    """

    outline: Outline
    moments: Moments
    members: np.ndarray
    pitch: float
    surface: DotSurface


def find_regions(dots: ContactDots) -> list[Region]:
    """The separate regions of one frame, largest first."""
    if not len(dots.ids) or not (dots.score > 0.5).any():
        return []
    xyz, score = dots.grids()
    surface = DotSurface(xyz)
    outlines, moments, pitch = region_outlines(score, surface)
    members = [dots.score > 0.5] if len(outlines) == 1 else [_within(outline, dots) for outline in outlines]
    regions = [Region(*shape, pitch, surface) for shape in zip(outlines, moments, members)]
    # Between two dots just below the threshold the interpolated score may exceed it: a region without dots is no contact.
    return [region for region in regions if region.moments.area > 0 and region.members.any()]


def _within(outline: Outline, dots: ContactDots) -> np.ndarray:
    """(N,) bool: the dots in contact inside the outline and outside its holes."""
    mask = np.zeros(((dots.rows + 1) * _MASK_SCALE, (dots.columns + 1) * _MASK_SCALE), np.uint8)
    loops = [np.round((loop[:, ::-1] + 0.5) * _MASK_SCALE).astype(np.int32) for loop in (outline.grid_points, *outline.grid_holes)]
    cv2.fillPoly(mask, loops, 1)
    place = np.stack(np.divmod(np.asarray(dots.ids), dots.columns)) * _MASK_SCALE + _MASK_SCALE // 2
    return (mask[place[0], place[1]] > 0) & (dots.score > 0.5)


def describe(dots: ContactDots, regions: list[Region], motion: RigidMotion | None = None,
             interval: float = np.nan) -> ContactRegionEstimate:
    """The ContactRegion of one frame; motion: of the object over interval, s, None when unknown."""
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
    """position: (3,) m; covariance: (3, 3) m^2; normal: (3,) unit, of the surface there; depth: m; force: N, along the region's mean
    normal. NaN: unknown."""

    position: np.ndarray
    covariance: np.ndarray
    normal: np.ndarray
    depth: float
    force: float


def find_contact(dots: ContactDots, region: Region, cap: Cap) -> RegionContact:
    """The contact in a region of one frame. Kernel: src/touchpad/contact_point.cpp.

    The dots of the region lie on the object. Along a principal direction in which they curve like a fingertip, the contact point is the
    lowest point of the fitted curve; along one without curvature (a face, an edge), it is the area centroid of the region. With too few
    dots for a fit the covariance covers both cases. The depth is the distance along z by which the object must retract to just touch the
    surface at rest: the largest height of the rest shape above the deformed surface at the region's dots, by a quadratic fitted around the
    deepest one. The force is the part along the region's normal of that on all dots to which the region is the nearest.
    """
    moments = region.moments
    return RegionContact(*_core.contact_point(
        dots.xyz.compress(region.members, axis=0), *joined(region.outline.loops), region.surface.wide, moments.centroid, moments.normal,
        area=moments.area, pitch=region.pitch, sigma=dots.sigma, centre_z=cap.centre_z, radius=cap.curvature_radius),
        _normal_force(dots, region))


def _normal_force(dots: ContactDots, region: Region) -> float:
    if dots.force is None:
        return np.nan
    own, others = (steps_from(scatter(some, dots.ids, len(dots.force), False), (dots.rows, dots.columns))
                   for some in (region.members, (dots.score > 0.5) & ~region.members))
    near = (own < BEYOND) & (own <= others)
    return max(float(-region.moments.normal @ (near @ dots.force)), 0.0)


_NOTCH = 1.3  # pitches, convexity defect of an outline from which it may be two merged touches; chosen
_REACH = 1.5  # pitches between the borders of a contact in one frame and in the next


class ContactFinder:
    """Contacts frame by frame. An outline with a notch, and a region into which contacts have merged, is AMBIGUOUS. calibrated_depth,
    calibrated_radius: m, largest calibrated depth and distance from the z axis; None: unknown."""

    def __init__(self, cap: Cap, calibrated_depth: float | None = None, calibrated_radius: float | None = None):
        self._cap, self._depth, self._radius = cap, calibrated_depth, calibrated_radius
        self._tracker = ContactTracker()

    def process(self, dots: ContactDots, regions: list[Region], stamp_s: float) -> list[ContactEstimate]:
        """One contact for each region of the frame at stamp_s, s, in their order."""
        labels = np.zeros(dots.rows * dots.columns, int)
        for k, region in enumerate(regions):
            labels[np.asarray(dots.ids)[region.members]] = k + 1
        tracked = self._tracker.assign(labels, [(k + 1, region.moments) for k, region in enumerate(regions)],
                                       _REACH * regions[0].pitch if regions else 0.0, stamp_s)
        contacts = []
        for region, one in zip(regions, tracked):
            found = find_contact(dots, region, self._cap)
            flags = self._flags(dots, region, found) | (AMBIGUOUS if one.merged else 0)
            contacts.append(ContactEstimate(one.number, found.position, found.normal, found.depth, found.force, found.covariance, flags,
                                            region.members))
        return contacts

    def _flags(self, dots: ContactDots, region: Region, found: RegionContact) -> int:
        place = region.outline.grid_points
        row, column = place.max(axis=0).tolist()
        flags = AT_EDGE if place.min() < 0.5 or row > dots.rows - 1.5 or column > dots.columns - 1.5 else 0
        if deepest_notch(place) > _NOTCH:
            flags |= AMBIGUOUS
        beyond = self._depth is not None and found.depth > self._depth
        outside = self._radius is not None and math.hypot(found.position[0], found.position[1]) > self._radius
        return flags | (OUT_OF_RANGE if beyond or outside else 0)
