# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact region, contacts and wrench of a gel from the dots of one frame."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..common.dots import DotTracks
from ..common.estimates import AT_EDGE, NONE, ContactEstimate, ContactRegionEstimate, SlipEstimate, next_state
from ..common.statistics import robust_sigma
from ..common.surface import Moments, axes
from ..common.surface_points import NON_CONTACT, STICKING, SurfacePoints, dot_points
from ..errors import BadArgument, BadFrame
from .discs import FEWEST, Disc
from .undeformed import UndeformedDots, layer_of

_SIGNIFICANT = 5.0  # sigmas that three dots must have moved: one of 1,000 does by chance in a thousand frames, three no mistaken dot
_SET, _RECOVERY_S = 0.1, 10.0  # prior: part of a press's displacement that a silicone keeps after it; s in which that falls to a third
FARTHEST_PX = 1e5  # no camera has so many
_LEAST_SIGMA = 0.05  # px: what light that shifts as the skin tilts does to a dot; no detector is better on a moving gel
_UNSEEN_SIGMA = 0.1  # px: of a detector of dots, before two frames have shown it
_DEPTH_ERROR = 0.1  # of the depth; measured on simulated gels
_FORCE_ERROR = 0.03  # of the force; the same
_PRESS_SIGMAS = 2.0  # below so many standard deviations a press is unknown
_SLIP_SIGMAS = 3.0  # by which shear over pressure must have changed since the press began before slip is called
_CIRCLE = 32  # vertices of a contact's outline
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


class GelEstimator:
    """Estimates contact of an elastic layer from its dots, frame by frame.

    Parameters
    ----------
    values : Mapping
        Of GEL_PARAMETERS.
    centre : ndarray, shape (2,), optional
        Where the sensor frame's origin is seen, px; None: in the middle of the undeformed dots.
    focal : float
        Focal length of the camera, px; 0 where it is not known: then that of a usual lens.
    force_error : float
        Standard deviation of the pressing force, of the force itself, beside that from the dots' noise.

    Raises
    ------
    BadArgument
        For values that are no gel.
    """

    def __init__(self, values: Mapping, centre: np.ndarray | None = None, focal: float = 0.0, force_error: float = _FORCE_ERROR):
        layer_of(values)
        self._force_error = force_error
        self._values, self._friction = values, values['gel.friction']
        self._modulus = values['gel.young_modulus'] / (2 + 2 * values['gel.poisson_ratio']) or np.nan
        self._scale, self._focal = values['gel.scale'], focal
        if not values['gel.pitch'] > 0 and not self._scale > 0:
            if not focal > 0 or not values['camera.translation'][2] > 0:
                raise BadArgument('parameters gel.pitch and gel.scale are 0 and the camera is not calibrated: one must tell how large the '
                                  'image is')
            self._scale = values['camera.translation'][2] / focal
        self._centre = None if centre is None else np.asarray(centre, float)
        self._next = 1
        self.reset()

    def reset(self) -> None:
        """Forget dots, noise and contacts; ids are not used again."""
        self._noise, self._undeformed, self._last = DotNoise(), None, {}
        self._force_sigma, self._slip = np.full(3, np.nan), GelSlip(self._friction)

    @property
    def force_sigma(self) -> np.ndarray:
        """(3,) N: standard deviations of the force in the last frame; NaN where nothing touches, or without a modulus."""
        return self._force_sigma

    @property
    def metres(self) -> float:
        """Length, m, that a pixel shows in the middle of the view; NaN before the first frame."""
        return self._undeformed.metres if self._undeformed else np.nan

    def to_image(self, xy: np.ndarray) -> np.ndarray:
        """Pixels (N, 2) of positions on the gel, m, in the sensor frame, after the first frame."""
        return self._undeformed.to_image(xy)

    def health(self) -> tuple[str, dict]:
        """A warning ('' for none) and name -> value, for /diagnostics."""
        unknown = [f'gel.{name} is not known: {what}' for name, what, known in (
            ('young_modulus', 'forces are NaN', np.isfinite(self._modulus)),
            ('thickness', 'depth is NaN', self._values['gel.thickness'] > 0)) if not known]
        warning = '; '.join(unknown) + '; measure it (docs/gel.md)' if unknown else ''
        if self._undeformed is None:
            return warning, {}
        error = 'unknown' if np.isnan(self._force_sigma).any() else 'x {:.2g} y {:.2g} z {:.2g} N'.format(*self._force_sigma)
        return warning, {'scale': f'{1e6 * self._undeformed.metres:.4g} um a pixel', 'noise of dots': f'{self._noise.sigma:.3f} px',
                         'standard deviation of the force': error}

    def process(self, tracks: DotTracks, stamp_s: float) -> GelResult:
        """Contact in one frame. Raises BadFrame for too few dots whose undeformed positions are known."""
        tracks = known_dots(tracks, 'dots')
        if self._undeformed is None or not self._undeformed.shows(tracks):
            self._undeformed = UndeformedDots(tracks, self._values, self._scale, self._centre, self._focal)
        undeformed, discs = self._undeformed, []
        if self._noise.touched(tracks, stamp_s):
            try:
                discs = undeformed.fit.solve(*undeformed.displacements(tracks), self._noise.sigma * undeformed.metres)
            except np.linalg.LinAlgError as error:
                raise BadFrame(f'no press explains how the dots moved ({error}); check them in image_annotated') from error
        return self._result(tracks, discs)

    def _result(self, tracks: DotTracks, discs: list[Disc]) -> GelResult:
        undeformed = self._undeformed
        xy, rest = undeformed.to_plane(tracks.uv), undeformed.to_plane(tracks.rest_uv)
        members = [np.hypot(*(rest - disc.middle).T) < disc.radius for disc in discs]
        region = ContactRegionEstimate(tracks.id, np.where(np.any(members, axis=0) if discs else False, STICKING,
                                                           np.full(len(xy), NON_CONTACT)).astype(np.uint8))
        wrench, self._force_sigma = np.zeros(6), np.full(3, np.nan)
        if discs:
            _describe(region, discs, undeformed.pitch)
            forces = np.array([_known_force(disc) for disc in discs])
            torque = np.cross([[*disc.middle, 0.0] for disc in discs], forces).sum(axis=0)
            wrench = np.concatenate([forces.sum(axis=0), torque[:2], [np.nan]])  # a turn of an object about its contact is not fitted
            variance = sum(np.diag(disc.covariance)[3:] for disc in discs) + (self._force_error * forces.sum(axis=0)[2])**2
            self._force_sigma = np.sqrt(variance) * self._modulus
        contacts = [self._contact(disc, member) for disc, member in zip(discs, members)]
        self._number(contacts)
        points = partial(dot_points, (1, len(tracks)), np.pad(xy, ((0, 0), (0, 1))), np.pad(rest, ((0, 0), (0, 1))), region.dot_state, None)
        slip = self._slip.estimate(discs) if self._friction else None
        return GelResult(region, contacts, wrench * self._modulus, points, self._force_sigma, slip)

    def _contact(self, disc: Disc, members: np.ndarray) -> ContactEstimate:
        """The contact of a disc, without its number."""
        force = -_known_force(disc)[2]
        depth = force * self._undeformed.fit.loads.depression(disc.radius) if self._values['gel.thickness'] > 0 else np.nan
        covariance = np.zeros((3, 3))
        covariance[:2, :2] = disc.covariance[:2, :2]
        covariance[2, 2] = depth**2 * (_DEPTH_ERROR**2 + disc.covariance[5, 5] / force**2)
        flags = AT_EDGE if self._undeformed.at_edge(disc) else 0
        return ContactEstimate(0, np.append(disc.middle, -depth), UP.copy(), depth, force * self._modulus, covariance, flags, members)

    def _number(self, contacts: list[ContactEstimate]) -> None:
        """Give each contact the number that the nearest one had a frame before, if that is within its size; else a new one."""
        free = dict(self._last)
        for k, contact in enumerate(contacts):
            place = contact.position[:2]
            number = min(free, key=lambda n: np.linalg.norm(free[n][0] - place), default=None)
            if number is None or np.linalg.norm(free[number][0] - place) > 2 * free[number][1]:
                number, self._next = self._next, self._next + 1
            free.pop(number, None)
            contacts[k] = replace(contact, id=number)
        self._last = {contact.id: (contact.position[:2], self._undeformed.pitch) for contact in contacts}


class GelSlip:
    """How much of a contact slips. friction: coefficient of friction of object and gel.

    Notes
    -----
    With a part q of its friction used up, a ball sticks on (1 - q)^(2/3) of its contact [1]_ [2]_. A state other than NONE is called only
    when shear over pressure has changed significantly since the press began: an object that is pressed aslant and held still does not slip.

    .. [1] C. Cattaneo, Sul contatto di due corpi elastici, 1938.
    .. [2] R. D. Mindlin, Compliance of elastic bodies in contact, 1949.
    """

    def __init__(self, friction: float):
        self._friction, self._state, self._begin, self._moves = friction, NONE, None, False

    def estimate(self, discs: list[Disc]) -> SlipEstimate:
        """Slip of all contacts of a frame."""
        force = np.sum([_known_force(disc) for disc in discs], axis=0) if discs else np.full(3, np.nan)
        if not -force[2] > 0:
            self._state, self._begin, self._moves = NONE, None, False
            return SlipEstimate()
        ratio, sigma = force[:2] / -force[2], float(np.sqrt(sum(np.trace(d.covariance[3:5, 3:5]) for d in discs))) / -force[2]
        if self._begin is None or not self._moves and sigma < self._begin[1] / 2:  # a light touch shows its shear badly
            self._begin = ratio, sigma
        self._moves |= bool(np.hypot(*(ratio - self._begin[0])) > _SLIP_SIGMAS * np.hypot(sigma, self._begin[1]))
        fraction = 1 - (1 - min(float(np.hypot(*ratio)) / self._friction, 1.0))**(2 / 3)
        self._state = next_state(self._state, fraction if self._moves else 0.0)
        twist = np.full(3, 0.0 if self._state == NONE else np.nan)  # how fast the object moves over them, dots do not show
        return SlipEstimate(self._state, fraction, twist, twist)


def _known_force(disc: Disc) -> np.ndarray:
    """(3,) m^2: the force of a disc, its press NaN where it is not significant or a pull."""
    pressed = -disc.force[2] > _PRESS_SIGMAS * np.sqrt(disc.covariance[5, 5])
    return np.array([*disc.force[:2], disc.force[2] if pressed else np.nan])


def _describe(region: ContactRegionEstimate, discs: list[Disc], step: float) -> None:
    """Fill in the region's shape; step: m, of its outlines."""
    angle = np.linspace(0, 2 * np.pi, _CIRCLE, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle), np.zeros(_CIRCLE)], axis=1)
    middles, radii = np.array([[*disc.middle, 0.0] for disc in discs]), np.array([disc.radius for disc in discs])
    areas = np.pi * radii**2
    second = areas @ np.stack([middles[:, 0]**2 + radii**2 / 4, middles[:, 0] * middles[:, 1], middles[:, 1]**2 + radii**2 / 4], axis=1)
    total = Moments(float(areas.sum()), areas.sum() * UP, areas @ middles, second)
    region.outlines = [middle + radius * circle for middle, radius in zip(middles, radii)]
    region.area, region.centroid, region.normal = total.area, total.centroid, UP.copy()
    region.major_axis, region.minor_axis, region.orientation = axes(total, region.outlines, step)
