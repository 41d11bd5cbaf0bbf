# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact regions of one frame and their area, centroid, normal and axes, from scores and positions of dots."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from ..._core import all_within
from ...common.surface import DotSurface, Moments, Outline, axes, region_outlines, to_grid
from ...common.estimates import ContactRegionEstimate
from ...common.rigid_motion import RigidFit
from ...common.geometry import quaternion
from ...errors import BadArgument

_MASK_SCALE = 8  # pixels a pitch, of the mask that assigns dots to regions; chosen


@dataclass
class ContactDots:
    """The dots of one frame; entry k of each array belongs to the same dot.

    rows, columns: of the grid; ids: (N,) row * columns + column; xyz, rest_xyz: (N, 3) m, now and untouched, sensor frame; score: (N,),
    above 0.5 in contact; state: (N,) uint8, 0 none, 1 sticking, 2 slipping; force: (N, 3) N, object on sensor, or None; sigma: standard
    deviation of a coordinate of xyz, m; all_dots: positions (K, 3), m, scores (K,), states and, with force, the forces (K, 3), N, that
    they carry, of all dots of the grid, unseen ones interpolated, or None. Raises BadArgument for shapes that differ or numbers that are
    not finite.
    """

    rows: int
    columns: int
    ids: np.ndarray
    xyz: np.ndarray
    rest_xyz: np.ndarray
    score: np.ndarray
    state: np.ndarray
    force: np.ndarray | None = None
    sigma: float = 30e-6  # chosen
    all_dots: Sequence[np.ndarray] | None = None

    def __post_init__(self):
        count = len(self.ids)
        shapes = {'xyz': (count, 3), 'rest_xyz': (count, 3), 'score': (count,), 'force': (count, 3)}
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


def describe(dots: ContactDots, regions: list[Region], motion: RigidFit | None = None, interval: float = np.nan) -> ContactRegionEstimate:
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
