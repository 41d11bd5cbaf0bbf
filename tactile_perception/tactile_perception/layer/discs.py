# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contacts as loaded discs: position, radius, pressing force and shear force of each, fitted to the displacements of a gel's dots."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.errors import BadFrame
from .constants import LAYER
from .layer import DiscLoads, Layer


@dataclass(frozen=True)
class Disc:
    """One contact.

    Attributes
    ----------
    centre : ndarray, shape (2,)
        Centre in m on the undeformed surface.
    radius : float
        Radius in m.
    force : ndarray, shape (3,)
        Force of the object on the gel over the shear modulus, in m^2.
    covariance : ndarray, shape (6, 6)
        Of centre, logarithm of the radius, and force.
    """

    centre: np.ndarray
    radius: float
    force: np.ndarray
    covariance: np.ndarray


class DiscFit:
    """Fits discs to the displacements of a gel's dots.

    A uniform stretch, rotation and shear of the whole view is fitted too, since the gel moves towards the camera and tilts under a press.

    Parameters
    ----------
    loads : DiscLoads
        Displacements under unit loads.
    dots : ndarray, shape (D, 2)
        Positions of the undeformed dots in m.
    pitch : float
        Distance of neighbouring dots in m.
    camera : ndarray, shape (3,)
        Position of the camera above the dots in m.

    Notes
    -----
    The errors of the model are proportional to the displacements around a dot. A dot is therefore weighted by the inverse of its noise and
    of LAYER.model_error times the RMS displacement within about a pitch. The common scale of the weighted residuals is estimated from them.
    """

    def __init__(self, loads: DiscLoads, dots: np.ndarray, pitch: float, camera: np.ndarray):
        self.loads, self.dots, self.pitch, self.camera = loads, dots, pitch, camera
        self.low, self.high = dots.min(axis=0) - pitch / 2, dots.max(axis=0) + pitch / 2
        area = float((self.high - self.low).prod())
        self.independent = max(area / (LAYER.correlation * pitch)**2, 6.0)  # number of independent residuals
        self._neighbours = np.exp(-((dots[:, None] - dots)**2).sum(axis=2) / (2 * pitch**2))
        step = max(pitch / 2, float(np.sqrt(area / LAYER.search_positions)))
        x, y = (np.linspace(a, b, max(int((b - a) / step), 2)) for a, b in zip(self.low, self.high))
        centres = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        radii = np.geomspace(loads.radii[0], loads.radii[-1],
                             int(np.log(loads.radii[-1] / loads.radii[0]) / np.log(LAYER.search_ratio)) + 2)
        uniform = np.linalg.qr(uniform_motions(dots, dots.mean(axis=0), pitch))[0]
        self._bases = np.concatenate([self._search_basis(centres, radius, uniform) for radius in radii]).reshape(-1, 2 * len(dots))
        self._candidates = np.column_stack([np.tile(centres, (len(radii), 1)), np.repeat(radii, len(centres))])

    def _search_basis(self, centres: np.ndarray, radius: float, uniform: np.ndarray) -> np.ndarray:
        """(C, 3, 2 D): of each candidate disc an orthonormal basis of the displacements that its loads cause, without uniform motions."""
        columns = self.loads.matrix(self.dots, centres, radius, self.camera).reshape(len(centres), 2 * len(self.dots), 3)
        columns = columns - uniform @ (uniform.T @ columns)
        gram = columns.transpose(0, 2, 1) @ columns
        size = np.trace(gram, axis1=1, axis2=2)  # nearly 0 for a disc that moves no dot; the ridge makes such a candidate explain nothing
        gram += 1e-9 * max(float(size.max()), LAYER.no_force) * np.eye(3)
        return np.linalg.solve(np.linalg.cholesky(gram), columns.transpose(0, 2, 1))

    @staticmethod
    def loads_for(layer: Layer, dots: np.ndarray, pitch: float) -> DiscLoads:
        """Displacements under the discs that these dots can resolve."""
        smallest = LAYER.min_radius * pitch
        return DiscLoads(layer, smallest, max(LAYER.max_radius * float((np.ptp(dots, axis=0) + pitch).min()), 2 * smallest))

    def solve(self, seen: np.ndarray, displacements: np.ndarray, sigma: float) -> list[Disc]:
        """Fit the contacts of one frame.

        Parameters
        ----------
        seen : ndarray of bool, shape (D,)
            Dots whose displacement is known.
        displacements : ndarray, shape (D, 2)
            Displacements in m; ignored where not seen.
        sigma : float
            Standard deviation of the noise of a coordinate in m.

        Returns
        -------
        list of Disc
            Contacts, the largest pressing force first; empty without evidence.

        Raises
        ------
        BadFrame
            If hardly any dot moves as a contact moves it.
        """
        for _ in range(2):  # the second time without dots that were taken for their neighbours
            discs, residual = self._contacts(seen, displacements, sigma)
            mistaken = seen & (np.abs(residual).max(axis=1) > LAYER.max_residual * self.pitch)
            if not mistaken.any():
                break
            seen = seen & ~mistaken
            if seen.sum() < LAYER.min_dots:
                raise BadFrame(f'no press explains the displacements of {mistaken.sum()} of {len(seen)} dots; check the dots in '
                               'image_annotated')
        return discs

    def neighbours(self, seen: np.ndarray) -> np.ndarray:
        """(S, S): weights of the seen dots in a mean around each of them."""
        weights = self._neighbours[np.ix_(seen, seen)]
        return weights / weights.sum(axis=1, keepdims=True)

    def _contacts(self, seen: np.ndarray, displacements: np.ndarray, sigma: float) -> tuple[list[Disc], np.ndarray]:
        """Contacts, and the residuals (D, 2) in m, 0 where not seen. A further disc must have evidence and overlap no other."""
        problem = _Problem(self, seen, displacements, sigma)
        found, shapes = problem.without_discs(), np.zeros((0, 4))
        while len(shapes) < LAYER.max_contacts:
            start, explained = self._search(_filled(self.dots, seen, found.residual), shapes)
            coarse, needed = (1 - explained) * found.squares, LAYER.next_evidence if len(shapes) else LAYER.first_evidence
            if problem.evidence(found.squares, coarse) < needed / 2:
                break  # refinement does not double the evidence
            trial = problem.refine(problem.with_likely_stress(np.vstack([shapes[:, :3], start])), problem.scale(coarse))
            if problem.evidence(found.squares, trial.squares) < needed or len(shapes) and not trial.is_separate():
                break
            found, shapes = trial, trial.shapes
        return found.discs(), found.residual

    def _search(self, residual: np.ndarray, known: np.ndarray) -> tuple[np.ndarray, float]:
        """Centre and radius (3,) of the candidate outside the known discs that explains most of the residual (D, 2), and the part of the
        sum of squares that it explains."""
        loads = (self._bases @ residual.ravel()).reshape(-1, 3)
        loads[:, 2] = np.maximum(loads[:, 2], 0.0)  # an object presses; the last component has the sign of the press
        squares = (loads**2).sum(axis=1)
        for disc in known:
            squares[_overlap(self._candidates, disc)] = 0.0
        best = int(squares.argmax())
        return self._candidates[best], min(float(squares[best]) / max(float(np.sum(residual**2)), LAYER.no_force), 1.0)


class _Problem:
    """The weighted displacements of the seen dots, without uniform motions, which the discs have to explain."""

    def __init__(self, fit: DiscFit, seen: np.ndarray, displacements: np.ndarray, sigma: float):
        self.fit, self.seen, self.dots = fit, seen, fit.dots[seen]
        uniform, moved = uniform_motions(self.dots, fit.dots.mean(axis=0), fit.pitch), displacements[seen].ravel()
        own = (moved - uniform @ np.linalg.lstsq(uniform, moved, rcond=None)[0]).reshape(-1, 2)
        variance = sigma**2 + LAYER.model_error**2 * (fit.neighbours(seen) @ (own**2).sum(axis=1))
        self.weights = np.repeat(sigma / np.sqrt(variance), 2)
        self._uniform = np.linalg.qr(self.weights[:, None] * uniform)[0]
        self.data = self._weighted(moved)
        self.shift = self._weighted(np.tile(np.eye(2), (len(self.dots), 1)))
        self._noise_squares = float(np.sum(self.weights**2)) * sigma**2

    def _weighted(self, columns: np.ndarray) -> np.ndarray:
        """The columns (..., 2 S, K), or a single one, weighted and without uniform motions."""
        weighted = columns * (self.weights if columns.ndim == 1 else self.weights[:, None])
        return weighted - self._uniform @ (self._uniform.T @ weighted)

    def evidence(self, before: float, after: float) -> float:
        """Twice the logarithm of the ratio of the likelihoods of two fits with these sums of squares."""
        return self.fit.independent * float(np.log(max(before, self._noise_squares) / max(after, self._noise_squares)))

    def scale(self, squares: float) -> float:
        """Standard deviation in m of one of the independent residuals, from their sum of squares."""
        return float(np.sqrt(max(squares, self._noise_squares) / self.fit.independent))

    def without_discs(self) -> _Evaluation:
        """What a uniform motion and a shift alone explain."""
        found, none = None, np.zeros((0, 4))
        for _ in range(3):  # the shift depends on the scale of the residuals, and the scale on the shift
            found = self.evaluate(none, self.scale(found.squares if found else float(self.data @ self.data)))
        return found

    def columns(self, centres: np.ndarray, radius: float) -> np.ndarray:
        """(..., 2 S, 3): weighted displacements under unit loads on discs of one radius at centres (..., 2)."""
        columns = self.fit.loads.matrix(self.dots, centres, radius, self.fit.camera)
        return self._weighted(columns.reshape(*centres.shape[:-1], 2 * len(self.dots), 3))

    def evaluate(self, shapes: np.ndarray, scale: float) -> _Evaluation:
        """The best shift and shears for pressed discs of shapes (K, 4): centre, radius, mean pressure over shear modulus; scale: m, of a
        residual, against which the prior of the shift counts."""
        columns = [self.columns(shape[:2], shape[2]) for shape in shapes]
        linear = np.concatenate([self.shift, *(c[:, :2] for c in columns)], axis=1)
        presses = np.pi * shapes[:, 2]**2 * shapes[:, 3]
        unpressed = self.data - sum((c[:, 2] * press for c, press in zip(columns, presses)), np.zeros(len(self.data)))
        prior = np.zeros(linear.shape[1])
        prior[:2] = (scale / LAYER.shift)**2
        inverse = np.linalg.inv(linear.T @ linear + np.diag(prior)) @ linear.T
        best = inverse @ unpressed
        return _Evaluation(self, shapes, columns, linear, inverse, np.column_stack([best[2:].reshape(-1, 2), presses]),
                           unpressed - linear @ best)

    def with_likely_stress(self, shapes: np.ndarray) -> np.ndarray:
        """(K, 4): shapes (K, 3) with the mean pressure of each that fits best within two standard deviations of its prior."""
        matrix = np.concatenate([self.columns(shape[:2], shape[2]) for shape in shapes], axis=1)
        presses = np.linalg.lstsq(matrix, self.data, rcond=None)[0][2::3]
        low, high = LAYER.mean_stress * np.exp([-2 * LAYER.stress_spread, 2 * LAYER.stress_spread])
        return np.column_stack([shapes, np.clip(presses / (np.pi * shapes[:, 2]**2), low, high)])

    def refine(self, shapes: np.ndarray, scale: float) -> _Evaluation:
        """Gauss-Newton on the shapes (K, 4) with shift and shears eliminated (variable projection in Kaufman's form); scale: m, of a
        residual at the start."""
        fit, current, damping = self.fit, self.evaluate(shapes, scale), LAYER.damping
        for _ in range(8):  # Gauss-Newton
            scale = self.scale(current.squares)
            vector, jacobian = current.vector(scale), current.jacobian(scale)
            normal = jacobian.T @ jacobian
            step = -np.linalg.solve(normal + damping * np.diag(np.diag(normal)), jacobian.T @ vector).reshape(-1, 4)
            step = np.clip(step, -1.0, 1.0)
            centre = np.clip(current.shapes[:, :2] + step[:, :2] * fit.pitch, fit.low, fit.high)
            radius = np.clip(current.shapes[:, 2] * np.exp(step[:, 2]), fit.loads.radii[0], fit.loads.radii[-1])
            trial = self.evaluate(np.column_stack([centre, radius, current.shapes[:, 3] * np.exp(step[:, 3])]), scale)
            if np.sum(trial.vector(scale)**2) >= vector @ vector:
                damping = 25 * max(damping, LAYER.damping)
                continue
            current, damping = trial, damping / 5
            if np.abs(step).max() < 1e-3:  # pitches, and logarithm of the radius
                break
        return current


@dataclass(frozen=True)
class _Evaluation:
    """Discs with the best shift and shears. All displacements are weighted.

    shapes: (K, 4) m, m, m, 1; columns: K times (2 S, 3), displacements under unit loads; linear: (2 S, 2 + 2 K), displacements under a unit
    shift and unit shears, and inverse, its pseudoinverse with the prior of the shift; force: (K, 3) m^2, the press positive; residuals:
    (2 S,) m.
    """

    problem: _Problem
    shapes: np.ndarray
    columns: list[np.ndarray]
    linear: np.ndarray
    inverse: np.ndarray
    force: np.ndarray
    residuals: np.ndarray

    @property
    def squares(self) -> float:
        """Sum of squares of the weighted residuals in m^2."""
        return float(self.residuals @ self.residuals)

    @property
    def residual(self) -> np.ndarray:
        """(D, 2) m, residuals without weights, 0 for dots that are not seen."""
        found = np.zeros_like(self.problem.fit.dots)
        found[self.problem.seen] = (self.residuals / self.problem.weights).reshape(-1, 2)
        return found

    def vector(self, scale: float) -> np.ndarray:
        """Residuals over their scale in m, and those of the prior of the mean pressure."""
        return np.concatenate([self.residuals / scale, np.log(self.shapes[:, 3] / LAYER.mean_stress) / LAYER.stress_spread])

    def derivatives(self) -> np.ndarray:
        """(2 S, 4 K): derivatives of the displacements by the centres in pitches and by the logarithms of radii and mean pressures."""
        problem, found = self.problem, []
        for shape, force, columns in zip(self.shapes, self.force, self.columns):
            shifted = problem.columns(shape[:2] + LAYER.difference * problem.fit.pitch * np.eye(2), shape[2])
            larger = problem.columns(shape[:2], shape[2] * (1 + LAYER.difference)) * np.array([1.0, 1.0, (1 + LAYER.difference)**2])
            found += [(other - columns) @ force / LAYER.difference for other in (*shifted, larger)] + [columns[:, 2] * force[2]]
        return np.array(found).T

    def jacobian(self, scale: float) -> np.ndarray:
        """(2 S + K, 4 K): derivatives of vector."""
        derivatives, count = self.derivatives(), len(self.shapes)
        prior = np.zeros((count, 4 * count))
        prior[np.arange(count), np.arange(3, 4 * count, 4)] = 1 / LAYER.stress_spread
        return np.concatenate([-(derivatives - self.linear @ (self.inverse @ derivatives)) / scale, prior])

    def is_separate(self) -> bool:
        """Whether the last disc overlaps none of the others."""
        return not any(_overlap(self.shapes[-1:], other).any() for other in self.shapes[:-1])

    def discs(self) -> list[Disc]:
        """The contacts, the largest pressing force first."""
        if not len(self.shapes):
            return []
        found = [Disc(shape[:2], float(shape[2]), force * [1, 1, -1], covariance)
                 for shape, force, covariance in zip(self.shapes, self.force, self._covariances())]
        return sorted(found, key=lambda disc: disc.force[2])

    def _covariances(self) -> list[np.ndarray]:
        """(6, 6) of each disc (Disc.covariance), all shifts, shears and shapes being unknown."""
        count, scale = len(self.shapes), self.problem.scale(self.squares)
        full = np.concatenate([self.derivatives().reshape(-1, count, 4), self.linear[:, 2:].reshape(-1, count, 2)], axis=2)
        full = np.concatenate([full.reshape(-1, 6 * count), self.linear[:, :2]], axis=1) / scale
        prior = np.zeros((count + 2, 6 * count + 2))
        prior[np.arange(count), np.arange(3, 6 * count, 6)] = 1 / LAYER.stress_spread
        prior[-2:, -2:] = np.eye(2) / LAYER.shift
        rows = np.concatenate([full, prior])
        size = np.sqrt((rows**2).sum(axis=0))
        inverse = np.linalg.pinv((rows / size).T @ (rows / size)) / np.outer(size, size)
        found, pitch = [], self.problem.fit.pitch
        for k, press in enumerate(self.force[:, 2]):
            to_disc = np.zeros((6, 6))  # from centre in pitches, logarithms of radius and mean pressure, shears
            to_disc[[0, 1, 2, 3, 4], [0, 1, 2, 4, 5]] = pitch, pitch, 1.0, 1.0, 1.0
            to_disc[5, 2:4] = -2 * press, -press
            found.append(to_disc @ inverse[6 * k:6 * k + 6, 6 * k:6 * k + 6] @ to_disc.T)
        return found


def _overlap(discs: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(N,) bool: whether discs (N, 3) overlap another."""
    return np.hypot(*(discs[:, :2] - other[:2]).T) < discs[:, 2] + other[2]


def uniform_motions(dots: np.ndarray, centre: np.ndarray, pitch: float) -> np.ndarray:
    """(2 D, 4): displacements of dots (D, 2) by a uniform stretch, rotation and two shears of the view about a centre."""
    x, y = ((dots - centre) / (4 * pitch)).T
    return np.stack([np.stack(pair, axis=1) for pair in ((x, y), (-y, x), (x, -y), (y, x))], axis=-1).reshape(-1, 4)


def _filled(dots: np.ndarray, seen: np.ndarray, displacements: np.ndarray) -> np.ndarray:
    """(D, 2): displacements; a dot that is not seen has that of the nearest seen one."""
    if seen.all():
        return displacements
    found, known = displacements.copy(), np.flatnonzero(seen)
    nearest = ((dots[~seen][:, None] - dots[known])**2).sum(axis=2).argmin(axis=1)
    found[~seen] = displacements[known[nearest]]
    return found
