# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Results as RViz markers."""
from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence

import numpy as np
from geometry_msgs.msg import Point, Quaternion, Vector3
from rclpy.duration import Duration
from sensor_msgs.msg import Image, PointCloud2
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from tactile_driver.nodes.messages.conversions import point
from tactile_driver.nodes.messages.images import grey_to_array
from tactile_msgs.msg import ContactRegion, Contacts, Slip
from tactile_perception.common.geometry import Cap

from . import pictures as colours
from .constants import COLOURS, DRAWING
from .pictures import array_of, states_of, touch_words

_LIFETIME = Duration(seconds=DRAWING.marker_s).to_msg()
_SLIP_COLOURS = {Slip.NONE: COLOURS.text, Slip.INCIPIENT: COLOURS.region, Slip.GROSS: COLOURS.states[2]}
_TWO_TRIANGLES = 0.5 * np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, -1, 0), (1, 1, 0), (-1, 1, 0)])  # a square of width 1


def _colour(rgb: Sequence[float], opacity: float = 1.0) -> ColorRGBA:
    """A colour (r, g, b), 0 to 1, as a message."""
    return ColorRGBA(r=rgb[0], g=rgb[1], b=rgb[2], a=opacity)


_STATES = [_colour(rgb) for rgb in COLOURS.states]


def _known(vector) -> np.ndarray:
    """(3,) of a message, unknown components as 0, so that the known ones can be drawn."""
    return np.nan_to_num(array_of([vector])[0])


def positions_of(cloud: PointCloud2) -> np.ndarray:
    """(N, 3), m, of a cloud whose points begin with x, y and z, as ours do."""
    rows = np.frombuffer(cloud.data, np.uint8).reshape(-1, cloud.point_step)
    return rows[:, :12].copy().view(np.float32).astype(float)


def forces_of(cloud: PointCloud2) -> tuple[np.ndarray, np.ndarray]:
    """Forces (N, 3) and pressing forces (N,), N, NaN where unknown, of a cloud as all sensors publish it."""
    offset = next(field.offset for field in cloud.fields if field.name == 'force_x')
    rows = np.frombuffer(cloud.data, np.uint8).reshape(-1, cloud.point_step)[:, offset:offset + 16].copy().view(np.float32).astype(float)
    return rows[:, :3], rows[:, 3]


class MarkerSet:
    """Makes the markers of each frame. Subclasses draw the surface of their sensor.

    Each array first deletes all markers, so that arrays that were lost do not matter; RViz draws an array in one step.
    RViz removes markers DRAWING.marker_s after the last array.

    Parameters
    ----------
    sizes : mapping
        text.height (m; 0: proportional to the sensor), text.side, text.up (3 numbers each), normal_length (m), and with a wrench
        force_length (m), full_force (N), full_torque (N m).
    size : float
        Length in m to which the widths of lines and arrows are proportional.

    Attributes
    ----------
    warning : str
        Text shown beside the sensor; '' for none.
    """

    def __init__(self, sizes: Mapping, size: float):
        self._sizes, self._size = sizes, size
        self._made: list[Marker] = []
        self._header = Header()
        self._seen = np.zeros(3)  # m, maximum half widths and height of the sensor so far
        self.warning = ''

    def frame(self, header: Header, found: Mapping) -> MarkerArray:
        """Markers of the messages of one frame, which have the given header.

        found: messages by topic (dots, image_raw of an array, contact_region, contacts, slip, wrench); any may be missing."""
        self._header, self._made = header, []
        region, contacts = found.get('contact_region') or ContactRegion(), (found.get('contacts') or Contacts()).contacts
        self._seen = np.maximum(self._seen, self._surface(found, region))
        self._outline(region)
        self._contacts(contacts, region)
        if 'wrench' in found and region.outlines and found['wrench'].header.frame_id in ('', header.frame_id):  # same origin
            self._wrench(found['wrench'].wrench, region)
        if 'slip' in found:
            self._slip(found['slip'], region)
        touched = region.outlines or contacts
        state = found['slip'].state if touched and 'slip' in found else Slip.NONE
        self._text('text', [header.frame_id, *(self._words(found) if touched else [])], self._text_position(), _SLIP_COLOURS[state])
        return self._all()

    def alone(self, header: Header) -> MarkerArray:
        """The warning alone."""
        self._header, self._made = header, []
        return self._all()

    def _surface(self, found: Mapping, region: ContactRegion) -> np.ndarray:
        """Draw the sensor's surface; return its half widths and height (3,), m."""
        raise NotImplementedError

    def _all(self) -> MarkerArray:
        if self.warning:
            letters, lines = DRAWING.hand_warning_size if self._in_hand else DRAWING.warning_size
            lines = textwrap.wrap(self.warning, letters, max_lines=lines, placeholder=' ...')
            height = np.max(np.multiply(DRAWING.warning_height, (self._half.max(), self._seen[2])))
            above = np.array([*-self._half, height]) - self._line_step * (len(lines) - 1)
            self._text('warning', lines, self._text_position() + 2 * self._line_step if self._in_hand else above, COLOURS.region)
        return MarkerArray(markers=[Marker(header=self._header, action=Marker.DELETEALL), *self._made])

    @property
    def _half(self) -> np.ndarray:
        """Half widths (2,), m, of the sensor, which determine the positions of texts."""
        return np.maximum(self._seen[:2], DRAWING.min_half_width * self._size)

    @property
    def _in_hand(self) -> bool:
        """Whether letter height and position of the text are set for the view of a hand."""
        return self._sizes['text.height'] > 0

    def _words(self, found: Mapping) -> list[str]:
        """Lines about the contact; on a hand a single line, whose colour shows the slip."""
        if not self._in_hand:
            return touch_words(found)
        words = touch_words({topic: message for topic, message in found.items() if topic != 'slip'})
        return [', '.join(words).replace(' deep', '')] if words else []

    @property
    def _letter_height(self) -> float:
        """m."""
        return self._sizes['text.height'] or DRAWING.letter_share * float(self._half.max())

    @property
    def _line_step(self) -> np.ndarray:
        """(3,), m, from one line to the next."""
        return -DRAWING.line_pitch * self._letter_height * np.array(self._sizes['text.up'], float)

    def _text_position(self) -> np.ndarray:
        """Position (3,), m, of the middle of the text's first line, beside the sensor on its side text.side."""
        side = np.array(self._sizes['text.side'], float)
        edge = side * [*self._half, self._half.max()]
        if self._in_hand:  # three lines must not overlap the sensor
            return edge + DRAWING.hand_text_gap * self._letter_height * side - self._line_step
        return edge + self._line_step

    def _text(self, ns: str, lines: Sequence[str], first: np.ndarray, colour: Sequence[float]) -> None:
        """Write one marker a line, the first one at (3,), m."""
        height = self._letter_height
        for number, line in enumerate(lines):
            # scale.x is the width of a space, which RViz otherwise takes from letters 1 m high.
            marker = self._add(ns, Marker.TEXT_VIEW_FACING, (0.5 * height, 0.0, height), _colour(colour), number=number)
            marker.pose.position = point(first + number * self._line_step)
            marker.text = line

    def _add(self, ns: str, kind: int, scale: Sequence[float], colour: ColorRGBA, points: np.ndarray | None = None,
             number: int = 0) -> Marker:
        marker = Marker(header=self._header, ns=ns, id=number, type=kind, scale=Vector3(x=scale[0], y=scale[1], z=scale[2]), color=colour,
                        points=[] if points is None else [Point(x=x, y=y, z=z) for x, y, z in points.tolist()], lifetime=_LIFETIME)
        marker.pose.orientation.w = 1.0
        self._made.append(marker)
        return marker

    def _outline(self, region: ContactRegion) -> None:
        for ns, rings, colour in (('outlines', region.outlines, COLOURS.region), ('holes', region.holes, COLOURS.hole)):
            rings = [array_of(polygon.points) for polygon in rings]
            if rings:
                ends = [np.stack([ring, np.roll(ring, -1, axis=0)], axis=1).reshape(-1, 3) for ring in rings]
                ends = np.concatenate(ends) + (0.0, 0.0, DRAWING.outline_height)
                self._add(ns, Marker.LINE_LIST, (0.5 * self._size, 0.0, 0.0), _colour(colour), ends)

    def _arrow(self, ns: str, number: int, ends: np.ndarray, colour: Sequence[float]) -> None:
        if np.isfinite(ends).all() and np.ptp(ends, axis=0).any():
            # A short arrow is thinner; otherwise RViz draws its head only.
            size = min(self._size, 0.2 * float(np.linalg.norm(ends[1] - ends[0])))
            self._add(ns, Marker.ARROW, (0.6 * size, 1.5 * size, 2.0 * size), _colour(colour), ends, number)

    def _contacts(self, contacts: Sequence, region: ContactRegion) -> None:
        for contact in contacts:
            position, normal = array_of([contact.position, contact.normal])
            foot = self._foot(position, region)
            self._arrow('normals', contact.id, np.stack([foot, foot + self._sizes['normal_length'] * normal]), COLOURS.contact)
            self._covariance(contact.id, position, np.asarray(contact.position_covariance).reshape(3, 3))

    def _foot(self, position: np.ndarray, _region: ContactRegion) -> np.ndarray:
        """Start (3,), m, of the normal arrow of a contact at a position (3,), m."""
        return position

    def _covariance(self, number: int, position: np.ndarray, covariance: np.ndarray) -> None:
        """Draw the ellipsoid that holds the contact position with 95 % probability."""
        if not (np.isfinite(covariance).all() and np.isfinite(position).all() and covariance.any()):
            return
        from scipy.spatial.transform import Rotation  # imported only when markers are drawn
        variances, axes = np.linalg.eigh(0.5 * (covariance + covariance.T))
        axes[:, 0] *= np.sign(np.linalg.det(axes))
        diameters = 2 * DRAWING.sigmas_95 * np.sqrt(np.maximum(variances, 0.0)).clip(DRAWING.min_diameter)
        marker = self._add('covariances', Marker.SPHERE, diameters.tolist(), _colour(COLOURS.contact, 0.5), number=number)
        marker.pose.position = point(position)
        marker.pose.orientation = Quaternion(**dict(zip('xyzw', Rotation.from_matrix(axes).as_quat().tolist())))

    def _wrench(self, wrench, region: ContactRegion) -> None:
        """Draw the force as an arrow towards the region's centroid, and the torque as one at the frame's origin.

        The force's tip ends normal_length before the centroid, so that it does not hide the contact.
        """
        force, torque = self._scaled(_known(wrench.force), 'full_force'), self._scaled(_known(wrench.torque), 'full_torque')
        direction = -force / max(float(np.linalg.norm(force)), 1e-12)
        tip = array_of([region.centroid])[0] + self._sizes['normal_length'] * direction
        self._arrow('force', 0, np.stack([tip - force, tip]), COLOURS.force)
        self._arrow('torque', 0, np.stack([np.zeros(3), torque]), COLOURS.torque)

    def _scaled(self, vector: np.ndarray, full: str) -> np.ndarray:
        """Arrow (3,), m, of a vector (3,): force_length long at the magnitude of the parameter full, proportional below, constant above."""
        return vector * (self._sizes['force_length'] / max(self._sizes[full], float(np.linalg.norm(vector))))

    def _slip(self, slip: Slip, region: ContactRegion) -> None:
        centre = array_of([slip.rotation_center])
        if slip.state != Slip.NONE and np.isfinite(centre[0, :2]).all():
            centre[0, 2] = centre[0, 2] if np.isfinite(centre[0, 2]) else region.centroid.z
            self._add('slip_center', Marker.SPHERE_LIST, [2.0 * self._size] * 3, _STATES[2], centre)


class DotMarkers(MarkerSet):
    """Markers of a sensor with dots. Further sizes: dot_size (m), dot_colour, full_depth (m), and for the undeformed surface sensor_type,
    cap.curvature_radius, cap.height, dome.rim_radius, dome.height (m)."""

    def __init__(self, sizes: Mapping):
        super().__init__(sizes, sizes['dot_size'])

    def _surface(self, found: Mapping, region: ContactRegion) -> np.ndarray:
        dots = found.get('dots')
        if dots is None or not (len(dots.x) or 'points' in found):
            return np.zeros(3)
        positions = np.column_stack([dots.x, dots.y, dots.z]).astype(float) if len(dots.x) else positions_of(found['points'])
        if len(positions) != len(dots.id):
            return np.zeros(3)
        known = np.isfinite(positions).all(axis=1)
        positions, states = positions[known], np.maximum(states_of(np.asarray(dots.id, np.int64)[known], region), 0)
        marker = self._add('dots', Marker.SPHERE_LIST, [self._size] * 3, _STATES[0], positions)
        if self._sizes['dot_colour'] == 'depth':
            relative = self._depths(positions) / self._sizes['full_depth']
            marker.colors = [_colour(rgb) for rgb in colours.of_depth(relative).tolist()]
        else:
            marker.colors = [_STATES[state] for state in states.tolist()]
        return np.append(np.abs(positions[:, :2]).max(axis=0, initial=0.0), positions[:, 2].max(initial=0.0))

    def _foot(self, position: np.ndarray, region: ContactRegion) -> np.ndarray:
        """See MarkerSet. On a dome the middle of the nearest outline, since its flank may touch beside the object's lowest point."""
        if self._sizes['dome.height'] <= 0 or not region.outlines:
            return position
        middles = np.stack([array_of(outline.points).mean(axis=0) for outline in region.outlines])
        return middles[np.argmin(np.linalg.norm(middles - position, axis=1))]

    def _depths(self, positions: np.ndarray) -> np.ndarray:
        """Depths (N,), m, of positions (N, 3), m, below the undeformed surface: along z for a sheet, radial for a cap."""
        rim, height = self._sizes['dome.rim_radius'], self._sizes['dome.height']
        if self._sizes['sensor_type'] == 'touchpad':
            cap = Cap(self._sizes['cap.curvature_radius'], self._sizes['cap.height'])
        elif min(rim, height) > 0:
            cap = Cap((rim**2 + height**2) / (2 * height), height)
        else:
            return -positions[:, 2]
        return cap.curvature_radius - np.linalg.norm(positions - [0.0, 0.0, cap.centre_z], axis=1)


class SurfaceMarkers(MarkerSet):
    """Markers of a gel whose whole surface is measured. Further sizes: dot_size (m), full_depth (m)."""

    def __init__(self, sizes: Mapping):
        super().__init__(sizes, sizes['dot_size'])

    def _surface(self, found: Mapping, region: ContactRegion) -> np.ndarray:
        positions = positions_of(found['points']) if 'points' in found else np.zeros((0, 3))
        marker = self._add('surface', Marker.SPHERE_LIST, [self._size] * 3, _STATES[0], positions)
        marker.colors = [_colour(rgb) for rgb in colours.of_depth(-positions[:, 2] / self._sizes['full_depth']).tolist()]
        return np.append(np.abs(positions[:, :2]).max(axis=0, initial=0.0), 0.0)


class ForceMarkers(MarkerSet):
    """Of taxels that measure force vectors. More sizes: dot_size (m), full_taxel_force (N)."""

    def __init__(self, sizes: Mapping):
        super().__init__(sizes, sizes['dot_size'])

    def _surface(self, found: Mapping, region: ContactRegion) -> np.ndarray:
        if 'points' not in found:
            return np.zeros(3)
        positions, forces, pressed = positions_of(found['points']), *forces_of(found['points'])
        full = self._sizes['full_taxel_force']
        marker = self._add('taxels', Marker.SPHERE_LIST, [self._size] * 3, _STATES[0], positions)
        marker.colors = [_colour(rgb) for rgb in colours.of_depth(np.nan_to_num(pressed) / full).tolist()]
        shown = np.flatnonzero((np.abs(forces) > DRAWING.min_value * full).any(axis=1))
        if len(shown):
            # A line ends on the surface, as if the object pushed with it.
            ends = np.stack([positions[shown] - forces[shown] * (self._sizes['force_length'] / full), positions[shown]], axis=1)
            self._add('forces', Marker.LINE_LIST, (0.3 * self._size, 0.0, 0.0), _colour(COLOURS.arrow), ends.reshape(-1, 3))
        return np.append(np.abs(positions[:, :2]).max(axis=0, initial=0.0), max(positions[:, 2].max(initial=0.0), 0.0))


class FingerMarkers(MarkerSet):
    """Markers of a finger. Further sizes: radius, point_size (m)."""

    def __init__(self, sizes: Mapping):
        super().__init__(sizes, 0.5 * sizes['point_size'])

    def _surface(self, found: Mapping, region: ContactRegion) -> np.ndarray:
        radius = self._sizes['radius']
        self._add('finger', Marker.SPHERE_LIST, [2 * radius] * 3, _colour(COLOURS.glass, 0.4), np.zeros((1, 3)))  # SPHERE is a coarse mesh
        positions = array_of(contact.position for contact in found['contacts'].contacts)
        positions = positions[np.isfinite(positions).all(axis=1)]
        if len(positions):
            self._add('points', Marker.SPHERE_LIST, [2 * self._size] * 3, _colour((1.0, 0.35, 0.1)), positions)
        return np.full(3, radius)


class TaxelMarkers(MarkerSet):
    """Markers of a taxel array. Further sizes: pitch (m), full_value, flow_scale (s)."""

    def __init__(self, sizes: Mapping):
        super().__init__(sizes, sizes['pitch'])
        self._tones = [_colour(rgb) for rgb in colours.of_depth(np.linspace(0.0, 1.0, DRAWING.tones)).tolist()]

    def _surface(self, found: Mapping, region: ContactRegion) -> np.ndarray:
        if region.outlines and np.isfinite(region.orientation):
            x, y = np.cos(region.orientation), np.sin(region.orientation)
            halves = 0.5 * np.array([[region.major_axis * x, region.major_axis * y, 0], [-region.minor_axis * y, region.minor_axis * x, 0]])
            self._add('axes', Marker.LINE_LIST, (0.5 * self._size, 0.0, 0.0), _colour(COLOURS.contact),
                      array_of([region.centroid]) + np.repeat(halves, 2, axis=0) * [[-1], [1], [-1], [1]])
        if region.outlines and 'slip' in found:
            self._flow(found['slip'])
        return self._cells(found['image_raw']) if 'image_raw' in found else np.zeros(3)

    def _cells(self, image: Image) -> np.ndarray:
        """Draw the array as a plate and each pressed taxel as a square on it, below the outlines; return half widths and height (3,), m."""
        values = grey_to_array(image, 'taxel image').astype(np.float32)
        full, pitch, (rows, columns) = self._sizes['full_value'], self._size, values.shape
        corners = _TWO_TRIANGLES * [columns * pitch, rows * pitch, 0.0] - [0.0, 0.0, 2 * DRAWING.layer]
        plate = self._add('plate', Marker.TRIANGLE_LIST, (1.0, 1.0, 1.0), self._tones[0], corners)
        plate.colors = [self._tones[0]] * len(corners)  # RViz shades a list whose corners have no colours
        row, column = np.nonzero(values > DRAWING.min_value * full)
        if len(row):
            x, y = (column - 0.5 * (columns - 1)) * pitch, (row - 0.5 * (rows - 1)) * pitch
            positions = np.column_stack([x, y, np.full(len(row), -DRAWING.layer)])
            tone = np.clip(np.round((DRAWING.tones - 1) * values[row, column] / full), 0, DRAWING.tones - 1).astype(int)
            corners = (positions[:, None] + pitch * _TWO_TRIANGLES).reshape(-1, 3)
            cells = self._add('cells', Marker.TRIANGLE_LIST, (1.0, 1.0, 1.0), _colour(COLOURS.text), corners)
            cells.colors = [self._tones[k] for k in np.repeat(tone, len(_TWO_TRIANGLES)).tolist()]
        return 0.5 * pitch * np.array([columns, rows, 0])

    def _flow(self, slip: Slip) -> None:
        """Draw the slip velocity at each slipping point as a line."""
        start, velocity = (np.column_stack([x, y, np.zeros(len(x))]).astype(float) for x, y in ((slip.x, slip.y), (slip.vx, slip.vy)))
        known = np.flatnonzero(np.isfinite(velocity).all(axis=1))
        known = known[::1 + len(known) // DRAWING.max_velocity_arrows]
        if len(known):
            ends = np.stack([start[known], start[known] + self._sizes['flow_scale'] * velocity[known]], axis=1).reshape(-1, 3)
            self._add('flow', Marker.LINE_LIST, (0.15 * self._size, 0.0, 0.0), _colour(COLOURS.arrow), ends)
