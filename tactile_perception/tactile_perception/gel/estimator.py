# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact region, contacts and wrench of a gel from the dots of one frame."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import cv2
import numpy as np

from ..common.dots import DotTracks
from ..common.estimates import AT_EDGE, NONE, ContactEstimate, ContactRegionEstimate, SlipEstimate, next_state
from ..common.statistics import robust_sigma
from ..common.surface import DotSurface, Moments, Outline, axes, region_outlines
from ..common.surface_points import NON_CONTACT, STICKING, SurfacePoints, dot_points
from ..errors import BadArgument, BadFrame
from .layer import Layer, Loads
from .traction import TractionFit, Tractions

FEWEST = 6  # dots: three parameters of a press and three of a shear
_CELLS = 1.5  # places for loads to a pitch; more changes forces by 1 %, for twice the time
_MOST = 400  # places: into more no gel is divided, for time; with 800, forces change by less than 1 %
_DRIFTED = 0.25  # px: a dot whose place at rest drifts farther is laid out anew; it changes displacements by less than a hundredth
_SIGNIFICANT = 5.0  # sigmas that three dots must have moved: one of 1,000 does by chance in a thousand frames, three no mistaken dot
_SET, _RECOVERY_S = 0.1, 10.0  # prior: of a touch's displacement, what a silicone keeps after it; s in which that falls to a third
_EDGE = 0.2  # of the greatest pressure: where the region ends. Between a ball's, which fades, and a stamp's; both blurred by the dots
FARTHEST_PX = 1e5  # no camera has so many
_COARSEST, _FINEST = 4.0, 0.02  # thicknesses from place to place: beyond, loads of neighbours do not meet, or all lie on one spot
_KEPT = 4  # times the dots of a frame that are known at most; then those that are not seen are forgotten
_LEAST_SIGMA = 0.05  # px: what light that shifts as the skin tilts does to a dot; no detector is better on a moving gel
_UNSEEN_SIGMA = 0.1  # px: of a detector of dots, before two frames have shown it
_NARROW = 4.0  # places across a region, below which the depth of its middle is not reported: loads are too blurred
_DEPTH_ERROR = 0.1, 0.5  # of the depth, and of that of a narrow region; measured on simulated gels
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class GelResult:
    """Estimates of one frame. wrench: (6,) N and N m, of the object on the gel, NaN without a modulus; points: surface points on demand;
    force_sigma: (3,) N, standard deviations of the wrench's force; slip: None where the friction is not known.
    """

    region: ContactRegionEstimate
    contacts: list[ContactEstimate]
    wrench: np.ndarray
    points: Callable[[], SurfacePoints]
    force_sigma: np.ndarray
    slip: SlipEstimate | None = None


class DotNoise:
    """Standard deviation of a coordinate of the dots, px, from what they do between two frames in which nothing touches; and what a touch
    leaves behind in the skin for a while."""

    def __init__(self):
        self._last, self._sum, self._count = None, _UNSEEN_SIGMA**2, 1.0
        self._farthest, self._stamp_s = 0.0, 0.0

    @property
    def sigma(self) -> float:
        """px."""
        return max(float(np.sqrt(self._sum / self._count)), _LEAST_SIGMA)

    def touched(self, tracks: DotTracks, stamp_s: float) -> bool:
        """Whether something touches: three dots of the next frame have moved by so many sigmas, and by more than the last touch may leave;
        if not, its noise is taken."""
        moved = float(np.sort(np.abs(tracks.duv).max(axis=1))[-3])
        self._farthest *= float(np.exp(-max(stamp_s - self._stamp_s, 0.0) / _RECOVERY_S))
        self._stamp_s = stamp_s
        if moved > _SIGNIFICANT * self.sigma + _SET * self._farthest:
            self._last, self._farthest = None, max(moved, self._farthest)
            return True
        if self._last is not None:
            _, now, before = np.intersect1d(tracks.id, self._last[0], return_indices=True)
            step = (tracks.duv[now] - self._last[1][before]).ravel()
            if len(step):
                size = robust_sigma(step) / np.sqrt(2)
                self._sum, self._count = self._sum + size**2, self._count + 1
        self._last = tracks.id, tracks.duv
        return False


def known_dots(tracks: DotTracks, name: str) -> DotTracks:
    """Those dots, called name, whose places at rest are known. Raises BadFrame for fewer than FEWEST."""
    known = ((np.abs(tracks.duv) < FARTHEST_PX) & (np.abs(tracks.uv) < FARTHEST_PX)).all(axis=1)
    if known.sum() < FEWEST:
        raise BadFrame(f'{known.sum()} {name} with a known place at rest; {FEWEST} are needed: check the view, or take a new reference')
    return tracks.take(known)


def layer_of(values: Mapping) -> Layer:
    """The layer with these values of GEL_PARAMETERS. Raises BadArgument."""
    return Layer(values['gel.thickness'], values['gel.poisson_ratio'], values['gel.dot_depth'])


class GelEstimator:
    """Estimates contact of an elastic layer from its dots, frame by frame.

    values: of REGION_PARAMETERS; centre: (2,) px, where the sensor frame's origin is seen, None for the middle of the dots at rest; focal:
    px, focal length of the camera, 0 where it is not known: then depth is taken not to move dots in the image. Raises BadArgument for
    values that are no gel.
    """

    def __init__(self, values: Mapping, centre: np.ndarray | None = None, focal: float = 0.0):
        self.layer = layer_of(values)
        self._modulus, self._friction = values['gel.young_modulus'] / (2 + 2 * self.layer.poisson) or np.nan, values['gel.friction']
        self._pitch, self._scale, self._focal = values['gel.pitch'], values['gel.scale'], focal
        if not self._pitch > 0 and not self._scale > 0:
            if not focal > 0 or not values['camera.translation'][2] > 0:
                raise BadArgument('parameters gel.pitch and gel.scale are 0 and the camera is not calibrated: one must tell how large the '
                                  'image is')
            self._scale = values['camera.translation'][2] / focal
        self._centre = None if centre is None else np.asarray(centre, float)
        self._next = 1
        self.reset()

    def reset(self) -> None:
        """Forget dots, noise and contacts; ids are not used again."""
        self._noise, self._laid, self._grid, self._last, self._force = DotNoise(), None, None, {}, None
        self._force_sigma, self._slip_state = np.full(3, np.nan), NONE

    def health(self) -> tuple[str, dict]:
        """A warning ('' for none) and name -> value, for /diagnostics."""
        warning = '' if np.isfinite(self._modulus) else 'gel.young_modulus is not known: forces are NaN; measure it (docs/gel.md)'
        if self._laid is None:
            return warning, {}
        error = 'unknown' if np.isnan(self._force_sigma).any() else 'x {:.2g} y {:.2g} z {:.2g} N'.format(*self._force_sigma)
        return warning, {'scale': f'{1e6 * self._laid.metres:.4g} um a pixel', 'noise of dots': f'{self._noise.sigma:.3f} px',
                         'standard deviation of the force': error}

    def process(self, tracks: DotTracks, stamp_s: float) -> GelResult:
        """Contact in one frame. Raises BadFrame for too few dots whose places at rest are known."""
        tracks = known_dots(tracks, 'dots')
        if self._laid is None or (tracks.rows, tracks.columns) != self._grid:
            self._laid = _LaidOut(tracks, self.layer, self._pitch, self._scale, self._centre, self._focal)
            self._grid, self._noise, self._force = (tracks.rows, tracks.columns), DotNoise(), None
        touched, sigma, metres = self._noise.touched(tracks, stamp_s), self._noise.sigma, self._laid.metres
        try:
            found = self._laid.fit.solve(self._laid.rows_of(tracks), tracks.duv * metres, sigma * metres, self._force) if touched else None
        except (np.linalg.LinAlgError, RuntimeError) as error:  # of nnls: no end
            raise BadFrame(f'no loads explain how the dots moved ({error}); check them in image_annotated') from error
        self._force = found.force if found else None
        return self._result(tracks, found)

    def _result(self, tracks: DotTracks, found: Tractions | None) -> GelResult:
        laid = self._laid
        xy, rest = ((uv - laid.middle) * laid.metres for uv in (tracks.uv, tracks.rest_uv))
        parts, step = ([], np.nan) if found is None else laid.regions(-found.force[:, 2])
        members = [_inside(outline, rest) for outline, _ in parts]
        inside = np.any(members, axis=0) if parts else np.zeros(len(xy), bool)
        region = ContactRegionEstimate(tracks.id, np.where(inside, STICKING, NON_CONTACT).astype(np.uint8))
        wrench, sigma = np.zeros(6), np.full(3, np.nan)
        if parts:
            _describe(region, parts, step)
            wrench = np.concatenate([found.total, np.cross(np.pad(laid.fit.places, ((0, 0), (0, 1))), found.force).sum(axis=0)])
            sigma = np.sqrt(np.diag(found.covariance)) * self._modulus
        contacts, self._force_sigma = self._contacts(found, parts, members), sigma
        points = partial(dot_points, (1, len(tracks)), np.pad(xy, ((0, 0), (0, 1))), np.pad(rest, ((0, 0), (0, 1))), region.dot_state, None)
        slip = self._slip(found.total if parts else None) if self._friction else None
        return GelResult(region, contacts, wrench * self._modulus, points, sigma, slip)

    def _slip(self, force: np.ndarray | None) -> SlipEstimate:
        """How much of a contact slips that bears a force (3,) in any unit; None: no contact. With a part q of its friction used up, a ball
        sticks on (1 - q)^(2/3) of its area (Cattaneo 1938, Mindlin 1949)."""
        if force is None:
            self._slip_state = NONE
            return SlipEstimate()
        used = min(float(np.hypot(*force[:2])) / (self._friction * -force[2]), 1.0)
        fraction = 1 - (1 - used)**(2 / 3)
        self._slip_state = next_state(self._slip_state, fraction)
        twist = np.full(3, 0.0 if self._slip_state == NONE else np.nan)  # how fast the object moves over them, dots do not show
        return SlipEstimate(self._slip_state, fraction, twist, twist)

    def _contacts(self, found: Tractions, parts: list[tuple[Outline, Moments]], members: list[np.ndarray]) -> list[ContactEstimate]:
        """One contact a part: its force is that of the places to which it is the nearest, its position their pressure's middle."""
        places, contacts, free = self._laid.fit.places, [], dict(self._last)
        middles = np.array([moments.centroid[:2] for _, moments in parts])
        nearest = ((places[:, None] - middles)**2).sum(axis=2).argmin(axis=1) if parts else None
        for k, (outline, moments) in enumerate(parts):
            load = np.where(nearest == k, -found.force[:, 2], 0.0)
            middle = load @ places / load.sum()
            depth = self._laid.depth(middle, found.force)
            narrow = moments.area < np.pi / 4 * (_NARROW * self._laid.step)**2
            position, covariance = np.append(middle, -depth), np.zeros((3, 3))
            covariance[:2, :2], covariance[2, 2] = found.place_covariance, (_DEPTH_ERROR[narrow] * depth)**2
            number = min(free, key=lambda n: np.linalg.norm(free[n] - position), default=None)
            if number is None or np.linalg.norm(free.pop(number) - position) > np.sqrt(moments.area):
                number, self._next = self._next, self._next + 1
            force, flags = float(load.sum() * self._modulus), AT_EDGE if self._laid.at_edge(outline) else 0
            depth = np.nan if narrow else depth
            contacts.append(ContactEstimate(number, position, UP.copy(), depth, force, covariance, flags, members[k]))
        self._last = {contact.id: contact.position for contact in contacts}
        return contacts


class _LaidOut:
    """The dots at rest in metres, and places for loads over them. tracks: the first frame's dots; others: see GelEstimator. Raises BadFrame
    for dots that lie on each other."""

    def __init__(self, tracks: DotTracks, layer: Layer, pitch: float, scale: float, centre: np.ndarray | None, focal: float):
        rest, near = tracks.rest_uv, _spacing(tracks)
        low, high = rest.min(axis=0), rest.max(axis=0)
        if not near > 0 or not (high - low > near).all():
            raise BadFrame('the dots at rest lie on each other or on a line; take a new reference, of the untouched gel')
        self.metres = scale or pitch / near
        self.middle = (low + high) / 2 if centre is None else centre
        self._pitch = near * self.metres
        self._low, self._high = ((corner - self.middle) * self.metres for corner in (low, high))
        size = self._high - self._low + 2 * self._pitch
        step = self.step = max(self._pitch / _CELLS, float(np.sqrt(size.prod() / _MOST)))
        if not _FINEST * layer.thickness < step < _COARSEST * layer.thickness:
            raise BadFrame(f'dots are {self._pitch:.3g} m apart on a gel of {layer.thickness:.3g} m; check the parameters gel.scale, '
                           'gel.pitch and gel.thickness, or take a new reference')
        columns, rows = np.ceil(size / step).astype(int)
        v, u = np.mgrid[:rows, :columns]
        places = (self._low + self._high) / 2 + (np.stack([u, v], axis=-1) - (np.array([columns, rows]) - 1) / 2) * step
        self._surface = DotSurface(np.pad(places, ((0, 0), (0, 0), (0, 1))))
        self.fit = TractionFit(layer, places.reshape(-1, 2), step, self.metres * focal or np.inf)
        self._surface_loads = Loads(Layer(layer.thickness, layer.poisson, 0.0), self.fit.blur * step)
        self._forget()

    def _forget(self) -> None:
        """Drop the dots."""
        self._index, self._rest = {}, np.zeros((0, 2))
        self._rows = np.zeros((0, 2, len(self.fit.places), 3))

    def rows_of(self, tracks: DotTracks) -> np.ndarray:
        """(D, 2, P, 3) of the frame's dots (TractionFit.rows); computed for those that are new or have another place at rest."""
        if len(self._index) > _KEPT * len(tracks):
            self._forget()
        rest, new = tracks.rest_uv, [k for k in tracks.id.tolist() if k not in self._index]
        self._index.update(zip(new, range(len(self._rest), len(self._rest) + len(new))))
        self._rest = np.concatenate([self._rest, np.full((len(new), 2), np.inf)])
        self._rows = np.concatenate([self._rows, np.zeros((len(new), *self._rows.shape[1:]))])
        at = np.array([self._index[k] for k in tracks.id.tolist()])
        other = ~(np.abs(rest - self._rest[at]) < _DRIFTED).all(axis=1)
        self._rest[at[other]] = rest[other]
        self._rows[at[other]] = self.fit.rows((rest[other] - self.middle) * self.metres)
        return self._rows[at]

    def regions(self, press: np.ndarray) -> tuple[list[tuple[Outline, Moments]], float]:
        """Separate regions of pressure, largest first, and the distance of places, m; press: (P,) loads."""
        pressure = cv2.GaussianBlur(np.maximum(press, 0).reshape(self._surface.shape), (0, 0), self.fit.blur)
        if not pressure.max() > 0:
            return [], np.nan
        outlines, moments, step = region_outlines(pressure / pressure.max(), self._surface, _EDGE)
        return [(outline, part) for outline, part in zip(outlines, moments) if part.area > 0], step

    def depth(self, place: np.ndarray, force: np.ndarray) -> float:
        """How deep, m, loads (P, 3) press the surface at a place (2,) m."""
        return float(-(self._surface_loads.matrix(place[None], self.fit.places)[0, 2] * force * [1, 1, -1]).sum())

    def at_edge(self, outline: Outline) -> bool:
        """Whether the region reaches beyond the outer dots."""
        xy = outline.points[:, :2]
        return bool((xy < self._low).any() or (xy > self._high).any())


def spacing_of(rest: np.ndarray) -> float:
    """Median distance of the nearest neighbours among rest (M, 2), in its unit."""
    return float(np.median(np.sort(np.linalg.norm(rest[:, None] - rest, axis=2), axis=1)[:, 1]))


def _spacing(tracks: DotTracks) -> float:
    """Median distance of neighbouring dots at rest, px: of those on a grid along rows and columns, else of each dot and the nearest."""
    if not tracks.rows:
        return spacing_of(tracks.rest_uv)
    grid = np.full((tracks.rows * tracks.columns, 2), np.nan)
    grid[tracks.id] = tracks.rest_uv
    grid = grid.reshape(tracks.rows, tracks.columns, 2)
    steps = np.concatenate([np.linalg.norm(np.diff(grid, axis=axis), axis=2).ravel() for axis in (0, 1)])
    return float(np.median(steps[np.isfinite(steps)])) if np.isfinite(steps).any() else 0.0


def _inside(outline: Outline, rest: np.ndarray) -> np.ndarray:
    """(D,) bool: whether places rest (D, 2) m lie inside an outline and outside its holes."""
    depth = [np.array([cv2.pointPolygonTest(line[:, :2].astype(np.float32), (float(x), float(y)), False) >= 0 for x, y in rest], bool)
             for line in outline.loops]
    return depth[0] & ~np.any([*depth[1:], np.zeros(len(rest), bool)], axis=0)


def _describe(region: ContactRegionEstimate, parts: list[tuple[Outline, Moments]], step: float) -> None:
    """Fill in the region's shape; step: m, of its outlines."""
    total = sum((moments for _, moments in parts[1:]), parts[0][1])
    region.outlines = [outline.points for outline, _ in parts]
    region.holes = [hole for outline, _ in parts for hole in outline.holes]
    region.area, region.centroid, region.normal = total.area, total.centroid, UP.copy()
    region.major_axis, region.minor_axis, region.orientation = axes(total, region.outlines + region.holes, step)
