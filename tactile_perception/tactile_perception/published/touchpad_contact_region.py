# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The method of the paper touchpad_contact_region.

Dots are detected in six steps (section 3.4, equations 15 and 16) and numbered from the middle row and column outwards (section 3.5,
equations 17 and 18 and the unnumbered one of step 5). Contact states follow from the motion of a rigid object (sections 3.2 and 3.3).
"""
from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
import scipy

from .._core.dots import GridNumbers
from ..common.dots import Dots
from ..common.surface import grid_normals, label_score, to_grid
from ..common.surface_points import NON_CONTACT, SLIPPING, STICKING
from ..core.errors import BadArgument, BadFrame
from ..dots.links import FARTHEST
from ..touchpad.contact import DotClassification
from ..touchpad.membrane import MembraneMaterial
from ..touchpad.pose import RigidMotion, fit_rigid
from .constants import TOUCHPAD
from .detector import PublishedDetector


class PaperDetector(PublishedDetector):
    """Dots as grey-weighted centroids of thresholded regions."""

    def detect(self, image: np.ndarray) -> Dots:
        """Dots of one image, by all six steps."""
        grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) if image.ndim == 3 else image
        _, binary = cv2.threshold(_emphasised(grey, self._sign), 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
        count, labels, stats, _ = cv2.connectedComponentsWithStats(binary, connectivity=8)
        inverted = cv2.bitwise_not(grey) if self._sign < 0 else grey
        zeroth, first_u, first_v = _moments(inverted, labels, count)
        area = stats[1:, cv2.CC_STAT_AREA].astype(float)
        kept = _is_dot_sized(area, grey.size) & (zeroth > 0)
        if not kept.any():
            raise BadFrame('no region of a dot\'s size is left after the threshold: check light, focus and the parameter polarity')
        uv = np.stack([first_u[kept], first_v[kept]], 1) / zeroth[kept, None]
        return Dots(uv, area[kept], np.full(len(uv), np.nan))


def _emphasised(grey: np.ndarray, sign: int) -> np.ndarray:
    """Step 2: contrast emphasis, with bright dots; (H, W) uint8."""
    mean = cv2.blur(grey, (TOUCHPAD.mean_side, TOUCHPAD.mean_side))
    return cv2.normalize(cv2.subtract(mean, grey) if sign < 0 else cv2.subtract(grey, mean), None, 0, 255, cv2.NORM_MINMAX)


def _moments(inverted, labels, count):
    """Steps 4 to 6, equation 16: m00, m10 and m01 of the inverted brightness over each region."""
    inside = np.flatnonzero(labels)
    region = labels.ravel()[inside]
    brightness = inverted.ravel()[inside].astype(float)
    row, column = np.divmod(inside, labels.shape[1])
    return tuple(np.bincount(region, brightness * power, count)[1:] for power in (1.0, column, row))


def _is_dot_sized(area, pixels):
    kept = (area >= TOUCHPAD.min_area) & (area < TOUCHPAD.max_image_share * pixels)
    if kept.any():
        kept &= area < TOUCHPAD.max_median_areas * np.median(area[kept])
    return kept


class PaperNumbering:
    """Numbers of dots on a printed grid, in each frame independently.

    Steps 1 and 2: the middle row and column start at the dots nearest to two fixed points, Q_x to the left of the image's centre and Q_y
    above it; here they are half of the grid's size away. The paper has no even number of rows or columns; the middle one is then that
    after the centre.

    Parameters
    ----------
    rows, columns : int
        Size of the printed grid.
    """

    def __init__(self, rows: int, columns: int):
        self._shape = rows, columns

    def number(self, uv: np.ndarray, width: float = 0, height: float = 0) -> GridNumbers:
        """Numbers of dots.

        Parameters
        ----------
        uv : ndarray, shape (N, 2)
            Positions of the dots, px.
        width, height : float
            Size of the image, px.

        Returns
        -------
        GridNumbers
            Number of each dot, -1 for none, and why there is none.

        Raises
        ------
        BadArgument
            If width or height is missing.
        """
        if not (width and height):
            raise BadArgument('numbering method paper starts at fixed points of the image: give its width and height, px')
        uv, id = np.asarray(uv, np.float64), np.full(len(uv), -1)
        good = np.flatnonzero(np.abs(uv).max(axis=1, initial=0.0) < FARTHEST)
        id[good], reason = self._number(uv[good], (np.array([width, height]) - 1) / 2)
        return GridNumbers(id=id, reason=reason)

    def _number(self, uv, centre) -> tuple[np.ndarray, str]:
        if len(uv) < 4:
            return np.full(len(uv), -1), f'only {len(uv)} dots found'
        tree, pitch, count = scipy.spatial.cKDTree(uv), _pitch(uv), np.array(self._shape[::-1])
        first = centre - pitch * (count - 1) / 2
        middle = first + pitch * (count // 2)
        row = _propagate_line(tree, np.array([first[0], middle[1]]), pitch * [1, 0], count[0])
        column = _propagate_line(tree, np.array([middle[0], first[1]]), pitch * [0, 1], count[1])
        crossing = [dot for dot in row if dot in column]  # step 4: D_c lies on both
        if len(crossing) != 1:
            return np.full(len(uv), -1), f'the middle row and column meet in {len(crossing)} dots, not in one'
        return _propagate_grid(tree, crossing[0], self._shape, pitch), ''


def _pitch(uv: np.ndarray) -> np.ndarray:
    """(2,) px, median distance along u and along v of dots at uv (N, 2) px from their nearest one in that direction."""
    step = uv[scipy.spatial.cKDTree(uv).query(uv, min(TOUCHPAD.nearest_dots + 1, len(uv)))[1][:, 1:]] - uv[:, None]
    length, is_along_u = np.hypot(*step.transpose(2, 0, 1)), np.abs(step[..., 0]) > np.abs(step[..., 1])
    nearest = np.array([np.where(axis, length, np.inf).min(axis=1) for axis in (is_along_u, ~is_along_u)])
    known = [distances[np.isfinite(distances)] for distances in nearest]
    return np.array([np.median(distances) if len(distances) else np.median(length[:, 0]) for distances in known])


def _propagate_line(tree: scipy.spatial.cKDTree, start: np.ndarray, step: np.ndarray, count: int) -> list[int]:
    """Step 3, equations 17 and 18: dots in sequence, each predicted by the last two; it stops where there is none."""
    dots = [int(tree.query(start)[1])]
    radius = TOUCHPAD.search_radius * np.linalg.norm(step)
    while len(dots) < count:
        distance, dot = tree.query(tree.data[dots[-1]] + step, distance_upper_bound=radius)
        if not np.isfinite(distance):
            break
        step = tree.data[dot] - tree.data[dots[-1]]
        dots.append(int(dot))
    return dots


def _propagate_grid(tree: scipy.spatial.cKDTree, middle: int, shape: tuple[int, int], pitch: np.ndarray) -> np.ndarray:
    """Step 5: outwards from the central dot, each dot predicted by two or three numbered ones."""
    start = (shape[0] // 2, shape[1] // 2)
    positions = {start: tree.data[middle]}
    id = np.full(len(tree.data), -1)
    id[middle] = start[0] * shape[1] + start[1]
    front = [start]
    while front:
        following = []
        for row, column in front:
            for r, c in ((row, column + 1), (row, column - 1), (row + 1, column), (row - 1, column)):
                if (r, c) in positions or not (0 <= r < shape[0] and 0 <= c < shape[1]):
                    continue
                predicted = _predicted(positions, r, c, row, column, pitch)
                distance, dot = tree.query(predicted, distance_upper_bound=TOUCHPAD.search_radius * pitch.min())
                if np.isfinite(distance) and id[dot] < 0:
                    positions[r, c], id[dot] = tree.data[dot], r * shape[1] + c
                    following.append((r, c))
        front = following
    return id


def _predicted(positions: dict, r: int, c: int, row: int, column: int, pitch: np.ndarray) -> np.ndarray:
    """P'_ij by the first line of step 5's equation whose dots are numbered; next to the first dot, the constant vector of step 3."""
    for a, b in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        if (r + a, c + b) in positions and (r + 2 * a, c + 2 * b) in positions:
            return 2 * positions[r + a, c + b] - positions[r + 2 * a, c + 2 * b]
    for a, b in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        if {(r + a, c + b), (r + a, c), (r, c + b)} <= positions.keys():
            return positions[r + a, c] + positions[r, c + b] - positions[r + a, c + b]
    return positions[row, column] + pitch * np.array([c - column, r - row])


@dataclass(frozen=True)
class PaperStates:
    """Contact states of the dots of one frame.

    Parameters
    ----------
    state : ndarray of uint8, shape (N,)
        NON_CONTACT, STICKING or SLIPPING.
    reference_id : int
        Number of the contact reference dot; -1 without one.
    motion : RigidMotion or None
        Motion of the object from t_p to t_c; None where it is unknown.
    interval : float
        t_c - t_p, s; NaN where it is unknown.
    """

    state: np.ndarray
    reference_id: int
    motion: RigidMotion | None
    interval: float


def smooth_shape(displacement: np.ndarray) -> np.ndarray:
    """Median displacement of each dot and those around it.

    Parameters
    ----------
    displacement : ndarray, shape (rows, columns, 3)
        In m; NaN for unseen dots.

    Returns
    -------
    ndarray, shape (rows, columns, 3)
        In m.

    Notes
    -----
    The paper takes positions from a smooth shape of the touchpad. Here each dot has a range of its own, and a single wrong one would be
    the reference dot and determine t_p.
    """
    rows, columns, _ = displacement.shape
    padded = np.pad(np.nan_to_num(displacement), ((1, 1), (1, 1), (0, 0)), mode='edge')
    return np.median([padded[r:r + rows, c:c + columns] for r in range(3) for c in range(3)], axis=0)


class PaperRegion:
    """Contact states of dots on a grid, frame by frame.

    While no frame of the last seconds is d_max away, the states stay. Once no dot is d_max from its undeformed position, none is in
    contact.

    Parameters
    ----------
    rows, columns : int
        Size of the grid.
    d_max : float
        Maximum displacement over an interval, m (D_max, equation 10): the paper's 12.0 px.
    delta_d : float
        Threshold of the tests, m (equations 12 and 14): the paper's 2.5 px.
    """

    def __init__(self, rows: int, columns: int, d_max: float = 0.91e-3, delta_d: float = 0.19e-3):
        self.rows, self.columns, self.d_max, self.delta_d = rows, columns, d_max, delta_d
        self._past: deque[tuple[float, np.ndarray]] = deque()
        self._state = np.zeros(rows * columns, np.uint8)

    def process(self, ids: np.ndarray, xyz: np.ndarray, rest_xyz: np.ndarray, stamp_s: float) -> PaperStates:
        """States of the dots in one frame.

        Parameters
        ----------
        ids : ndarray of int, shape (N,)
            Numbers of the dots.
        xyz, rest_xyz : ndarray, shape (N, 3)
            Present and undeformed positions in the sensor frame, m. Dots with NaN in xyz count as unseen.
        stamp_s : float
            Time of the frame, s.

        Returns
        -------
        PaperStates
        """
        now, rest = (to_grid(ids, positions, self.rows, self.columns).reshape(-1, 3) for positions in (xyz, rest_xyz))
        found = self._judge(ids, now, np.linalg.norm(now - rest, axis=1), stamp_s)
        self._past.append((stamp_s, now))
        while self._past[0][0] < stamp_s - TOUCHPAD.max_interval_s:
            self._past.popleft()
        return found

    def _judge(self, ids, now, displacement, stamp_s) -> PaperStates:
        """The states; displacement: (K,) m, of each dot from its undeformed position."""
        if not np.isfinite(displacement).any() or np.nanmax(displacement) < self.d_max:
            self._state[:] = NON_CONTACT
            return PaperStates(self._state[ids], -1, None, np.nan)
        before, since = self._previous(now)
        if before is None:
            return PaperStates(self._state[ids], self._reference(displacement), None, np.nan)
        is_common = np.isfinite(before[:, 0]) & np.isfinite(now[:, 0])
        reference = self._reference(np.where(is_common, displacement, np.nan))
        motion = self._object_motion(reference, before, now, is_common)
        if motion is None:
            return PaperStates(self._state[ids], reference, None, np.nan)
        self._decide(reference, motion, before, now, is_common)
        return PaperStates(self._state[ids], reference, motion, stamp_s - since)

    def _previous(self, now: np.ndarray) -> tuple[np.ndarray | None, float]:
        """Positions at t_p, and t_p: the newest frame from which some dot has moved by more than d_max (equation 10)."""
        for stamp, positions in reversed(self._past):
            step = now - positions
            if (np.einsum('ki,ki->k', step, step) > self.d_max**2).any():
                return positions, stamp
        return None, np.nan

    @staticmethod
    def _reference(displacement: np.ndarray) -> int:
        """Number of the dot farthest from its undeformed position (equation 2); -1 if no dot can be compared."""
        return int(np.nanargmax(displacement)) if np.isfinite(displacement).any() else -1

    def _object_motion(self, reference: int, before, now, is_common) -> RigidMotion | None:
        """Motion of the object from the dots nearest to the reference dot on the grid, which are assumed to stick (equation 3)."""
        seen = np.flatnonzero(is_common)
        row, column = np.divmod(seen, self.columns)
        distance = (row - reference // self.columns)**2 + (column - reference % self.columns)**2
        nearest = seen[np.argsort(distance, kind='stable')[:TOUCHPAD.sticking_dots]]
        return fit_rigid(before[nearest], now[nearest])

    def _decide(self, reference: int, motion: RigidMotion, before, now, is_common) -> None:
        """Equation 12 for dots that were free, equations 12 and 14 for dots that were in contact."""
        displacement = now - before
        # Right side of equation 7; R(-w) is the transpose of the object's rotation.
        predicted = displacement + (now[reference] - now) @ (np.eye(3) - motion.rotation.T).T
        difference = displacement[reference] - predicted
        normals = grid_normals(now.reshape(self.rows, self.columns, 3)).reshape(-1, 3)
        limit = self.delta_d * np.sqrt(np.nanmax(np.sum(displacement**2, axis=1))) / self.d_max
        sticks = np.linalg.norm(difference, axis=1) < limit
        touches = np.abs(np.sum(difference * normals, axis=1)) < limit
        contact = np.where(self._state == NON_CONTACT, sticks, touches | sticks)
        state = np.where(contact, np.where(sticks, STICKING, SLIPPING), NON_CONTACT)
        self._state = np.where(is_common, state, self._state).astype(np.uint8)


class PaperMethod:
    """Classifies the dots of a touchpad by their movements; it estimates no forces. See PaperRegion for the arguments."""

    def __init__(self, rows: int, columns: int, d_max: float, delta_d: float):
        self._shape = rows, columns
        self._region = PaperRegion(rows, columns, d_max, delta_d)
        self._rest = np.full((rows * columns, 3), np.nan)

    def set_rest(self, rest_xyz: np.ndarray) -> None:
        """Set the dots' undeformed positions (K, 3), m."""
        self._rest = rest_xyz

    def classify(self, ids: np.ndarray, xyz: np.ndarray, stamp_s: float) -> DotClassification:
        """Classify dots ids (N,) at positions xyz (N, 3), m, at stamp_s, s."""
        rest = self._rest[ids]
        displacement = smooth_shape(to_grid(ids, xyz - rest, *self._shape)).reshape(-1, 3)[ids]
        found = self._region.process(ids, rest + displacement, rest, stamp_s)
        score = label_score(to_grid(ids, (found.state > 0).astype(float), *self._shape)).ravel()[ids]
        return DotClassification(found.state, score, np.full(6, np.nan), np.full((len(ids), 2), np.nan), motion=found.motion,
                                 interval=found.interval)


def make_method(rows: int, columns: int, material: MembraneMaterial, origin: np.ndarray, values: Mapping) -> PaperMethod:
    """The method with values of TOUCHPAD_PARAMETERS; it uses neither the membrane's material nor the camera centre."""
    return PaperMethod(rows, columns, values['paper.d_max'], values['paper.delta_d'])
