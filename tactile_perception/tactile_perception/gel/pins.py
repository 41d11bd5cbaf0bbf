# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact of a soft dome whose pins a camera sees, as of TacTip: what touches, and after a calibration where and how deep.

The region is the hull of the pins that have moved. How pins move is nearly proportional to the depth of a press, times a function of its
place; so depth, and depth times place, are linear functions of their displacements, fitted by ridge regression to known presses. A cubic
makes up for what is not proportional. The errors at places that the fit did not see are the covariance that is reported.
"""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import cv2
import numpy as np

from ..calibration.files.format import AGAIN, fitted_arrays
from ..common.dots import DotTracks
from ..common.estimates import OUT_OF_RANGE, ContactEstimate, ContactRegionEstimate
from ..common.surface_points import NON_CONTACT, STICKING, dot_points
from ..errors import BadCalibration
from .estimator import UP, DotNoise, GelResult, known_dots
from .undeformed import spacing_of

_EDGE = 0.5  # of the greatest displacement: pins beside the contact move less
_REACH, _OWN = 1.0, 1e-3  # spacings: over so far pins move alike; variance of their own part over that
_FEWEST_PRESSES = 12  # places: four numbers for each of three functions
_RIDGES = 10.0 ** np.arange(-4.0, 2.0, 0.5)  # candidates, of the largest singular value squared
_BEYOND = 3.0  # times what displacements at a calibrated press left unexplained: another object, or a place between none of the presses
_SIGMAS = 2.0  # of place and depth, by which a result may lie outside what was calibrated
SENSOR = 'pins'  # sensor type, of its calibration
_SHAPES = {'rest': (None, 2), 'spacing': (), 'directions': (None, None), 'weights': (None, 3), 'curve': (3,), 'covariance': (3, 3),
           'unexplained': (), 'depth': (2,), 'outline': (None, 2), 'height': (6,)}


@dataclass(frozen=True)
class PinModel:
    """rest: (M, 2) px, untouched pins; spacing: px; directions: (R, 2 M) orthonormal, of displacements that presses cause; weights: (R, 3),
    displacements along them, px, to depth x, depth y, m^2, and depth, m; curve: (3,), depth by this depth, its square and cube; covariance:
    (3, 3) m^2, of errors of x, y and depth at places left out; unexplained: px, RMS of displacements outside the directions there; depth:
    (2,) m, range; outline: (P, 2) m, around the places; height: (6,), z of a press that just touches, m, by 1, x, y, x^2, x y, y^2."""

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
        """The model with these fields. Raises BadCalibration."""
        model = cls(**fitted_arrays(fitted, _SHAPES, 'calibration of pins'))
        if (len(model.directions), 2 * len(model.rest)) != (len(model.weights), model.directions.shape[1]):
            raise BadCalibration(f'the calibration of pins does not fit together; {AGAIN}')
        return model

    def estimate(self, moved: np.ndarray) -> tuple[np.ndarray, float, np.ndarray, bool]:
        """Place (3,) m, depth, m, covariance (3, 3) of the place, and whether these lie within what was calibrated, by displacements moved
        (2 M,), px, of the pins."""
        along = self.directions @ moved
        place, depth = _place_and_depth(along @ self.weights, self.curve)
        covariance = self.covariance * np.outer([1, 1, -1], [1, 1, -1])  # z falls as depth grows
        sigma = np.sqrt(np.diag(covariance))
        left = np.sqrt(np.mean((moved - along @ self.directions)**2))
        inside = cv2.pointPolygonTest(self.outline.astype(np.float32), tuple(map(float, place)), True) > -_SIGMAS * sigma[:2].max()
        within = self.depth[0] - _SIGMAS * sigma[2] < depth < self.depth[1] + _SIGMAS * sigma[2]
        z = float(_terms(place[None])[0] @ self.height) - depth
        return np.append(place, z), float(depth), covariance, bool(inside and within and left < _BEYOND * self.unexplained)


def smoothed(rest: np.ndarray, spacing: float, tracks: DotTracks) -> np.ndarray:
    """(2 M,) px, displacements at rest (M, 2) px of a field through those of the frame's dots."""
    def alike(a, b):
        return np.exp(-((a[:, None] - b)**2).sum(axis=2) / (2 * (_REACH * spacing)**2))
    known = np.isfinite(tracks.duv).all(axis=1) & np.isfinite(tracks.uv).all(axis=1)
    at = tracks.rest_uv[known]
    field = np.linalg.solve(alike(at, at) + _OWN * np.eye(len(at)), tracks.duv[known])
    return (alike(rest, at) @ field).ravel()


def _place_and_depth(moments: np.ndarray, curve: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places (..., 2) and depths (...), m, from depth x, depth y and depth (..., 3)."""
    depth = moments[..., 2]
    return moments[..., :2] / depth[..., None], np.stack([depth, depth**2, depth**3], axis=-1) @ curve


def _terms(place: np.ndarray) -> np.ndarray:
    """(N, 6): 1, x, y, x^2, x y, y^2 of places (N, 2)."""
    x, y = place.T
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)


def fit_pins(rest: np.ndarray, moved: np.ndarray, position: np.ndarray, depth: np.ndarray) -> tuple[PinModel, np.ndarray]:
    """The model, and errors (N, 3) m of x, y and depth at presses that were left out.

    rest: (M, 2) px; moved: (N, 2 M) px, of pressed pins; position: (N, 3) m, of the tip; depth: (N,) m. Raises BadCalibration for too few
    places.
    """
    place, press = np.unique(np.round(position[:, :2], 4), axis=0, return_inverse=True)
    press = press.ravel()
    if len(place) < _FEWEST_PRESSES or np.linalg.matrix_rank(place - place.mean(axis=0), 1e-4) < 2:
        raise BadCalibration(f'{len(place)} places pressed; pins need {_FEWEST_PRESSES} and more, not on a line')
    goal = np.column_stack([depth[:, None] * position[:, :2], depth])
    groups = press % min(len(place), 10)  # ten parts, each of whole places
    reported, left = np.empty((len(_RIDGES), *goal.shape)), np.empty(len(goal))
    for group in np.unique(groups):
        out = groups == group
        directions, *weights = _ridges(moved[~out], goal[~out], _RIDGES)
        along = moved[out] @ directions.T
        reported[:, out], left[out] = along @ np.array(weights), np.sqrt(np.mean((moved[out] - along @ directions)**2, axis=1))
    fits = [_judged(one, position, depth) for one in reported]
    best = int(np.argmin([np.linalg.norm(error, axis=1).mean() for _, error in fits]))
    curve, error = fits[best]
    directions, weights = _ridges(moved, goal, _RIDGES[best:best + 1])
    height = np.linalg.lstsq(_terms(position[:, :2]), position[:, 2] + depth, rcond=None)[0]
    model = PinModel(rest, spacing_of(rest), directions, weights, curve, error.T @ error / len(error), np.percentile(left, 95),
                     np.array([depth.min(), depth.max()]), cv2.convexHull(position[:, :2].astype(np.float32))[:, 0].astype(float), height)
    return model, error


def _judged(reported: np.ndarray, position: np.ndarray, depth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The curve that brings depth x, depth y and depth (N, 3) nearest to the true depths, and errors (N, 3) m of x, y and depth with it."""
    curve = np.linalg.lstsq(reported[:, 2:] ** [1, 2, 3], depth, rcond=None)[0]
    at, deep = _place_and_depth(reported, curve)
    return curve, np.column_stack([at - position[:, :2], deep - depth])


def _ridges(moved: np.ndarray, goal: np.ndarray, ridges: np.ndarray) -> tuple[np.ndarray, ...]:
    """Orthonormal directions (R, 2 M) of displacements (N, 2 M), and for each ridge weights (R, 3) of displacements along them that give
    goal (N, 3)."""
    left, size, directions = np.linalg.svd(moved, full_matrices=False)
    kept = size > 1e-3 * size[0]
    left, size, directions = left[:, kept], size[kept], directions[kept]
    return directions, *((size / (size**2 + ridge * size[0]**2 / len(moved)))[:, None] * (left.T @ goal) for ridge in ridges)


class PinEstimator:
    """Contact of a pin dome, frame by frame. values: of PINS_PARAMETERS; model: of a calibration, None without: then place and depth are
    not known."""

    def __init__(self, values: Mapping, model: PinModel | None = None):
        self._scale, self._pitch, self._model = values['gel.scale'], values['gel.pitch'], model
        self._next, self._touching = 1, False
        self.reset()

    def reset(self) -> None:
        """Forget the noise."""
        self._noise = DotNoise()

    def health(self) -> tuple[str, dict]:
        """A warning ('' for none) and name -> value, for /diagnostics."""
        warning = '' if self._model else 'pins are not calibrated: place and depth of contacts are NaN; run calibrate with known presses'
        return warning, {'noise of pins': f'{self._noise.sigma:.3f} px'}

    def process(self, tracks: DotTracks, stamp_s: float) -> GelResult:
        """Contact in one frame. Raises BadFrame for too few pins whose places at rest are known."""
        tracks = known_dots(tracks, 'pins')
        way = np.linalg.norm(tracks.duv, axis=1)
        touched = self._noise.touched(tracks, stamp_s)
        metres = self._metres(tracks)
        rest = (tracks.rest_uv - (tracks.rest_uv.min(axis=0) + tracks.rest_uv.max(axis=0)) / 2) * metres
        region = ContactRegionEstimate(tracks.id, np.full(len(tracks), NON_CONTACT, np.uint8))
        contacts = []
        if touched:
            self._next += not self._touching
            self._outline(region, rest, way > _EDGE * np.sort(way)[-3])
            contacts = [self._contact(tracks, region)]
        self._touching = touched
        points = partial(dot_points, (1, len(tracks)), np.pad(rest + tracks.duv * metres, ((0, 0), (0, 1))), np.pad(rest, ((0, 0), (0, 1))),
                         region.dot_state, None)
        return GelResult(region, contacts, np.full(6, np.nan), points, np.full(3, np.nan))

    def _metres(self, tracks: DotTracks) -> float:
        """m a pixel; NaN where neither gel.scale nor gel.pitch tells."""
        if self._scale or not self._pitch:
            return self._scale or np.nan
        return self._pitch / spacing_of(tracks.rest_uv)

    @staticmethod
    def _outline(region: ContactRegionEstimate, rest: np.ndarray, moved: np.ndarray) -> None:
        """Fill in the hull of the moved pins and the states of those within."""
        hull = cv2.convexHull(rest[moved].astype(np.float32)) if np.isfinite(rest).all() else None
        region.dot_state[moved] = STICKING
        if hull is None or len(hull) < 3:
            region.area = np.nan
            return
        within = [cv2.pointPolygonTest(hull, tuple(map(float, place)), False) >= 0 for place in rest]
        region.dot_state[within] = STICKING
        m = cv2.moments(hull)
        region.outlines, region.area, region.normal = [np.pad(hull[:, 0].astype(float), ((0, 0), (0, 1)))], float(m['m00']), UP.copy()
        region.centroid = np.array([m['m10'], m['m01'], 0.0]) / m['m00']

    def _contact(self, tracks: DotTracks, region: ContactRegionEstimate) -> ContactEstimate:
        place, depth, covariance, known = np.full(3, np.nan), np.nan, np.full((3, 3), np.nan), False
        if self._model is not None:
            found = self._model.estimate(smoothed(self._model.rest, self._model.spacing, tracks))
            known = found[-1]
            place, depth, covariance = found[:3] if known else (place, depth, covariance)
        flags = 0 if known or self._model is None else OUT_OF_RANGE
        return ContactEstimate(self._next - 1, place, UP.copy(), depth, np.nan, covariance, flags, region.dot_state > 0)
