# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Published methods.

Detectors: touchpad_contact_region (section 3.4, six steps, eqs 15 and 16), areal_sensor_contact_position (section 2.2) and
air_cushion_contact (section III.A). Numbers: touchpad_contact_region (section 3.5: five steps, eqs 17, 18 and the unnumbered one of step
5); air_cushion_contact by SORT (Bewley, Ge, Ott, Ramos, Upcroft: Simple online and realtime tracking, 2016): boxes followed by a Kalman
filter of constant velocity each, and assigned by their overlap.
"""
from __future__ import annotations

import cv2
import numpy as np
import scipy

from ..common.dots import Dots, GridNumbers
from ..errors import BadArgument, BadFrame
from .links import FARTHEST

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


_GREEN = 1
_SQUARE = np.ones((3, 3), np.uint8)
_DENOISE, _WITHIN = 10.0, 7  # grey levels, strength of the non-local means; px, side of the window in which it looks for what is alike
_LEAST, _MOST = 0.2, 5.0  # median areas, smallest and largest marker


class PaperArealDetector:
    """Green channel, opening, Otsu's threshold, labels; sign: 1 for bright markers, -1 for dark."""

    def __init__(self, sign: int):
        self._sign = sign

    def detect(self, image: np.ndarray) -> Dots:
        """Markers of one checked uint8 image: centroid and number of their pixels. Raises BadFrame where there are none."""
        green = image if image.ndim == 2 else cv2.extractChannel(image, _GREEN)
        opened = cv2.morphologyEx(_bright(green, self._sign), cv2.MORPH_OPEN, _SQUARE)
        binary = cv2.threshold(opened, 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)[1]
        _, _, stats, centre = cv2.connectedComponentsWithStats(binary, connectivity=8)
        return _dots(centre[1:], stats[1:, cv2.CC_STAT_AREA])


class PaperCushionDetector:
    """Grey, non-local means, Otsu's threshold, erosion, contours; sign: 1 for bright markers, -1 for dark."""

    def __init__(self, sign: int):
        self._sign = sign

    def detect(self, image: np.ndarray) -> Dots:
        """Markers of one checked uint8 image: centroid and area of their contours. Raises BadFrame where there are none."""
        grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
        denoised = cv2.fastNlMeansDenoising(_bright(grey, self._sign), h=_DENOISE, searchWindowSize=_WITHIN)
        binary = cv2.threshold(denoised, 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)[1]
        contours = cv2.findContours(cv2.erode(binary, _SQUARE), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
        moments = [m for m in map(cv2.moments, contours) if m['m00'] > 0]
        sums = np.array([(m['m00'], m['m10'], m['m01']) for m in moments]).reshape(-1, 3)
        return _dots(sums[:, 1:] / sums[:, :1], sums[:, 0])


def _bright(grey, sign):
    return grey if sign > 0 else cv2.bitwise_not(grey)


def _dots(uv, area) -> Dots:
    """Dots of a marker's size; sigma is NaN (the papers have none)."""
    area = np.asarray(area, float)
    some = area >= _SMALLEST
    typical = np.median(area[some]) if some.any() else np.nan
    kept = some & (area > _LEAST * typical) & (area < _MOST * typical)
    if not kept.any():
        raise BadFrame('no region of a marker\'s size is left after the threshold: check light, focus and the parameter polarity')
    return Dots(np.asarray(uv, float)[kept], area[kept], np.full(int(kept.sum()), np.nan))


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


_FRAME_S = 1 / 30  # s: the variances of the authors' program are those of a frame of video
_BEGIN = np.diag([10.0, 1e4])  # covariance of a coordinate and its velocity where a track begins
_DRIFT = np.array([np.diag([1.0, 0.01]), np.diag([1.0, 0.01]), np.diag([1.0, 1e-4])])  # added in a frame: column, row, area
_SEEN = np.array([1.0, 1.0, 10.0])  # variances of what is seen: column and row, px^2; area, px^4
_OVERLAP = 0.3  # least intersection over union of a box with the predicted one
_MAX_AGE = 1  # frames that a track may be unseen: the default of the authors' program


class SortNumbers:
    """Numbers of markers: those of the places at which their tracks began.

    pattern: (K, 2) px, untouched places; None: those of the first frame. The box of a marker is the square around a circle of its area, so
    the filter needs no ratio of sides. A track that ended does not come back: its marker begins another one, and has no number.
    """

    def __init__(self, pattern: np.ndarray | None = None):
        self._pattern, self._stamp_s = pattern, -np.inf
        self._mean, self._covariance = np.zeros((0, 3, 2)), np.zeros((0, 3, 2, 2))  # of column, row, area, and their velocities a frame
        self._id, self._age = np.zeros(0, int), np.zeros(0, int)  # age: frames since the track's dot was seen

    def update(self, dots: Dots, stamp_s: float, size: tuple | None = None) -> np.ndarray:
        """Number (N,) of each dot, -1 for one whose track began later than the first frame; stamp_s: s, later than the last."""
        boxes = np.column_stack([dots.uv, dots.area * (4 / np.pi)])
        if self._stamp_s == -np.inf:
            uv = dots.uv if self._pattern is None else np.asarray(self._pattern, float)
            self._begin(np.column_stack([uv, np.full(len(uv), np.median(boxes[:, 2]))]), np.arange(len(uv)))
        else:
            self._predict((stamp_s - self._stamp_s) / _FRAME_S)
        overlap = self._overlap(boxes)
        track, dot = scipy.optimize.linear_sum_assignment(overlap, maximize=True)
        same = overlap[track, dot] >= _OVERLAP
        track, dot = track[same], dot[same]
        self._correct(track, boxes[dot])
        self._stamp_s = stamp_s
        self._age += 1
        self._age[track] = 0
        id = np.full(len(boxes), -1)
        id[dot] = self._id[track]
        kept = self._age <= _MAX_AGE
        self._mean, self._covariance, self._id, self._age = (values[kept] for values in (self._mean, self._covariance, self._id, self._age))
        new = np.delete(boxes, dot, axis=0)
        self._begin(new, np.full(len(new), -1))
        return id

    def _begin(self, boxes: np.ndarray, id: np.ndarray) -> None:
        """Begin a track at each of boxes (N, 3)."""
        self._mean = np.concatenate([self._mean, np.stack([boxes, np.zeros_like(boxes)], axis=2)])
        self._covariance = np.concatenate([self._covariance, np.broadcast_to(_BEGIN, (len(boxes), 3, 2, 2))])
        self._id, self._age = np.append(self._id, id), np.append(self._age, np.zeros(len(boxes), int))

    def _predict(self, frames: float) -> None:
        step = np.array([[1.0, frames], [0.0, 1.0]])
        self._mean = self._mean @ step.T
        self._covariance = step @ self._covariance @ step.T + frames * _DRIFT

    def _correct(self, track: np.ndarray, boxes: np.ndarray) -> None:
        mean, covariance = self._mean[track], self._covariance[track]
        gain = covariance[..., 0] / (covariance[..., 0, :1] + _SEEN[:, None])
        self._mean[track] = mean + gain * (boxes - mean[..., 0])[..., None]
        self._covariance[track] = covariance - gain[..., None] * covariance[..., :1, :]

    def _overlap(self, boxes: np.ndarray) -> np.ndarray:
        """Intersection over union (T, N) of each track's box with each of boxes (N, 3)."""
        ours, seen = self._mean[:, None, :, 0], boxes[None]
        area = np.maximum(ours[..., 2], 0), seen[..., 2]
        side = [np.sqrt(one)[..., None] for one in area]
        within = np.clip((side[0] + side[1]) / 2 - np.abs(ours[..., :2] - seen[..., :2]), 0, np.minimum(*side)).prod(axis=2)
        return np.nan_to_num(within / (area[0] + area[1] - within))
