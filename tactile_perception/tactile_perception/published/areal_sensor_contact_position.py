# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The published method of the paper areal_sensor_contact_position.

Markers are thresholded regions of the green channel (section 2.2); the depth of each follows from its area and displacement, and the
contact point from Gaussians through the depths.
"""
from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from ..common.dots import Dots
from ..common.marker_sensor import MarkerSensor
from ..errors import BadArgument, BadCalibration, BadFrame
from ..press.estimate import AT_EDGE, OUT_OF_RANGE, TouchEstimate
from ..press.field import MarkerField, common_rest
from ..press.methods import Method
from ..press.presses import Presses, rms_errors

_GREEN = 1
SQUARE = np.ones((3, 3), np.uint8)
_SMALLEST = 6  # px of a region; smaller ones are noise
_LEAST, _MOST = 0.2, 5.0  # median areas, smallest and largest marker


class PaperArealDetector:
    """Green channel, opening, Otsu's threshold, labels; sign: 1 for bright markers, -1 for dark."""

    def __init__(self, sign: int):
        self._sign = sign

    def detect(self, image: np.ndarray) -> Dots:
        """Markers of one checked uint8 image: centroid and number of their pixels. Raises BadFrame where there are none."""
        green = image if image.ndim == 2 else cv2.extractChannel(image, _GREEN)
        opened = cv2.morphologyEx(bright_image(green, self._sign), cv2.MORPH_OPEN, SQUARE)
        binary = cv2.threshold(opened, 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)[1]
        _, _, stats, centre = cv2.connectedComponentsWithStats(binary, connectivity=8)
        return marker_dots(centre[1:], stats[1:, cv2.CC_STAT_AREA])


def bright_image(grey: np.ndarray, sign: int) -> np.ndarray:
    """An image in which markers are bright; sign: 1 if they are, -1 for dark ones."""
    return grey if sign > 0 else cv2.bitwise_not(grey)


def marker_dots(uv, area) -> Dots:
    """Dots of a marker's size; sigma is NaN (the papers have none)."""
    area = np.asarray(area, float)
    some = area >= _SMALLEST
    typical = np.median(area[some]) if some.any() else np.nan
    kept = some & (area > _LEAST * typical) & (area < _MOST * typical)
    if not kept.any():
        raise BadFrame('no region of a marker\'s size is left after the threshold: check light, focus and the parameter polarity')
    return Dots(np.asarray(uv, float)[kept], area[kept], np.full(int(kept.sum()), np.nan))


DEGREE = 3      # of the polynomials (paper: "the third-degree polynomial is the best fit")
_BELOW = 0.05   # of the calibrated range: a value further below it is out of range. Chosen


@dataclass(frozen=True)
class Cubics:
    """depth = c0 + c1 x + c2 x^2 + c3 x^3 of K markers (eqs 1 and 2, eq 5 of the dome), m.

    coefficients: (K, 4) of (x - low) / (high - low), c0 first; low, high: (K,) calibrated range of x; all NaN where x was not seen.
    """

    coefficients: np.ndarray
    low: np.ndarray
    high: np.ndarray

    def __post_init__(self):
        if self.coefficients.shape != (len(self.low), DEGREE + 1) or self.low.shape != self.high.shape:
            raise ValueError(f'coefficients {self.coefficients.shape} of {len(self.low)} markers')

    @classmethod
    def fit(cls, x: np.ndarray, depth: np.ndarray) -> Cubics:
        """Least squares to x (M, K), NaN where not seen, at depth (M,), m; NaN for x without change or seen fewer than five times."""
        count = x.shape[1]
        coefficients, low, high = np.full((count, DEGREE + 1), np.nan), np.full(count, np.nan), np.full(count, np.nan)
        for k, column in enumerate(x.T):
            seen = np.isfinite(column)
            if seen.sum() <= DEGREE + 1 or not np.ptp(column[seen]) > 0:
                continue
            least, most = column[seen].min(), column[seen].max()
            inside = (column[seen] - least) / (most - least)
            coefficients[k], low[k], high[k] = _monotone(inside, depth[seen]), least, most
        return cls(coefficients, low, high)

    def __call__(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Depths (K,), m, of x (K,) clamped to the calibrated range, NaN where unknown; and whether x lies outside it."""
        part = (x - self.low) / (self.high - self.low)
        inside = np.clip(part, 0.0, 1.0)
        return (self.coefficients * inside[:, None] ** np.arange(DEGREE + 1)).sum(1), (part > 1.0) | (part < -_BELOW)


def _monotone(x: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """(4,) coefficients over 0 <= x <= 1 of the highest degree up to three that only rises or only falls there: one x has one depth."""
    places, order = np.linspace(0.0, 1.0, 21)[:, None], np.arange(1, DEGREE + 1)
    for degree in range(DEGREE, 0, -1):
        fitted = np.zeros(DEGREE + 1)
        fitted[:degree + 1] = np.linalg.lstsq(x[:, None] ** np.arange(degree + 1), depth, rcond=None)[0]
        slope = places ** (order - 1) @ (order * fitted[1:])
        if slope.min() >= 0 or slope.max() <= 0:
            break
    return fitted


def area_and_shift(field: MarkerField) -> tuple[np.ndarray, np.ndarray]:
    """x_a, area over the untouched area, and x_c, m, displacement, of each marker (K,)."""
    return np.exp(field.growth), np.hypot(*field.shift.T)


@dataclass(frozen=True)
class MarkerDepths:
    """Depth of each marker by its area and by its displacement, weighted. weight: (K,) w_a of eq 5; w_c is 1 - w_a (eq 7)."""

    area: Cubics
    shift: Cubics
    weight: np.ndarray

    def each(self, field: MarkerField) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
        """y_a and y_c (eqs 1, 2), each with whether it is out of range."""
        by_area, by_shift = area_and_shift(field)
        return self.area(by_area), self.shift(by_shift)

    def depths(self, field: MarkerField) -> tuple[np.ndarray, np.ndarray]:
        """Depth (K,) m of each marker (eq 6), by one of the two where the other is unknown, NaN where both are; whether it is out of
        range."""
        (area, area_out), (shift, shift_out) = self.each(field)
        weight = np.where(np.isnan(area), 0.0, np.where(np.isnan(shift), 1.0, self.weight))
        depth = np.where(weight > 0, weight * area, 0.0) + np.where(weight < 1, (1 - weight) * shift, 0.0)
        return depth, np.where(weight > 0.5, area_out, shift_out)

    @classmethod
    def fit(cls, presses: Presses, pitch: float) -> MarkerDepths:
        """Polynomials of the plate's presses (fig 5) and weights of a tip's presses on markers (fig 10), which the polynomials have not
        seen; pitch: m. Raises BadCalibration without a plate, or where no tip was pressed onto a marker."""
        if presses.plate is None:
            raise BadCalibration("the paper's method needs a plate that is pressed onto all markers, step by step: calibrate --plate BAG")
        plate = presses.plate
        area, shift = (np.stack(values) for values in zip(*map(area_and_shift, plate.fields)))
        found = cls(Cubics.fit(area, plate.depth), Cubics.fit(shift, plate.depth), np.full(area.shape[1], 0.5))
        return cls(found.area, found.shift, found._weights(presses, pitch))

    def _weights(self, presses: Presses, pitch: float) -> np.ndarray:
        """w_a (K,) of eqs 3 to 5; a marker that no tip was pressed onto has that of the nearest one that a tip was pressed onto."""
        rest, squares, count = common_rest(presses.fields)[0], np.zeros((len(self.weight), 2)), np.zeros((len(self.weight), 2))
        for k in np.flatnonzero(presses.touching):
            far = np.hypot(*(rest - presses.position[k, :2]).T)
            marker = int(np.nanargmin(far))
            if far[marker] < pitch / 2:
                off = np.array([depth[marker] for depth, _ in self.each(presses.fields[k])]) - presses.depth[k]
                squares[marker] += np.nan_to_num(off)**2
                count[marker] += np.isfinite(off)
        known = np.flatnonzero(count.all(1))
        if not len(known):
            raise BadCalibration('no tip was pressed onto a marker; press at places of markers too')
        sigma = np.sqrt(squares[known] / count[known])
        weight = sigma[:, 1] / np.maximum(sigma.sum(1), 1e-12)
        apart = np.nan_to_num(np.hypot(*(rest[:, None] - rest[known]).transpose(2, 0, 1)), nan=np.inf)
        return weight[apart.argmin(1)]


def plate_step(plate: Presses) -> float:
    """The step, m, of a plate's stage: the median distance of the depths at which it stops, which are those of two frames on end; where it
    stops for a frame each, of all depths."""
    depth = np.round(plate.depth, 5)
    stops = np.unique(depth[1:][np.diff(depth) == 0])
    return float(np.median(np.diff(stops if len(stops) > _STEPS else np.unique(depth))))


_STEPS = 3  # depths of a plate that, with the untouched sheet, determine a cubic


def check_plate(plate: Presses, sensor: MarkerSensor) -> None:
    """Raise BadCalibration for a plate that stops at too few depths, or that is tilted: by how the markers move away from the camera
    centre's foot point, it is deeper at a corner of the sheet than in the middle by more than half a step."""
    depths = len(np.unique(np.round(plate.depth[plate.touching], 5)))
    if depths < _STEPS:
        raise BadCalibration(f'plate: {depths} depths; at least {_STEPS} are needed, in steps of a millimetre over the whole range')
    slopes = []
    for field, true in zip((field for field, on in zip(plate.fields, plate.touching) if on), plate.depth[plate.touching]):
        arm = field.rest - field.camera_centre[:, :2]
        away = np.hypot(*arm.T)
        zoom = (field.shift * arm).sum(1) / np.maximum(away, 1e-9)**2  # depth over what is left of the distance to the camera centre
        too_deep = np.abs(field.camera_centre[:, 2]) * zoom / (1 + zoom) - true
        seen = np.isfinite(too_deep)
        plane = np.column_stack([field.rest, np.ones(len(away))])[seen] * away[seen, None]
        slopes.append(np.linalg.lstsq(plane, too_deep[seen] * away[seen], rcond=None)[0][:2])
    slope = np.median(slopes, axis=0)
    ends = float(np.abs(slope) @ (np.array(sensor.size) / 2))
    if ends > plate_step(plate) / 2:
        raise BadCalibration(f'plate: tilted by {np.degrees(np.arctan(np.hypot(*slope))):.1f} degrees, so that a corner is '
                             f'{1e3 * ends:.1f} mm deeper than the middle; align it with the sheet')


REACH = 2      # neighbours on each side (eq 13)


@dataclass(frozen=True)
class GridPoint:
    """place: (2,) m; depth: m; at_edge: it is on the border of the grid."""

    place: np.ndarray
    depth: float
    at_edge: bool


def gaussian(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Centre and height of the Gaussian through y > 0 at x (eqs 8 to 13), which is at one of x or between two; NaN where there is none."""
    if len(x) < 3:
        return np.nan, np.nan
    middle, scale = x.mean(), np.ptp(x)
    d = np.linalg.lstsq(((x - middle) / scale)[:, None] ** np.arange(3), np.log(y / y.max()), rcond=None)[0]
    if not d[2] < 0 or not abs(centre := -d[1] / (2 * d[2])) * scale <= np.abs(x - middle).max():
        return np.nan, np.nan
    return float(middle + centre * scale), float(y.max() * np.exp(d[0] - d[1]**2 / (4 * d[2])))


def grid_point(depth: np.ndarray, places: np.ndarray) -> GridPoint | None:
    """The contact point of depths (rows, columns) m of markers at places (rows, columns, 2) m, both NaN where unknown.

    None where no marker has a positive depth. The paper does not say what it does where the logarithm of a depth does not exist, nor at the
    border: fits take the positive depths among the five, at least three; the height is the mean of both fits; where an axis has no Gaussian
    the deepest marker itself is reported.
    """
    depth = np.where(np.isfinite(places).all(-1) & np.isfinite(depth), depth, np.nan)
    if not np.nanmax(depth, initial=0.0) > 0:
        return None
    row, column = np.unravel_index(np.nanargmax(depth), depth.shape)
    at_edge = bool(row in (0, depth.shape[0] - 1) or column in (0, depth.shape[1] - 1))
    fits = np.array([gaussian(x[y > 0], y[y > 0]) for x, y in _lines(depth, places, row, column)])
    if np.isfinite(fits).all():
        return GridPoint(fits[:, 0], float(fits[:, 1].mean()), at_edge)
    return GridPoint(places[row, column].copy(), float(depth[row, column]), at_edge)


def _lines(depth, places, row, column):
    """Along x and along y: places and depths of the markers within REACH of the deepest, fewer at the border."""
    for axis in (0, 1):
        index = (column, row)[axis] + np.arange(-REACH, REACH + 1)
        index = index[(index >= 0) & (index < depth.shape[1 - axis])]
        line = (row, index) if axis == 0 else (index, column)
        yield places[line][:, axis], depth[line]


MIN_THRESHOLD = 2e-4  # m, of depth and of change of distance. Thresholds are ours: of a sheet, the maximum of untouched frames


@dataclass(frozen=True)
class PaperCalibration:
    """depths: of the markers; quiet: m, detection threshold; place_sigma, depth_sigma: m, RMS errors at the presses of the calibration."""

    depths: MarkerDepths
    quiet: float
    place_sigma: float
    depth_sigma: float


class PaperTouch:
    """The paper's method on a sheet with a regular grid; detects one touch at most."""

    def __init__(self, calibration: PaperCalibration, sensor: MarkerSensor):
        if not sensor.is_sheet or sensor.rows * sensor.columns != len(calibration.depths.weight):
            raise BadArgument(f'the paper\'s method needs a sheet with a grid of {len(calibration.depths.weight)} markers, got {sensor}')
        self.calibration, self.sensor = calibration, sensor

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """The touch of one frame, with the RMS errors at the presses of the calibration as covariance; empty without contact."""
        known = self.calibration
        depth, outside = known.depths.depths(field)
        shape = self.sensor.rows, self.sensor.columns
        point = grid_point(depth.reshape(shape), field.rest.reshape(shape + (2,)))
        if point is None or not point.depth > known.quiet:
            return []
        half = np.array(self.sensor.size) / 2
        place = np.clip(point.place, -half, half)
        flags = (OUT_OF_RANGE if outside[np.nanargmax(depth)] else 0) | (AT_EDGE if point.at_edge else 0)
        variance = np.square([known.place_sigma, known.place_sigma, known.depth_sigma])
        return [TouchEstimate(np.append(place, -point.depth), point.depth, np.diag(variance), known.depth_sigma, flags=flags)]


def calibrate_paper(presses: Presses, sensor: MarkerSensor, _known: PaperCalibration | None = None) -> PaperCalibration:
    """Calibrate PaperTouch. Raises BadCalibration without a plate (check_plate), or where no press is over a marker."""
    if presses.plate is not None:
        check_plate(presses.plate, sensor)
    depths = MarkerDepths.fit(presses, min(sensor.pitch))
    still = [np.nanmax(depths.depths(field)[0], initial=0.0) for field, on in zip(presses.fields, presses.touching) if not on]
    found = PaperCalibration(depths, float(max([*still, MIN_THRESHOLD])), np.nan, np.nan)
    return replace(found, **rms_errors(PaperTouch(found, sensor), presses))


FASTEST_CONTACT = 0.1  # m/s, standard deviation of the velocity with which a contact begins
CONTACT_ACCELERATION = 0.5  # m/s^2, standard deviation, of a hand that moves over a sheet within centimetres and tenths of a second


class ContactFilter:
    """A Kalman filter on each contact's position and depth: constant velocity, white acceleration.

    The paper names it in its abstract and gives neither model nor variances: what is measured has the errors of the calibration's presses.
    """

    def __init__(self):
        self._tracks: dict[int, tuple[float, np.ndarray, np.ndarray]] = {}  # stamp, s, (2, 4) means, (4, 2, 2) covariances by id

    def update(self, touches: list[TouchEstimate], ids: list[int], stamp_s: float) -> list[TouchEstimate]:
        """The touches of a frame at stamp_s, s, filtered; ids: of their contacts. A contact that is not there is forgotten."""
        self._tracks = {id: self._step(self._tracks.get(id), touch, stamp_s) for id, touch in zip(ids, touches)}
        return [replace(touch, position=mean[0, :3], depth=float(mean[0, 3]), covariance=np.diag(covariance[:3, 0, 0]),
                        depth_sigma=float(np.sqrt(covariance[3, 0, 0])))
                for touch, (_, mean, covariance) in zip(touches, (self._tracks[id] for id in ids))]

    @staticmethod
    def _step(before: tuple | None, touch: TouchEstimate, stamp_s: float) -> tuple[float, np.ndarray, np.ndarray]:
        seen = np.append(touch.position, touch.depth)
        noise = np.append(np.diag(touch.covariance), touch.depth_sigma**2)
        if before is None:
            still = np.stack([noise, np.full(4, FASTEST_CONTACT**2)], axis=1)
            return stamp_s, np.stack([seen, np.zeros(4)]), still[:, :, None] * np.eye(2)
        last_s, mean, covariance = before
        interval = stamp_s - last_s
        step, push = np.array([[1.0, interval], [0.0, 1.0]]), np.array([interval**2 / 2, interval])
        mean = step @ mean
        covariance = step @ covariance @ step.T + CONTACT_ACCELERATION**2 * np.outer(push, push)
        gain = covariance[:, :, 0] / (covariance[:, 0, 0] + noise)[:, None]
        return stamp_s, mean + gain.T * (seen - mean[0]), covariance - gain[:, :, None] * covariance[:, :1, :]


#: For the table of methods of sheets.
METHOD = Method(calibrate_paper, PaperCalibration, PaperTouch, ContactFilter)
