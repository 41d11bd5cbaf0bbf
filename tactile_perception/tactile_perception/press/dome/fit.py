# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Fit of one or two presses to a frame of a dome (src/press/dome_fit.cpp), from the best match in a table of starts."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..field import MarkerField
from .mechanics import seen_at
from .library import RADIUS_SPREAD, ROUGHER, DomeLibrary

X, Y, DEPTH, RADIUS, FRICTION, DRAG = 0, 1, 2, 3, 4, slice(5, 7)  # numbers of a press: see _core.DomeLibrary
PRESS = 7
ALIKE = 4.5              # model errors of neighbouring markers are alike: standard deviation that they count, over their own. Chosen
FAINTEST = 1e-5          # m, least depth. Chosen: far below what markers show
LIMIT = (0.01, 0.01, 0.5, 0.5, 0.5, 0.3, 0.3)  # of one step: m, logs, way of a drag over depth. Chosen
RINGS, DEPTHS = (0.0, 0.14, 0.28, 0.42, 0.56), (0.06, 0.15, 0.35, 0.6, 0.85)  # starts, of rim radius and deepest press. Chosen
FAINTEST_START = 0.01    # least depth of a start over the least one of the table. Chosen
LEAST_MISFIT = 0.1       # of a covariance: no fit is believed to be better. Chosen
TERMS = 5                # degree of the polynomials that describe what a sum of fields lacks, which is smooth. Chosen
APART = 2.2              # pitches: least distance of the starts of two touches. Chosen


@dataclass(frozen=True)
class FieldNoise:
    """Standard deviations of displacements per axis: still, m, of an untouched marker; share: model error over a marker's displacement,
    and top: over the greatest displacement."""

    still: float
    share: float
    top: float


@dataclass(frozen=True)
class PressPrior:
    """What is known of a press beforehand: drag: standard deviation of the way of the drag over the depth; friction: of its number (see
    friction_of in library.py); tip_sigma: of the log radius over the library's spread; together: what the
    sum of the presses' fields lacks: its RMS over the greatest displacement; rougher, wider: by how much that number and that log radius
    may really differ from their means, standard deviations: covariances count them where they are larger than those of the fit."""

    drag: float
    friction: float
    tip_sigma: float = 0.35
    together: float = 0.0
    rougher: float = 0.0
    wider: float = 0.0


#: Number of friction of a tip whose friction is unknown: standard deviation for coefficients from 0.2 to 1.0, evenly over their logs
UNKNOWN_FRICTION = float(np.log(1.0 / 0.2) / np.sqrt(12) / np.log2(ROUGHER))
#: Log radius of an unknown tip over the library's spread: standard deviation for tips of 0.6 to 2 times the calibrated radius, likewise
UNKNOWN_TIP = float(np.log(2.0 / 0.6) / np.sqrt(12) / RADIUS_SPREAD)
#: Of a press that goes straight in, which hardly tells friction, and of one that is dragged, which turns the friction of the press along
#: the drag, so that nothing of it is left once the tip slips; a tip that sticks carries the skin farther than it is deep. Chosen
STRAIGHT, DRAGGED = PressPrior(0.005, 0.05, rougher=UNKNOWN_FRICTION, wider=UNKNOWN_TIP), PressPrior(1.0, 1.0)
#: Of two presses: the more one is dragged by the other or slips, the less else markers tell; gas and tension of the skin are shared. Chosen
OF_TWO = PressPrior(0.1, 0.01, together=0.1)


@dataclass(frozen=True)
class DomeFound:
    """presses: (n, 7); covariance: (7 n, 7 n), of one press in proportion to the misfit: mean squared
    residual over its variance."""

    presses: np.ndarray
    covariance: np.ndarray
    misfit: float


class DomeInverse:
    """points, camera_centres: (K, 3) m, untouched markers and their cameras, NaN unknown; plane_z: m; pitch: m, of the markers."""

    def __init__(self, library: DomeLibrary, noise: FieldNoise, points: np.ndarray, camera_centres: np.ndarray, plane_z: float,
                 pitch: float):
        self.library, self.noise, self.points, self._plane_z = library, noise, np.array(points, float), plane_z
        self._camera_centres = np.array(np.nan_to_num(camera_centres), float)
        self._rest = seen_at(self.points, self._camera_centres, plane_z)
        self.starts = _starts(library)
        shown = np.array([self.appear(start[None]) for start in self.starts]).reshape(len(self.starts), -1)
        self._shown = shown.astype(np.float32)  # far finer than the noise of markers, and half as much to read
        self._sizes = np.sum(shown**2, axis=1)
        apart = np.hypot(*(self.starts[:, None, :2] - self.starts[:, :2]).transpose(2, 0, 1))
        gram = shown @ shown.T
        self._smooth = _polynomials(self._rest)
        self._both = np.where(apart >= APART * pitch, 2 * gram + self._sizes[:, None] + self._sizes, np.inf)

    def appear(self, presses: np.ndarray) -> np.ndarray:
        """(K, 2) m, apparent displacement under presses (n, 7); 0 for markers at unknown places."""
        return np.nan_to_num(seen_at(self.points + self.moved(presses), self._camera_centres, self._plane_z) - self._rest)

    def moved(self, presses: np.ndarray) -> np.ndarray:
        """(K, 3) m, displacement of the markers under presses (n, 7)."""
        return self.library.moved(self.points, presses)

    def match(self, field: MarkerField) -> np.ndarray:
        """(S,) m^2, products of the field with the starts' fields."""
        return self._shown @ np.where(field.seen[:, None], field.shift, 0.0).ravel().astype(np.float32)

    def score(self, field: MarkerField, match: np.ndarray) -> float:
        """Match of the best start, in standard deviations of noise."""
        return float((match / np.sqrt(self._sizes)).max() / np.median(self.sigma(field)[field.seen]))

    def start(self, match: np.ndarray) -> np.ndarray:
        """(1, 7), the start with the least squared residual from the field of a match, less deep where the field is fainter than its own:
        from starts that are too deep, a faint press would be fitted where the dome gives way least."""
        return self._fainter(match, self._sizes)

    def start_of_two(self, match: np.ndarray) -> np.ndarray:
        """(2, 7), the two starts whose sum has the least squared residual, likewise."""
        return self._fainter(match[:, None] + match, self._both)

    def _fainter(self, match: np.ndarray, sizes: np.ndarray) -> np.ndarray:
        """(n, 7), the n starts with the least squared residual, by the products of their fields with the field (S, ...) and the squares of
        theirs (S, ...), n axes."""
        fainter = np.clip(match / sizes, FAINTEST_START, 1.0)
        best = np.unravel_index(np.argmin(fainter * (fainter * sizes - 2 * match)), sizes.shape)
        starts = self.starts[list(best)]
        starts[:, DEPTH] += np.log(fainter[best])
        return starts

    def solve(self, field: MarkerField, starts: np.ndarray, prior: PressPrior = STRAIGHT) -> DomeFound:
        """Fit presses to a field, from starts (n, 7)."""
        seen = field.seen & np.isfinite(self.points).all(1)
        variance, model = self._variances(field)
        weight = np.where(seen, 1 / (variance + ALIKE**2 * model), 0.0)
        shared = self._shared(field, weight, prior.together) if prior.together else np.zeros((0, len(weight)))
        found = self.library.kernel.fit(
            points=self.points, camera_centres=self._camera_centres, plane_z=self._plane_z, shift=np.where(seen[:, None], field.shift,
                                                                                                           0.0), weight=weight,
            shared=shared, starts=starts, prior=self._prior(prior))
        misfit = float(np.sum(found.left**2 / (variance + model)[:, None])) / max(2 * int(seen.sum()), 1)
        amiss = max(misfit, LEAST_MISFIT) if len(starts) == 1 else 1.0  # what a sum of two fields lacks is in the covariance
        return DomeFound(found.presses, found.covariance * amiss + self._unknown(found.covariance, prior), misfit)

    def _unknown(self, covariance: np.ndarray, prior: PressPrior) -> np.ndarray:
        """What a covariance (7 n, 7 n) lacks as friction and radius differ from their means by more than the fit was reported: the fit
        holds them there with the weights of its prior."""
        weight, variance = self._prior(prior)[1], np.zeros(PRESS)
        variance[[RADIUS, FRICTION]] = prior.wider**2, prior.rougher**2
        more = np.tile(np.maximum(weight * (weight * variance - 1), 0.0), len(covariance) // PRESS)
        return (covariance * more) @ covariance

    def _shared(self, field: MarkerField, weight: np.ndarray, together: float) -> np.ndarray:
        """(m, K): rows whose products are taken off the diagonal weights (K,) of each axis, so that their inverse counts what a sum of two
        fields lacks (Woodbury 1950)."""
        most = together * np.sqrt(_squares(field).max())
        weighted = self._smooth.T * weight
        factor = np.linalg.cholesky(weighted @ self._smooth + np.eye(len(weighted)) * len(weighted) / most**2)
        return np.linalg.solve(factor, weighted)

    def _prior(self, prior: PressPrior) -> np.ndarray:
        """(5, 7) mean, weight, least, most and longest step."""
        plan = self.library.plan
        reach, deepest = plan.reach, np.log(plan.depth)
        weight = np.array([1e-6, 1e-6, 1e-6, prior.tip_sigma**-2, prior.friction**-2, prior.drag**-2, prior.drag**-2])
        least = [-reach, -reach, np.log(FAINTEST), -1.0, -1.0, -2.0, -2.0]
        most = [reach, reach, deepest, 1.0, 1.0, 2.0, 2.0]
        return np.array([[0.0] * PRESS, weight, least, most, LIMIT])

    def sigma(self, field: MarkerField) -> np.ndarray:
        """(K,) m, noise of each marker per axis."""
        return np.where(np.isfinite(field.sigma), np.maximum(field.sigma, self.noise.still / 2), self.noise.still)

    def _variances(self, field: MarkerField) -> tuple[np.ndarray, np.ndarray]:
        """(K,) m^2, of noise, and of model error, per axis."""
        square = _squares(field)
        return self.sigma(field)**2, self.noise.share**2 * square + self.noise.top**2 * square.max()


def _squares(field: MarkerField) -> np.ndarray:
    """(K,) m^2, of the displacements, 0 where not seen."""
    return np.sum(np.where(field.seen[:, None], field.shift, 0.0)**2, axis=1)


def _polynomials(places: np.ndarray) -> np.ndarray:
    """(K, m): polynomials of places (K, 2), orthogonal and of unit RMS over the known ones; 0 at others."""
    known = np.isfinite(places).all(1)
    x, y = (places[known] / np.abs(places[known]).max()).T
    terms = np.stack([x**i * y**j for i in range(TERMS + 1) for j in range(TERMS + 1 - i)], axis=1)
    smooth = np.zeros((len(places), terms.shape[1]))
    smooth[known] = np.linalg.qr(terms)[0] * np.sqrt(known.sum())
    return smooth


def _starts(library: DomeLibrary) -> np.ndarray:
    """(S, 7) presses all over the dome."""
    starts, rim, deepest = [], library.plan.rim_radius, library.plan.depth
    for ring in RINGS:
        if ring * rim > library.plan.reach:
            break
        count = max(1, round(2 * np.pi * ring / RINGS[1]))
        for turn in np.arange(count) * 2 * np.pi / count:
            place = ring * rim * np.array([np.cos(turn), np.sin(turn)])
            starts += [[*place, np.log(part * deepest), 0.0, 0.0, 0.0, 0.0] for part in DEPTHS]
    return np.array(starts)
