# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact point and depth in NumPy: what the compiled ones measure themselves against."""
import math
from dataclasses import dataclass

import numpy as np
from outline_reference import boundary_sd, place_and_normal
from scipy.linalg import lapack
from tactile_perception.common.geometry import tangents

_SIGNIFICANT = 4.0  # standard deviations by which a curvature must differ from zero; chosen
_BENT = 0.1  # rad, rotation of the normal from the centre of a region to its border below which the region is a face; chosen
_ROUND = 2.5  # largest ratio of the principal curvatures of a fingertip; chosen
_REACH = 2.6  # pitches around the deepest dot in which a quadratic smooths the depth: 21 dots; chosen
_BETWEEN = 0.6  # pitches to the nearest dot within which a maximum lies between dots; chosen, below 1/sqrt(2) of a cell's centre
_QUADRATIC = 9  # fewest dots for the six coefficients of a quadratic; chosen
_FEWEST = 5  # fewest dots for the four coefficients of an isotropic quadratic; chosen
_ISOTROPIC = np.eye(6)[:, :4] + np.outer(np.eye(6)[5], np.eye(4)[3])  # from these four coefficients to the six
_RIDGE = 1e-10 * np.eye(6)
_FINGERTIP = 8e-3  # m, radius of a typical fingertip


def quadratic_terms(offset: np.ndarray) -> np.ndarray:
    """(N, 6) terms 1, x, y, x^2/2, xy, y^2/2 at offset (N, 2)."""
    x, y = offset.T
    terms = np.empty((6, len(x)))
    terms[0], terms[1], terms[2], terms[3], terms[4], terms[5] = 1.0, x, y, 0.5 * x * x, x * y, 0.5 * y * y
    return terms.T


def contact_point(dots, region) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Contact point (3,), m, on the deformed surface, its covariance (3, 3), m^2, and the unit normal (3,) of the surface there.

    The dots of the region lie on the object. Along a principal direction in which they curve like a fingertip, the contact point is the
    lowest point of the fitted curve; along one without curvature (a face, an edge), it is the area centroid of the region. With too few
    dots for a fit the covariance covers both cases.
    """
    centroid, covariance = _centroid(dots, region)
    points = dots.xyz[region.members] - centroid
    if len(points) < _FEWEST:
        return centroid, covariance + _unknown_shape(region.moments.normal), region.moments.normal
    offset, projector, tip_covariance = _round_tip(points, region.moments, dots.sigma)
    if not projector.any() or not offset @ offset < 2 * region.moments.area:
        return centroid, covariance, region.moments.normal
    rest = np.eye(3)
    rest[:2, :2] -= projector
    position, normal = place_and_normal(region.surface, centroid[:2] + offset)
    return position, rest @ covariance @ rest + tip_covariance, normal


def _round_tip(points: np.ndarray, moments, sigma: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lowest point of the object through points (N, 3), m, from their centroid: x and y (2,), projector (2, 2) on the directions in which
    the object is round (x and y are 0 across them), covariance (3, 3)."""
    normal = moments.normal
    frame = np.vstack([tangents(normal), normal])
    bend = _principal_bend(points @ frame.T, sigma)
    along = points @ (frame[:2].T @ bend.directions)
    along -= along.sum(axis=0) / len(along)
    reach = 2 * np.sqrt(np.einsum('ij,ij->j', along, along) / len(along))
    curved = (bend.curvature > _SIGNIFICANT * bend.curvature_sd) & (bend.curvature * reach > _BENT)
    if curved.all() and bend.curvature[1] < _ROUND * bend.curvature[0]:
        return _sphere_tip(points, sigma)
    offset, projector, covariance = np.zeros(2), np.zeros((2, 2)), np.zeros((3, 3))
    for k in np.flatnonzero(curved):
        direction = bend.directions[:, k] @ frame[:2]
        steep = direction[2] / normal[2] + bend.slope[k]
        length = -steep / np.hypot(1, steep) / bend.curvature[k]
        offset += length * direction[:2]
        both = np.outer(direction[:2], direction[:2])
        projector += both / np.trace(both)
        covariance[:2, :2] += both * ((length * bend.curvature_sd[k])**2 + bend.slope_sd[k]**2) / bend.curvature[k]**2
    return offset, projector, covariance


def _unknown_shape(normal: np.ndarray) -> np.ndarray:
    """(3, 3) m^2, covariance of the centroid as the tip of a fingertip of unknown shape: its offset grows with the surface's tilt."""
    away = np.array([normal[0], normal[1], 0.0]) * _FINGERTIP
    return np.outer(away, away)


def _centroid(dots, region) -> tuple[np.ndarray, np.ndarray]:
    centroid = region.moments.centroid
    sds = boundary_sd(region.outline.loops, [loop - centroid for loop in region.outline.loops], region.pitch) / region.moments.area
    count = max(int(region.members.sum()), 1)
    return centroid, np.diag(np.square(sds)) + np.diag([0, 0, dots.sigma**2 / count])


@dataclass(frozen=True)
class _Bend:
    """Principal curvatures (2,), 1/m, smaller first, positive where the object bulges into the sensor, along directions (2, 2), columns in
    the tangent plane, and slopes (2,), with their standard deviations."""

    directions: np.ndarray
    curvature: np.ndarray
    curvature_sd: np.ndarray
    slope: np.ndarray
    slope_sd: np.ndarray


def _principal_bend(local: np.ndarray, sigma: float) -> _Bend:
    """Bend of the quadratic fitted to local (N, 3), m, coordinates along two tangents and the normal; isotropic for few dots."""
    terms = quadratic_terms(local[:, :2])
    kind = np.eye(6) if len(local) >= _QUADRATIC else _ISOTROPIC
    design = terms @ kind
    scale = np.maximum(np.abs(design).max(axis=0), 1e-12)
    design = design / scale
    square = design.T @ design
    spread = kind @ (lapack.dposv(square + _RIDGE[:len(square), :len(square)], np.eye(len(square)))[1] / scale[:, None])
    found = spread @ (design.T @ local[:, 2])
    residual = local[:, 2] - terms @ found
    noise = max(sigma, math.sqrt(residual @ residual / (len(local) - kind.shape[1])))
    covariance = spread @ square @ spread.T * noise**2
    curvature, along = _principal(*found[3:].tolist())
    weights = np.array([along[0]**2, 2 * along[0] * along[1], along[1]**2])
    curvature_sd = np.sqrt((weights * (covariance[3:, 3:] @ weights)).sum(axis=0))
    slope_sd = np.sqrt((along * (covariance[1:3, 1:3] @ along)).sum(axis=0))
    return _Bend(along, curvature, curvature_sd, found[1:3] @ along, slope_sd)


def _principal(xx: float, xy: float, yy: float) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues (2,), smaller first, and eigenvectors (2, 2), columns, of [[xx, xy], [xy, yy]]."""
    middle, radius, angle = (xx + yy) / 2, math.hypot((xx - yy) / 2, xy), math.atan2(xy, (xx - yy) / 2) / 2
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.array([middle - radius, middle + radius]), np.array([[-sine, cosine], [cosine, sine]])


def _pseudo_inverse(design: np.ndarray) -> np.ndarray:
    """(C, N), regularised, of design (N, C) with columns of about 1."""
    return lapack.dposv(design.T @ design + _RIDGE[:design.shape[1], :design.shape[1]], design.T)[1]


def _sphere_tip(points: np.ndarray, sigma: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """_round_tip by a sphere fitted to points (N, 3), m; x and y are NaN without a solution."""
    design = np.column_stack([2 * points, np.ones(len(points))])
    scale = np.abs(design).max(axis=0)
    inverse = _pseudo_inverse(design / scale)
    found = inverse @ np.sum(points**2, axis=1) / scale
    square = found[3] + found[:3] @ found[:3]
    covariance = np.zeros((3, 3))
    covariance[:2, :2] = ((inverse @ inverse.T) / np.outer(scale, scale))[:2, :2] * 4 * square * sigma**2
    return (found[:2] if square > 0 else np.full(2, np.nan)), np.eye(2), covariance


def contact_depth(dots, region, cap) -> float:
    """Depth, m: the distance along z by which the object must retract to just touch the surface at rest.

    The largest height of the rest shape above the deformed surface in the region, by a quadratic fitted around the deepest dot.
    """
    points = dots.xyz[region.members]
    if not len(points):
        points = region.outline.points
    gap = cap.heights(points[:, :2]) - points[:, 2]
    known = np.isfinite(gap)
    if not known.any():
        return np.nan
    middle = int(np.nanargmax(gap))
    offset = (points[:, :2] - points[middle, :2]) / region.pitch
    near = (np.einsum('ij,ij->i', offset, offset) < _REACH**2) & known
    if np.count_nonzero(near) < _QUADRATIC:
        return float(gap[middle])
    return float(_smoothed_peak(offset[near], gap[near]))


def _smoothed_peak(offset: np.ndarray, gap: np.ndarray) -> float:
    """Maximum of the quadratic fitted to gap (N,) at offset (N, 2), pitches, at the dots or between them: it is not extrapolated."""
    design = quadratic_terms(offset)
    found = lapack.dposv(design.T @ design + 10 * _RIDGE, design.T @ gap)[1]
    best = (design @ found).max()
    across = found[3] * found[5] - found[4]**2
    if found[3] >= 0 or across <= 0:  # no maximum
        return best
    top = np.array([found[4] * found[2] - found[5] * found[1], found[4] * found[1] - found[3] * found[2]]) / across
    away = offset - top
    between = np.einsum('ij,ij->i', away, away).min() < _BETWEEN**2
    return max(best, found[0] + 0.5 * found[1:3] @ top) if between else best
