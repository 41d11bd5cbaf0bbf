# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The method of the paper air_cushion_contact.

Markers are the contours of a thresholded image (section III.A), followed by SORT (sort.py). The contact point and its depth follow from the
four largest changes of the mean distance between a marker and its five neighbours.
"""
from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from ..common.dots import Dots
from ..common.marker_sensor import MarkerSensor, first_touch_height, rest_points
from ..core.errors import BadArgument, BadCalibration
from ..press.estimate import OUT_OF_RANGE, TouchEstimate
from ..press.field import MarkerField, common_rest
from ..press.methods import Method
from ..press.presses import Presses, rms_errors
from .areal_sensor_contact_position import Cubics, bright_image, marker_dots
from .constants import AREAL, CUSHION
from .detector import PublishedDetector


class PaperCushionDetector(PublishedDetector):
    """Markers by grey image, non-local means, Otsu's threshold, erosion and contours."""

    def detect(self, image: np.ndarray) -> Dots:
        """Markers of one image: centroid and area of their contours."""
        grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
        denoised = cv2.fastNlMeansDenoising(bright_image(grey, self._sign), h=CUSHION.denoising_strength,
                                            searchWindowSize=CUSHION.search_window)
        binary = cv2.threshold(denoised, 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)[1]
        contours = cv2.findContours(cv2.erode(binary, None), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
        moments = [m for m in map(cv2.moments, contours) if m['m00'] > 0]
        sums = np.array([(m['m00'], m['m10'], m['m01']) for m in moments]).reshape(-1, 3)
        return marker_dots(sums[:, 1:] / sums[:, :1], sums[:, 0])


def neighbours(rest: np.ndarray) -> np.ndarray:
    """The five nearest neighbours of each marker.

    Parameters
    ----------
    rest : ndarray, shape (K, 2)
        Undeformed positions, m; NaN where unknown.

    Returns
    -------
    ndarray of int, shape (K, 5)

    Raises
    ------
    BadCalibration
        If fewer than six positions are known.
    """
    distance = np.hypot(*(rest[:, None] - rest[None]).transpose(2, 0, 1))
    distance[~np.isfinite(distance)] = np.inf
    np.fill_diagonal(distance, np.inf)
    if np.isfinite(rest).all(1).sum() <= CUSHION.neighbours:
        raise BadCalibration(f'at least {CUSHION.neighbours + 1} markers must be seen; check the image of the untouched dome')
    return np.argsort(distance, axis=1)[:, :CUSHION.neighbours]


def distance_changes(field: MarkerField, near: np.ndarray) -> np.ndarray:
    """Absolute change of the mean distance to the neighbours (equation 1).

    Parameters
    ----------
    field : MarkerField
        The markers of one frame.
    near : ndarray of int, shape (K, 5)
        Neighbours of each marker; those that are seen count.

    Returns
    -------
    ndarray, shape (K,)
        In m; NaN for a marker that is not seen.
    """
    seen = field.seen

    def mean_distance(positions):
        """(K,) m, of positions (K, 2) to the neighbours that are seen."""
        distances = np.hypot(*(positions[near] - positions[:, None]).transpose(2, 0, 1))
        known = seen[near] & seen[:, None]
        return np.where(known, distances, 0.0).sum(1) / np.where(known.any(1), known.sum(1), np.nan)
    return np.abs(mean_distance(field.rest + field.shift) - mean_distance(field.rest))


def four_largest(changes: np.ndarray, positions: np.ndarray, max_distance: float) -> tuple[np.ndarray, float] | None:
    """The contact point by the four largest changes (equations 2 to 4).

    Parameters
    ----------
    changes : ndarray, shape (K,)
        Of the markers, m; NaN where unknown.
    positions : ndarray, shape (K, 2)
        Of the markers, m; NaN where unknown.
    max_distance : float
        From the largest change to the others, m.

    Returns
    -------
    tuple of ndarray, shape (2,), and float, or None
        Weighted position and mean change, m; None if nothing changed.
    """
    changes = np.where(np.isfinite(changes) & np.isfinite(positions).all(1), changes, 0.0)
    first = int(changes.argmax())
    if not changes[first] > 0:
        return None
    is_near = np.hypot(*(positions - positions[first]).T) <= max_distance
    four = np.argsort(np.where(is_near, changes, -1.0))[::-1][:CUSHION.largest_changes]
    four = four[is_near[four]]
    middle, share = positions[four].mean(0), changes[four] / changes[four].sum()
    return middle + share @ (positions[four] - middle), float(changes[four].mean())


@dataclass(frozen=True)
class CushionCalibration:
    """Calibration of PaperCushion.

    Parameters
    ----------
    rest : ndarray, shape (K, 2)
        Undeformed positions of the markers, m.
    camera_centres : ndarray, shape (K, 3)
        Camera centre of each marker, m.
    cubic : Cubics
        From a mean change to a depth (equation 5).
    quiet : float
        Detection threshold of the mean change, m.
    place_sigma, depth_sigma : float
        RMS errors of position and depth at the presses of the calibration, m.
    """

    rest: np.ndarray
    camera_centres: np.ndarray
    cubic: Cubics
    quiet: float
    place_sigma: float
    depth_sigma: float


class PaperCushion:
    """The paper's method on a dome; it reports one contact at most.

    Parameters
    ----------
    calibration : CushionCalibration
    sensor : MarkerSensor
    """

    def __init__(self, calibration: CushionCalibration, sensor: MarkerSensor):
        self.calibration, self.sensor = calibration, sensor
        self.near = neighbours(calibration.rest)
        self.points = rest_points(calibration.rest, calibration.camera_centres, sensor)

    def measure(self, field: MarkerField) -> tuple[np.ndarray, float] | None:
        """Position (2,) in sensor x and y and mean change, m; None if nothing changed. Raises BadArgument for another pattern."""
        if len(field) != len(self.near):
            raise BadArgument(f'calibrated for {len(self.near)} markers, got a field of {len(field)}')
        return four_largest(distance_changes(field, self.near), self.points[:, :2], CUSHION.max_distance * max(self.sensor.pitch))

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """The contact of one frame, with the RMS errors at the presses of the calibration as covariance; empty without contact."""
        found, known = self.measure(field), self.calibration
        if found is None or not found[1] > known.quiet:
            return []
        depth, is_outside = (value.item() for value in known.cubic(np.array([found[1]])))
        height = first_touch_height(found[0], 0.0, self.sensor)[0] - depth
        variance = np.square([known.place_sigma, known.place_sigma, known.depth_sigma])
        return [TouchEstimate(np.append(found[0], height), depth, np.diag(variance), known.depth_sigma,
                              flags=OUT_OF_RANGE if is_outside else 0)]


def calibrate_cushion(presses: Presses, sensor: MarkerSensor, _known: CushionCalibration | None = None) -> CushionCalibration:
    """Calibrate PaperCushion. Raises BadCalibration if the presses determine no rising cubic."""
    rest, camera_centres = common_rest(presses.fields)
    near, positions = neighbours(rest), rest_points(rest, camera_centres, sensor)[:, :2]
    found = [four_largest(distance_changes(field, near), positions, CUSHION.max_distance * max(sensor.pitch)) for field in presses.fields]
    change = np.array([0.0 if f is None else f[1] for f in found])
    cubic = Cubics.fit(change[presses.touching, None], presses.depth[presses.touching])
    if np.isnan(cubic.low).any():
        raise BadCalibration('the distances between markers do not change with depth; check the presses\' depths')
    quiet = float(max(CUSHION.threshold_ratio * change[~presses.touching].max(initial=0.0), AREAL.min_threshold))
    found = CushionCalibration(rest, camera_centres, cubic, quiet, np.nan, np.nan)
    return replace(found, **rms_errors(PaperCushion(found, sensor), presses))


#: For the table of methods of domes.
METHOD = Method(calibrate_cushion, CushionCalibration, PaperCushion)
