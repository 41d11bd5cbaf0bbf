# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The method of the paper areal_sensor_contact_position.

Markers are thresholded regions of the green channel (section 2.2). The depth of each follows from its area and its displacement, the
contact point from Gaussians through the depths.
"""
from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from ..common.dots import Dots
from ..common.marker_sensor import MarkerSensor
from ..core.errors import BadArgument, BadCalibration, BadFrame
from ..press.estimate import AT_EDGE, OUT_OF_RANGE, TouchEstimate
from ..press.field import MarkerField, common_rest
from ..press.methods import Method
from ..press.presses import Presses, rms_errors
from .constants import AREAL
from .detector import PublishedDetector


class PaperArealDetector(PublishedDetector):
    """Markers by green channel, opening, Otsu's threshold and labels."""

    def detect(self, image: np.ndarray) -> Dots:
        """Markers of one image: centroid and number of their pixels."""
        green = image if image.ndim == 2 else cv2.extractChannel(image, 1)
        opened = cv2.morphologyEx(bright_image(green, self._sign), cv2.MORPH_OPEN, None)  # None: a square of 3 px
        binary = cv2.threshold(opened, 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)[1]
        _, _, stats, centre = cv2.connectedComponentsWithStats(binary, connectivity=8)
        return marker_dots(centre[1:], stats[1:, cv2.CC_STAT_AREA])


def bright_image(grey: np.ndarray, sign: int) -> np.ndarray:
    """The image in which markers are bright; sign: 1 if they are already, -1 for dark ones."""
    return grey if sign > 0 else cv2.bitwise_not(grey)


def marker_dots(uv: np.ndarray, area: np.ndarray) -> Dots:
    """Those of the regions at uv (N, 2) px that have a marker's size; area: (N,) px. Raises BadFrame without any."""
    area = np.asarray(area, float)
    kept = area >= AREAL.min_area
    median = np.median(area[kept]) if kept.any() else np.nan
    smallest, largest = AREAL.median_areas
    kept &= (area > smallest * median) & (area < largest * median)
    if not kept.any():
        raise BadFrame('no region of a marker\'s size is left after the threshold: check light, focus and the parameter polarity')
    return Dots(np.asarray(uv, float)[kept], area[kept], np.full(int(kept.sum()), np.nan))


@dataclass(frozen=True)
class Cubics:
    """Depths of K markers as cubics of a value x each.

    Parameters
    ----------
    coefficients : ndarray, shape (K, 4)
        Of the powers of (x - low) / (high - low), in m, the constant first.
    low, high : ndarray, shape (K,)
        Calibrated range of x. All three are NaN where x was not seen.

    Notes
    -----
    depth = c0 + c1 x + c2 x^2 + c3 x^3: equations 1 and 2, and equation 5 of the paper air_cushion_contact.
    """

    coefficients: np.ndarray
    low: np.ndarray
    high: np.ndarray

    def __post_init__(self):
        if self.coefficients.shape != (len(self.low), AREAL.degree + 1) or self.low.shape != self.high.shape:
            raise ValueError(f'coefficients {self.coefficients.shape} of {len(self.low)} markers')

    @classmethod
    def fit(cls, x: np.ndarray, depth: np.ndarray) -> Cubics:
        """Fit by least squares.

        Parameters
        ----------
        x : ndarray, shape (M, K)
            Values at M depths; NaN where a marker was not seen.
        depth : ndarray, shape (M,)
            In m.

        Returns
        -------
        Cubics
            NaN for a marker that was seen fewer than five times, or whose x does not change.
        """
        count = x.shape[1]
        coefficients, low, high = np.full((count, AREAL.degree + 1), np.nan), np.full(count, np.nan), np.full(count, np.nan)
        for k, column in enumerate(x.T):
            seen = np.isfinite(column)
            if seen.sum() <= AREAL.degree + 1 or not np.ptp(column[seen]) > 0:
                continue
            low[k], high[k] = column[seen].min(), column[seen].max()
            coefficients[k] = _monotone((column[seen] - low[k]) / (high[k] - low[k]), depth[seen])
        return cls(coefficients, low, high)

    def __call__(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Depths (K,), m, of x (K,) clamped to the calibrated range, NaN where unknown; and whether x lies outside it."""
        relative = (x - self.low) / (self.high - self.low)
        clamped = np.clip(relative, 0.0, 1.0)
        is_outside = (relative > 1.0) | (relative < -AREAL.range_margin)
        return (self.coefficients * clamped[:, None] ** np.arange(AREAL.degree + 1)).sum(1), is_outside


def _monotone(x: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """(4,) coefficients over 0 <= x <= 1 of the highest degree up to three that only rises or only falls there: one x has one depth."""
    samples, order = np.linspace(0.0, 1.0, 21)[:, None], np.arange(1, AREAL.degree + 1)
    for degree in range(AREAL.degree, 0, -1):
        fitted = np.zeros(AREAL.degree + 1)
        fitted[:degree + 1] = np.linalg.lstsq(x[:, None] ** np.arange(degree + 1), depth, rcond=None)[0]
        slope = samples ** (order - 1) @ (order * fitted[1:])
        if slope.min() >= 0 or slope.max() <= 0:
            break
    return fitted


def area_and_shift(field: MarkerField) -> tuple[np.ndarray, np.ndarray]:
    """x_a, area over the undeformed area, and x_c, displacement in m, of each marker (K,)."""
    return np.exp(field.growth), np.hypot(*field.shift.T)


@dataclass(frozen=True)
class MarkerDepths:
    """Depth of each of K markers by its area and by its displacement, weighted.

    Parameters
    ----------
    area, shift : Cubics
        Depth by area and by displacement (equations 1 and 2).
    weight : ndarray, shape (K,)
        w_a of equation 5; w_c is 1 - w_a (equation 7).
    """

    area: Cubics
    shift: Cubics
    weight: np.ndarray

    def each(self, field: MarkerField) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
        """y_a and y_c (equations 1 and 2), each with whether it is out of range."""
        by_area, by_shift = area_and_shift(field)
        return self.area(by_area), self.shift(by_shift)

    def depths(self, field: MarkerField) -> tuple[np.ndarray, np.ndarray]:
        """Depth of each marker (equation 6).

        Parameters
        ----------
        field : MarkerField
            The markers of one frame.

        Returns
        -------
        depth : ndarray, shape (K,)
            In m; by one of the two cubics where the other is unknown, NaN where both are.
        is_outside : ndarray of bool, shape (K,)
            Whether it is out of the calibrated range.
        """
        (area, area_outside), (shift, shift_outside) = self.each(field)
        weight = np.where(np.isnan(area), 0.0, np.where(np.isnan(shift), 1.0, self.weight))
        depth = np.where(weight > 0, weight * area, 0.0) + np.where(weight < 1, (1 - weight) * shift, 0.0)
        return depth, np.where(weight > 0.5, area_outside, shift_outside)

    @classmethod
    def fit(cls, presses: Presses, pitch: float) -> MarkerDepths:
        """Fit the cubics to the presses of a plate (fig 5) and the weights to those of a tip (fig 10), which the cubics have not seen.

        Parameters
        ----------
        presses : Presses
            Of a tip, with those of the plate.
        pitch : float
            Distance between markers, m.

        Raises
        ------
        BadCalibration
            Without a plate, or if no tip was pressed onto a marker.
        """
        if presses.plate is None:
            raise BadCalibration("the paper's method needs a plate that is pressed onto all markers, step by step: calibrate --plate BAG")
        plate = presses.plate
        area, shift = (np.stack(values) for values in zip(*map(area_and_shift, plate.fields)))
        found = cls(Cubics.fit(area, plate.depth), Cubics.fit(shift, plate.depth), np.full(area.shape[1], 0.5))
        return cls(found.area, found.shift, found._weights(presses, pitch))

    def _weights(self, presses: Presses, pitch: float) -> np.ndarray:
        """w_a (K,) of equations 3 to 5; a marker that no tip was pressed onto has that of the nearest one that a tip was pressed onto."""
        rest, squares, count = common_rest(presses.fields)[0], np.zeros((len(self.weight), 2)), np.zeros((len(self.weight), 2))
        for k in np.flatnonzero(presses.touching):
            distance = np.hypot(*(rest - presses.position[k, :2]).T)
            marker = int(np.nanargmin(distance))
            if distance[marker] < pitch / 2:
                error = np.array([depth[marker] for depth, _ in self.each(presses.fields[k])]) - presses.depth[k]
                squares[marker] += np.nan_to_num(error)**2
                count[marker] += np.isfinite(error)
        known = np.flatnonzero(count.all(1))
        if not len(known):
            raise BadCalibration('no tip was pressed onto a marker; press at positions of markers too')
        sigma = np.sqrt(squares[known] / count[known])
        weight = sigma[:, 1] / np.maximum(sigma.sum(1), 1e-12)
        distance = np.nan_to_num(np.hypot(*(rest[:, None] - rest[known]).transpose(2, 0, 1)), nan=np.inf)
        return weight[distance.argmin(1)]


def plate_step(plate: Presses) -> float:
    """The step, m, of a plate's stage.

    It is the median distance of the depths at which the stage stops, which are those of two consecutive frames; where it stops for a frame
    each, of all depths.
    """
    depth = np.round(plate.depth, 5)
    stops = np.unique(depth[1:][np.diff(depth) == 0])
    return float(np.median(np.diff(stops if len(stops) > AREAL.min_plate_depths else np.unique(depth))))


def check_plate(plate: Presses, sensor: MarkerSensor) -> None:
    """Check that the presses of a plate determine the cubics.

    Parameters
    ----------
    plate : Presses
        Of the plate.
    sensor : MarkerSensor
        The sheet.

    Raises
    ------
    BadCalibration
        If the plate stops at too few depths, or is tilted: by how the markers move away from the foot point of the camera centre, it is
        deeper at a corner of the sheet than in the middle by more than half a step.
    """
    depths = len(np.unique(np.round(plate.depth[plate.touching], 5)))
    if depths < AREAL.min_plate_depths:
        raise BadCalibration(f'plate: {depths} depths; at least {AREAL.min_plate_depths} are needed: press it in steps of a millimetre '
                             'over the whole range')
    slopes = []
    for field, true in zip((field for field, on in zip(plate.fields, plate.touching) if on), plate.depth[plate.touching]):
        arm = field.rest - field.camera_centre[:, :2]
        distance = np.hypot(*arm.T)
        zoom = (field.shift * arm).sum(1) / np.maximum(distance, 1e-9)**2  # depth over the remaining distance to the camera centre
        excess = np.abs(field.camera_centre[:, 2]) * zoom / (1 + zoom) - true
        seen = np.isfinite(excess)
        plane = np.column_stack([field.rest, np.ones(len(distance))])[seen] * distance[seen, None]
        slopes.append(np.linalg.lstsq(plane, excess[seen] * distance[seen], rcond=None)[0][:2])
    slope = np.median(slopes, axis=0)
    at_corner = float(np.abs(slope) @ (np.array(sensor.size) / 2))
    if at_corner > plate_step(plate) / 2:
        raise BadCalibration(f'plate: tilted by {np.degrees(np.arctan(np.hypot(*slope))):.1f} degrees, so that a corner is '
                             f'{1e3 * at_corner:.1f} mm deeper than the middle; align it with the sheet')


@dataclass(frozen=True)
class GridPoint:
    """A contact point: its position (2,), m, and depth, m; at_edge, whether it is on the border of the grid."""

    position: np.ndarray
    depth: float
    at_edge: bool


def gaussian(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Centre and height of the Gaussian through y > 0 at x (equations 8 to 13), between the ends of x; NaN where there is none."""
    if len(x) < 3:
        return np.nan, np.nan
    middle, scale = x.mean(), np.ptp(x)
    d = np.linalg.lstsq(((x - middle) / scale)[:, None] ** np.arange(3), np.log(y / y.max()), rcond=None)[0]
    if not d[2] < 0 or not abs(centre := -d[1] / (2 * d[2])) * scale <= np.abs(x - middle).max():
        return np.nan, np.nan
    return float(middle + centre * scale), float(y.max() * np.exp(d[0] - d[1]**2 / (4 * d[2])))


def grid_point(depth: np.ndarray, positions: np.ndarray) -> GridPoint | None:
    """The contact point of the depths of markers on a grid.

    Parameters
    ----------
    depth : ndarray, shape (rows, columns)
        In m; NaN where unknown.
    positions : ndarray, shape (rows, columns, 2)
        Of the markers, m; NaN where unknown.

    Returns
    -------
    GridPoint or None
        None if no marker has a positive depth.

    Notes
    -----
    The paper does not say what it does where the logarithm of a depth does not exist, nor at the border. Here the fits take the positive
    depths among the five, at least three; the height is the mean of both fits; where an axis has no Gaussian the deepest marker itself is
    reported.
    """
    depth = np.where(np.isfinite(positions).all(-1) & np.isfinite(depth), depth, np.nan)
    if not np.nanmax(depth, initial=0.0) > 0:
        return None
    row, column = np.unravel_index(np.nanargmax(depth), depth.shape)
    at_edge = bool(row in (0, depth.shape[0] - 1) or column in (0, depth.shape[1] - 1))
    fits = np.array([gaussian(x[y > 0], y[y > 0]) for x, y in _lines(depth, positions, row, column)])
    if np.isfinite(fits).all():
        return GridPoint(fits[:, 0], float(fits[:, 1].mean()), at_edge)
    return GridPoint(positions[row, column].copy(), float(depth[row, column]), at_edge)


def _lines(depth, positions, row, column):
    """Along x and along y: positions and depths of the deepest marker and its neighbours, fewer at the border."""
    for axis in (0, 1):
        index = (column, row)[axis] + np.arange(-AREAL.neighbours, AREAL.neighbours + 1)
        index = index[(index >= 0) & (index < depth.shape[1 - axis])]
        line = (row, index) if axis == 0 else (index, column)
        yield positions[line][:, axis], depth[line]


@dataclass(frozen=True)
class PaperCalibration:
    """Calibration of PaperTouch.

    Parameters
    ----------
    depths : MarkerDepths
        Of the markers.
    quiet : float
        Detection threshold, m.
    place_sigma, depth_sigma : float
        RMS errors of position and depth at the presses of the calibration, m.
    """

    depths: MarkerDepths
    quiet: float
    place_sigma: float
    depth_sigma: float


class PaperTouch:
    """The paper's method on a sheet with a regular grid; it reports one contact at most.

    Parameters
    ----------
    calibration : PaperCalibration
    sensor : MarkerSensor

    Raises
    ------
    BadArgument
        If the sensor is no sheet with the calibrated number of markers.
    """

    def __init__(self, calibration: PaperCalibration, sensor: MarkerSensor):
        if not sensor.is_sheet or sensor.rows * sensor.columns != len(calibration.depths.weight):
            raise BadArgument(f'the paper\'s method needs a sheet with a grid of {len(calibration.depths.weight)} markers, got {sensor}')
        self.calibration, self.sensor = calibration, sensor

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """The contact of one frame, with the RMS errors at the presses of the calibration as covariance; empty without contact."""
        known = self.calibration
        depth, is_outside = known.depths.depths(field)
        shape = self.sensor.rows, self.sensor.columns
        point = grid_point(depth.reshape(shape), field.rest.reshape(shape + (2,)))
        if point is None or not point.depth > known.quiet:
            return []
        half = np.array(self.sensor.size) / 2
        position = np.clip(point.position, -half, half)
        flags = (OUT_OF_RANGE if is_outside[np.nanargmax(depth)] else 0) | (AT_EDGE if point.at_edge else 0)
        variance = np.square([known.place_sigma, known.place_sigma, known.depth_sigma])
        return [TouchEstimate(np.append(position, -point.depth), point.depth, np.diag(variance), known.depth_sigma, flags=flags)]


def calibrate_paper(presses: Presses, sensor: MarkerSensor, _known: PaperCalibration | None = None) -> PaperCalibration:
    """Calibrate PaperTouch. Raises BadCalibration without a plate (check_plate), or if no press is over a marker."""
    if presses.plate is not None:
        check_plate(presses.plate, sensor)
    depths = MarkerDepths.fit(presses, min(sensor.pitch))
    untouched = [np.nanmax(depths.depths(field)[0], initial=0.0) for field, on in zip(presses.fields, presses.touching) if not on]
    found = PaperCalibration(depths, float(max([*untouched, AREAL.min_threshold])), np.nan, np.nan)
    return replace(found, **rms_errors(PaperTouch(found, sensor), presses))


class ContactFilter:
    """A Kalman filter on each contact's position and depth: constant velocity, white acceleration.

    The paper names it in its abstract and gives neither model nor variances. Each measurement has the errors of the calibration's presses.
    """

    def __init__(self):
        self._tracks: dict[int, tuple[float, np.ndarray, np.ndarray]] = {}  # stamp, s, (2, 4) means, (4, 2, 2) covariances by id

    def update(self, contacts: list[TouchEstimate], ids: list[int], stamp_s: float) -> list[TouchEstimate]:
        """The filtered contacts of a frame; a contact that is not there is dropped.

        Parameters
        ----------
        contacts : list of TouchEstimate
            As measured.
        ids : list of int
            Number of each contact.
        stamp_s : float
            Time of the frame, s.

        Returns
        -------
        list of TouchEstimate
        """
        self._tracks = {id: self._updated(self._tracks.get(id), contact, stamp_s) for id, contact in zip(ids, contacts)}
        return [replace(contact, position=mean[0, :3], depth=float(mean[0, 3]), covariance=np.diag(covariance[:3, 0, 0]),
                        depth_sigma=float(np.sqrt(covariance[3, 0, 0])))
                for contact, (_, mean, covariance) in zip(contacts, (self._tracks[id] for id in ids))]

    @staticmethod
    def _updated(before: tuple | None, contact: TouchEstimate, stamp_s: float) -> tuple[float, np.ndarray, np.ndarray]:
        measured = np.append(contact.position, contact.depth)
        noise = np.append(np.diag(contact.covariance), contact.depth_sigma**2)
        if before is None:
            variance = np.stack([noise, np.full(4, AREAL.speed_sigma**2)], axis=1)
            return stamp_s, np.stack([measured, np.zeros(4)]), variance[:, :, None] * np.eye(2)
        last_s, mean, covariance = before
        interval = stamp_s - last_s
        step, push = np.array([[1.0, interval], [0.0, 1.0]]), np.array([interval**2 / 2, interval])
        mean = step @ mean
        covariance = step @ covariance @ step.T + AREAL.acceleration_sigma**2 * np.outer(push, push)
        gain = covariance[:, :, 0] / (covariance[:, 0, 0] + noise)[:, None]
        return stamp_s, mean + gain.T * (measured - mean[0]), covariance - gain[:, :, None] * covariance[:, :1, :]


#: For the table of methods of sheets.
METHOD = Method(calibrate_paper, PaperCalibration, PaperTouch, ContactFilter)
