# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact regions of one frame, and the contacts in them from frame to frame: point, depth, force, id."""
from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from .. import _core
from ..common.surface import DotSurface, Moments, Outline, axes, joined, region_outlines, to_grid
from ..common.estimates import AMBIGUOUS, AT_EDGE, OUT_OF_RANGE, ContactEstimate, ContactRegionEstimate
from ..common.rigid_motion import RigidMotion
from ..common.geometry import Cap, deepest_notch, quaternion
from ..common.statistics import all_within
from ..errors import BadArgument

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
            if np.shape(values) != shape or not all_within(np.asarray(values, float)):
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


_NO_FORCE = np.zeros((0, 3))


def find_contact(dots: ContactDots, region: Region, cap: Cap) -> _core.RegionContact:
    """The contact in a region of one frame. Kernel: src/touchpad/contact.cpp and contact_point.cpp.

    The dots of the region lie on the object. Along a principal direction in which they curve like a fingertip, the contact point is the
    lowest point of the fitted curve; along one without curvature (a face, an edge), it is the area centroid of the region. With too few
    dots for a fit the covariance covers both cases. The depth is the distance along z by which the object must retract to just touch the
    surface at rest: the largest height of the rest shape above the deformed surface at the region's dots, by a quadratic fitted around the
    deepest one. The force is the part along the region's normal of that on all dots to which the region is the nearest.
    """
    moments = region.moments
    return _core.region_contact(
        dots.ids, dots.xyz, region.members, dots.score > 0.5, _NO_FORCE if dots.force is None else dots.force,
        *joined(region.outline.loops), region.surface.wide, moments.centroid, moments.normal, rows=dots.rows, columns=dots.columns,
        area=moments.area, pitch=region.pitch, sigma=dots.sigma, centre_z=cap.centre_z, radius=cap.curvature_radius)


_NOTCH = 1.3  # pitches, convexity defect of an outline from which it may be two merged touches; chosen


class ContactTracker:
    """Contacts frame by frame.

    A region continues the contact of the last frame with which it shares most dots; without common dots, the nearest one within a pitch
    and a half from border to border. A contact that is lost for a frame keeps its id. Of merging regions, the one with most common dots
    gives its id; of the parts of a region that splits, the one with most common dots keeps it. An outline with a notch is AMBIGUOUS.
    calibrated_depth, calibrated_radius: m, largest calibrated depth and distance from the z axis; None: unknown.
    """

    def __init__(self, cap: Cap, calibrated_depth: float | None = None, calibrated_radius: float | None = None):
        for name, value in (('calibrated_depth', calibrated_depth), ('calibrated_radius', calibrated_radius)):
            if value is not None and not 0 < value < np.inf:
                raise BadArgument(f'contact tracker: {name} must be positive, m, got {value}')
        self._cap, self._depth, self._radius = cap, calibrated_depth, calibrated_radius
        self._next = 1
        self.reset()

    def reset(self) -> None:
        """Forget all contacts; ids are not used again."""
        self._last: dict[int, _Track] = {}

    def process(self, dots: ContactDots, regions: list[Region]) -> list[ContactEstimate]:
        """One contact for each region of this frame, in their order."""
        held = [set(np.asarray(dots.ids)[region.members].tolist()) for region in regions]
        chosen = _match(held, regions, self._last)
        contacts, tracks = [], {}
        for k, region in enumerate(regions):
            number = chosen.get(k)
            if number is None:
                number, self._next = self._next, self._next + 1
            tracks[number] = _Track(held[k], region.moments.centroid, region.moments.area)
            found = find_contact(dots, region, self._cap)
            contacts.append(ContactEstimate(number, found.position, found.normal, found.depth, found.force, found.covariance,
                                            self._flags(dots, region, found), region.members))
        lost = {number: replace(track, lost=True) for number, track in self._last.items() if number not in tracks and not track.lost}
        self._last = tracks | lost
        return contacts

    def _flags(self, dots: ContactDots, region: Region, found: _core.RegionContact) -> int:
        place = region.outline.grid_points
        row, column = place.max(axis=0).tolist()
        flags = AT_EDGE if place.min() < 0.5 or row > dots.rows - 1.5 or column > dots.columns - 1.5 else 0
        if deepest_notch(place) > _NOTCH:
            flags |= AMBIGUOUS
        beyond = self._depth is not None and found.depth > self._depth
        outside = self._radius is not None and math.hypot(found.position[0], found.position[1]) > self._radius
        return flags | (OUT_OF_RANGE if beyond or outside else 0)


@dataclass(frozen=True)
class _Track:
    held: set
    centroid: np.ndarray
    area: float
    lost: bool = False


def _match(held: list[set], regions: list[Region], last: dict[int, _Track]) -> dict[int, int]:
    """Id for each region that continues a contact: greedily by most common dots, then by the smallest gap."""
    pairs = []
    for k, region in enumerate(regions):
        for number, track in last.items():
            radii = math.sqrt(region.moments.area / math.pi) + math.sqrt(track.area / math.pi)
            gap = math.dist(region.moments.centroid, track.centroid) - radii
            common = len(held[k] & track.held)
            if common or gap < 1.5 * region.pitch:
                pairs.append((-common, gap, number, k))
    chosen: dict[int, int] = {}
    for _, _, number, k in sorted(pairs):
        if k not in chosen and number not in chosen.values():
            chosen[k] = number
    return chosen
