# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Rotations, poses of frames, vectors by components, spherical caps and uniform splines."""
from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from ..core.errors import BadArgument, BadFrame
from .constants import COMMON


def rotation_vector(rotation: np.ndarray) -> np.ndarray:
    """(3,) axis times angle (rad, at most pi) of a rotation matrix (3, 3), exact for angles near 0 and near pi too."""
    skew = 0.5 * np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    sine = np.linalg.norm(skew)
    cosine = 0.5 * (np.trace(rotation) - 1)
    angle = np.arctan2(sine, cosine)
    if cosine > -0.5:
        return skew / np.sinc(angle / np.pi)
    # Near half a turn the axis is that of the symmetric part, cos I + (1 - cos) axis axis^T.
    square = 0.5 * (rotation + rotation.T) - cosine * np.eye(3)
    axis = square[np.argmax(np.diag(square))]
    return axis * (angle / np.linalg.norm(axis) * (-1 if axis @ skew < 0 else 1))


def rotation_matrix(vector: np.ndarray) -> np.ndarray:
    """Rotation (3, 3) by a vector (3,) of axis times angle, rad (Rodrigues)."""
    return cv2.Rodrigues(np.asarray(vector, float))[0]


def quaternion(rotation: np.ndarray) -> np.ndarray:
    """(4,) unit quaternion x, y, z, w, w >= 0, of a rotation matrix (3, 3)."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rotation.tolist()
    squares = [1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz, 1 + xx + yy + zz]  # of each part, times four
    largest = squares.index(max(squares))
    products = ((squares[0], xy + yx, xz + zx, zy - yz), (xy + yx, squares[1], yz + zy, xz - zx),
                (xz + zx, yz + zy, squares[2], yx - xy), (zy - yz, xz - zx, yx - xy, squares[3]))[largest]
    answer = np.array(products) / (2 * math.sqrt(squares[largest]))
    return answer if answer[3] >= 0 else -answer


def matrix_of_quaternion(quaternion: np.ndarray) -> np.ndarray:
    """Rotation (3, 3) of a unit quaternion (4,) x, y, z, w."""
    x, y, z, w = quaternion
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def principal_values(matrix: np.ndarray) -> tuple[float, float]:
    """Smaller and larger eigenvalue of a symmetric matrix (2, 2)."""
    (a, b), (_, c) = matrix.tolist()
    middle, half = 0.5 * (a + c), math.hypot(0.5 * (a - c), b)
    return middle - half, middle + half


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross product of component-first arrays (3, ...): np.cross without its copies. For arrays (..., 3): cross(a.T, b.T).T."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape), np.result_type(a, b))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.multiply(a[j], b[k], out=out[i, ...])
        out[i] -= a[k] * b[j]
    return out


def tangents(normal: np.ndarray) -> np.ndarray:
    """Two unit vectors (2, 3) across unit normal (3,) and each other; with normal they are a right-handed frame."""
    first = np.zeros(3)
    first[np.argmin(np.abs(normal))] = 1.0
    first -= (first @ normal) * normal
    first /= np.linalg.norm(first)
    return np.stack([first, cross(normal, first)])


def are_collinear(points: np.ndarray, min_aspect: float = 1e-3) -> bool:
    """Whether the second largest extent of points (N, 3) is less than this share of the largest one."""
    centred = points - points.mean(axis=0)
    scatter = centred.T @ centred
    total = scatter.trace()  # its square less the squares is twice the sum of the products of two squared extents
    return bool(total**2 - np.vdot(scatter, scatter) <= 2 * (min_aspect * total)**2)


def deepest_notch(corners: np.ndarray) -> float:
    """Largest depth below the convex hull of a polygon's corners (M, 2), to a ten thousandth of their unit."""
    if len(corners) < 4:
        return 0.0
    whole = np.rint(np.asarray(corners) * COMMON.notch_steps).astype(np.int32)
    notches = cv2.convexityDefects(whole, np.sort(cv2.convexHull(whole, returnPoints=False), axis=0))
    return 0.0 if notches is None else notches[:, 0, 3].max() / 256 / COMMON.notch_steps  # depths come in parts of 256


Pose = tuple[np.ndarray, np.ndarray]


class FrameTree:
    """Pose of each frame in its parent: the newest, and those of the latest seconds. changes: number of transforms taken."""

    def __init__(self):
        self._links: dict[str, tuple[str, deque[tuple[float, np.ndarray, np.ndarray]]]] = {}
        self.changes = 0

    @property
    def frames(self) -> list[str]:
        """All that are known."""
        return sorted({*self._links, *(parent for parent, _ in self._links.values())})

    def take(self, parent: str, child: str, quaternion: np.ndarray, translation: np.ndarray, stamp_s: float = -np.inf) -> None:
        """child lies in parent with quaternion (4,) x, y, z, w and translation (3,) m: at stamp_s, or from now on. One that is older than
        the last one is left out. Raises BadFrame for a quaternion whose norm is near 0 or overflows, a translation beyond 1e9 m, numbers
        that are not finite, and a child that is its own parent."""
        quaternion, translation = np.asarray(quaternion, float), np.asarray(translation, float)
        with np.errstate(over='ignore'):  # refused just below
            length = float(np.linalg.norm(quaternion))
        if not (COMMON.min_quaternion_norm < length < np.inf and (np.abs(translation) <= COMMON.max_translation).all() and parent != child):
            raise BadFrame(f'transform from {parent!r} to {child!r} is not a rigid transform: rotation {quaternion.tolist()}, translation '
                           f'{translation.tolist()}; it is skipped')
        known, poses = self._links.get(child, (parent, deque()))
        if known != parent or stamp_s == -np.inf:
            poses = deque()
        elif poses and stamp_s <= poses[-1][0]:
            return
        poses.append((stamp_s, matrix_of_quaternion(quaternion / length), translation))
        while stamp_s - poses[0][0] > COMMON.pose_memory_s:
            poses.popleft()
        self._links[child] = parent, poses
        self.changes += 1

    def pose(self, frame: str, reference: str, stamp_s: float | None = None) -> Pose | None:
        """(rotation (3, 3), translation (3,) m) that take a point of frame to reference, by the newest transforms, or at a time between two
        of them; None where they do not hang together, or the transforms do not reach that time."""
        here, there = self._above(frame, stamp_s), self._above(reference, stamp_s)
        common = next((name for name in here if name in there), None)
        if common is None:
            return None
        (rotation, translation), (back, offset) = here[common], there[common]
        return back.T @ rotation, back.T @ (translation - offset)

    def _above(self, frame: str, stamp_s: float | None) -> dict[str, Pose]:
        """The frame's pose in itself and in each frame above it, nearest first, as far as they are known."""
        poses, pose = {}, (np.eye(3), np.zeros(3))
        while frame not in poses:
            poses[frame] = pose
            parent, kept = self._links.get(frame, (frame, ()))
            found = _at(kept, stamp_s)
            if found is not None:
                frame, pose = parent, (found[0] @ pose[0], found[0] @ pose[1] + found[1])
        return poses


def _at(poses: Sequence[tuple[float, np.ndarray, np.ndarray]], stamp_s: float | None) -> Pose | None:
    """The newest of poses, or the one at a time, s: one that stays, or between two; None where they do not reach there."""
    if poses and (stamp_s is None or len(poses) == 1 and poses[0][0] == -np.inf):
        return poses[-1][1:]
    if not poses or not poses[0][0] <= stamp_s <= poses[-1][0]:
        return None
    after = next(k for k, pose in enumerate(poses) if pose[0] >= stamp_s)
    (t0, r0, p0), (t1, r1, p1) = poses[max(after - 1, 0)], poses[after]
    share = (stamp_s - t0) / (t1 - t0) if after else 0.0
    return r0 @ rotation_matrix(share * rotation_vector(r0.T @ r1)), p0 + share * (p1 - p0)


def wrench_at(wrench: np.ndarray, rotation: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """(6,) wrench at the origin of another frame {S} (paper taxel_array_image_processing, eqs 8, 9), of a wrench (6,) at the origin of a
    frame whose pose in {S} is rotation (3, 3) and origin (3,) m. A component that needs an unknown one is NaN."""
    moves = np.zeros((6, 6))
    moves[:3, :3] = moves[3:, 3:] = rotation
    moves[3:, :3] = np.cross(origin, rotation.T).T
    needed = np.abs(moves) > COMMON.rotation_rounding
    return np.where(needed, moves * np.where(needed, wrench, 0), 0).sum(axis=1)


@dataclass(frozen=True)
class Cap:
    """A spherical cap over the rim plane z = 0: curvature_radius and height in m; the sphere's centre lies on the z axis."""

    curvature_radius: float = 0.020
    height: float = 0.013

    def __post_init__(self):
        if not 0 < self.height <= 2 * self.curvature_radius < np.inf:
            raise BadArgument(f'cap: need 0 < height <= 2 curvature_radius, got height {self.height} m, radius {self.curvature_radius} m')

    @property
    def centre_z(self) -> float:
        """Height of the sphere's centre over the rim plane, m."""
        return self.height - self.curvature_radius

    @property
    def rim_radius(self) -> float:
        """Radius of the clamped rim, m."""
        return float(np.sqrt(self.curvature_radius**2 - self.centre_z**2))

    def ranges(self, origin: np.ndarray, rays: np.ndarray) -> np.ndarray:
        """Distances (N,), m, from origin (3,) or (N, 3) along unit rays (N, 3) to the far side of the sphere; NaN where a ray misses it."""
        return sphere_ranges(origin, rays, np.array([0.0, 0.0, self.centre_z]), self.curvature_radius)[1]

    def meet(self, origin: np.ndarray, rays: np.ndarray) -> np.ndarray:
        """Points (N, 3), m, where unit rays (N, 3) from origin (3,) or (N, 3) meet the cap from inside; NaN where a ray misses it."""
        return origin + self.ranges(origin, rays)[:, None] * rays

    def heights(self, xy: np.ndarray) -> np.ndarray:
        """Heights (N,) of the rest shape over the rim plane at xy (N, 2), m; NaN beyond the sphere."""
        inside = self.curvature_radius**2 - np.sum(np.square(xy), axis=1)
        return self.centre_z + np.sqrt(np.where(inside >= 0, inside, np.nan))


def sphere_ranges(origin: np.ndarray, rays: np.ndarray, centre: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Distances (N,), m, along unit rays (N, 3) to the near and to the far side of a sphere; NaN where a ray misses it.

    origin: (3,), or one for each ray (N, 3), m; centre: (3,) m.
    """
    offset = origin - centre
    along = rays @ offset if offset.ndim == 1 else np.einsum('ij,ij->i', rays, offset)
    inside = along**2 - np.einsum('...i,...i->...', offset, offset) + radius**2
    half_chord = np.sqrt(np.where((inside >= 0) & (inside < np.inf), inside, np.nan))
    return -along - half_chord, half_chord - along


def spline_fit(levels: int) -> np.ndarray:
    """(levels + 3, levels + 1): from values at levels 0 to levels to coefficients of uniform cubic B-splines, not-a-knot ends."""
    rows = np.zeros((levels + 3, levels + 3))
    for k in range(levels + 1):
        rows[k, k:k + 3] = np.array([1, 4, 1]) / 6
    rows[-2, :5] = rows[-1, -5:] = [1, -4, 6, -4, 1]
    return np.linalg.inv(rows)[:, :levels + 1]


def extrapolate(values: np.ndarray, at: np.ndarray) -> None:
    """Extrapolate values (N, M, ...) linearly over at (M,), in place, where their first number is NaN; what is known once only stays."""
    for k in range(2, len(at)):
        missing = np.isnan(values[:, k].reshape(len(values), -1)[:, 0])
        last, before = values[missing, k - 1], values[missing, k - 2]
        step = (at[k] - at[k - 1]) / (at[k - 1] - at[k - 2])
        values[missing, k] = last + step * np.where(np.isnan(before), 0.0, last - before)


def error_angle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angles, rad, between unit vectors (..., 3) (paper psd_fingertip_3d, eqs 12, 13). The arc sine of half the chord keeps small
    angles exact."""
    return 2 * np.arcsin(np.clip(0.5 * np.linalg.norm(a - b, axis=-1), 0.0, 1.0))
