# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The method of the paper taxel_array_image_processing.

Nonzero taxels are contact (section II.B), edges are its shape (section III.B), slip is the pyramidal Lucas-Kanade flow of corner features
(section III.C).
"""
from __future__ import annotations

import cv2
import numpy as np

from ..common.estimates import NONE, SlipEstimate, next_state, planar_twist
from ..taxel.estimator import Observed
from ..taxel.pressure import SoftPad, TaxelArray
from ..taxel.region import find_regions
from ..taxel.response import Response
from .constants import TAXEL_ARRAY


def image_moments(image: np.ndarray, array: TaxelArray) -> tuple[np.ndarray, float]:
    """Centroid and angle by the moments of an image's values (equations 1 to 4).

    Parameters
    ----------
    image : ndarray, shape (rows, columns)
        Values of the taxels, not negative.
    array : TaxelArray

    Returns
    -------
    centroid : ndarray, shape (2,)
        In m; NaN of an image without values.
    angle : float
        Of the major axis, rad in (-pi/2, pi/2]; NaN of an image without values.
    """
    total = float(image.sum())
    if not total > 0:
        return np.full(2, np.nan), np.nan
    by_column, by_row = image.sum(axis=0, dtype=float), image.sum(axis=1, dtype=float)
    x, y = by_column @ array.x / total, by_row @ array.y / total
    from_x, from_y = array.x - x, array.y - y
    mixed = float(from_y @ image @ from_x)
    return np.array([x, y]), float(0.5 * np.arctan2(2 * mixed, by_column @ from_x**2 - by_row @ from_y**2))


def edge_loops(image: np.ndarray, array: TaxelArray) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Outlines and holes of the contacts in an image by its edges (section III.B).

    Loops of edges are outlines, those within one are holes, those within a hole outlines. Beyond the array's rim nothing is pressed.

    Parameters
    ----------
    image : ndarray, shape (rows, columns)
        Values of the taxels, not negative.
    array : TaxelArray

    Returns
    -------
    outlines, holes : list of ndarray, shape (n, 3)
        In m.
    """
    maximum = float(image.max(initial=0.0))
    if not maximum > 0:
        return [], []
    grey = cv2.copyMakeBorder(np.clip(image * (255 / maximum), 0, 255).astype(np.uint8), 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0)
    edges = cv2.Canny(grey, *TAXEL_ARRAY.edge_thresholds, L2gradient=True)  # the paper names no detector of edges
    lines, family = cv2.findContours(edges, cv2.RETR_TREE, cv2.CHAIN_APPROX_NONE)
    parents = family[0, :, 3] if lines else ()
    found: tuple[list, list] = [], []
    for line, parent in zip(lines, parents):
        depth = 0  # in the tree, in which the inner border of a loop of edges lies between the loop and what it encloses
        while parent >= 0:
            depth, parent = depth + 1, parents[parent]
        if depth % 2 == 0 and len(line) >= 3:
            position = (line[:, 0] - 1 - 0.5 * np.array([array.columns - 1, array.rows - 1])) * array.pitch
            found[depth // 2 % 2].append(np.pad(position, ((0, 0), (0, 1))))
    return found


def _corners(image):
    """(N, 1, 2) corner features of an image; None without any."""
    return cv2.goodFeaturesToTrack(image, TAXEL_ARRAY.max_corners, TAXEL_ARRAY.corner_quality, TAXEL_ARRAY.corner_distance,
                                   blockSize=TAXEL_ARRAY.corner_block)


class PaperMethod:
    """Contact and slip as published, without a model of the pad.

    Parameters
    ----------
    array : TaxelArray

    Attributes
    ----------
    is_depth_preferred : bool
        The force follows from equation 5 where the depth is known.
    """

    is_depth_preferred = True

    def __init__(self, array: TaxelArray):
        self._array = array
        self.reset()

    def reset(self) -> None:
        """The next image is the first."""
        self._last: tuple[np.ndarray, float] | None = None
        self._state = NONE

    def observe(self, pressure: np.ndarray, sigma: float, full: np.ndarray, stamp_s: float) -> Observed:
        """Regions of nonzero taxels, with the centre and angle of all contacts by the image's values, its edges, and slip since the last
        frame. pressure: (rows, columns); sigma: its noise; full: saturated taxels; stamp_s: s."""
        touched = pressure > TAXEL_ARRAY.zero_sigmas * sigma
        image = np.where(touched, pressure, 0)
        regions = find_regions(touched.astype(np.float32), pressure, self._array, full=full)
        return Observed(regions, self._slip(bool(regions.all), pressure, stamp_s), *image_moments(image, self._array),
                        *edge_loops(image, self._array))

    def _slip(self, touches: bool, pressure: np.ndarray, stamp_s: float) -> SlipEstimate:
        maximum = float(pressure.max(initial=0.0))
        if not touches or maximum <= 0:
            self.reset()
            return SlipEstimate()
        image = np.clip(pressure * (255 / maximum), 0, 255).astype(np.uint8)
        last, self._last = self._last, (image, stamp_s)
        corners = None if last is None or min(image.shape) < TAXEL_ARRAY.min_side else _corners(last[0])
        if corners is None or len(corners) < TAXEL_ARRAY.min_features:
            return SlipEstimate(self._state, 0.0, np.zeros(3), np.zeros(3))
        side = TAXEL_ARRAY.flow_window
        now, status, _ = cv2.calcOpticalFlowPyrLK(last[0], image, corners, None, winSize=(side, side), maxLevel=TAXEL_ARRAY.flow_levels)
        good = status.ravel() > 0
        if good.sum() < TAXEL_ARRAY.min_features:
            return SlipEstimate(self._state, 0.0, np.zeros(3), np.zeros(3))
        return self._estimate(corners[good, 0], (now - corners)[good, 0], stamp_s - last[1])

    def _estimate(self, corners: np.ndarray, flow: np.ndarray, interval: float) -> SlipEstimate:
        moves = np.hypot(flow[:, 0], flow[:, 1]) > TAXEL_ARRAY.min_displacement
        fraction = float(moves.mean())
        self._state = next_state(self._state, fraction)
        position = (corners - 0.5 * np.array([self._array.columns - 1, self._array.rows - 1])) * self._array.pitch
        velocity = flow * (self._array.pitch / interval)
        estimate = SlipEstimate(self._state, fraction, np.zeros(3), np.zeros(3), x=position[moves, 0], y=position[moves, 1],
                                vx=velocity[moves, 0], vy=velocity[moves, 1])
        if self._state == NONE:
            return estimate
        linear, turn, centre = planar_twist(position, velocity)
        estimate.linear, estimate.angular = np.array([*linear, 0.0]), np.array([0.0, 0.0, turn])
        estimate.rotation_center = np.array([*centre, 0.0]) if np.isfinite(centre).all() else np.full(3, np.nan)
        return estimate


def make_method(array: TaxelArray, pad: SoftPad, response: Response) -> PaperMethod:
    """The method; it uses neither the pad nor the response."""
    return PaperMethod(array)
