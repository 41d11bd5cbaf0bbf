# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The published method of the paper touchpad_contact_region.

Dots are detected in six steps (section 3.4, eqs 15 and 16) and numbered from the middle row and column outwards (section 3.5, eqs 17, 18
and the unnumbered one of step 5); contact states follow from the motion of a rigid object (sections 3.2 and 3.3).
"""
from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
import scipy

from ..common.dots import Dots, GridNumbers
from ..common.surface import grid_normals, label_score, to_grid
from ..dots.links import FARTHEST
from ..errors import BadArgument, BadFrame
from ..touchpad.contact import DotClassification
from ..touchpad.membrane import MembraneMaterial
from ..touchpad.pose import RigidMotion, fit_rigid

# The papers give no values; chosen for dots of 5 to 15 px at 640 x 480.
_BLOCK = 31  # px, side of the local mean
_SMALLEST = 6  # px of a region; smaller ones are noise
_LARGEST_SHARE = 0.02  # of the image, largest region
_LARGEST_OF_TYPICAL = 4.0  # median areas, largest region


def _emphasise(grey: np.ndarray, sign: int) -> np.ndarray:
    """Step 2: contrast emphasis, with bright dots; (H, W) uint8."""
    above = cv2.subtract(cv2.blur(grey, (_BLOCK, _BLOCK)), grey) if sign < 0 else cv2.subtract(grey, cv2.blur(grey, (_BLOCK, _BLOCK)))
    return cv2.normalize(above, None, 0, 255, cv2.NORM_MINMAX)


class PaperDetector:
    """Dots as grey-weighted centroids of thresholded regions; sign: 1 for bright dots, -1 for dark."""

    def __init__(self, sign: int):
        self._sign = sign

    def detect(self, image: np.ndarray) -> Dots:
        """All six steps for one checked uint8 image; sigma is NaN (the paper has none). Raises BadFrame where no region is left."""
        grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) if image.ndim == 3 else image
        emphasised = _emphasise(grey, self._sign)
        _, binary = cv2.threshold(emphasised, 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
        count, labels, stats, _ = cv2.connectedComponentsWithStats(binary, connectivity=8)
        inverted = cv2.bitwise_not(grey) if self._sign < 0 else grey
        zeroth, first_u, first_v = _moments(inverted, labels, count)
        area = stats[1:, cv2.CC_STAT_AREA].astype(float)
        kept = _dot_sized(area, grey.size) & (zeroth > 0)
        if not kept.any():
            raise BadFrame('no region of a dot\'s size is left after the threshold: check light, focus and the parameter polarity')
        uv = np.stack([first_u[kept], first_v[kept]], 1) / zeroth[kept, None]
        return Dots(uv, area[kept], np.full(len(uv), np.nan))


def _moments(inverted, labels, count):
    """Steps 4 to 6, eq 16: m00, m10 and m01 of the inverted brightness over each region."""
    inside = np.flatnonzero(labels)
    region = labels.ravel()[inside]
    brightness = inverted.ravel()[inside].astype(float)
    row, column = np.divmod(inside, labels.shape[1])
    return tuple(np.bincount(region, brightness * power, count)[1:] for power in (1.0, column, row))


def _dot_sized(area, pixels):
    kept = (area >= _SMALLEST) & (area < _LARGEST_SHARE * pixels)
    if kept.any():
        kept &= area < _LARGEST_OF_TYPICAL * np.median(area[kept])
    return kept


_SEARCH = 0.5  # pitches around a predicted position: the paper gives no value; wider ones overlap
_AROUND = 8  # nearest dots among which those along the row and the column are; the diagonal ones may be nearer than the latter


class PaperNumbering:
    """Indices on a printed grid of rows x columns, each frame anew. Steps 1 and 2: the middle row and column start at the dots nearest to
    two fixed points, Q_x left of and Q_y above the image's centre; here half the grid's size away from it. Of an even number of rows or
    columns, which the paper does not have, the middle one is that after the centre."""

    def __init__(self, rows: int, columns: int):
        self._shape = rows, columns

    def number(self, uv: np.ndarray, width: float = 0, height: float = 0) -> GridNumbers:
        """GridNumbers of dots at uv (N, 2) px. Raises BadArgument without width and height of the image, px."""
        if not (width and height):
            raise BadArgument('numbering method paper starts at fixed points of the image: give its width and height, px')
        uv, id = np.asarray(uv, np.float64), np.full(len(uv), -1)
        good = np.flatnonzero(np.abs(uv).max(axis=1, initial=0.0) < FARTHEST)
        id[good], reason = self._number(uv[good], (np.array([width, height]) - 1) / 2)
        return GridNumbers(id, reason)

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
    step = uv[scipy.spatial.cKDTree(uv).query(uv, min(_AROUND + 1, len(uv)))[1][:, 1:]] - uv[:, None]
    length, along = np.hypot(*step.transpose(2, 0, 1)), np.abs(step[..., 0]) > np.abs(step[..., 1])
    nearest = np.array([np.where(axis, length, np.inf).min(axis=1) for axis in (along, ~along)])
    known = [distances[np.isfinite(distances)] for distances in nearest]
    return np.array([np.median(distances) if len(distances) else np.median(length[:, 0]) for distances in known])


def _propagate_line(tree: scipy.spatial.cKDTree, start: np.ndarray, step: np.ndarray, count: int) -> list[int]:
    """Step 3, eqs 17 and 18: dots in sequence, each predicted by the last two; stops where there is none."""
    dots = [int(tree.query(start)[1])]
    reach = _SEARCH * np.linalg.norm(step)
    while len(dots) < count:
        distance, dot = tree.query(tree.data[dots[-1]] + step, distance_upper_bound=reach)
        if not np.isfinite(distance):
            break
        step = tree.data[dot] - tree.data[dots[-1]]
        dots.append(int(dot))
    return dots


def _propagate_grid(tree: scipy.spatial.cKDTree, middle: int, shape: tuple[int, int], pitch: np.ndarray) -> np.ndarray:
    """Step 5: outwards from the central dot, each dot predicted by two or three indexed ones."""
    start = (shape[0] // 2, shape[1] // 2)
    places = {start: tree.data[middle]}
    id = np.full(len(tree.data), -1)
    id[middle] = start[0] * shape[1] + start[1]
    front = [start]
    while front:
        following = []
        for row, column in front:
            for r, c in ((row, column + 1), (row, column - 1), (row + 1, column), (row - 1, column)):
                if (r, c) in places or not (0 <= r < shape[0] and 0 <= c < shape[1]):
                    continue
                distance, dot = tree.query(_predicted(places, r, c, row, column, pitch), distance_upper_bound=_SEARCH * pitch.min())
                if np.isfinite(distance) and id[dot] < 0:
                    places[r, c], id[dot] = tree.data[dot], r * shape[1] + c
                    following.append((r, c))
        front = following
    return id


def _predicted(places: dict, r: int, c: int, row: int, column: int, pitch: np.ndarray) -> np.ndarray:
    """P'_ij by the first line of step 5's equation whose dots are indexed; next to the first dot, the constant vector of step 3."""
    for a, b in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        if (r + a, c + b) in places and (r + 2 * a, c + 2 * b) in places:
            return 2 * places[r + a, c + b] - places[r + 2 * a, c + 2 * b]
    for a, b in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        if {(r + a, c + b), (r + a, c), (r, c + b)} <= places.keys():
            return places[r + a, c] + places[r, c + b] - places[r + a, c + b]
    return places[row, column] + pitch * np.array([c - column, r - row])


NON_CONTACT, STICKING, SLIPPING = 0, 1, 2
_HORIZON_S = 4.0  # s, in which t_p is searched
_AROUND = 9  # dots around the reference dot that are assumed to stick (section 3.2: "at least a set of nine dots")


@dataclass(frozen=True)
class PaperStates:
    """state: (N,) uint8 of NON_CONTACT, STICKING, SLIPPING; reference_id: number of the contact reference dot, -1 without one;
    motion: the object's from t_p to t_c, None when unknown; interval: t_c - t_p, s, NaN when unknown."""

    state: np.ndarray
    reference_id: int
    motion: RigidMotion | None
    interval: float


def smooth_shape(moved: np.ndarray) -> np.ndarray:
    """Medians (rows, columns, 3) of how dots and those around them moved, (rows, columns, 3) m, NaN for unseen ones.

    The paper takes places from a smooth shape of the touchpad. Here each dot has a range of its own: a single wrong one would be the
    reference dot, and determine t_p.
    """
    rows, columns, _ = moved.shape
    around = np.pad(np.nan_to_num(moved), ((1, 1), (1, 1), (0, 0)), mode='edge')
    return np.median([around[r:r + rows, c:c + columns] for r in range(3) for c in range(3)], axis=0)


class PaperRegion:
    """States of dots on a rows x columns grid, frame by frame.

    d_max: m, largest displacement that makes an interval long enough (D_max, eq 10); delta_d: m, threshold of the tests (eqs 12, 14):
    the paper's 12.0 and 2.5 px in m. While no frame of the last seconds is d_max away, the states stay; once no dot is d_max from its
    untouched position, none is in contact.
    """

    def __init__(self, rows: int, columns: int, d_max: float = 0.91e-3, delta_d: float = 0.19e-3):
        self.rows, self.columns, self.d_max, self.delta_d = rows, columns, d_max, delta_d
        self._past: deque[tuple[float, np.ndarray]] = deque()
        self._state = np.zeros(rows * columns, np.uint8)

    def process(self, ids: np.ndarray, xyz: np.ndarray, rest_xyz: np.ndarray, stamp_s: float) -> PaperStates:
        """States of the dots ids (N,) at xyz (N, 3), untouched at rest_xyz (N, 3), sensor frame, m, at stamp_s.

        Dots with NaN in xyz count as unseen.
        """
        now, rest = (to_grid(ids, places, self.rows, self.columns).reshape(-1, 3) for places in (xyz, rest_xyz))
        found = self._judge(ids, now, np.linalg.norm(now - rest, axis=1), stamp_s)
        self._past.append((stamp_s, now))
        while self._past[0][0] < stamp_s - _HORIZON_S:
            self._past.popleft()
        return found

    def _judge(self, ids, now, moved, stamp_s) -> PaperStates:
        if not np.isfinite(moved).any() or np.nanmax(moved) < self.d_max:
            self._state[:] = NON_CONTACT
            return PaperStates(self._state[ids], -1, None, np.nan)
        before, since = self._previous(now)
        if before is None:
            return PaperStates(self._state[ids], self._reference(moved), None, np.nan)
        both = np.isfinite(before[:, 0]) & np.isfinite(now[:, 0])
        reference = self._reference(np.where(both, moved, np.nan))
        motion = self._object_motion(reference, before, now, both)
        if motion is None:
            return PaperStates(self._state[ids], reference, None, np.nan)
        self._decide(reference, motion, before, now, both)
        return PaperStates(self._state[ids], reference, motion, stamp_s - since)

    def _previous(self, now: np.ndarray) -> tuple[np.ndarray | None, float]:
        """Positions at t_p, and t_p: the newest frame from which some dot has moved by more than d_max (eq 10)."""
        for stamp, places in reversed(self._past):
            step = now - places
            if (np.einsum('ki,ki->k', step, step) > self.d_max**2).any():
                return places, stamp
        return None, np.nan

    @staticmethod
    def _reference(moved: np.ndarray) -> int:
        """Number of the dot farthest from its untouched position (eq 2); -1 if no dot can be compared."""
        return int(np.nanargmax(moved)) if np.isfinite(moved).any() else -1

    def _object_motion(self, reference: int, before, now, both) -> RigidMotion | None:
        """The object's motion from the seen dots nearest to the reference dot on the grid, assumed to stick (eq 3)."""
        seen = np.flatnonzero(both)
        row, column = np.divmod(seen, self.columns)
        distance = (row - reference // self.columns)**2 + (column - reference % self.columns)**2
        around = seen[np.argsort(distance, kind='stable')[:_AROUND]]
        return fit_rigid(before[around], now[around])

    def _decide(self, reference: int, motion: RigidMotion, before, now, both) -> None:
        """Eq 12 for dots that were free, eqs 12 and 14 for dots that were in contact."""
        displacement = now - before
        # Right side of eq 7; R(-w) is the transpose of the object's rotation.
        predicted = displacement + (now[reference] - now) @ (np.eye(3) - motion.rotation.T).T
        difference = displacement[reference] - predicted
        normals = grid_normals(now.reshape(self.rows, self.columns, 3)).reshape(-1, 3)
        limit = self.delta_d * np.sqrt(np.nanmax(np.sum(displacement**2, axis=1))) / self.d_max
        sticks = np.linalg.norm(difference, axis=1) < limit
        touches = np.abs(np.sum(difference * normals, axis=1)) < limit
        contact = np.where(self._state == NON_CONTACT, sticks, touches | sticks)
        state = np.where(contact, np.where(sticks, STICKING, SLIPPING), NON_CONTACT)
        self._state = np.where(both, state, self._state).astype(np.uint8)


class PaperMethod:
    """By the movements of dots (paper touchpad_contact_region, eqs 2, 7, 9 to 14); estimates no forces."""

    def __init__(self, rows: int, columns: int, d_max: float, delta_d: float):
        self._shape = rows, columns
        self._region = PaperRegion(rows, columns, d_max, delta_d)
        self._rest = np.full((rows * columns, 3), np.nan)

    def set_rest(self, rest_xyz: np.ndarray) -> None:
        """Set the dots' rest positions (K, 3), m."""
        self._rest = rest_xyz

    def classify(self, ids: np.ndarray, xyz: np.ndarray, stamp_s: float) -> DotClassification:
        """Classify dots ids (N,) at xyz (N, 3), m, at stamp_s."""
        rest = self._rest[ids]
        moved = smooth_shape(to_grid(ids, xyz - rest, *self._shape)).reshape(-1, 3)[ids]
        found = self._region.process(ids, rest + moved, rest, stamp_s)
        score = label_score(to_grid(ids, (found.state > 0).astype(float), *self._shape)).ravel()[ids]
        return DotClassification(found.state, score, np.full(6, np.nan), np.full((len(ids), 2), np.nan), motion=found.motion,
                                 interval=found.interval)


def make_method(rows: int, columns: int, material: MembraneMaterial, origin: np.ndarray, values: Mapping) -> PaperMethod:
    """The method with values of TOUCHPAD_PARAMETERS; it uses neither the membrane nor the camera centre."""
    return PaperMethod(rows, columns, values['paper.d_max'], values['paper.delta_d'])
