# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact of a soft dome with pins that a camera sees, such as TacTip: the region, and after a calibration the position and depth.

The region is the hull of the pins that have moved. The displacements of the pins are nearly proportional to the depth of a press, times a
function of its position. Depth and depth times position are therefore linear functions of the displacements, which ridge regression fits
to known presses. A cubic of the depth corrects what is not proportional. The reported covariance is that of the errors at positions that
were left out of the fit.
"""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import cv2
import numpy as np

from ..common.dots import DotTracks
from ..common.estimates import OUT_OF_RANGE, ContactEstimate, ContactRegionEstimate
from ..common.surface_points import NON_CONTACT, STICKING, dot_points
from ..core.calibration_file import AGAIN, fitted_arrays
from ..core.errors import BadCalibration
from ..layer.estimator import UP, DotNoise, GelResult, known_dots
from ..layer.undeformed import spacing_of
from .constants import PIN

SENSOR = 'pins'  # sensor type, of its calibration
_SHAPES = {'rest': (None, 2), 'spacing': (), 'directions': (None, None), 'weights': (None, 3), 'curve': (3,), 'covariance': (3, 3),
           'unexplained': (), 'depth': (2,), 'outline': (None, 2), 'height': (6,)}


@dataclass(frozen=True)
class PinModel:
    """Position and depth of a press as functions of the displacements of the pins.

    Attributes
    ----------
    rest : ndarray, shape (M, 2)
        Undeformed positions of the pins in px.
    spacing : float
        Distance of neighbouring pins in px.
    directions : ndarray, shape (R, 2 M)
        Orthonormal directions of the displacements that presses cause.
    weights : ndarray, shape (R, 3)
        From displacements along the directions in px to depth times x, depth times y (m^2), and depth (m).
    curve : ndarray, shape (3,)
        Coefficients of the corrected depth: of the depth, its square and its cube.
    covariance : ndarray, shape (3, 3)
        Of the errors of x, y and depth at positions left out of the fit, in m^2.
    unexplained : float
        RMS of the displacements outside the directions at these positions, in px.
    depth : ndarray, shape (2,)
        Calibrated range in m.
    outline : ndarray, shape (P, 2)
        Convex hull of the calibrated positions in m.
    height : ndarray, shape (6,)
        z of a press of depth 0 in m: coefficients of 1, x, y, x^2, x y, y^2.
    """

    rest: np.ndarray
    spacing: float
    directions: np.ndarray
    weights: np.ndarray
    curve: np.ndarray
    covariance: np.ndarray
    unexplained: float
    depth: np.ndarray
    outline: np.ndarray
    height: np.ndarray

    @classmethod
    def from_dict(cls, fitted: Mapping) -> PinModel:
        """The model with the fields of a calibration file. Raises BadCalibration."""
        model = cls(**fitted_arrays(fitted, _SHAPES, 'calibration of pins'))
        if (len(model.directions), 2 * len(model.rest)) != (len(model.weights), model.directions.shape[1]):
            raise BadCalibration(f'the sizes of the arrays in the calibration of pins do not match; {AGAIN}')
        return model

    def estimate(self, displacements: np.ndarray) -> tuple[np.ndarray, float, np.ndarray, bool]:
        """Position and depth of a press.

        Parameters
        ----------
        displacements : ndarray, shape (2 M,)
            Displacements of the pins in px.

        Returns
        -------
        position : ndarray, shape (3,)
            In m.
        depth : float
            In m.
        covariance : ndarray, shape (3, 3)
            Of the position, in m^2.
        is_in_range : bool
            Whether the press is within the calibrated range.
        """
        along = self.directions @ displacements
        position, depth = _position_and_depth(along @ self.weights, self.curve)
        covariance = self.covariance * np.outer([1, 1, -1], [1, 1, -1])  # z falls as depth grows
        sigma = np.sqrt(np.diag(covariance))
        unexplained = np.sqrt(np.mean((displacements - along @ self.directions)**2))
        margin, inside = PIN.range_sigmas * sigma, cv2.pointPolygonTest(self.outline.astype(np.float32), tuple(map(float, position)), True)
        is_in_range = (inside > -margin[:2].max() and self.depth[0] - margin[2] < depth < self.depth[1] + margin[2]
                       and unexplained < PIN.max_unexplained * self.unexplained)
        z = float(_terms(position[None])[0] @ self.height) - depth
        return np.append(position, z), float(depth), covariance, bool(is_in_range)


def smoothed(undeformed: np.ndarray, spacing: float, tracks: DotTracks) -> np.ndarray:
    """(2 M,) px: displacements at undeformed positions (M, 2) px, interpolated from those of a frame's dots by a Gaussian process."""
    def correlation(a, b):
        return np.exp(-((a[:, None] - b)**2).sum(axis=2) / (2 * (PIN.correlation * spacing)**2))
    known = np.isfinite(tracks.duv).all(axis=1) & np.isfinite(tracks.uv).all(axis=1)
    positions = tracks.rest_uv[known]
    field = np.linalg.solve(correlation(positions, positions) + PIN.nugget * np.eye(len(positions)), tracks.duv[known])
    return (correlation(undeformed, positions) @ field).ravel()


def _position_and_depth(moments: np.ndarray, curve: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions (..., 2) and corrected depths (...) in m, from depth times x, depth times y, and depth (..., 3)."""
    depth = moments[..., 2]
    return moments[..., :2] / depth[..., None], np.stack([depth, depth**2, depth**3], axis=-1) @ curve


def _terms(position: np.ndarray) -> np.ndarray:
    """(N, 6): 1, x, y, x^2, x y, y^2 of positions (N, 2)."""
    x, y = position.T
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)


def fit_pins(undeformed: np.ndarray, displacements: np.ndarray, position: np.ndarray, depth: np.ndarray) -> tuple[PinModel, np.ndarray]:
    """Fit the model to known presses.

    Parameters
    ----------
    undeformed : ndarray, shape (M, 2)
        Undeformed positions of the pins in px.
    displacements : ndarray, shape (N, 2 M)
        Displacements of the pins in px, of each press.
    position : ndarray, shape (N, 3)
        Positions of the tip in m.
    depth : ndarray, shape (N,)
        Depths in m.

    Returns
    -------
    model : PinModel
    error : ndarray, shape (N, 3)
        Errors of x, y and depth in m, each press being left out of the fit.

    Raises
    ------
    BadCalibration
        For too few positions, or collinear ones.
    """
    pressed, press = np.unique(np.round(position[:, :2], 4), axis=0, return_inverse=True)
    press = press.ravel()
    if len(pressed) < PIN.min_positions or np.linalg.matrix_rank(pressed - pressed.mean(axis=0), 1e-4) < 2:
        raise BadCalibration(f'{len(pressed)} positions were pressed; record {PIN.min_positions} or more that are not collinear')
    goal = np.column_stack([depth[:, None] * position[:, :2], depth])
    ridges = np.array(PIN.ridges)
    groups = press % min(len(pressed), 10)  # ten parts, each of whole positions
    reported, unexplained = np.empty((len(ridges), *goal.shape)), np.empty(len(goal))
    for group in np.unique(groups):
        out = groups == group
        directions, *weights = _ridges(displacements[~out], goal[~out], ridges)
        along = displacements[out] @ directions.T
        reported[:, out] = along @ np.array(weights)
        unexplained[out] = np.sqrt(np.mean((displacements[out] - along @ directions)**2, axis=1))
    fits = [_judged(one, position, depth) for one in reported]
    best = int(np.argmin([np.linalg.norm(error, axis=1).mean() for _, error in fits]))
    curve, error = fits[best]
    directions, weights = _ridges(displacements, goal, ridges[best:best + 1])
    height = np.linalg.lstsq(_terms(position[:, :2]), position[:, 2] + depth, rcond=None)[0]
    outline = cv2.convexHull(position[:, :2].astype(np.float32))[:, 0].astype(float)
    model = PinModel(undeformed, spacing_of(undeformed), directions, weights, curve, error.T @ error / len(error),
                     np.percentile(unexplained, 95), np.array([depth.min(), depth.max()]), outline, height)
    return model, error


def _judged(reported: np.ndarray, position: np.ndarray, depth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The curve that fits depth times x, depth times y and depth (N, 3) to the true depths, and errors (N, 3) m of x, y and depth."""
    curve = np.linalg.lstsq(reported[:, 2:] ** [1, 2, 3], depth, rcond=None)[0]
    estimate, corrected = _position_and_depth(reported, curve)
    return curve, np.column_stack([estimate - position[:, :2], corrected - depth])


def _ridges(displacements: np.ndarray, goal: np.ndarray, ridges: np.ndarray) -> tuple[np.ndarray, ...]:
    """Orthonormal directions (R, 2 M) of displacements (N, 2 M), and for each ridge the weights (R, 3) of displacements along them that
    give goal (N, 3)."""
    u, size, directions = np.linalg.svd(displacements, full_matrices=False)
    kept = size > 1e-3 * size[0]
    u, size, directions = u[:, kept], size[kept], directions[kept]
    return directions, *((size / (size**2 + ridge * size[0]**2 / len(displacements)))[:, None] * (u.T @ goal) for ridge in ridges)


class PinEstimator:
    """Contact of a dome of pins, frame by frame.

    Parameters
    ----------
    values : Mapping
        Values of PINS_PARAMETERS.
    model : PinModel, optional
        From a calibration; without it position and depth are NaN.
    """

    def __init__(self, values: Mapping, model: PinModel | None = None):
        self._scale, self._pitch, self._model = values['gel.scale'], values['gel.pitch'], model
        self._next_id, self._is_pressed = 1, False
        self.reset()

    def reset(self) -> None:
        """Drop the noise."""
        self._noise = DotNoise()

    def health(self) -> tuple[str, dict]:
        """A warning ('' for none) and name -> value, for /diagnostics."""
        warning = '' if self._model else ('pins are not calibrated: position and depth of contacts are NaN; run calibrate with presses at '
                                          'known positions')
        return warning, {'noise of pins': f'{self._noise.sigma:.3f} px'}

    def process(self, tracks: DotTracks, stamp_s: float) -> GelResult:
        """Contact in one frame. Raises BadFrame for too few pins whose undeformed positions are known."""
        tracks = known_dots(tracks, 'pins')
        displacement = np.linalg.norm(tracks.duv, axis=1)
        is_pressed = self._noise.is_pressed(tracks, stamp_s)
        metres = self._metres(tracks)
        undeformed = (tracks.rest_uv - (tracks.rest_uv.min(axis=0) + tracks.rest_uv.max(axis=0)) / 2) * metres
        region = ContactRegionEstimate(tracks.id, np.full(len(tracks), NON_CONTACT, np.uint8))
        contacts = []
        if is_pressed:
            self._next_id += not self._is_pressed
            self._outline(region, undeformed, displacement > PIN.contact_share * np.sort(displacement)[-3])
            contacts = [self._contact(tracks, region)]
        self._is_pressed = is_pressed
        points = partial(dot_points, (1, len(tracks)), np.pad(undeformed + tracks.duv * metres, ((0, 0), (0, 1))),
                         np.pad(undeformed, ((0, 0), (0, 1))), region.dot_state, None)
        return GelResult(region, contacts, np.full(6, np.nan), points, np.full(3, np.nan))

    def _metres(self, tracks: DotTracks) -> float:
        """Length in m that one pixel shows; NaN where gel.scale and gel.pitch are 0."""
        if self._scale or not self._pitch:
            return self._scale or np.nan
        return self._pitch / spacing_of(tracks.rest_uv)

    @staticmethod
    def _outline(region: ContactRegionEstimate, undeformed: np.ndarray, has_moved: np.ndarray) -> None:
        """Fill in the hull of the pins that have moved and the states of the pins within it."""
        hull = cv2.convexHull(undeformed[has_moved].astype(np.float32)) if np.isfinite(undeformed).all() else None
        region.dot_state[has_moved] = STICKING
        if hull is None or len(hull) < 3:
            region.area = np.nan
            return
        is_inside = [cv2.pointPolygonTest(hull, tuple(map(float, position)), False) >= 0 for position in undeformed]
        region.dot_state[is_inside] = STICKING
        m = cv2.moments(hull)
        region.outlines, region.area, region.normal = [np.pad(hull[:, 0].astype(float), ((0, 0), (0, 1)))], float(m['m00']), UP.copy()
        region.centroid = np.array([m['m10'], m['m01'], 0.0]) / m['m00']

    def _contact(self, tracks: DotTracks, region: ContactRegionEstimate) -> ContactEstimate:
        position, depth, covariance, is_known = np.full(3, np.nan), np.nan, np.full((3, 3), np.nan), False
        if self._model is not None:
            *found, is_known = self._model.estimate(smoothed(self._model.rest, self._model.spacing, tracks))
            position, depth, covariance = found if is_known else (position, depth, covariance)
        flags = 0 if is_known or self._model is None else OUT_OF_RANGE
        return ContactEstimate(self._next_id - 1, position, UP.copy(), depth, np.nan, covariance, flags, region.dot_state > 0)
