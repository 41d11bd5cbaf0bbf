# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Depth of each marker from its area and its displacement (paper areal_sensor_contact_position, eqs 1 to 7), with fall-backs.

A marker is calibrated with the fingertip presses nearest to it; it is assumed as deep as the tip. Area and displacement are expressed as
growth (log of the area ratio) and apparent displacement in the viewing plane. So a marker without presses of its own can use its
neighbours' polynomials: growth unchanged, displacement in proportion to the distance from the eye's foot point.
"""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...errors import BadCalibration
from ..field import MarkerField

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
