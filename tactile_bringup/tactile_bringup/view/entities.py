# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Serialised messages of sensors, live or recorded, as Rerun entities. An entity has the path of its topic."""
from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
import rerun as rr

from tactile_driver.errors import TactileError
from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.recordings.reader import RawMessage
from tactile_driver.recordings.serialization import decode, header_stamp_ns
from tactile_perception.common.surface_points import UNKNOWN

from ..visualization import pictures as colours
from ..visualization.constants import COLOURS, DRAWING
from ..visualization.pictures import array_of
from .constants import VIEW

_JPEG = [cv2.IMWRITE_JPEG_QUALITY, 80]
_DOT = rr.Radius.ui_points(3.0)
_LINE = rr.Radius.ui_points(2.0)
_STATE_COLOURS = np.array([*COLOURS.states, COLOURS.text])  # by state; the last one: unknown
_CONTACT = 64, 112, 224  # also of its label: legible on the light and on the dark theme
_LEVELS = (rr.TextLogLevel.INFO, rr.TextLogLevel.WARN, rr.TextLogLevel.ERROR, rr.TextLogLevel.ERROR)


def namespace_of(topic: str) -> str:
    """'/thumb' of '/thumb/contacts'."""
    return topic.rpartition('/')[0]


def _colours_of(states: np.ndarray) -> np.ndarray:
    return (255 * _STATE_COLOURS[np.minimum(states, len(_STATE_COLOURS) - 1)]).astype(np.uint8)


def _rgb(colour: tuple) -> tuple:
    return tuple(round(255 * part) for part in colour)


class Entities:
    """Logs messages to a Rerun recording.

    Parameters
    ----------
    stream : rerun.RecordingStream
        Where they are logged.
    rate : float
        How many images and surfaces are drawn per second of a topic's stamps at most; numbers are plotted for every message. 0: all.
    """

    def __init__(self, stream: rr.RecordingStream, rate: float):
        self._stream, self._rate = stream, rate
        self.topics: set[str] = set()  # that will come, as far as they are known
        self._drawn: dict[str, int] = {}  # topic -> number of the interval that was drawn
        self._frames: set[str] = set()  # entities whose coordinate frame was logged
        self._states: dict[str, tuple] = {}  # namespace -> stamp, ids and states of its last region
        self._dots: dict[str, object] = {}  # namespace -> dots that wait for their states
        self._centre: dict[str, np.ndarray] = {}  # namespace -> centroid of its last region, m
        self._half: dict[str, float] = {}  # namespace -> half width of the sensor, m
        self._largest: dict[str, float] = {}  # entity -> largest value so far, to which others are in proportion
        self._said: dict[str, str] = {}  # node -> its last message on /diagnostics
        self.refused = 0

    def add(self, message: RawMessage) -> None:
        """Log one message; one that is damaged is counted in `refused`."""
        kind = _KINDS[message.type_name]
        is_drawn = message.type_name in _HEADLESS or self._is_due(message.topic, header_stamp_ns(message.data))
        if not is_drawn and message.type_name in _HEAVY:
            return
        try:
            decoded = decode(message.data, message.type_name)
            if message.type_name not in _HEADLESS:
                stamp_ns = header_stamp_ns(message.data)
                self._stream.set_time('time', timestamp=1e-9 * stamp_ns)
                if message.type_name == 'tactile_msgs/msg/Contacts':
                    self._plot(namespace_of(message.topic) + '/latency', 1e-6 * (message.stamp_ns - stamp_ns))
            kind(self, message.topic, decoded, is_drawn)
        except (TactileError, ValueError, cv2.error):
            self.refused += 1

    def _is_due(self, topic: str, stamp_ns: int) -> bool:
        interval = int(1e-9 * stamp_ns * self._rate) if self._rate else stamp_ns
        is_due = interval != self._drawn.get(topic)
        self._drawn[topic] = interval
        return is_due

    def _plot(self, path: str, values) -> None:
        self._stream.log(path, rr.Scalars(values))

    def _draw(self, path: str, frame: str, what) -> None:
        """Log something three-dimensional in a frame of ROS."""
        if path not in self._frames:
            self._frames.add(path)
            self._stream.log(path, rr.CoordinateFrame(frame), static=True)
        self._stream.log(path, what)

    def _scaled(self, path: str, vector: np.ndarray) -> np.ndarray:
        """An arrow for a vector: the longest one so far is as long as the sensor is half wide."""
        length = float(np.linalg.norm(vector))
        self._largest[path] = max(self._largest.get(path, 1e-9), length)
        return vector * self._half.get(namespace_of(path), 0.02) / self._largest[path]

    def _image(self, topic: str, message, _is_drawn: bool) -> None:
        picture = image_to_array(message)
        if picture.ndim == 2 and max(picture.shape) <= VIEW.max_array_side:
            full = self._largest[topic] = max(self._largest.get(topic, 1.0), float(picture.max()))
            shown = colours.of_depth(picture.ravel() / full).reshape(*picture.shape, 3)
            what = rr.Image((255 * shown).astype(np.uint8), 'RGB')
        else:
            what = rr.EncodedImage(contents=cv2.imencode('.jpg', picture, _JPEG)[1].tobytes(), media_type='image/jpeg')
        self._stream.log(topic, what)

    def _compressed(self, topic: str, message, _is_drawn: bool) -> None:
        media = 'image/png' if 'png' in message.format else 'image/jpeg'
        self._stream.log(topic, rr.EncodedImage(contents=bytes(message.data), media_type=media))

    def _take_dots(self, topic: str, message, _is_drawn: bool) -> None:
        space = namespace_of(topic)
        if space + '/contact_region' in self.topics and self._states.get(space, (None,))[0] != message.header.stamp:
            self._dots[space] = message  # drawn with their states, which come in the next message
        else:
            self._draw_dots(space, message)

    def _draw_dots(self, space: str, message) -> None:
        _, ids, states = self._states.get(space, (None, np.zeros(0, int), np.zeros(0, int)))
        known = np.full(max(np.max(ids, initial=0), np.max(message.id, initial=0)) + 1, len(_STATE_COLOURS) - 1)
        known[ids] = states
        shades = _colours_of(known[np.asarray(message.id, int)])
        self._stream.log(space + '/image_raw/dots', rr.Points2D(np.column_stack([message.u, message.v]), colors=shades, radii=_DOT))
        if len(message.x) and space + '/points' not in self.topics:
            self._surface(space + '/dots', message.header, np.column_stack([message.x, message.y, message.z]), shades)

    def _points(self, topic: str, message, _is_drawn: bool) -> None:
        rows = np.frombuffer(message.data, np.uint8).reshape(-1, message.point_step)
        offset = {field.name: field.offset for field in message.fields}
        states = rows[:, offset['state']] if 'state' in offset else np.full(len(rows), UNKNOWN)
        self._surface(topic, message.header, rows[:, :12].copy().view(np.float32), _colours_of(states))

    def _surface(self, path: str, header, positions: np.ndarray, shades: np.ndarray) -> None:
        known = np.isfinite(positions).all(axis=1)
        if known.any():
            space = namespace_of(path)
            self._half[space] = max(self._half.get(space, 0.0), float(np.abs(positions[known, :2]).max()))
        self._draw(path, header.frame_id, rr.Points3D(positions[known], colors=shades[known], radii=_DOT))

    def _region(self, topic: str, message, _is_drawn: bool) -> None:
        space = namespace_of(topic)
        self._states[space] = message.header.stamp, np.asarray(message.dot_id, int), np.asarray(message.dot_state, int)
        waiting = self._dots.pop(space, None)
        if waiting is not None and waiting.header.stamp == message.header.stamp:
            self._draw_dots(space, waiting)
        self._centre[space] = array_of([message.centroid])[0] if message.outlines else np.zeros(3)
        rings = [array_of([*ring.points, ring.points[0]]) for ring in (*message.outlines, *message.holes) if ring.points]
        shades = [_rgb(COLOURS.region)] * len(message.outlines) + [_rgb(COLOURS.hole)] * len(message.holes)
        self._draw(topic, message.header.frame_id, rr.LineStrips3D(rings, colors=shades[:len(rings)], radii=_LINE))

    def _contacts(self, topic: str, message, is_drawn: bool) -> None:
        found, space = message.contacts, namespace_of(topic)
        self._plot(space + '/depth', 1e3 * max((contact.depth for contact in found), default=0.0))
        self._plot(space + '/force', sum(contact.force for contact in found))
        if not is_drawn:
            return
        positions = array_of(contact.position for contact in found)
        frame = message.header.frame_id
        self._draw(topic, frame, rr.Points3D(positions, colors=_CONTACT, radii=_DOT,
                                             labels=[f'{1e3 * c.depth:.1f} mm, {c.force:.2f} N'.replace('nan', '-') for c in found]))
        normals = 0.5 * self._half.get(space, 0.02) * array_of(contact.normal for contact in found)
        self._draw(topic + '/normals', frame, rr.Arrows3D(origins=positions, vectors=normals, colors=_CONTACT, radii=_LINE))
        axes = [_ellipsoid(np.reshape(contact.position_covariance, (3, 3))) for contact in found]
        known = [k for k, axis in enumerate(axes) if axis is not None]
        self._draw(topic + '/covariance', frame, rr.Ellipsoids3D(
            centers=positions[known], half_sizes=np.reshape([axes[k][0] for k in known], (-1, 3)),
            quaternions=np.reshape([axes[k][1] for k in known], (-1, 4)), colors=[(*_rgb(COLOURS.region), 120)] * len(known)))

    def _wrench(self, topic: str, message, is_drawn: bool) -> None:
        force, torque = array_of([message.wrench.force, message.wrench.torque])
        self._plot(topic + '/force', force)
        if not is_drawn:
            return
        for name, vector, colour in (('arrow', force, COLOURS.force), ('torque', torque, COLOURS.torque)):
            arrow = self._scaled(f'{topic}_{name}', np.nan_to_num(vector))
            origin = self._centre.get(namespace_of(topic), np.zeros(3)) - arrow if name == 'arrow' else np.zeros(3)
            self._draw(f'{topic}/{name}', message.header.frame_id, rr.Arrows3D(
                origins=[origin], vectors=[arrow], colors=_rgb(colour), radii=_LINE))

    def _slip(self, topic: str, message, is_drawn: bool) -> None:
        self._plot(topic + '/fraction', message.slipping_fraction)
        self._plot(topic + '/state', float(message.state))
        if not is_drawn:
            return
        height = self._centre.get(namespace_of(topic), np.zeros(3))[2]
        starts = np.column_stack([message.x, message.y, np.full(len(message.x), height)])
        flow = np.column_stack([message.vx, message.vy, np.zeros(len(message.x))])
        known = np.isfinite(flow).all(axis=1) & flow.any(axis=1) if len(flow) else np.zeros(0, bool)
        largest = self._largest[topic] = max(self._largest.get(topic, 1e-9), float(np.linalg.norm(flow[known], axis=1).max(initial=0.0)))
        self._draw(topic, message.header.frame_id, rr.Arrows3D(
            origins=starts[known], vectors=0.3 * self._half.get(namespace_of(topic), 0.02) * flow[known] / largest,
            colors=_rgb(COLOURS.arrow), radii=rr.Radius.ui_points(1.0)))

    def _voltages(self, topic: str, message, is_drawn: bool) -> None:
        if is_drawn:
            self._plot(topic, np.reshape(message.voltages, (-1, 4)).mean(axis=0))

    def _diagnostics(self, topic: str, message, _is_drawn: bool) -> None:
        stamp = message.header.stamp
        self._stream.set_time('time', timestamp=stamp.sec + 1e-9 * stamp.nanosec)
        for status in message.status:
            if self._said.get(status.name) != status.message:
                self._said[status.name] = status.message
                level = _LEVELS[min(status.level[0], len(_LEVELS) - 1)]
                self._stream.log(topic, rr.TextLog(f'{status.name}: {status.message}', level=level))

    def _transforms(self, topic: str, message, _is_drawn: bool) -> None:
        for each in message.transforms:
            at, turn, stamp = each.transform.translation, each.transform.rotation, each.header.stamp
            what = rr.Transform3D(translation=(at.x, at.y, at.z), quaternion=(turn.x, turn.y, turn.z, turn.w),
                                  parent_frame=each.header.frame_id, child_frame=each.child_frame_id)
            is_static = topic.endswith('/tf_static')
            if not is_static:
                self._stream.set_time('time', timestamp=stamp.sec + 1e-9 * stamp.nanosec)
            self._stream.log(f'/tf/{each.child_frame_id}', what, static=is_static)


def _ellipsoid(covariance: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Half axes (3,), m, and quaternion (4,) of the ellipsoid that holds a position with 95 % probability; None where it is unknown."""
    if not np.isfinite(covariance).all() or not covariance.any():
        return None
    from scipy.spatial.transform import Rotation
    variances, axes = np.linalg.eigh(0.5 * (covariance + covariance.T))
    axes[:, 0] *= np.sign(np.linalg.det(axes))
    return DRAWING.sigmas_95 * np.sqrt(np.maximum(variances, 0.0)), Rotation.from_matrix(axes).as_quat()


_KINDS: dict[str, Callable] = {
    'sensor_msgs/msg/Image': Entities._image,
    'sensor_msgs/msg/CompressedImage': Entities._compressed,
    'sensor_msgs/msg/PointCloud2': Entities._points,
    'tactile_msgs/msg/DotTracks': Entities._take_dots,
    'tactile_msgs/msg/ContactRegion': Entities._region,
    'tactile_msgs/msg/Contacts': Entities._contacts,
    'tactile_msgs/msg/Slip': Entities._slip,
    'tactile_msgs/msg/PsdVoltages': Entities._voltages,
    'geometry_msgs/msg/WrenchStamped': Entities._wrench,
    'diagnostic_msgs/msg/DiagnosticArray': Entities._diagnostics,
    'tf2_msgs/msg/TFMessage': Entities._transforms,
}
_HEAVY = {name for name in _KINDS if name.endswith(('Image', 'PointCloud2', 'DotTracks', 'ContactRegion'))}
_HEADLESS = {'tf2_msgs/msg/TFMessage', 'diagnostic_msgs/msg/DiagnosticArray'}
