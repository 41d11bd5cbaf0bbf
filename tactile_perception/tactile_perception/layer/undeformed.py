# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dots of the undeformed gel in its plane, and the position of the camera over it, from one image of the dots."""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..common.dots import DotTracks
from ..core.errors import BadFrame
from .constants import LAYER
from .discs import Disc, DiscFit
from .layer import Layer


class UndeformedDots:
    """The undeformed dots in the plane of the gel's surface, and the fit of discs to their displacements.

    Parameters
    ----------
    tracks : DotTracks
        Dots of the first frame.
    values : Mapping
        Values of GEL_PARAMETERS.
    scale : float
        Length in m that one pixel shows in the middle of the view; 0: computed from gel.pitch.
    centre : ndarray, shape (2,), optional
        Image position of the origin in px; None: the middle of the dots.
    focal : float
        Focal length in px; 0: not known, that of a common lens is taken.

    Raises
    ------
    BadFrame
        For dots that coincide or are collinear, or whose distance does not fit the thickness of the layer.

    Notes
    -----
    A camera with an oblique view maps the plane by a homography. Its two perspective coefficients follow from the numbers of the grid by
    least squares. They give the tilt of the camera [1]_, and thus the point above which it stands. A pattern without a grid is taken as
    seen perpendicularly.

    A layer whose thickness is not known is taken as thick: half as thick as the dots' field is wide. In thicker layers the visible dots
    move alike.

    .. [1] R. Hartley, A. Zisserman, Multiple View Geometry in Computer Vision, 2nd edition, 2004, sections 4.1 and 8.6.
    """

    def __init__(self, tracks: DotTracks, values: Mapping, scale: float, centre: np.ndarray | None, focal: float):
        self._reference = tracks.rest_uv
        low, high = self._reference.min(axis=0), self._reference.max(axis=0)
        self._centre = (low + high) / 2 if centre is None else centre
        self._perspective, self.metres = _perspective(tracks, self._centre), 1.0
        near = _spacing(tracks, self.to_plane(self._reference))
        if not near > 0 or not (high - low > near).all():
            raise BadFrame('the undeformed dots coincide or are collinear; take a new reference of the untouched gel')
        self.metres = scale or values['gel.pitch'] / near
        self.pitch = near * self.metres
        side = self.metres * float((high - low).min())
        layer = layer_of(values, max(side / 2, 2.0 * self.pitch))  # a thickness that is not given
        if not LAYER.min_pitch * layer.thickness < self.pitch < LAYER.max_pitch * layer.thickness:
            raise BadFrame(f'the dots are {self.pitch:.3g} m apart on a gel {layer.thickness:.3g} m thick; check the parameters gel.scale, '
                           'gel.pitch and gel.thickness, or take a new reference')
        self._grid, self._index = (tracks.rows, tracks.columns), {number: k for k, number in enumerate(tracks.id.tolist())}
        width = float((high - low).max() if centre is None else 2 * centre.max())
        dots = self.to_plane(self._reference)
        self._low, self._high = dots.min(axis=0), dots.max(axis=0)
        camera = self._camera(focal or width / 2 / np.tan(np.radians(LAYER.view_deg / 2)))
        self.fit = DiscFit(DiscFit.loads_for(layer, dots, self.pitch), dots, self.pitch, camera)

    def _camera(self, focal: float) -> np.ndarray:
        """(3,) m: position of a camera of this focal length, px, above the gel."""
        tilt = focal * self._perspective  # tangent
        cosine2 = 1 / (1 + tilt @ tilt)
        return self.metres * focal * np.array([*(tilt * cosine2), np.sqrt(cosine2)])

    def to_plane(self, uv: np.ndarray) -> np.ndarray:
        """Positions (N, 2) on the gel in m of image positions (N, 2) in px."""
        offset = uv - self._centre
        return self.metres * offset / np.maximum(1 + offset @ self._perspective, LAYER.min_perspective)[:, None]

    def to_image(self, xy: np.ndarray) -> np.ndarray:
        """Image positions (N, 2) in px of positions (N, 2) on the gel in m."""
        offset = np.asarray(xy) / self.metres
        return self._centre + offset / np.maximum(1 - offset @ self._perspective, LAYER.min_perspective)[:, None]

    def _rows_of(self, tracks: DotTracks) -> np.ndarray:
        """(N,) index of each dot of a frame among the undeformed ones, -1 for one that is not among them."""
        rows = np.array([self._index.get(number, -1) for number in tracks.id.tolist()])
        has_drifted = np.abs(tracks.rest_uv - self._reference[rows]).max(axis=1) > LAYER.max_drift * self.pitch / self.metres
        return np.where(has_drifted, -1, rows)

    def shows(self, tracks: DotTracks) -> bool:
        """Whether nearly all dots of a frame are among the undeformed ones."""
        return (tracks.rows, tracks.columns) == self._grid and np.mean(self._rows_of(tracks) < 0) <= LAYER.max_new_share

    def displacements(self, tracks: DotTracks) -> tuple[np.ndarray, np.ndarray]:
        """Which of the undeformed dots are seen (D,), and their displacements (D, 2), m."""
        rows = self._rows_of(tracks)
        seen, displacements, known = np.zeros(len(self._reference), bool), np.zeros(self._reference.shape), rows >= 0
        seen[rows[known]] = True
        displacements[rows[known]] = self.to_plane(tracks.uv[known]) - self.to_plane(tracks.rest_uv[known])
        return seen, displacements

    def at_edge(self, disc: Disc) -> bool:
        """Whether the contact reaches beyond the outer dots."""
        return bool((disc.centre - disc.radius < self._low).any() or (disc.centre + disc.radius > self._high).any())


def layer_of(values: Mapping, unknown: float = 1.0) -> Layer:
    """The layer with these values of GEL_PARAMETERS; unknown: m, thickness to take where it is not known. Raises BadArgument."""
    return Layer(values['gel.thickness'] or unknown, values['gel.poisson_ratio'], values['gel.dot_depth'])


def spacing_of(positions: np.ndarray) -> float:
    """Median distance of nearest neighbours among positions (M, 2), in their unit."""
    return float(np.median(np.sort(np.linalg.norm(positions[:, None] - positions, axis=2), axis=1)[:, 1]))


def _spacing(tracks: DotTracks, positions: np.ndarray) -> float:
    """Median distance of neighbouring dots at positions (N, 2), in their unit: neighbours along rows and columns of a grid, else nearest
    neighbours."""
    if not tracks.rows:
        return spacing_of(positions)
    grid = np.full((tracks.rows * tracks.columns, 2), np.nan)
    grid[tracks.id] = positions
    grid = grid.reshape(tracks.rows, tracks.columns, 2)
    steps = np.concatenate([np.linalg.norm(np.diff(grid, axis=axis), axis=2).ravel() for axis in (0, 1)])
    return float(np.median(steps[np.isfinite(steps)])) if np.isfinite(steps).any() else 0.0


def _perspective(tracks: DotTracks, centre: np.ndarray) -> np.ndarray:
    """(2,) 1/px: coefficients g of the map offset / (1 + g . offset) from image offsets from the centre to the plane; 0 without a grid."""
    if not tracks.rows or len(tracks) < LAYER.min_dots_for_tilt:
        return np.zeros(2)
    row, column = np.divmod(tracks.id, tracks.columns)
    if len(set(row.tolist())) < 3 or len(set(column.tolist())) < 3:
        return np.zeros(2)
    offset = tracks.rest_uv - centre
    size = np.abs(offset).max()
    point, none = np.column_stack([offset / size, np.ones(len(offset))]), np.zeros((len(offset), 3))
    # index (1 + g . offset) = a . offset + c, with an a and a c for rows and for columns, and the same g
    indices = [index - index.mean() for index in (row, column)]
    shared = [-index[:, None] * point[:, :2] for index in indices]
    matrix = np.block([[point, none, shared[0]], [none, point, shared[1]]])
    return np.linalg.lstsq(matrix, np.concatenate(indices), rcond=None)[0][-2:] / size
