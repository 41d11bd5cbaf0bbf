# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contacts as loaded discs: position, radius, press and shear of each from the displacements of a gel's dots."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import BadFrame
from .layer import DiscLoads

FEWEST = 6  # dots: three parameters of a press and three of a shear
MAX_CONTACTS = 4  # bounds the time of a frame
_RADII = 0.3, 0.4  # pitches, the smallest disc that dots resolve; part of the smaller side of the dots' field, largest with its rim in view
_CANDIDATES = 220  # positions of the coarse search; a finer one ends in the same disc
_CANDIDATE_RADII = 1.4  # ratio of neighbouring radii of the coarse search; the same
_MEAN_STRESS = 0.7  # prior: mean pressure over shear modulus. A ball on a thick incompressible layer has 1.7 a / R (Hertz); a / R about 0.4
_STRESS_SPREAD = 0.35  # prior: standard deviation of its logarithm: a factor of 1.4, as a / R from 0.3 to 0.6
_DOWN = np.array([1.0, 1.0, -1.0])  # a press is a force down
_SMALL, _TINY = 1e-4, 1e-30  # step of a derivative, pitches or a part of the radius; m^2, a force that is none
_SHIFT = 3e-5  # m; prior: standard deviation of the shift of the gel against its camera, whose holder gives way
_CORRELATED = 2.0  # pitches; residuals of presses on gels correlate by 0.1 at one pitch, by 0.02 at two
_MISTAKEN = 0.3  # pitches of residual: a dot that was taken for its neighbour; no press leaves so much
_STEPS, _DAMPING = 8, 1e-3  # of Gauss and Newton
_SINGULAR = 1e-9  # of the largest candidate's sum of squares, added to each
_TOLERANCE = 1e-3  # pitches, and of the radius: the iteration ends
FIRST_EVIDENCE = 8.0  # twice the logarithm of the likelihood ratio against an even motion, where dots have moved significantly
SECOND_EVIDENCE = 24.0  # of a disc more, which has six parameters: by chance once in 2,000 (chi-square)


@dataclass(frozen=True)
class Disc:
    """One contact.

    Attributes
    ----------
    middle : ndarray, shape (2,)
        m.
    radius : float
        m.
    force : ndarray, shape (3,)
        Of the object on the gel, over the shear modulus, m^2.
    covariance : ndarray, shape (6, 6)
        Of middle, logarithm of the radius, and force.
    """

    middle: np.ndarray
    radius: float
    force: np.ndarray
    covariance: np.ndarray


class DiscFit:
    """Fits discs to displacements of a gel's dots.

    An even stretch, turn and shear of the whole view is fitted besides: the gel moves towards the camera and tilts when it is pressed.

    Parameters
    ----------
    loads : DiscLoads
    dots : ndarray, shape (D, 2)
        Dots of the undeformed gel, m.
    pitch : float
        Distance of neighbouring dots, m.
    camera : ndarray, shape (3,)
        Position of the camera over the dots, m.
    """

    def __init__(self, loads: DiscLoads, dots: np.ndarray, pitch: float, camera: np.ndarray):
        self.loads, self.dots, self.pitch, self.camera = loads, dots, pitch, camera
        low, high = dots.min(axis=0) - pitch / 2, dots.max(axis=0) + pitch / 2
        self.low, self.high = low, high
        # What a linear layer leaves unexplained of real presses is not correlated over two pitches: so many residuals are independent.
        self.independent = max(float((high - low).prod()) / (_CORRELATED * pitch)**2, 6.0)
        step = max(pitch / 2, float(np.sqrt((high - low).prod() / _CANDIDATES)))
        x, y = (np.linspace(a, b, max(int((b - a) / step), 2)) for a, b in zip(low, high))
        middles = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        radii = np.geomspace(loads.radii[0], loads.radii[-1],
                             int(np.log(loads.radii[-1] / loads.radii[0]) / np.log(_CANDIDATE_RADII)) + 2)
        count = len(dots)
        even = _even(dots, dots.mean(axis=0), pitch)
        self._even = np.linalg.qr(even)[0]
        bases = []
        for radius in radii:
            columns = loads.matrix(dots, middles, radius, camera).reshape(len(middles), 2 * count, 3)
            columns = columns - self._even @ (self._even.T @ columns)
            gram = columns.transpose(0, 2, 1) @ columns
            size = np.trace(gram, axis1=1, axis2=2)  # nearly 0 for a disc that moves no dot; such a candidate explains nothing
            gram += (_SINGULAR * max(float(size.max()), _TINY)) * np.eye(3)
            root = np.linalg.cholesky(gram)
            bases.append(np.linalg.solve(root, columns.transpose(0, 2, 1)))
        self._bases = np.concatenate(bases).reshape(-1, 2 * count)
        self._candidates = np.column_stack([np.tile(middles, (len(radii), 1)), np.repeat(radii, len(middles))])

    @staticmethod
    def loads_for(layer, dots: np.ndarray, pitch: float) -> DiscLoads:
        """Tables for the discs that these dots can resolve."""
        sides = np.ptp(dots, axis=0) + pitch
        return DiscLoads(layer, _RADII[0] * pitch, max(_RADII[1] * float(sides.min()), _RADII[0] * pitch * 2))

    def solve(self, seen: np.ndarray, moved: np.ndarray, sigma: float) -> list[Disc]:
        """Contacts, the strongest first; none without evidence.

        Parameters
        ----------
        seen : ndarray of bool, shape (D,)
            Dots whose displacement is known.
        moved : ndarray, shape (D, 2)
            Displacements, m; ignored where not seen.
        sigma : float
            Standard deviation of a coordinate, m.

        Raises
        ------
        BadFrame
            If hardly any dot moves as a contact moves it.
        """
        for _ in range(2):  # the second time without mistaken dots
            discs, residual = self._contacts(seen, moved, sigma)
            mistaken = seen & (np.abs(residual).max(axis=1) > _MISTAKEN * self.pitch)
            if not mistaken.any():
                break
            seen = seen & ~mistaken
            if seen.sum() < FEWEST:
                raise BadFrame(f'no press explains how {mistaken.sum()} of {len(seen)} dots moved; check them in image_annotated')
        return discs

    def _contacts(self, seen: np.ndarray, moved: np.ndarray, sigma: float) -> tuple[list[Disc], np.ndarray]:
        """Contacts, and what they leave of the displacements (D, 2), m, 0 where not seen. A disc more must be worth its parameters."""
        problem = _Problem(self, seen, moved, sigma)
        found, shapes = problem.without_discs(), np.zeros((0, 4))
        while len(shapes) < MAX_CONTACTS:
            start, squares = self._coarse(_filled(self.dots, seen, found.residual), shapes)
            needed = SECOND_EVIDENCE if len(shapes) else FIRST_EVIDENCE
            if problem.gain(found.squares, found.squares - squares) < needed / 2:
                break  # no refinement doubles the evidence
            trial = problem.refine(problem.with_likely_stress(np.vstack([shapes[:, :3], start])), problem.scale(found.squares - squares))
            if problem.gain(found.squares, trial.squares) < needed or len(shapes) and not trial.is_separate():
                break
            found, shapes = trial, trial.shapes
        return found.discs(), found.residual

    def _coarse(self, residual: np.ndarray, known: np.ndarray) -> tuple[np.ndarray, float]:
        """Middle and radius (3,) of the candidate beside the known discs (K, 3) that explains most of the residual (D, 2), and how much
        of its sum of squares that is."""
        loads = (self._bases @ residual.ravel()).reshape(-1, 3)
        loads[:, 2] = np.maximum(loads[:, 2], 0.0)  # an object presses; the last of the three has the sign of the press
        squares = (loads**2).sum(axis=1)
        for disc in known:
            squares[_overlap(self._candidates, disc)] = 0.0
        best = int(squares.argmax())
        return self._candidates[best], float(squares[best])


class _Problem:
    """Displacements of the seen dots, less their even part, which discs have to explain."""

    def __init__(self, fit: DiscFit, seen: np.ndarray, moved: np.ndarray, sigma: float):
        self.fit, self.seen, self.dots = fit, seen, fit.dots[seen]
        self.even = np.linalg.qr(_even(self.dots, fit.dots.mean(axis=0), fit.pitch))[0]
        self.data = self.without_even(moved[seen].ravel())
        self.shift = self.without_even(np.tile(np.eye(2), (len(self.dots), 1)))
        self.floor = 2 * seen.sum() * sigma**2

    def without_even(self, columns: np.ndarray) -> np.ndarray:
        """(2 D, ...): the columns less their even part."""
        return columns - self.even @ (self.even.T @ columns)

    def gain(self, before: float, after: float) -> float:
        """Twice the logarithm of the ratio of the likelihoods of two fits that leave these sums of squares."""
        return self.fit.independent * float(np.log((before + self.floor) / (max(after, 0.0) + self.floor)))

    def without_discs(self) -> _Evaluation:
        """What an even motion alone explains."""
        found, none = None, np.zeros((0, 4))
        for _ in range(3):  # the shift depends on the residuals' scale, and they on it
            found = self.evaluate(none, self.scale(found.squares if found else float(self.data @ self.data)))
        return found

    def scale(self, squares: float) -> float:
        """Standard deviation, m, of one of the independent residuals, from their sum of squares."""
        return float(np.sqrt(max(squares, self.floor) / self.fit.independent))

    def columns(self, middles: np.ndarray, radius: float) -> np.ndarray:
        """(..., 2 D, 3): displacements under unit loads on discs of one radius at middles (..., 2), less their even part."""
        columns = self.fit.loads.matrix(self.dots, middles, radius, self.fit.camera)
        return self.without_even(columns.reshape(*middles.shape[:-1], 2 * len(self.dots), 3))

    def evaluate(self, shapes: np.ndarray, scale: float) -> _Evaluation:
        """The shift and the shears that fit best with pressed discs of shapes (K, 4): middle, radius, mean pressure over shear modulus;
        scale: m, of a residual, against which the shift's prior counts."""
        columns = [self.columns(shape[:2], shape[2]) for shape in shapes]
        linear = np.concatenate([self.shift, *(c[:, :2] for c in columns)], axis=1)
        presses = np.pi * shapes[:, 2]**2 * shapes[:, 3]
        unpressed = self.data - sum((c[:, 2] * press for c, press in zip(columns, presses)), np.zeros(len(self.data)))
        prior = np.zeros(linear.shape[1])
        prior[:2] = (scale / _SHIFT)**2
        inverse = np.linalg.inv(linear.T @ linear + np.diag(prior)) @ linear.T
        found = inverse @ unpressed
        return _Evaluation(self, shapes, columns, linear, inverse, found[:2], np.column_stack([found[2:].reshape(-1, 2), presses]),
                           unpressed - linear @ found)

    def with_likely_stress(self, shapes: np.ndarray) -> np.ndarray:
        """(K, 4): shapes (K, 3), the mean pressure of each being the one that fits best within two standard deviations of its prior."""
        matrix = np.concatenate([self.columns(shape[:2], shape[2]) for shape in shapes], axis=1)
        presses = np.linalg.lstsq(matrix, self.data, rcond=None)[0][2::3]
        low, high = _MEAN_STRESS * np.exp([-2 * _STRESS_SPREAD, 2 * _STRESS_SPREAD])
        return np.column_stack([shapes, np.clip(presses / (np.pi * shapes[:, 2]**2), low, high)])

    def refine(self, shapes: np.ndarray, scale: float) -> _Evaluation:
        """Gauss and Newton on the shapes (K, 4), with shift and shears eliminated (variable projection, in Kaufman's form); scale: m, of a
        residual, to start with."""
        fit, now, damping = self.fit, self.evaluate(shapes, scale), _DAMPING
        for _ in range(_STEPS):
            scale = self.scale(now.squares)
            vector, slopes = now.vector(scale), now.slopes(scale)
            normal = slopes.T @ slopes
            step = -np.linalg.solve(normal + damping * np.diag(np.diag(normal)), slopes.T @ vector).reshape(-1, 4)
            step = np.clip(step, -1.0, 1.0)
            middle = np.clip(now.shapes[:, :2] + step[:, :2] * fit.pitch, fit.low, fit.high)
            radius = np.clip(now.shapes[:, 2] * np.exp(step[:, 2]), fit.loads.radii[0], fit.loads.radii[-1])
            trial = self.evaluate(np.column_stack([middle, radius, now.shapes[:, 3] * np.exp(step[:, 3])]), scale)
            if np.sum(trial.vector(scale)**2) >= vector @ vector:
                damping = 25 * max(damping, _DAMPING)
                continue
            now, damping = trial, damping / 5
            if np.abs(step).max() < _TOLERANCE:
                break
        return now


@dataclass(frozen=True)
class _Evaluation:
    """Discs with the shift and the shears that fit best. shapes: (K, 4) m, m, m, 1; columns: K times (2 D, 3), displacements under unit
    loads; linear: (2 D, 2 + 2 K) under a unit shift and unit shears, and inverse, its pseudoinverse with the shift's prior; shift: (2,) m;
    force: (K, 3) m^2, the press positive; left: (2 D,) m, residuals."""

    problem: _Problem
    shapes: np.ndarray
    columns: list[np.ndarray]
    linear: np.ndarray
    inverse: np.ndarray
    shift: np.ndarray
    force: np.ndarray
    left: np.ndarray

    @property
    def squares(self) -> float:
        """m^2, of the residuals."""
        return float(self.left @ self.left)

    @property
    def residual(self) -> np.ndarray:
        """(D, 2) m, 0 for dots that are not seen."""
        found = np.zeros_like(self.problem.fit.dots)
        found[self.problem.seen] = self.left.reshape(-1, 2)
        return found

    def vector(self, scale: float) -> np.ndarray:
        """Residuals over their scale, m, and those of the prior of the mean pressure."""
        return np.concatenate([self.left / scale, np.log(self.shapes[:, 3] / _MEAN_STRESS) / _STRESS_SPREAD])

    def turns(self) -> np.ndarray:
        """(2 D, 4 K): how the displacements change with the middles, in pitches, and the logarithms of radii and mean pressures, under the
        same shears."""
        problem, found = self.problem, []
        for shape, force, columns in zip(self.shapes, self.force, self.columns):
            moved = problem.columns(shape[:2] + _SMALL * problem.fit.pitch * np.eye(2), shape[2])
            grown = problem.columns(shape[:2], shape[2] * (1 + _SMALL))
            larger = grown * np.array([1.0, 1.0, (1 + _SMALL)**2])
            found += [(other - columns) @ force / _SMALL for other in (*moved, larger)] + [columns[:, 2] * force[2]]
        return np.array(found).T

    def slopes(self, scale: float) -> np.ndarray:
        """(2 D + K, 4 K) of vector."""
        turns, count = self.turns(), len(self.shapes)
        prior = np.zeros((count, 4 * count))
        prior[np.arange(count), np.arange(3, 4 * count, 4)] = 1 / _STRESS_SPREAD
        return np.concatenate([-(turns - self.linear @ (self.inverse @ turns)) / scale, prior])

    def is_separate(self) -> bool:
        """Whether the last disc overlaps none of the others."""
        return not any(_overlap(self.shapes[-1:], other).any() for other in self.shapes[:-1])

    def discs(self) -> list[Disc]:
        """The contacts, the hardest press first."""
        if not len(self.shapes):
            return []
        covariances = self._covariances()
        found = [Disc(shape[:2], float(shape[2]), force * _DOWN, covariance)
                 for shape, force, covariance in zip(self.shapes, self.force, covariances)]
        return sorted(found, key=lambda disc: disc.force[2])

    def _covariances(self) -> list[np.ndarray]:
        """(6, 6) of each disc (Disc.covariance), all shears and shapes being unknown."""
        count, scale = len(self.shapes), self.problem.scale(self.squares)
        full = np.concatenate([self.turns().reshape(-1, count, 4), self.linear[:, 2:].reshape(-1, count, 2)], axis=2)
        full = np.concatenate([full.reshape(-1, 6 * count), self.linear[:, :2]], axis=1) / scale
        prior = np.zeros((count + 2, 6 * count + 2))
        prior[np.arange(count), np.arange(3, 6 * count, 6)] = 1 / _STRESS_SPREAD
        prior[-2:, -2:] = np.eye(2) / _SHIFT
        rows = np.concatenate([full, prior])
        size = np.sqrt((rows**2).sum(axis=0))
        inverse = np.linalg.pinv((rows / size).T @ (rows / size)) / np.outer(size, size)
        found = []
        for k, press in enumerate(self.force[:, 2]):
            to_disc = np.zeros((6, 6))  # from middle in pitches, logarithms of radius and mean pressure, shears
            to_disc[[0, 1, 2, 3, 4], [0, 1, 2, 4, 5]] = self.problem.fit.pitch, self.problem.fit.pitch, 1.0, 1.0, 1.0
            to_disc[5, 2:4] = -2 * press, -press
            found.append(to_disc @ inverse[6 * k:6 * k + 6, 6 * k:6 * k + 6] @ to_disc.T)
        return found


def _overlap(discs: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(N,) bool: whether discs (N, 3) overlap another."""
    return np.hypot(*(discs[:, :2] - other[:2]).T) < discs[:, 2] + other[2]


def _even(dots: np.ndarray, middle: np.ndarray, pitch: float) -> np.ndarray:
    """(2 D, 4): displacements of dots (D, 2) that stretch, turn and shear the whole view evenly about its middle."""
    x, y = ((dots - middle) / (4 * pitch)).T
    return np.stack([np.stack(pair, axis=1) for pair in ((x, y), (-y, x), (x, -y), (y, x))], axis=-1).reshape(-1, 4)


def _filled(dots: np.ndarray, seen: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """(D, 2): displacements, of dots that are not seen those of the nearest that is."""
    if seen.all():
        return moved
    found, known = moved.copy(), np.flatnonzero(seen)
    nearest = ((dots[~seen][:, None] - dots[known])**2).sum(axis=2).argmin(axis=1)
    found[~seen] = moved[known[nearest]]
    return found
