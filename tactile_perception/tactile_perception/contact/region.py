# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Where the object touches in one frame: regions, and the figures that describe them, from scores and places of dots."""
from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np

from ..errors import BadArgument
from .dot_surface import DotSurface
from .grid_surface import to_grid
from .moments import MomentField, Moments
from .outline import Outline, region_outlines
from .rigid import RigidFit

# Standard deviation of an outline, and the length along it over which its errors hang together, in pitches of the dots.
OUTLINE_SIGMA = 0.3
OUTLINE_LENGTH = 1.0
# A region has a direction where its two variances differ by this many standard deviations (about 10 degrees of doubt).
_DIRECTION = 3.0
_MASK_SCALE = 8  # pixels a pitch, of the raster that tells which dots lie in which region


@dataclass
class ContactDots:
    """What is known of the dots of one frame; entry k of each array belongs to the same dot.

    rows, columns: of the grid; ids: (N,) row * columns + column; xyz, rest_xyz: (N, 3) m, now and untouched, sensor frame; score: (N,),
    above 0.5 in contact; state: (N,) uint8, 0 none, 1 sticking, 2 slipping; force: (N, 3) N, object on sensor, or None; sigma: standard
    deviation of a coordinate of xyz, m; whole: places (K, 3), m, and scores (K,), and what follows them, of all dots of the grid, of those
    not seen as the membrane has them, where that is known. Raises BadArgument for shapes that differ or numbers that are not finite.
    """

    rows: int
    columns: int
    ids: np.ndarray
    xyz: np.ndarray
    rest_xyz: np.ndarray
    score: np.ndarray
    state: np.ndarray
    force: np.ndarray | None = None
    sigma: float = 30e-6
    whole: Sequence[np.ndarray] | None = None

    def __post_init__(self):
        count = len(self.ids)
        shapes = {'xyz': (count, 3), 'rest_xyz': (count, 3), 'score': (count,), 'state': (count,), 'force': (count, 3)}
        for name, shape in shapes.items():
            values = getattr(self, name)
            if values is not None and (np.shape(values) != shape or not np.isfinite(values).all()):
                raise BadArgument(f'contact dots: {name} must be {shape} finite numbers; leave dots out that are not known')
        if min(self.rows, self.columns) < 2 or not 0 < self.sigma < np.inf:
            raise BadArgument(f'contact dots: need a grid of 2 x 2 or more and sigma > 0, got {self.rows} x {self.columns}, {self.sigma}')

    def grids(self) -> tuple[np.ndarray, np.ndarray]:
        """Places (rows, columns, 3), m, and scores (rows, columns) of all dots; NaN where a dot was not seen and nothing is known of it."""
        if self.whole is None:
            return to_grid(self.ids, self.xyz, self.rows, self.columns), to_grid(self.ids, self.score, self.rows, self.columns)
        return self.whole[0].reshape(self.rows, self.columns, 3), self.whole[1].reshape(self.rows, self.columns)


@dataclass(frozen=True)
class Region:
    """One separate region.

    members: (N,) bool, the frame's dots in it; pitch: of the dots, m; surface: the present one.
    """

    outline: Outline
    moments: Moments
    members: np.ndarray
    pitch: float
    surface: DotSurface

    def boundary_sd(self, values: list[np.ndarray]) -> np.ndarray:
        """Standard deviations (C,) of integrals over the region whose integrands on outline and holes are values [(M, C), ...]."""
        return boundary_sd(self.outline.loops, values, self.pitch)


@dataclass
class ContactRegionEstimate:
    """The fields of tactile_msgs/ContactRegion; what is not known is NaN, area is 0 where nothing touches.

    dot_id, dot_state: (N,); outlines, holes: lists of (M, 3) m; area: m^2 on the surface; centroid, normal: (3,); orientation: rad in
    (-pi/2, pi/2]; major_axis, minor_axis: m, full lengths of the ellipse of the same moments; motion_rotation: (4,) quaternion x y z w and
    motion_translation: (3,) m, so that a point of the object at x comes to rotation x + translation, over motion_interval s.
    """

    dot_id: np.ndarray
    dot_state: np.ndarray
    outlines: list[np.ndarray] = field(default_factory=list)
    holes: list[np.ndarray] = field(default_factory=list)
    area: float = 0.0
    centroid: np.ndarray = field(default_factory=lambda: np.full(3, np.nan))
    normal: np.ndarray = field(default_factory=lambda: np.full(3, np.nan))
    orientation: float = np.nan
    major_axis: float = np.nan
    minor_axis: float = np.nan
    motion_translation: np.ndarray = field(default_factory=lambda: np.full(3, np.nan))
    motion_rotation: np.ndarray = field(default_factory=lambda: np.full(4, np.nan))
    motion_interval: float = np.nan


def find_regions(dots: ContactDots) -> list[Region]:
    """The separate regions of one frame, largest first."""
    if not len(dots.ids) or not (dots.score > 0.5).any():
        return []
    xyz, score = dots.grids()
    surface = DotSurface(xyz)
    outlines = region_outlines(score, surface)
    if not outlines:
        return []
    moments = MomentField(surface, outlines)
    members = [dots.score > 0.5] if len(outlines) == 1 else [_within(outline, dots) for outline in outlines]
    regions = [Region(outline, moments.of(outline), inside, moments.pitch, surface) for outline, inside in zip(outlines, members)]
    # Two dots that nearly touch may make the smooth score between them one that does: no dot in it, no contact.
    return [region for region in regions if region.moments.area > 0 and region.members.any()]


def _within(outline: Outline, dots: ContactDots) -> np.ndarray:
    """(N,) bool: the dots that touch, in the outline and in none of its holes."""
    mask = np.zeros(((dots.rows + 1) * _MASK_SCALE, (dots.columns + 1) * _MASK_SCALE), np.uint8)
    loops = [np.round((loop[:, ::-1] + 0.5) * _MASK_SCALE).astype(np.int32) for loop in (outline.grid_points, *outline.grid_holes)]
    cv2.fillPoly(mask, loops, 1)
    place = np.stack(np.divmod(np.asarray(dots.ids), dots.columns)) * _MASK_SCALE + _MASK_SCALE // 2
    return (mask[place[0], place[1]] > 0) & (dots.score > 0.5)


def describe(dots: ContactDots, regions: list[Region], motion: RigidFit | None = None, interval: float = np.nan) -> ContactRegionEstimate:
    """All fields of ContactRegion for one frame; motion: of the object over interval s, None when unknown."""
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


def axes(moments: Moments, loops: list[np.ndarray], pitch: float) -> tuple[float, float, float]:
    """Full lengths (m) of the ellipse of the same moments, and its direction (rad), NaN where errors of the outline could make it."""
    x, y = (moments.first[:2] / moments.area).tolist()
    xx, xy, yy = (moments.second / moments.area).tolist()
    xx, xy, yy = xx - x * x, xy - x * y, yy - y * y
    mean, half = 0.5 * (xx + yy), math.hypot(0.5 * (xx - yy), xy)
    major, minor = 4 * math.sqrt(max(mean + half, 0)), 4 * math.sqrt(max(mean - half, 0))
    angle = 0.5 * math.atan2(2 * xy, xx - yy)
    # Squares along and across, as the real part of a complex square.
    back = complex(math.cos(angle), -math.sin(angle))
    turned = [(np.ascontiguousarray(loop[:, :2]).view(complex) - complex(x, y)) * back for loop in loops]
    doubt = boundary_sd(loops, [(place * place).real for place in turned], pitch)[0] / moments.area
    if 2 * half < _DIRECTION * doubt:
        return major, minor, np.nan
    return major, minor, angle if angle > -0.5 * math.pi else 0.5 * math.pi


def boundary_sd(loops: list[np.ndarray], values: list[np.ndarray], pitch: float) -> np.ndarray:
    """Standard deviations (C,) of integrals over a region that errors of its outline make.

    loops: [(M, 3), ...] m, outline and holes; values: [(M, C), ...], the integrands there. Each stretch of OUTLINE_LENGTH pitches is
    taken to be off by OUTLINE_SIGMA pitches on its own.
    """
    squares = sum(_side_lengths(loop) @ value**2 for loop, value in zip(loops, values))
    return OUTLINE_SIGMA * pitch * np.sqrt(OUTLINE_LENGTH * pitch * squares)


def _side_lengths(loop: np.ndarray) -> np.ndarray:
    side = np.concatenate([loop[1:], loop[:1]]) - loop
    return np.sqrt(np.einsum('ij,ij->i', side, side))


def quaternion(rotation: np.ndarray) -> np.ndarray:
    """(4,) unit quaternion x, y, z, w, w >= 0, of a rotation matrix (3, 3)."""
    x, y, z = np.diag(rotation)
    squares = 0.25 * np.maximum([1 + x - y - z, 1 - x + y - z, 1 - x - y + z, 1 + x + y + z], 0)
    largest = int(np.argmax(squares))
    sums = np.array([[0, rotation[0, 1] + rotation[1, 0], rotation[0, 2] + rotation[2, 0], rotation[2, 1] - rotation[1, 2]],
                     [0, 0, rotation[1, 2] + rotation[2, 1], rotation[0, 2] - rotation[2, 0]],
                     [0, 0, 0, rotation[1, 0] - rotation[0, 1]], [0, 0, 0, 0]])
    sums = sums + sums.T
    answer = sums[largest] / (4 * np.sqrt(squares[largest]))
    answer[largest] = np.sqrt(squares[largest])
    return answer if answer[3] >= 0 else -answer
