# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The published methods: of a sheet, paper areal_sensor_contact_position; of a dome, paper air_cushion_contact."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..errors import BadArgument, BadCalibration
from .estimate import AT_EDGE, OUT_OF_RANGE, TouchEstimate
from .field import MarkerField
from .presses import Presses, cross_validation_rmse
from .sensor import MarkerSensor, first_touch_height, rest_points

NEAR_FOOT = 0.5  # pitches: depth hardly displaces a marker nearer to the eye's foot point; only its area is used. Chosen
LENDERS = 4      # calibrated neighbours that an uncalibrated marker interpolates between. Chosen
_BELOW = 0.05    # of the calibrated range: a value further below zero is out of range. Chosen
_SLOPES = np.linspace(0.0, 1.0, 21)  # of the calibrated range: places at which a polynomial must rise


@dataclass(frozen=True)
class Cubic:
    """depth = c1 x + c2 x^2 + c3 x^3, m, rising over 0 <= x <= top; sigma: standard deviation over its presses, m (eqs 3, 4)."""

    coefficients: np.ndarray
    top: float
    sigma: float

    def __call__(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Depths, m, clamped to the calibrated range, and whether x lies outside it."""
        inside = np.clip(x, 0.0, self.top)
        return np.polyval(np.append(self.coefficients[::-1], 0.0), inside), (x > self.top) | (x < -_BELOW * self.top)


def rising_cubic(x: np.ndarray, depth: np.ndarray) -> Cubic | None:
    """The polynomial of eq 1 or 2 through zero, of the highest degree up to 3 that rises over its range; None where none does."""
    top = float(x.max(initial=0.0))
    if top <= 0:
        return None
    for degree in range(min(3, len(np.unique(np.round(x / top, 3)))), 0, -1):
        powers = (x[:, None] / top) ** np.arange(1, degree + 1)
        scaled = np.linalg.lstsq(powers, depth, rcond=None)[0]
        slope = (np.arange(1, degree + 1) * _SLOPES[:, None] ** np.arange(degree)) @ scaled
        if slope.min() > 0:
            fitted = np.zeros(3)
            fitted[:degree] = scaled / top ** np.arange(1, degree + 1)
            return Cubic(fitted, top, float(np.sqrt(np.mean((powers @ scaled - depth) ** 2))))
    return None


def weights(sigma_area: float, sigma_shift: float) -> tuple[float, float]:
    """Weights of area and displacement (eqs 5, 7); equal where both deviations vanish, 1 and 0 where one is NaN."""
    if np.isnan(sigma_area) or np.isnan(sigma_shift):
        return float(np.isnan(sigma_shift)), float(np.isnan(sigma_area))
    both = sigma_area + sigma_shift
    return (sigma_shift / both, sigma_area / both) if both > 0 else (0.5, 0.5)


class MarkerDepths:
    """The polynomials and weights of the K markers of one pattern.

    rows: one (marker, distance from the eye's foot in m, area Cubic or None, displacement Cubic or None) for each calibrated marker;
    rest: (K, 2) m untouched places; reach: (K,) m, their distances from the eye's foot. Raises BadCalibration where there are no rows.
    """

    def __init__(self, rows: list, rest: np.ndarray, reach: np.ndarray, pitch: float):
        if not rows:
            raise BadCalibration('no marker is under a press; record presses on the sheet, near markers')
        self.rows, self.rest, self.reach, self.pitch = rows, rest, reach, pitch
        self._lender, self._share = self._lend()
        self._area, self._moved = _Cubics([row[2] for row in rows]), _Cubics([row[3] for row in rows])
        weight = np.array([weights(*pair) for pair in zip(self._area.sigma, self._moved.sigma)])
        self._weight_area, self._weight_moved = weight.T
        lent = np.array([row[1] for row in rows])[self._lender]
        with np.errstate(divide='ignore', invalid='ignore'):
            self._stretch = np.where(reach[:, None] > NEAR_FOOT * pitch, lent / reach[:, None], np.nan)

    def depths(self, field: MarkerField) -> tuple[np.ndarray, np.ndarray]:
        """Depth (K,) m of each marker (eq 6), NaN where it is not seen, and (K,) bool, whether it is beyond the calibrated range."""
        shift = np.hypot(*field.shift.T)
        by_area, area_out = self._area.depths(field.growth[:, None] + 0 * self._share, self._lender)
        by_shift, shift_out = self._moved.depths(shift[:, None] * self._stretch, self._lender)
        area, moved = np.isfinite(by_area), np.isfinite(by_shift)
        of_area = np.where(area & moved, self._weight_area[self._lender], area * 1.0)
        of_shift = np.where(area & moved, self._weight_moved[self._lender], moved * 1.0)
        share = self._share * (area | moved)
        depth = share * (of_area * np.where(area, by_area, 0.0) + of_shift * np.where(moved, by_shift, 0.0))
        outside = (share > 0) & (((of_area > 0) & area_out) | ((of_shift > 0) & shift_out))
        total = share.sum(1)
        return depth.sum(1) / np.where(total > 0, total, np.nan), outside.any(1)

    def _lend(self) -> tuple[np.ndarray, np.ndarray]:
        """(K, LENDERS) rows that each marker interpolates, and their weights; its own row alone where it has one."""
        known = np.array([row[0] for row in self.rows])
        far = np.nan_to_num(np.hypot(*(self.rest[:, None] - self.rest[known]).transpose(2, 0, 1)), nan=1.0)
        lender = np.argsort(far, axis=1)[:, :LENDERS]
        far = np.maximum(np.take_along_axis(far, lender, axis=1), 1e-9)
        share = np.where(far[:, :1] < 1e-8, far <= far[:, :1], far**-2.0)
        return lender, share / share.sum(1, keepdims=True)

    def numbers(self) -> dict:
        """For the calibration file."""
        return {'rest': self.rest, 'reach': self.reach, 'pitch': self.pitch,
                'rows': [{'marker': int(marker), 'reach': reach, 'area': _plain(area), 'shift': _plain(moved)}
                         for marker, reach, area, moved in self.rows]}

    @classmethod
    def from_numbers(cls, numbers: Mapping) -> MarkerDepths:
        """From the calibration file. Raises BadCalibration where something is missing."""
        try:
            rows = [(row['marker'], row['reach'], _cubic(row['area']), _cubic(row['shift'])) for row in numbers['rows']]
            return cls(rows, np.array(numbers['rest'], float), np.array(numbers['reach'], float), float(numbers['pitch']))
        except (KeyError, TypeError, ValueError) as wrong:
            raise BadCalibration(f'the marker polynomials cannot be read ({wrong!r}); calibrate anew') from wrong


class _Cubics:
    """Several cubics at once; a None gives NaN."""

    def __init__(self, cubics: list):
        nothing = Cubic(np.full(3, np.nan), np.nan, np.nan)
        cubics = [cubic or nothing for cubic in cubics]
        self.coefficients = np.array([cubic.coefficients for cubic in cubics])
        self.top, self.sigma = np.array([cubic.top for cubic in cubics]), np.array([cubic.sigma for cubic in cubics])

    def depths(self, x: np.ndarray, which: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As Cubic's own, of the cubics numbered which at x, both (K, L)."""
        top, (c1, c2, c3) = self.top[which], np.moveaxis(self.coefficients[which], -1, 0)
        inside = np.clip(np.where(np.isfinite(x), x, np.nan), 0.0, top)
        return inside * (c1 + inside * (c2 + inside * c3)), (x > top) | (x < -_BELOW * top)


def _plain(cubic: Cubic | None) -> dict:
    return {} if cubic is None else {'coefficients': cubic.coefficients.tolist(), 'top': cubic.top, 'sigma': cubic.sigma}


def _cubic(numbers: Mapping) -> Cubic | None:
    return None if not numbers else Cubic(np.array(numbers['coefficients'], float), float(numbers['top']), float(numbers['sigma']))


def fit_marker_depths(presses, pitch: float) -> MarkerDepths:
    """Fit to Presses on a sheet; pitch in m. Raises BadCalibration where no marker is under a press."""
    rest, eye = common_rest(presses.fields)
    reach = np.hypot(*(rest - eye[:, :2]).T)
    under: dict[int, list] = {}
    for field, position, depth in zip(*(values for values in _touched(presses))):
        far = np.hypot(*(rest - position[:2]).T)
        nearest = int(np.nanargmin(far))
        if far[nearest] < 0.75 * pitch and field.seen[nearest]:
            under.setdefault(nearest, []).append((depth, field.growth[nearest], float(np.hypot(*field.shift[nearest]))))
    rows = []
    for marker, pressed in sorted(under.items()):
        depth, growth, shift = np.array(pressed).T
        known = np.isfinite(growth)
        moved = rising_cubic(shift, depth) if reach[marker] > NEAR_FOOT * pitch else None
        area = rising_cubic(growth[known], depth[known]) if known.any() else None
        if area is not None or moved is not None:
            rows.append((marker, float(reach[marker]), area, moved))
    return MarkerDepths(rows, rest, reach, pitch)


def common_rest(fields) -> tuple[np.ndarray, np.ndarray]:
    """Median untouched positions (K, 2) m and eyes (K, 3) m over the fields that see a marker; NaN where none does."""
    rest, eye = np.stack([f.rest for f in fields]), np.stack([f.eye for f in fields])
    return _middle(rest), _middle(eye)


def _middle(values: np.ndarray) -> np.ndarray:
    seen = np.isfinite(values).all(-1).any(0)
    middle = np.full(values.shape[1:], np.nan)
    middle[seen] = np.nanmedian(values[:, seen], axis=0)
    return middle


def _touched(presses) -> tuple:
    on = np.flatnonzero(presses.touching)
    return [presses.fields[k] for k in on], presses.position[on], presses.depth[on]


REACH = 2      # neighbours on each side (paper, eq 13)
LEAST_SHARE = 0.02  # of the greatest depth: shallower markers are mostly noise, which the log amplifies. Chosen
ABROAD = 1.0   # pitches, largest distance of a valid peak from the deepest marker. Chosen: beyond it another marker would be deepest
FLAT = 1e-3    # log depth: a fit that falls by less over the neighbours has no peak. Chosen
TALL = 1.5     # largest height of a valid peak over the deepest marker. Chosen


@dataclass(frozen=True)
class GridPoint:
    """place: (2,) m; depth: m; reason: '' or the name of the fall-back; at_edge: the deepest marker is on the border of the grid."""

    place: np.ndarray
    depth: float
    reason: str
    at_edge: bool


def gaussian(x: np.ndarray, y: np.ndarray, weight: np.ndarray | None = None) -> tuple[float, float]:
    """Centre and height of the Gaussian through y > 0 at x (eqs 9 to 13); NaN where the fit has no peak or too few points."""
    if len(x) < 3:
        return np.nan, np.nan
    middle, weight = x.mean(), np.ones(len(x)) if weight is None else weight
    powers = (x[:, None] - middle) ** np.arange(3)
    scale = np.abs(x - middle).max() ** np.arange(3)
    d = np.linalg.lstsq(powers / scale * weight[:, None], np.log(y / y.max()) * weight, rcond=None)[0] / scale
    if not d[2] * scale[2] < -FLAT:
        return np.nan, np.nan
    centre = -d[1] / (2 * d[2])
    return float(centre + middle), float(y.max() * np.exp(min(d[0] - d[1] ** 2 / (4 * d[2]), 50.0)))


def grid_point(depth: np.ndarray, places: np.ndarray, pitch: tuple[float, float]) -> GridPoint | None:
    """The contact point of depths (rows, columns) m of markers at places (rows, columns, 2) m, both NaN where unknown.

    None where no marker has a positive depth.
    """
    depth = np.where(np.isfinite(places).all(-1) & np.isfinite(depth), depth, np.nan)
    if not np.nanmax(depth, initial=0.0) > 0:
        return None
    row, column = np.unravel_index(np.nanargmax(depth), depth.shape)
    at_edge = bool(row in (0, depth.shape[0] - 1) or column in (0, depth.shape[1] - 1))
    for reason, way in (('', _two_fits), ('weighted', _weighted_fits), ('two_dimensional', _one_fit)):
        place, height = way(depth, places, row, column)
        off = np.abs(place - places[row, column]) / pitch
        if (off <= ABROAD).all() and 0 < height <= TALL * depth[row, column]:
            return GridPoint(place, height, reason, at_edge)
    return GridPoint(_centroid(depth, places, row, column), float(depth[row, column]), 'centroid', at_edge)


def _lines(depth, places, row, column):
    """Along x and along y: places and depths of the markers within REACH of the deepest, fewer at the border."""
    for axis in (0, 1):
        index = (column, row)[axis] + np.arange(-REACH, REACH + 1)
        index = index[(index >= 0) & (index < depth.shape[1 - axis])]
        line = (row, index) if axis == 0 else (index, column)
        yield places[line][:, axis], depth[line]


def _two_fits(depth, places, row, column):
    """The paper's fits: five markers along each axis, all of positive depth."""
    lines = list(_lines(depth, places, row, column))
    if not all(len(y) == 2 * REACH + 1 and (y > 0).all() for _, y in lines):
        return np.full(2, np.nan), np.nan
    fits = [gaussian(x, y) for x, y in lines]
    return np.array([fit[0] for fit in fits]), float(np.mean([fit[1] for fit in fits]))


def _weighted_fits(depth, places, row, column):
    least, fits = LEAST_SHARE * depth[row, column], []
    for x, y in _lines(depth, places, row, column):
        deep = y > least
        fits.append(gaussian(x[deep], y[deep], y[deep]))
    return np.array([fit[0] for fit in fits]), float(np.mean([fit[1] for fit in fits]))


def _patch(depth, places, row, column):
    rows, columns = slice(max(row - REACH, 0), row + REACH + 1), slice(max(column - REACH, 0), column + REACH + 1)
    deep, where = depth[rows, columns].ravel(), places[rows, columns].reshape(-1, 2)
    good = deep > LEAST_SHARE * depth[row, column]
    return deep[good], where[good]


def _one_fit(depth, places, row, column):
    deep, where = _patch(depth, places, row, column)
    if len(deep) < 6:
        return np.full(2, np.nan), np.nan
    scale = np.ptp(where, axis=0).max()
    x, y = ((where - places[row, column]) / scale).T
    powers = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
    d = np.linalg.lstsq(powers * deep[:, None], np.log(deep) * deep, rcond=None)[0]
    curve = np.array([[2 * d[3], d[4]], [d[4], 2 * d[5]]])
    if not np.linalg.eigvalsh(curve)[1] < -FLAT:
        return np.full(2, np.nan), np.nan
    peak = -np.linalg.solve(curve, d[1:3])
    height = np.exp(min(d[0] + d[1:3] @ peak / 2, 50.0))
    return places[row, column] + peak * scale, float(height)


def _centroid(depth, places, row, column):
    deep, where = _patch(depth, places, row, column)
    return deep @ where / deep.sum()


QUIET = 2.0     # detection threshold over the greatest depth, or change of distance, in untouched frames. Chosen
LEAST = 2e-4    # m, least detection threshold. Chosen


class PaperTouch:
    """The paper's method on a sheet with a regular grid; detects one touch at most."""

    def __init__(self, depths: MarkerDepths, sensor: MarkerSensor, quiet: float, place_sigma: float, depth_sigma: float):
        if not sensor.is_sheet or sensor.rows * sensor.columns != len(depths.rest):
            raise BadArgument(f'the paper\'s method needs a sheet with a grid of {len(depths.rest)} markers, got {sensor}')
        self.depths, self.sensor, self.quiet = depths, sensor, quiet
        self.place_sigma, self.depth_sigma = place_sigma, depth_sigma

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """The touch of one frame, with the cross-validation RMSE as covariance; empty without contact."""
        depth, outside = self.depths.depths(field)
        shape = self.sensor.rows, self.sensor.columns
        point = grid_point(depth.reshape(shape), field.rest.reshape(shape + (2,)), self.sensor.pitch)
        if point is None or not point.depth > self.quiet:
            return []
        half = np.array(self.sensor.size) / 2
        place = np.clip(point.place, -half, half)
        flags = (OUT_OF_RANGE if outside[np.nanargmax(depth)] else 0) | (AT_EDGE if point.at_edge else 0)
        variance = np.square([self.place_sigma, self.place_sigma, self.depth_sigma])
        return [TouchEstimate(np.append(place, -point.depth), point.depth, np.diag(variance), self.depth_sigma, flags=flags,
                              reason=point.reason)]

    @classmethod
    def fit(cls, presses: Presses, sensor: MarkerSensor) -> dict:
        """Parameters for the calibration file. Raises BadCalibration where no press is over a marker."""
        method = cls._fitted(presses, sensor)
        place, depth = cross_validation_rmse(lambda some: cls._fitted(some, sensor), presses)
        return {'depths': method.depths.numbers(), 'quiet': method.quiet, 'place_sigma': place, 'depth_sigma': depth}

    @classmethod
    def _fitted(cls, presses: Presses, sensor: MarkerSensor) -> PaperTouch:
        depths = fit_marker_depths(presses, min(sensor.pitch))
        still = [np.nanmax(depths.depths(field)[0], initial=0.0) for field, on in zip(presses.fields, presses.touching) if not on]
        return cls(depths, sensor, float(max(QUIET * max(still, default=0.0), LEAST)), float('nan'), float('nan'))

    @classmethod
    def from_fitted(cls, fitted: Mapping, sensor: MarkerSensor) -> PaperTouch:
        """From the calibration file. Raises BadCalibration where something is missing."""
        try:
            numbers = [float(fitted[name]) for name in ('quiet', 'place_sigma', 'depth_sigma')]
            depths = MarkerDepths.from_numbers(fitted['depths'])
        except (KeyError, TypeError, ValueError) as wrong:
            raise BadCalibration(f'the paper\'s method in the calibration file cannot be read ({wrong!r}); calibrate anew') from wrong
        return cls(depths, sensor, *numbers)


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


class PaperCushion:
    """The paper's method on a dome; detects one touch at most."""

    def __init__(self, rest: np.ndarray, points: np.ndarray, cubic: Cubic, sensor: MarkerSensor, numbers: Mapping):
        self.rest, self.points, self.cubic, self.sensor = rest, points, cubic, sensor
        self.near = neighbours(rest)
        self.quiet, self.place_sigma, self.depth_sigma = (float(numbers[k]) for k in ('quiet', 'place_sigma', 'depth_sigma'))

    def measure(self, field: MarkerField) -> tuple[np.ndarray, float] | None:
        """Place (2,) m in sensor x and y, and mean change, m; None where nothing changed. Raises BadArgument for another pattern."""
        if len(field) != len(self.rest):
            raise BadArgument(f'calibrated for {len(self.rest)} markers, got a field of {len(field)}')
        return four_largest(distance_changes(field, self.near), self.points[:, :2], RANGE * max(self.sensor.pitch))

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """The touch of one frame, with the cross-validation RMSE as covariance; empty without contact."""
        found = self.measure(field)
        if found is None or not found[1] > self.quiet:
            return []
        depth, outside = (value.item() for value in self.cubic(np.array(found[1])))
        height = first_touch_height(found[0], 0.0, self.sensor)[0] - depth
        variance = np.square([self.place_sigma, self.place_sigma, self.depth_sigma])
        return [TouchEstimate(np.append(found[0], height), depth, np.diag(variance), self.depth_sigma,
                              flags=OUT_OF_RANGE if outside else 0)]

    @classmethod
    def fit(cls, presses: Presses, sensor: MarkerSensor) -> dict:
        """Parameters for the calibration file. Raises BadCalibration where the presses determine no rising cubic."""
        numbers = cls._numbers(presses, sensor)
        rmse = cross_validation_rmse(lambda some: cls.from_fitted(cls._numbers(some, sensor), sensor), presses)
        return numbers | dict(zip(('place_sigma', 'depth_sigma'), rmse))

    @classmethod
    def _numbers(cls, presses: Presses, sensor: MarkerSensor) -> dict:
        rest, eye = common_rest(presses.fields)
        near, places = neighbours(rest), rest_points(rest, eye, sensor)[:, :2]
        found = [four_largest(distance_changes(field, near), places, RANGE * max(sensor.pitch)) for field in presses.fields]
        change = np.array([0.0 if f is None else f[1] for f in found])
        cubic = rising_cubic(change[presses.touching], presses.depth[presses.touching])
        if cubic is None:
            raise BadCalibration('the distances between markers do not grow with depth; check the presses\' depths')
        quiet = max(QUIET * change[~presses.touching].max(initial=0.0), LEAST)
        return {'rest': rest, 'eye': eye, 'coefficients': cubic.coefficients.tolist(), 'top': cubic.top,
                'sigma': cubic.sigma, 'quiet': float(quiet), 'place_sigma': float('nan'), 'depth_sigma': float('nan')}

    @classmethod
    def from_fitted(cls, fitted: Mapping, sensor: MarkerSensor) -> PaperCushion:
        """From the calibration file. Raises BadCalibration where something is missing."""
        try:
            rest, eye = np.array(fitted['rest'], float), np.array(fitted['eye'], float)
            cubic = Cubic(np.array(fitted['coefficients'], float), float(fitted['top']), float(fitted['sigma']))
            return cls(rest, rest_points(rest, eye, sensor), cubic, sensor, fitted)
        except (KeyError, TypeError, ValueError) as wrong:
            raise BadCalibration(f'the air cushion\'s method in the calibration file cannot be read ({wrong!r}); calibrate anew') from wrong
