# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact regions: level contours of the dots' contact score on the current surface, and their moments."""
from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from .. import _core
from .dot_grid import fill_unseen
from .dot_surface import DotSurface
from .region_moments import Moments
from ..errors import BadArgument

REFINE = 2  # steps per pitch of an outline. Chosen
# Gaussian of half a pitch, which smooths the staircase of labels along a slanted edge.
_LABEL_SPREAD = np.float32([0.107, 0.786, 0.107])


@dataclass(frozen=True)
class Outline:
    """One region: a closed polygon and the holes in it, in the sensor frame and on the grid (last vertex joins the first).

    points: (M, 3) m, M >= 3, turning from +x to +y; holes: list of (M, 3) m, turning the other way; grid_points, grid_holes: the same
    vertices as (row, column), where a dot is at whole numbers.
    """

    points: np.ndarray
    holes: list[np.ndarray]
    grid_points: np.ndarray
    grid_holes: list[np.ndarray]

    @property
    def loops(self) -> list[np.ndarray]:
        """The outline and its holes, (M, 3) each."""
        return [self.points, *self.holes]


def label_score(contact: np.ndarray) -> np.ndarray:
    """Score (rows, columns), level 0.5, from labels: contact (rows, columns) of 0 and 1, NaN for unseen dots."""
    filled = np.clip(fill_unseen(contact), 0, 1)
    return cv2.sepFilter2D(filled, -1, _LABEL_SPREAD, _LABEL_SPREAD, borderType=cv2.BORDER_REPLICATE)


def region_outlines(score: np.ndarray, surface: DotSurface, level: float = 0.5, refine: int = REFINE,
                    ceiling: float = 1.0) -> tuple[list[Outline], list[Moments], float]:
    """Regions where score (rows, columns) is above level, largest first: outlines on the surface, moments without the holes, and
    the mean distance of neighbouring dots, m, in the part of the surface that they cover.

    Unseen dots (NaN) are filled from their neighbours. score is clipped to 0 and ceiling, so that the border is independent of the pressure
    of an edge. Outlines have refine steps per pitch. Regions at the pattern's border are closed half a pitch outside the last dots.
    Raises BadArgument for shapes that do not fit.
    """
    if score.shape != surface.shape or refine < 1 or not 0 < level < ceiling:
        raise BadArgument(f'region_outlines: need score {surface.shape}, refine >= 1 and 0 < level < ceiling, '
                          f'got {score.shape}, {refine}, {level}, {ceiling}')
    places, start, region, points, moments, pitch = _core.find_outlines(fill_unseen(score), surface.wide, level=level, ceiling=ceiling,
                                                                        refine=refine)
    return grouped(places, points, start, region), [Moments(float(sums[0]), sums[1:4], sums[4:7], sums[7:]) for sums in moments], pitch


def grouped(places: np.ndarray, points: np.ndarray, start: np.ndarray, region: np.ndarray) -> list[Outline]:
    """Outlines with the holes that lie in them, from vertices places (M, 2), points (M, 3), the first ones, and M, of the polygons start
    (L + 1,), and their regions (L,), as the kernels give them."""
    ends, outlines = start.tolist(), []
    for k, number in enumerate(region.tolist()):
        part = slice(ends[k], ends[k + 1])
        if number == len(outlines):
            outlines.append(Outline(points[part], [], places[part], []))
        else:
            outlines[number].holes.append(points[part])
            outlines[number].grid_holes.append(places[part])
    return outlines
