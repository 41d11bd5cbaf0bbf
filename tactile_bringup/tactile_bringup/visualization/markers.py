# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Results as RViz markers."""
from __future__ import annotations

import textwrap
from collections.abc import Mapping

import numpy as np
from geometry_msgs.msg import Point, Quaternion, Vector3
from rclpy.duration import Duration
from std_msgs.msg import ColorRGBA, Header
from tactile_msgs.msg import ContactRegion, Contacts, DotTracks, Slip
from tactile_perception.common.geometry import Cap
from visualization_msgs.msg import Marker, MarkerArray

from . import pictures as colours
from .pictures import states_of



SLIP_NAMES = {Slip.NONE: 'no slip', Slip.INCIPIENT: 'incipient slip', Slip.GROSS: 'gross slip'}


def touch_words(found: Mapping) -> list[str]:
    """Depth, force and slip state, as far as they are known, from messages by topic (contacts, wrench, slip; any may be missing)."""
    contacts = found['contacts'].contacts if 'contacts' in found else []
    depths = [contact.depth for contact in contacts if np.isfinite(contact.depth)]
    forces = [contact.force for contact in contacts if np.isfinite(contact.force)]
    words = [f'{1e3 * max(depths):.1f} mm deep' if depths else '']
    if 'wrench' in found:
        words.append(force_word(found['wrench'].wrench.force))
    elif forces:
        words.append(f'{sum(forces):.2f} N')
    words.append(SLIP_NAMES.get(found['slip'].state, '') if 'slip' in found else '')
    return [word for word in words if word]


def force_word(force) -> str:
    """Magnitude of the force; its z component where only that is known; '' where neither is."""
    size = float(np.linalg.norm([force.x, force.y, force.z]))
    if np.isfinite(size):
        return f'{size:.1f} N'
    return f'{abs(force.z):.1f} N along z' if np.isfinite(force.z) else ''


#: s, chosen: RViz removes markers this long after the last data.
STALE_S = 2.0
_LIFETIME = Duration(seconds=STALE_S).to_msg()
_WITHIN_95 = 2.796  # derived: square root of the 95 % quantile of chi-square with 3 degrees of freedom (7.815)
_THINNEST = 1e-5  # m, chosen: RViz warns about a scale of zero
_LIFTED = 2e-4  # m, chosen: height of outlines over the surface, which would hide them
_LETTERS = 0.13  # of the sensor's half width: height of letters. Chosen
_LINE = 36  # letters in a line of a warning. Chosen
_SLIP_COLOURS = {Slip.NONE: colours.TEXT, Slip.INCIPIENT: colours.REGION, Slip.GROSS: colours.STATE_COLOURS[2]}


def colour_of(rgb: tuple[float, float, float], opacity: float = 1.0) -> ColorRGBA:
    """A colour (r, g, b), 0 to 1, as a message."""
    return ColorRGBA(r=rgb[0], g=rgb[1], b=rgb[2], a=opacity)


_STATES = [colour_of(rgb) for rgb in colours.STATE_COLOURS]


def points_of(places: np.ndarray) -> list[Point]:
    """Convert positions (N, 3), m, to Points."""
    return [Point(x=x, y=y, z=z) for x, y, z in places.tolist()]


def _array(points) -> np.ndarray:
    return np.array([(p.x, p.y, p.z) for p in points], float).reshape(-1, 3)


def rings_of(region: ContactRegion) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Outlines and holes of a region, each (n, 3), m."""
    return [_array(polygon.points) for polygon in region.outlines], [_array(polygon.points) for polygon in region.holes]


def untouched_cap(sizes: Mapping) -> Cap | None:
    """Spherical cap of the untouched surface of a touchpad or an air cushion; None for a sheet."""
    if sizes['sensor_type'] == 'touchpad':
        return Cap(sizes['cap.curvature_radius'], sizes['cap.height'])
    rim, height = sizes['dome.rim_radius'], sizes['dome.height']
    return Cap((rim**2 + height**2) / (2 * height), height) if min(rim, height) > 0 else None


class MarkerSet:
    """Makes the markers of each frame. Each array first deletes all markers, so that it is whole whichever of those before it were lost;
    RViz handles an array at once, between two pictures.

    RViz removes markers that nothing has renewed for STALE_S, whatever has ended.
    warning: shown beside the sensor, '' for none.
    sizes: dot_size (m), dot_colour, full_depth (m), normal_length (m), force_length (m), full_force (N), full_torque (N m), and the
    untouched surface: sensor_type, cap.curvature_radius, cap.height, dome.rim_radius, dome.height (m).
    """

    def __init__(self, sizes: Mapping):
        self._sizes = sizes
        self._made: list[Marker] = []
        self._header = Header()
        self._half = np.full(2, 10 * sizes['dot_size'])  # m, half widths of the sensor: the largest seen
        self.warning = ''

    def frame(self, header: Header, found: Mapping) -> MarkerArray:
        """Markers for messages by topic (dots, contact_region, contacts, slip, wrench; any may be missing) under their header."""
        self._header, self._made = header, []
        dots = found.get('dots')
        places = np.column_stack([dots.x, dots.y, dots.z]).astype(float) if dots is not None and len(dots.x) else np.zeros((0, 3))
        region = found.get('contact_region') or ContactRegion()
        if len(places):
            self._dots(dots, places, region)
        if region.outlines:
            self._region(region)
        if found.get('contacts') is not None:
            self._contacts(found['contacts'])
        if found.get('wrench') is not None:
            self._wrench(found['wrench'].wrench, region)
        if found.get('slip') is not None:
            self._slip(found['slip'], region)
        return self._array(found, np.abs(places[np.isfinite(places).all(axis=1), :2]).max(axis=0, initial=0.0))

    def alone(self, header: Header) -> MarkerArray:
        """The warning alone."""
        self._header, self._made = header, []
        self._warning()
        return MarkerArray(markers=[Marker(header=header, action=Marker.DELETEALL), *self._made])

    def _array(self, found: Mapping, half: np.ndarray) -> MarkerArray:
        """The markers made, with the sensor's name and the numbers of the touch in front of it; half: of the sensor's widths (2,), m."""
        self._half = np.maximum(self._half, half)
        touched = (found.get('contact_region') or ContactRegion()).outlines or (found.get('contacts') or Contacts()).contacts
        lines = [self._header.frame_id, *(touch_words(found) if touched else [])]
        state = found['slip'].state if touched and 'slip' in found else Slip.NONE
        self._text('text', '\n'.join(lines), (*(0.95 * self._half), -0.25 * float(self._half.max())), _SLIP_COLOURS[state])
        self._warning()
        return MarkerArray(markers=[Marker(header=self._header, action=Marker.DELETEALL), *self._made])

    def _warning(self) -> None:
        if self.warning:
            self._text('warning', textwrap.fill(self.warning, _LINE), (*(-1.1 * self._half), 0.6 * float(self._half.max())), colours.REGION)

    def _text(self, ns: str, text: str, place: tuple[float, float, float], colour: tuple[float, float, float]) -> None:
        height = _LETTERS * float(self._half.max())
        # scale.x is the width of a space, which RViz otherwise takes from letters 1 m high.
        marker = self._add(ns, Marker.TEXT_VIEW_FACING, (0.5 * height, 0.0, height), colour_of(colour), [])
        marker.text, marker.pose.position = text, Point(x=place[0], y=place[1], z=place[2])

    def _add(self, ns: str, kind: int, scale: tuple[float, float, float], colour: ColorRGBA, points: list[Point],
             number: int = 0) -> Marker:
        marker = Marker(header=self._header, ns=ns, id=number, type=kind, scale=Vector3(x=scale[0], y=scale[1], z=scale[2]), color=colour,
                        points=points, lifetime=_LIFETIME)
        marker.pose.orientation.w = 1.0
        self._made.append(marker)
        return marker

    def _dots(self, dots: DotTracks, places: np.ndarray, region: ContactRegion) -> None:
        known = np.isfinite(places).all(axis=1)
        places, id, size = places[known], np.asarray(dots.id, np.int64)[known], self._sizes['dot_size']
        points, share = points_of(places), self._depths(places) / self._sizes['full_depth']
        self._add('dots', Marker.SPHERE_LIST, (size, size, size), _STATES[0], points).colors = self._dot_colours(id, share, region)

    def _dot_colours(self, id: np.ndarray, share: np.ndarray, region: ContactRegion) -> list[ColorRGBA]:
        """Colours of the dots id (N,) with relative depths share (N,), by state or by depth."""
        if self._sizes['dot_colour'] == 'depth':
            return [colour_of(rgb) for rgb in colours.of_depth(share).tolist()]
        state = states_of(id, np.asarray(region.dot_id, np.int64), np.asarray(region.dot_state, np.int64))
        return [_STATES[max(s, 0)] for s in state.tolist()]

    def _depths(self, places: np.ndarray) -> np.ndarray:
        """Depths (N,), m, of positions (N, 3), m, below the untouched surface: along z for a sheet, radial for a cap."""
        cap = untouched_cap(self._sizes)
        if cap is None:
            return -places[:, 2]
        return cap.curvature_radius - np.linalg.norm(places - [0.0, 0.0, cap.centre_z], axis=1)

    def _region(self, region: ContactRegion) -> None:
        outlines, holes = rings_of(region)
        for ns, rings, colour in (('outlines', outlines, colours.REGION), ('holes', holes, colours.HOLE)):
            if rings:
                ends = [np.stack([ring, np.roll(ring, -1, axis=0)], axis=1).reshape(-1, 3) for ring in rings]
                lines = np.concatenate(ends) + (0.0, 0.0, _LIFTED)
                self._add(ns, Marker.LINE_LIST, (0.5 * self._sizes['dot_size'], 0.0, 0.0), colour_of(colour), points_of(lines))

    def _arrow(self, ns: str, number: int, ends: np.ndarray, colour: tuple[float, float, float]) -> None:
        if np.isfinite(ends).all() and np.ptp(ends, axis=0).any():
            # A short arrow is thinner, so that it keeps its shaft; RViz would make it all head.
            size = min(self._sizes['dot_size'], 0.2 * float(np.linalg.norm(ends[1] - ends[0])))
            self._add(ns, Marker.ARROW, (0.6 * size, 1.5 * size, 2.0 * size), colour_of(colour), points_of(ends), number)

    def _contacts(self, contacts: Contacts) -> None:
        for contact in contacts.contacts:
            place, normal = _array([contact.position])[0], _array([contact.normal])[0]
            self._arrow('normals', contact.id, np.stack([place, place + self._sizes['normal_length'] * normal]), colours.CONTACT)
            self._covariance(contact.id, place, np.asarray(contact.position_covariance).reshape(3, 3))

    def _covariance(self, number: int, place: np.ndarray, covariance: np.ndarray) -> None:
        """Draw the ellipsoid that holds the contact position with 95 % probability."""
        if not (np.isfinite(covariance).all() and np.isfinite(place).all() and covariance.any()):
            return
        variances, axes = np.linalg.eigh(0.5 * (covariance + covariance.T))
        axes[:, 0] *= np.sign(np.linalg.det(axes))
        across = 2 * _WITHIN_95 * np.sqrt(np.maximum(variances, 0.0)).clip(_THINNEST)
        marker = self._add('covariances', Marker.SPHERE, tuple(across.tolist()), colour_of(colours.CONTACT, 0.5), [], number)
        marker.pose.position = points_of(place[None])[0]
        from scipy.spatial.transform import Rotation  # imported only when markers are drawn
        orientation = Rotation.from_matrix(axes).as_quat().tolist()
        marker.pose.orientation = Quaternion(x=orientation[0], y=orientation[1], z=orientation[2], w=orientation[3])

    def _wrench(self, wrench, region: ContactRegion) -> None:
        """Draw the force as an arrow towards the region's centroid, and the torque as one at the frame's origin.

        The force's tip ends normal_length before the centroid, so that it does not hide the contact. Unknown vectors are not drawn.
        """
        if not region.outlines:
            return
        force = self._arrow_of(_array([wrench.force])[0], self._sizes['full_force'])
        torque = self._arrow_of(_array([wrench.torque])[0], self._sizes['full_torque'])
        away = -force / max(float(np.linalg.norm(force)), 1e-12)
        tip = _array([region.centroid])[0] + self._sizes['normal_length'] * away
        self._arrow('force', 0, np.stack([tip - force, tip]), colours.FORCE)
        self._arrow('torque', 0, np.stack([np.zeros(3), torque]), colours.TORQUE)

    def _arrow_of(self, vector: np.ndarray, full: float) -> np.ndarray:
        """Arrow (3,), m, of a vector (3,): proportional up to the magnitude full, force_length long from there on."""
        share = float(np.linalg.norm(vector)) / full
        return vector * (self._sizes['force_length'] / full / max(1.0, share))

    def _slip(self, slip: Slip, region: ContactRegion) -> None:
        centre = _array([slip.rotation_center])[0]
        if slip.state != Slip.NONE and np.isfinite(centre[:2]).all():
            centre[2] = centre[2] if np.isfinite(centre[2]) else region.centroid.z
            size = 2.0 * self._sizes['dot_size']
            self._add('slip_center', Marker.SPHERE_LIST, (size, size, size), _STATES[2], points_of(centre[None]))
