# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact region, contacts, wrench and slip of a gel from the dots of one frame."""
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
from ..core.errors import BadArgument, BadFrame
from .constants import LAYER
from .discs import Disc
from .undeformed import UndeformedDots, layer_of

UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class GelResult:
    """Estimates of one frame.

    Attributes
    ----------
    region : ContactRegionEstimate
    contacts : list of ContactEstimate
    wrench : ndarray, shape (6,)
        Of the object on the gel in N and N m; NaN without a modulus.
    points : callable
        Returns the SurfacePoints of the frame.
    force_sigma : ndarray, shape (3,)
        Standard deviations of the force in N.
    slip : SlipEstimate or None
        None where the friction is not known.
    """

    region: ContactRegionEstimate
    contacts: list[ContactEstimate]
    wrench: np.ndarray
    points: Callable[[], SurfacePoints]
    force_sigma: np.ndarray
    slip: SlipEstimate | None = None


class DotNoise:
    """Decides whether something presses on the dots, and measures their noise while nothing does."""

    def __init__(self):
        self._previous, self._sum, self._count = None, LAYER.prior_noise_px**2, 1.0
        self._largest_px, self._stamp_s = 0.0, 0.0  # largest displacement of the presses so far, as it fades

    @property
    def sigma(self) -> float:
        """Standard deviation of a coordinate of a dot in px."""
        return max(float(np.sqrt(self._sum / self._count)), LAYER.min_noise_px)

    def is_pressed(self, tracks: DotTracks, stamp_s: float) -> bool:
        """Whether three dots of the next frame are displaced by more than noise and what the last press may leave in the skin explain. If
        not, the frame counts in the noise."""
        displacement = float(np.sort(np.abs(tracks.duv).max(axis=1))[-3])
        self._largest_px *= float(np.exp(-max(stamp_s - self._stamp_s, 0.0) / LAYER.recovery_s))
        self._stamp_s = stamp_s
        if displacement > LAYER.pressed_sigmas * self.sigma + LAYER.kept_share * self._largest_px:
            self._previous, self._largest_px = None, max(displacement, self._largest_px)
            return True
        if self._previous is not None:
            _, now, before = np.intersect1d(tracks.id, self._previous[0], return_indices=True)
            change = (tracks.duv[now] - self._previous[1][before]).ravel()
            if len(change):
                self._sum, self._count = self._sum + robust_sigma(change)**2 / 2, self._count + 1
        self._previous = tracks.id, tracks.duv
        return False


def known_dots(tracks: DotTracks, name: str) -> DotTracks:
    """The dots whose undeformed positions are known; name: of the dots in messages. Raises BadFrame for fewer than MIN_DOTS."""
    known = ((np.abs(tracks.duv) < LAYER.max_px) & (np.abs(tracks.uv) < LAYER.max_px)).all(axis=1)
    if known.sum() < LAYER.min_dots:
        raise BadFrame(f'{known.sum()} {name} with a known undeformed position; {LAYER.min_dots} are needed: check the view, or take a new '
                       'reference')
    return tracks.take(known)


class GelEstimator:
    """Estimates the contact of an elastic layer from its dots, frame by frame.

    Parameters
    ----------
    values : Mapping
        Values of GEL_PARAMETERS.
    centre : ndarray, shape (2,), optional
        Image position of the sensor frame's origin in px; None: the middle of the undeformed dots.
    focal : float
        Focal length of the camera in px; 0: not known, that of a common lens is taken.
    force_error : float
        Relative standard deviation of the pressing force, beside the contribution of the dots' noise.

    Raises
    ------
    BadArgument
        For values that do not describe a gel.
    """

    def __init__(self, values: Mapping, centre: np.ndarray | None = None, focal: float = 0.0, force_error: float = 0.03):
        layer_of(values)
        self._force_error = force_error
        self._values, self._friction = values, values['gel.friction']
        self._modulus = values['gel.young_modulus'] / (2 + 2 * values['gel.poisson_ratio']) or np.nan  # of shear
        self._scale, self._focal = values['gel.scale'], focal
        if not values['gel.pitch'] > 0 and not self._scale > 0:
            if not focal > 0 or not values['camera.translation'][2] > 0:
                raise BadArgument('the scale of the image is not known: set the parameter gel.pitch or gel.scale, or calibrate the camera '
                                  'and set camera.translation')
            self._scale = values['camera.translation'][2] / focal
        self._centre = None if centre is None else np.asarray(centre, float)
        self._next_id = 1
        self.reset()

    def reset(self) -> None:
        """Drop dots, noise and contacts; ids are not used again."""
        self._noise, self._undeformed, self._previous = DotNoise(), None, {}
        self._force_sigma, self._slip = np.full(3, np.nan), GelSlip(self._friction)

    @property
    def force_sigma(self) -> np.ndarray:
        """(3,) N: standard deviations of the force in the last frame; NaN without contact or without a modulus."""
        return self._force_sigma

    @property
    def metres(self) -> float:
        """Length in m that one pixel shows in the middle of the view; NaN before the first frame."""
        return self._undeformed.metres if self._undeformed else np.nan

    @property
    def pitch(self) -> float:
        """Distance in m of neighbouring dots; NaN before the first frame."""
        return self._undeformed.pitch if self._undeformed else np.nan

    def to_image(self, xy: np.ndarray) -> np.ndarray:
        """Image positions (N, 2) in px of positions (N, 2) on the gel in m, sensor frame; after the first frame."""
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
        return self._result(tracks, self._discs(tracks, stamp_s))

    def slip(self, tracks: DotTracks, stamp_s: float) -> SlipEstimate:
        """Slip alone in one frame, of a gel with known friction. Raises BadFrame as process does."""
        return self._slip.estimate(self._discs(known_dots(tracks, 'dots'), stamp_s))

    def _discs(self, tracks: DotTracks, stamp_s: float) -> list[Disc]:
        """The presses that explain the displacements of the dots."""
        if self._undeformed is None or not self._undeformed.shows(tracks):
            self._undeformed = UndeformedDots(tracks, self._values, self._scale, self._centre, self._focal)
        undeformed, discs = self._undeformed, []
        if self._noise.is_pressed(tracks, stamp_s):
            try:
                discs = undeformed.fit.solve(*undeformed.displacements(tracks), self._noise.sigma * undeformed.metres)
            except np.linalg.LinAlgError as error:
                raise BadFrame(f'no press explains the displacements of the dots ({error}); check the dots in image_annotated') from error
        return discs

    def _result(self, tracks: DotTracks, discs: list[Disc]) -> GelResult:
        undeformed = self._undeformed
        xy, reference = undeformed.to_plane(tracks.uv), undeformed.to_plane(tracks.rest_uv)
        members = [np.hypot(*(reference - disc.centre).T) < disc.radius for disc in discs]
        region = ContactRegionEstimate(tracks.id, np.where(np.any(members, axis=0) if discs else False, STICKING,
                                                           np.full(len(xy), NON_CONTACT)).astype(np.uint8))
        wrench, self._force_sigma = np.zeros(6), np.full(3, np.nan)
        contacts = [self._contact(disc, member) for disc, member in zip(discs, members)]
        if discs:
            centres = np.array([[*contact.position[:2], 0.0] for contact in contacts])
            _describe(region, centres, np.array([disc.radius for disc in discs]), undeformed.pitch)
            forces = np.array([_known_force(disc) for disc in discs])
            torque = np.cross(centres, forces).sum(axis=0)
            wrench = np.concatenate([forces.sum(axis=0), torque[:2], [np.nan]])  # the rotation of an object about its contact is not fitted
            variance = sum(np.diag(disc.covariance)[3:] for disc in discs) + (self._force_error * forces.sum(axis=0)[2])**2
            self._force_sigma = np.sqrt(variance) * self._modulus
        self._number(contacts)
        points = partial(dot_points, (1, len(tracks)), np.pad(xy, ((0, 0), (0, 1))), np.pad(reference, ((0, 0), (0, 1))), region.dot_state,
                         None)
        slip = self._slip.estimate(discs) if self._friction else None
        return GelResult(region, contacts, wrench * self._modulus, points, self._force_sigma, slip)

    def _contact(self, disc: Disc, members: np.ndarray) -> ContactEstimate:
        """The contact of a disc, without its number. Its position is that of the deformed gel: the shear has moved the surface."""
        loads, force = self._undeformed.fit.loads, -_known_force(disc)[2]
        drag = loads.drag(disc.radius)
        moved, to_position = drag * disc.force[:2], np.hstack([np.eye(2), np.zeros((2, 1)), drag * np.eye(2), np.zeros((2, 1))])
        depth = force * loads.depression(disc.radius) if self._values['gel.thickness'] > 0 else np.nan
        covariance = np.zeros((3, 3))
        covariance[:2, :2] = to_position @ disc.covariance @ to_position.T + (LAYER.model_error * np.hypot(*moved))**2 * np.eye(2)
        covariance[2, 2] = depth**2 * (LAYER.depth_error**2 + disc.covariance[5, 5] / force**2)
        flags = AT_EDGE if self._undeformed.at_edge(disc) else 0
        position = np.append(disc.centre + moved, -depth)
        return ContactEstimate(0, position, UP.copy(), depth, force * self._modulus, covariance, flags, members)

    def _number(self, contacts: list[ContactEstimate]) -> None:
        """Give each contact the number of the nearest one in the previous frame, if that is within two pitches; else a new one."""
        free = dict(self._previous)
        for k, contact in enumerate(contacts):
            distance = {number: np.linalg.norm(position - contact.position[:2]) for number, position in free.items()}
            number = min(distance, key=distance.get, default=None)
            if number is None or distance[number] > 2 * self._undeformed.pitch:
                number, self._next_id = self._next_id, self._next_id + 1
            free.pop(number, None)
            contacts[k] = replace(contact, id=number)
        self._previous = {contact.id: contact.position[:2] for contact in contacts}


class GelSlip:
    """Slip of a contact from its shear over its pressure.

    Parameters
    ----------
    friction : float
        Coefficient of friction between object and gel.

    Notes
    -----
    If a part q of the friction is used up, a ball sticks on (1 - q)^(2/3) of its contact [1]_ [2]_. A state other than NONE is reported
    only after shear over pressure has changed significantly since the press began: an object that is pressed obliquely and held still does
    not slip.

    .. [1] C. Cattaneo, Sul contatto di due corpi elastici, 1938.
    .. [2] R. D. Mindlin, Compliance of elastic bodies in contact, 1949.
    """

    def __init__(self, friction: float):
        self._friction, self._state, self._start, self._has_changed = friction, NONE, None, False

    def estimate(self, discs: list[Disc]) -> SlipEstimate:
        """Slip of all contacts of a frame."""
        force = np.sum([_known_force(disc) for disc in discs], axis=0) if discs else np.full(3, np.nan)
        if not -force[2] > 0:
            self._state, self._start, self._has_changed = NONE, None, False
            return SlipEstimate()
        ratio, sigma = force[:2] / -force[2], float(np.sqrt(sum(np.trace(d.covariance[3:5, 3:5]) for d in discs))) / -force[2]
        if self._start is None or not self._has_changed and sigma < self._start[1] / 2:  # a light press shows its shear poorly
            self._start = ratio, sigma
        self._has_changed |= bool(np.hypot(*(ratio - self._start[0])) > LAYER.min_slip_sigmas * np.hypot(sigma, self._start[1]))
        fraction = 1 - (1 - min(float(np.hypot(*ratio)) / self._friction, 1.0))**(2 / 3)
        self._state = next_state(self._state, fraction if self._has_changed else 0.0)
        velocity = np.full(3, 0.0 if self._state == NONE else np.nan)  # the dots do not show how fast the object moves over the gel
        return SlipEstimate(self._state, fraction, velocity, velocity)


def _known_force(disc: Disc) -> np.ndarray:
    """(3,) m^2: the force of a disc; its pressing component is NaN if it is not significant."""
    is_significant = -disc.force[2] > LAYER.min_force_sigmas * np.sqrt(disc.covariance[5, 5])
    return np.array([*disc.force[:2], disc.force[2] if is_significant else np.nan])


def _describe(region: ContactRegionEstimate, centres: np.ndarray, radii: np.ndarray, step: float) -> None:
    """Fill in the shape of the region, which is of discs at centres (K, 3) with radii (K,), m; step: m, of its outlines."""
    angle = np.linspace(0, 2 * np.pi, 32, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle), np.zeros(32)], axis=1)
    (x, y, _), areas = centres.T, np.pi * radii**2
    second = areas @ np.stack([x**2 + radii**2 / 4, x * y, y**2 + radii**2 / 4], axis=1)
    total = Moments(float(areas.sum()), areas.sum() * UP, areas @ centres, second)
    region.outlines = [centre + radius * circle for centre, radius in zip(centres, radii)]
    region.area, region.centroid, region.normal = total.area, total.centroid, UP.copy()
    region.major_axis, region.minor_axis, region.orientation = axes(total, region.outlines, step)
