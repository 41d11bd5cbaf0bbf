# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dots of the undeformed gel in its plane, and the position of the camera over it, from one image of the dots."""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..common.dots import DotTracks
from ..errors import BadFrame
from .discs import Disc, DiscFit
from .layer import Layer

_UNKNOWN_THICKNESS = 2.0  # pitches, of a gel whose thickness is not given: it only decides how far displacements spread
_VIEW_DEG = 60.0  # prior: angle of view of an uncalibrated camera across the longer side; lenses of webcams have 50 to 75 degrees
_MIN_DOTS_FOR_TILT = 16  # twice the parameters of a homography
_NEAR_HORIZON = 0.1  # of the scale in the middle: no gel is seen so aslant that a pixel shows ten times as much
_DRIFTED = 0.25  # pitches: a dot whose undeformed position is farther off is another dot
_MAX_NEW_SHARE = 0.2  # of a frame's dots: when more are new, the undeformed gel is measured anew
_MAX_PITCH, _MIN_PITCH = 4.0, 0.02  # thicknesses: beyond, a press displaces one dot only, or all alike


class UndeformedDots:
    """The undeformed dots in the plane of the gel's surface.

    Parameters
    ----------
    tracks : DotTracks
        Dots of the first frame.
    values : Mapping
        Of REGION_PARAMETERS.
    scale : float
        m a pixel in the middle of the view; 0: from gel.pitch.
    centre : ndarray, shape (2,), optional
        Where the origin is seen, px; None: in the middle of the dots.
    focal : float
        Focal length, px; 0: not known, then that of a usual lens.

    Raises
    ------
    BadFrame
        For dots that lie on each other, or much too far apart for the layer.

    Notes
    -----
    A camera that looks at the plane obliquely sees it by a homography. Its two perspective coefficients are found from the grid's numbers
    by least squares; they tell the tilt of the camera [1]_, and so the point that it is above. Dots without a grid are seen straight.

    .. [1] R. Hartley, A. Zisserman, Multiple View Geometry in Computer Vision, 2nd edition, 2004, sections 4.1 and 8.6.
    """

    def __init__(self, tracks: DotTracks, values: Mapping, scale: float, centre: np.ndarray | None, focal: float):
        self._rest = tracks.rest_uv
        low, high = self._rest.min(axis=0), self._rest.max(axis=0)
        self.middle = (low + high) / 2 if centre is None else centre
        self._perspective, self.metres = _perspective(tracks, self.middle), 1.0
        near = _spacing(tracks, self.to_plane(self._rest))
        if not near > 0 or not (high - low > near).all():
            raise BadFrame('the undeformed dots lie on each other or on a line; take a new reference, of the untouched gel')
        self.metres = scale or values['gel.pitch'] / near
        self.pitch = near * self.metres
        layer = layer_of(values, self.pitch)
        if not _MIN_PITCH * layer.thickness < self.pitch < _MAX_PITCH * layer.thickness:
            raise BadFrame(f'dots are {self.pitch:.3g} m apart on a gel of {layer.thickness:.3g} m; check the parameters gel.scale, '
                           'gel.pitch and gel.thickness, or take a new reference')
        self._grid, self._index = (tracks.rows, tracks.columns), {number: k for k, number in enumerate(tracks.id.tolist())}
        side = float((high - low).max() if centre is None else 2 * centre.max())
        dots = self.to_plane(self._rest)
        self._low, self._high = dots.min(axis=0), dots.max(axis=0)
        camera = self._camera(focal or side / 2 / np.tan(np.radians(_VIEW_DEG / 2)))
        self.fit = DiscFit(DiscFit.loads_for(layer, dots, self.pitch), dots, self.pitch, camera)

    def _camera(self, focal: float) -> np.ndarray:
        """(3,) m: where a camera of this focal length, px, is over the gel: the foot of its perpendicular, and its height."""
        tilt = focal * self._perspective  # tangent
        cosine2 = 1 / (1 + tilt @ tilt)
        return self.metres * focal * np.array([*(tilt * cosine2), np.sqrt(cosine2)])

    def to_plane(self, uv: np.ndarray) -> np.ndarray:
        """Positions on the gel, m, of pixels (N, 2)."""
        offset = uv - self.middle
        return self.metres * offset / np.maximum(1 + offset @ self._perspective, _NEAR_HORIZON)[:, None]

    def to_image(self, xy: np.ndarray) -> np.ndarray:
        """Pixels of positions (N, 2) on the gel, m."""
        offset = np.asarray(xy) / self.metres
        return self.middle + offset / np.maximum(1 - offset @ self._perspective, _NEAR_HORIZON)[:, None]

    def _rows_of(self, tracks: DotTracks) -> np.ndarray:
        """(N,) index of each of a frame's dots among the undeformed ones, -1 for another dot."""
        rows = np.array([self._index.get(number, -1) for number in tracks.id.tolist()])
        drifted = np.abs(tracks.rest_uv - self._rest[rows]).max(axis=1) > _DRIFTED * self.pitch / self.metres
        return np.where(drifted, -1, rows)

    def shows(self, tracks: DotTracks) -> bool:
        """Whether nearly all dots of a frame are among the undeformed ones."""
        return (tracks.rows, tracks.columns) == self._grid and np.mean(self._rows_of(tracks) < 0) <= _MAX_NEW_SHARE

    def displacements(self, tracks: DotTracks) -> tuple[np.ndarray, np.ndarray]:
        """Which of the undeformed dots are seen (D,), and their displacements (D, 2), m."""
        rows = self._rows_of(tracks)
        seen, displacements, known = np.zeros(len(self._rest), bool), np.zeros(self._rest.shape), rows >= 0
        seen[rows[known]] = True
        displacements[rows[known]] = self.to_plane(tracks.uv[known]) - self.to_plane(tracks.rest_uv[known])
        return seen, displacements

    def at_edge(self, disc: Disc) -> bool:
        """Whether the contact reaches beyond the outer dots."""
        return bool((disc.middle - disc.radius < self._low).any() or (disc.middle + disc.radius > self._high).any())


def layer_of(values: Mapping, pitch: float = 1.0) -> Layer:
    """The layer with these values of GEL_PARAMETERS; pitch: m, of the dots, for an unknown thickness. Raises BadArgument."""
    return Layer(values['gel.thickness'] or _UNKNOWN_THICKNESS * pitch, values['gel.poisson_ratio'], values['gel.dot_depth'])


def spacing_of(rest: np.ndarray) -> float:
    """Median distance of the nearest neighbours among positions (M, 2), in their unit."""
    return float(np.median(np.sort(np.linalg.norm(rest[:, None] - rest, axis=2), axis=1)[:, 1]))


def _spacing(tracks: DotTracks, rest: np.ndarray) -> float:
    """Median distance of neighbouring dots at rest (N, 2), in its unit: along rows and columns of a grid, else of each dot and the
    nearest."""
    if not tracks.rows:
        return spacing_of(rest)
    grid = np.full((tracks.rows * tracks.columns, 2), np.nan)
    grid[tracks.id] = rest
    grid = grid.reshape(tracks.rows, tracks.columns, 2)
    steps = np.concatenate([np.linalg.norm(np.diff(grid, axis=axis), axis=2).ravel() for axis in (0, 1)])
    return float(np.median(steps[np.isfinite(steps)])) if np.isfinite(steps).any() else 0.0


def _perspective(tracks: DotTracks, middle: np.ndarray) -> np.ndarray:
    """(2,) 1/px: perspective coefficients g of the map offset / (1 + g . offset) from pixels about the middle to the plane."""
    if not tracks.rows or len(tracks) < _MIN_DOTS_FOR_TILT:
        return np.zeros(2)
    row, column = np.divmod(tracks.id, tracks.columns)
    if len(set(row.tolist())) < 3 or len(set(column.tolist())) < 3:
        return np.zeros(2)
    offset = tracks.rest_uv - middle
    size = np.abs(offset).max()
    point = np.column_stack([offset / size, np.ones(len(offset))])
    rows = []
    for index in (row, column):  # index (1 + g . offset) = a . offset + c, with a and c of its own
        centred = index - index.mean()
        rows.append((point, -centred[:, None] * point[:, :2], centred))
    none = np.zeros_like(point)
    matrix = np.block([[rows[0][0], none, rows[0][1]], [none, rows[1][0], rows[1][1]]])
    return np.linalg.lstsq(matrix, np.concatenate([rows[0][2], rows[1][2]]), rcond=None)[0][-2:] / size
