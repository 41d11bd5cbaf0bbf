# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The published method of the paper air_cushion_contact.

Markers are the contours of a thresholded image (section III.A); the contact point and the depth follow from the four largest changes of the
mean distance to five neighbours. Markers are followed by SORT (sort.py).
"""
from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from ..common.dots import Dots
from ..common.marker_sensor import MarkerSensor, first_touch_height, rest_points
from ..errors import BadArgument, BadCalibration
from ..press.estimate import OUT_OF_RANGE, TouchEstimate
from ..press.field import MarkerField, common_rest
from ..press.methods import Method
from ..press.presses import Presses, rms_errors
from .areal_sensor_contact_position import MIN_THRESHOLD, SQUARE, Cubics, bright_image, marker_dots

_DENOISE, _WITHIN = 10.0, 7  # grey levels, strength of the non-local means; px, side of the window in which it looks for what is alike


class PaperCushionDetector:
    """Grey, non-local means, Otsu's threshold, erosion, contours; sign: 1 for bright markers, -1 for dark."""

    def __init__(self, sign: int):
        self._sign = sign

    def detect(self, image: np.ndarray) -> Dots:
        """Markers of one checked uint8 image: centroid and area of their contours. Raises BadFrame where there are none."""
        grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
        denoised = cv2.fastNlMeansDenoising(bright_image(grey, self._sign), h=_DENOISE, searchWindowSize=_WITHIN)
        binary = cv2.threshold(denoised, 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)[1]
        contours = cv2.findContours(cv2.erode(binary, SQUARE), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
        moments = [m for m in map(cv2.moments, contours) if m['m00'] > 0]
        sums = np.array([(m['m00'], m['m10'], m['m01']) for m in moments]).reshape(-1, 3)
        return marker_dots(sums[:, 1:] / sums[:, :1], sums[:, 0])


QUIET = 2.0  # detection threshold of a dome over the maximum change of distance in untouched frames. Chosen
NEAREST, LARGEST = 5, 4  # neighbours; changes (eq 2)
RANGE = 3.0   # pitches from the largest change within which the others are searched; the paper gives no number. Chosen


def neighbours(rest: np.ndarray) -> np.ndarray:
    """(K, 5) ids of the five nearest neighbours of each marker at rest (K, 2) m. Raises BadCalibration where fewer are known."""
    apart = np.hypot(*(rest[:, None] - rest[None]).transpose(2, 0, 1))
    apart[~np.isfinite(apart)] = np.inf
    np.fill_diagonal(apart, np.inf)
    if np.isfinite(rest).all(1).sum() <= NEAREST:
        raise BadCalibration(f'at least {NEAREST + 1} markers must be seen; check the image of the untouched dome')
    return np.argsort(apart, axis=1)[:, :NEAREST]


def distance_changes(field: MarkerField, near: np.ndarray) -> np.ndarray:
    """(K,) m, absolute change of the mean distance (eq 1) to the neighbours near (K, 5) that are seen; NaN for a marker not seen."""
    now = field.rest + field.shift

    def mean_distance(places):
        """(K,) m, of places (K, 2) to the neighbours that are seen."""
        distances = np.hypot(*(places[near] - places[:, None]).transpose(2, 0, 1))
        both = seen[near] & seen[:, None]
        return np.where(both, distances, 0.0).sum(1) / np.where(both.any(1), both.sum(1), np.nan)
    seen = field.seen
    return np.abs(mean_distance(now) - mean_distance(field.rest))


def four_largest(changes: np.ndarray, places: np.ndarray, reach: float) -> tuple[np.ndarray, float] | None:
    """Weighted place (2,) m (eqs 2 to 4) and mean change, m, of the four largest changes within reach of the largest; None: no change."""
    changes = np.where(np.isfinite(changes) & np.isfinite(places).all(1), changes, 0.0)
    first = int(changes.argmax())
    if not changes[first] > 0:
        return None
    close = np.hypot(*(places - places[first]).T) <= reach
    four = np.argsort(np.where(close, changes, -1.0))[::-1][:LARGEST]
    four = four[close[four]]
    middle, share = places[four].mean(0), changes[four] / changes[four].sum()
    return middle + share @ (places[four] - middle), float(changes[four].mean())


@dataclass(frozen=True)
class CushionCalibration:
    """rest: (K, 2) m, and camera_centres: (K, 3) m, of the untouched markers; cubic: from a mean change to a depth; the rest as of
    PaperCalibration."""

    rest: np.ndarray
    camera_centres: np.ndarray
    cubic: Cubics
    quiet: float
    place_sigma: float
    depth_sigma: float


class PaperCushion:
    """The paper's method on a dome; detects one touch at most."""

    def __init__(self, calibration: CushionCalibration, sensor: MarkerSensor):
        self.calibration, self.sensor = calibration, sensor
        self.near = neighbours(calibration.rest)
        self.points = rest_points(calibration.rest, calibration.camera_centres, sensor)

    def measure(self, field: MarkerField) -> tuple[np.ndarray, float] | None:
        """Place (2,) m in sensor x and y, and mean change, m; None where nothing changed. Raises BadArgument for another pattern."""
        if len(field) != len(self.near):
            raise BadArgument(f'calibrated for {len(self.near)} markers, got a field of {len(field)}')
        return four_largest(distance_changes(field, self.near), self.points[:, :2], RANGE * max(self.sensor.pitch))

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """The touch of one frame, with the RMS errors at the presses of the calibration as covariance; empty without contact."""
        found, known = self.measure(field), self.calibration
        if found is None or not found[1] > known.quiet:
            return []
        depth, outside = (value.item() for value in known.cubic(np.array([found[1]])))
        height = first_touch_height(found[0], 0.0, self.sensor)[0] - depth
        variance = np.square([known.place_sigma, known.place_sigma, known.depth_sigma])
        return [TouchEstimate(np.append(found[0], height), depth, np.diag(variance), known.depth_sigma,
                              flags=OUT_OF_RANGE if outside else 0)]


def calibrate_cushion(presses: Presses, sensor: MarkerSensor, _known: CushionCalibration | None = None) -> CushionCalibration:
    """Calibrate PaperCushion. Raises BadCalibration where the presses determine no rising cubic."""
    rest, camera_centres = common_rest(presses.fields)
    near, places = neighbours(rest), rest_points(rest, camera_centres, sensor)[:, :2]
    found = [four_largest(distance_changes(field, near), places, RANGE * max(sensor.pitch)) for field in presses.fields]
    change = np.array([0.0 if f is None else f[1] for f in found])
    cubic = Cubics.fit(change[presses.touching, None], presses.depth[presses.touching])
    if np.isnan(cubic.low).any():
        raise BadCalibration('the distances between markers do not change with depth; check the presses\' depths')
    quiet = float(max(QUIET * change[~presses.touching].max(initial=0.0), MIN_THRESHOLD))
    found = CushionCalibration(rest, camera_centres, cubic, quiet, np.nan, np.nan)
    return replace(found, **rms_errors(PaperCushion(found, sensor), presses))


#: For the table of methods of domes.
METHOD = Method(calibrate_cushion, CushionCalibration, PaperCushion)
