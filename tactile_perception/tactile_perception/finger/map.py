# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From the detector to the sphere.

Geometry of the hemisphere (Maekawa et al., eqs 6 to 8, 12, 13) and of the detector (eq 1); the calibrated map, a Gaussian process with a
polynomial trend, and its shift with the light; the equidistant map (eqs 2 to 5).
"""
from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..core.errors import BadCalibration
from .constants import FINGER


def direction(phi: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Unit normals (..., 3) at azimuth phi and polar angle theta, rad (eq 7)."""
    return np.stack([np.cos(phi) * np.sin(theta), np.sin(phi) * np.sin(theta), np.cos(theta) + 0 * phi], axis=-1)


def log_map(normal: np.ndarray) -> np.ndarray:
    """Logarithmic map at the pole: unit vectors (..., 3) to tangent vectors (..., 2), rad, whose length is the polar angle."""
    across = np.hypot(normal[..., 0], normal[..., 1])
    theta = np.arctan2(across, np.where(np.isfinite(normal[..., 2]), normal[..., 2], np.nan))
    with np.errstate(invalid='ignore', divide='ignore'):
        return normal[..., :2] * np.where(across > 0, theta / across, 1.0)[..., None]


def exp_map(plane: np.ndarray) -> np.ndarray:
    """Exponential map at the pole, the inverse of log_map: tangent vectors (..., 2), rad, to unit vectors (..., 3)."""
    theta = np.hypot(plane[..., 0], plane[..., 1])
    return np.concatenate([plane * np.sinc(theta / np.pi)[..., None], np.cos(theta)[..., None]], axis=-1)


#: Rows: outputs x1, y1, x2, y2. Columns: difference along x and along y (numerators of eq 1), total (its denominator), cross term.
MIX = np.array([[-1.0, -1.0, 1.0, 1.0], [1.0, -1.0, 1.0, -1.0], [1.0, 1.0, 1.0, 1.0], [-1.0, 1.0, 1.0, -1.0]])
TOTAL, CROSS = 2, 3


def centroid(sums: np.ndarray) -> np.ndarray:
    """Centroids (N, 2) of the light on the detector, its spots, from sums (N, 4) = net voltages @ MIX (eq 1 without its offset).

    In half widths L_d / 2 of the detector, -1 to 1; NaN where the total is not positive.
    """
    total = sums[:, TOTAL:CROSS]
    with np.errstate(divide='ignore', invalid='ignore'):
        return np.where(total > 0, sums[:, :TOTAL] / total, np.nan)


@dataclass(frozen=True)
class EquidistantMap:
    """offset: (2,) half widths, image of the pole (x_c0 of eq 2); beta: rad per half width (beta_c of eq 5)."""

    offset: np.ndarray
    beta: float

    def normals(self, spot: np.ndarray) -> np.ndarray:
        """Unit normals (N, 3) at spots (N, 2), half widths (eqs 3, 4, 7)."""
        return exp_map(self.beta * (spot - self.offset))


def tabulated(evaluate: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Table (nodes, nodes, channels) of evaluate(spots (N, 2)) -> (N, channels) on a grid of nodes over the square from -1 to 1, rows
    along y: what the kernels interpolate bilinearly (src/finger/detector.hpp). Some lines at a time: all at once take 50 MB."""
    line = np.linspace(-1, 1, FINGER.cells + 1)
    spots = np.stack(np.meshgrid(line, line), axis=-1)
    values = np.concatenate([evaluate(lines.reshape(-1, 2)) for lines in np.array_split(spots, 8)])
    return values.reshape(FINGER.cells + 1, FINGER.cells + 1, -1).astype(float)


def trend(spot: np.ndarray, terms: int) -> np.ndarray:
    """Basis (N, terms) at spots (N, 2): 3 terms are affine, 5 add radial distortion of third order."""
    x, y = spot.T
    square = x * x + y * y
    return np.column_stack([np.ones(len(spot)), x, y, x * square, y * square])[:, :terms]


def _kernel(a: np.ndarray, b: np.ndarray, length: float) -> np.ndarray:
    return np.exp(-0.5 * ((a[:, None] - b[None]) ** 2).sum(-1) / length**2)


@dataclass(frozen=True)
class SmoothMap:
    """Gaussian process (squared exponential kernel) with a polynomial trend.

    spot: (N, 2) half widths, training points; slopes: (terms, 2) of the trend; weights: (N, 2) of the kernels; length: half widths, of the
    kernel; amplitude: rad, its standard deviation; extra: rad, standard deviation of the labels; noise: (N,) rad, effect of the light's
    noise at each point.
    """

    spot: np.ndarray
    slopes: np.ndarray
    weights: np.ndarray
    length: float
    amplitude: float
    extra: float
    noise: np.ndarray

    def values(self, spot: np.ndarray) -> np.ndarray:
        """Predicted values (M, 2), rad, at spots (M, 2)."""
        return trend(spot, len(self.slopes)) @ self.slopes + self.amplitude**2 * _kernel(spot, self.spot, self.length) @ self.weights

    def deviation(self, spot: np.ndarray) -> np.ndarray:
        """Standard deviation (M,), rad, of either value at spots (M, 2), without the noise of the light."""
        inverse, basis, normal = self._process
        cross = self.amplitude**2 * _kernel(spot, self.spot, self.length)
        explained = (cross @ inverse * cross).sum(1)
        free = trend(spot, len(self.slopes)) - cross @ (inverse @ basis)
        variance = self.amplitude**2 - explained + ((free @ np.linalg.pinv(normal)) * free).sum(1)
        return np.sqrt(np.maximum(variance, 0.0) + self.extra**2)

    def precision(self) -> np.ndarray:
        """Inverse covariance (N, N), rad^-2, of either value at the training points, with the trend projected out."""
        return _without_trend(*self._process)

    @cached_property
    def _process(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return _process(self.spot, self.noise, len(self.slopes), (self.length, self.amplitude, self.extra))


def _process(spot: np.ndarray, noise: np.ndarray, terms: int,
             hyper: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Inverse covariance (N, N) of values at spots (N, 2), basis (N, terms) of their trend, and (terms, terms) of its least squares;
    hyper: length, amplitude, extra."""
    length, amplitude, extra = hyper
    inverse, basis = np.linalg.inv(amplitude**2 * _kernel(spot, spot, length) + np.diag(noise**2 + extra**2)), trend(spot, terms)
    return inverse, basis, basis.T @ inverse @ basis


def _without_trend(inverse: np.ndarray, basis: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """The inverse covariance (N, N) with the trend projected out; see _process."""
    return inverse - inverse @ basis @ np.linalg.solve(normal, basis.T @ inverse)


def _solved(spot: np.ndarray, values: np.ndarray, noise: np.ndarray, terms: int, hyper: tuple[float, float, float]):
    """(log restricted likelihood, slopes, weights, leave-one-out residuals (N, 2)) for hyper (see _process)."""
    inverse, basis, normal = _process(spot, noise, terms, hyper)
    slopes = np.linalg.solve(normal, basis.T @ inverse @ values)
    weights = inverse @ (values - basis @ slopes)
    # Leave-one-out residuals in closed form: weights over the diagonal of the precision with the trend projected out.
    left_out = weights / np.diag(_without_trend(inverse, basis, normal))[:, None]
    evidence = values.shape[1] * (np.linalg.slogdet(inverse)[1] - np.linalg.slogdet(normal)[1])
    return 0.5 * (evidence - ((values - basis @ slopes) * weights).sum()), slopes, weights, left_out


def fit_smooth_map(spot: np.ndarray, values: np.ndarray, noise: np.ndarray, terms: int = 5) -> tuple[SmoothMap, np.ndarray]:
    """The map from spots (N, 2), half widths, to values (N, 2), rad, and its leave-one-out residuals (N, 2), rad.

    noise: (N,) rad, of each spot; terms: of the trend. Hyperparameters maximise the restricted likelihood over a grid.
    """
    # From the spacing of a dense calibration to the half width of the detector, and from a tenth of a degree to the distortion of the
    # paper's finger (6 degrees, fig 8).
    lengths, amplitudes = (0.15, 0.25, 0.4, 0.65, 1.0), (0.003, 0.01, 0.03, 0.1)  # half widths, rad
    label_sigmas = (0.0005, 0.001, 0.002, 0.004, 0.008)  # rad: errors of positions and labels beside the noise of the light
    choices = itertools.product(lengths, amplitudes, label_sigmas)
    best = max(choices, key=lambda hyper: _solved(spot, values, noise, terms, hyper)[0])
    _, slopes, weights, left_out = _solved(spot, values, noise, terms, best)
    return SmoothMap(spot, slopes, weights, *best, noise), left_out


def level_basis(spot: np.ndarray, terms: int) -> np.ndarray:
    """Basis (N, terms) of the light at first contact at spots (N, 2)."""
    x, y = spot.T
    square = x * x + y * y
    return np.column_stack([np.ones(len(spot)), square, square * square, x, y])[:, :terms]


# The patch of a stronger contact is larger and reaches farther to either side. More light arrives from the side of the pole than from that
# of the rim, so the spot moves towards the pole as the light grows.


@dataclass(frozen=True)
class LightShift:
    """typical: (5,) coefficients of the logarithm of the light, V, of a typical contact at a spot; slopes: (4, 2), rad for a contact of
    twice that light, of the four terms that grow with the distance from the detector's centre."""

    typical: np.ndarray
    slopes: np.ndarray

    def light(self, spot: np.ndarray) -> np.ndarray:
        """Light (N,), V, of a typical contact at spots (N, 2), half widths."""
        return np.exp(np.clip(level_basis(spot, FINGER.light_terms) @ self.typical, -FINGER.max_log, FINGER.max_log))

    def relative(self, spot: np.ndarray, light: np.ndarray) -> np.ndarray:
        """Light (N,), V, over the typical one, minus 1, clipped to -1 to 1."""
        # relative light up to which the shift is corrected: a calibration with a few forces shows no more
        return np.clip(light / self.light(spot) - 1, -1.0, 1.0)

    def bend(self, spot: np.ndarray) -> np.ndarray:
        """What a contact of twice the typical light adds to the map, (N, 2) rad."""
        return trend(spot, 5)[:, 1:] @ self.slopes

    def values(self, spot: np.ndarray, light: np.ndarray) -> np.ndarray:
        """What contacts at spots (N, 2), half widths, with light (N,), V, add to the map, (N, 2) rad."""
        return self.relative(spot, light)[:, None] * self.bend(spot)


def fit_light_shift(spot: np.ndarray, values: np.ndarray, light: np.ndarray, smooth: SmoothMap) -> LightShift:
    """The shift with the light (N,), V, that a map of the spots (N, 2) alone leaves in values (N, 2), rad: generalised least squares with
    the covariance of that map."""
    typical = np.linalg.lstsq(level_basis(spot, FINGER.light_terms), np.log(light), rcond=None)[0]
    found = LightShift(typical, np.zeros((4, 2)))
    basis = found.relative(spot, light)[:, None] * trend(spot, 5)[:, 1:]
    weight = smooth.precision()
    return LightShift(typical, np.linalg.lstsq(basis.T @ weight @ basis, basis.T @ weight @ values, rcond=None)[0])


def fit_equidistant_map(spot: np.ndarray, normal: np.ndarray) -> tuple[EquidistantMap, list[str]]:
    """The map fitted to contacts at spots (N, 2), half widths, with known normals (N, 3), and notes on what was assumed.

    Contacts at the pole give the offset (eq 2), all others the scale: eq 5, averaged with the distances as weights. Raises BadCalibration
    without contacts, for non-finite values, and where all spots coincide.
    """
    if not len(spot):
        raise BadCalibration('no contact at a known position: press the finger at its pole and at one more known position')
    if not (np.isfinite(spot).all() and np.isfinite(normal).all()):
        raise BadCalibration('a contact\'s position or normal is not finite: leave it out of the recording')
    theta = np.linalg.norm(log_map(normal), axis=1)
    pole = theta <= 0.05  # rad: 0.8 mm on the surface of the paper's finger
    others = ~pole
    notes = []
    if pole.any():
        offset = spot[pole].mean(axis=0)
    elif len(spot) > 2:
        offset = _extrapolated_offset(spot, log_map(normal))
        notes.append('no contact at the pole: the offset is extrapolated from the others')
    else:
        offset = np.zeros(2)
        notes.append('no contact at the pole: the detector\'s offset is assumed to be 0')
    if not others.any():
        notes.append(f'no contact away from the pole: the scale is the nominal {FINGER.nominal_beta:.3f} rad per half width')
        return EquidistantMap(offset, FINGER.nominal_beta), notes
    distance = float(np.linalg.norm(spot[others] - offset, axis=1).sum())
    if not 1e-6 * others.sum() < distance < np.inf:  # half widths, mean distance from the pole: guards the division of eq 5
        raise BadCalibration('contacts away from the pole have the detector position of the pole: check that light reaches the detector')
    return EquidistantMap(offset, float(theta[others].sum()) / distance), notes


def _extrapolated_offset(spot: np.ndarray, plane: np.ndarray) -> np.ndarray:
    """(2,) spot of the pole by a linear fit of spots to tangent vectors."""
    basis = np.column_stack([plane, np.ones(len(plane))])
    return np.linalg.lstsq(basis, spot, rcond=None)[0][2]
