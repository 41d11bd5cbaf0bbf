# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""RViz markers of a taxel array: cells coloured by value, outlines, axes, normals, flow, slip and wrench."""
from __future__ import annotations

import math
from collections.abc import Mapping

import cv2
import numpy as np
from geometry_msgs.msg import Point, Vector3, Wrench
from sensor_msgs.msg import Image
from std_msgs.msg import ColorRGBA, Header
from tactile_driver.nodes.messages.images import grey_to_array
from tactile_msgs.msg import ContactRegion, Slip
from visualization_msgs.msg import Marker, MarkerArray

from .. import colours
from .messages import MarkerSet, points_of, rings_of

_MOST_ARROWS = 200  # chosen
_TONES = 64  # steps of the cells' colours, chosen: finer than the eye resolves
_FAINT = 0.025  # of the full value, chosen: a fainter cell is drawn as untouched
_MOST_CELLS = 400  # chosen: 4 ms a message
_UNDER = 1e-4  # m, chosen: from the outlines down to the cells, and from these to the plate of the untouched ones
_SHARED = ('normal_length', 'force_length', 'full_force', 'full_torque')


def _colour(rgb, opacity: float = 1.0) -> ColorRGBA:
    return ColorRGBA(r=float(rgb[0]), g=float(rgb[1]), b=float(rgb[2]), a=opacity)


def _known(wrench: Wrench) -> Wrench:
    """The wrench with unknown (NaN) components set to zero, so that the known ones can be drawn."""
    parts = {name: {axis: float(np.nan_to_num(getattr(getattr(wrench, name), axis))) for axis in 'xyz'} for name in ('force', 'torque')}
    return Wrench(force=Vector3(**parts['force']), torque=Vector3(**parts['torque']))


class TaxelMarkers(MarkerSet):
    """Markers of an array; sizes: pitch, cell_height, normal_length, force_length (m), full_value, full_force (N), full_torque (N m),
    flow_scale (s).
    """

    def __init__(self, sizes: Mapping):
        super().__init__({'dot_size': sizes['pitch'], **{name: sizes[name] for name in _SHARED}})
        self._array_sizes = sizes
        self._tones = [_colour(rgb) for rgb in colours.of_depth(np.linspace(0.0, 1.0, _TONES)).tolist()]
        self._shape: tuple[int, ...] = ()  # of the array
        self._squares: dict[tuple, list[list[Point]]] = {}  # by shape of the array and number of parts

    def frame(self, header: Header, found: Mapping) -> MarkerArray:
        """Markers for messages by topic (image_raw, contact_region, contacts, slip, wrench; any may be missing) under their header."""
        self._header, self._made = header, []
        region = found.get('contact_region') or ContactRegion()
        if found.get('image_raw') is not None:
            self._cells(found['image_raw'])
        if region.outlines:
            self._lines(region)
        if found.get('contacts') is not None:
            self._contacts(found['contacts'])
        if found.get('wrench') is not None:
            self._wrench(_known(found['wrench'].wrench), region)
        if found.get('slip') is not None and region.outlines:
            self._flow(found['slip'])
            self._slip(found['slip'], region)
        return self._array(found, 0.5 * self._array_sizes['pitch'] * np.array(self._shape[::-1] or (0, 0)))

    def _cells(self, image: Image) -> None:
        """Draw the array as a plate and each pressed taxel as a square on it, just under the surface, where the outlines lie.

        Triangles, because RViz darkens the upper side of cubes; and few, because rclpy converts each point: of many pressed taxels, blocks.
        """
        values = grey_to_array(image, 'taxel image').astype(np.float32)
        self._shape, full = values.shape, self._array_sizes['full_value']
        side = math.ceil(math.sqrt(np.count_nonzero(values > _FAINT * full) / _MOST_CELLS))
        if side > 1:
            values = cv2.resize(values, tuple(max(1, count // side) for count in self._shape[::-1]), interpolation=cv2.INTER_AREA)
        tone = np.clip(np.round((_TONES - 1) * values.ravel() / full), 0, _TONES - 1).astype(int)
        squares = self._squares_of(values.shape)
        cells = [(squares[k], tone[k]) for k in np.flatnonzero(values.ravel() > _FAINT * full).tolist()]
        for ns, shown in (('plate', [(self._squares_of((1, 1), -2 * _UNDER)[0], 0)]), ('cells', cells)):
            if shown:
                corners = [point for square, _ in shown for point in square]
                marker = self._add(ns, Marker.TRIANGLE_LIST, (1.0, 1.0, 1.0), _colour(colours.TEXT), corners)
                marker.colors = [self._tones[k] for _, k in shown for _ in range(2)]  # one a triangle, which RViz does not light

    def _squares_of(self, parts: tuple[int, int], height: float = -_UNDER) -> list[list[Point]]:
        """Corners of two triangles for each of parts (rows, columns) of the array, at a height, m; made once."""
        key = self._shape, parts
        if key not in self._squares:
            size = self._array_sizes['pitch'] * np.array(self._shape[::-1]) / parts[::-1]
            row, column = (index.ravel() for index in np.indices(parts))
            centres = np.column_stack([column, row]) - 0.5 * (np.array(parts[::-1]) - 1)
            corners = size * (centres[:, None] + 0.5 * np.array([(-1, -1), (1, -1), (1, 1), (-1, -1), (1, 1), (-1, 1)]))
            self._squares[key] = [points_of(square) for square in np.dstack([corners, np.full(corners.shape[:2], height)])]
        return self._squares[key]

    def _lines(self, region: ContactRegion) -> None:
        """Draw outlines, holes and principal axes of the region."""
        width = 0.3 * self._array_sizes['pitch']
        for ns, rings, colour in zip(('outlines', 'holes'), rings_of(region), (colours.REGION, colours.HOLE)):
            if rings:
                ends = [np.stack([ring, np.roll(ring, -1, axis=0)], axis=1).reshape(-1, 3) for ring in rings]
                self._add(ns, Marker.LINE_LIST, (width, 0.0, 0.0), _colour(colour), points_of(np.concatenate(ends)))
        middle = np.array([region.centroid.x, region.centroid.y, region.centroid.z])
        if np.isfinite(region.orientation):
            along = np.array([np.cos(region.orientation), np.sin(region.orientation), 0.0])
            across = np.array([-along[1], along[0], 0.0])
            ends = [middle + side * 0.5 * length * axis for axis, length in ((along, region.major_axis), (across, region.minor_axis))
                    for side in (-1, 1)]
            self._add('axes', Marker.LINE_LIST, (width, 0.0, 0.0), _colour(colours.CONTACT), points_of(np.array(ends)))

    def _flow(self, slip: Slip) -> None:
        """Draw the slip velocity at each slipping point as a line."""
        size, scale = self._array_sizes['pitch'], self._array_sizes['flow_scale']
        at = np.column_stack([slip.x, slip.y, np.zeros(len(slip.x))]).astype(float)
        by = np.column_stack([slip.vx, slip.vy, np.zeros(len(slip.vx))]).astype(float)
        known = np.flatnonzero(np.isfinite(by).all(axis=1))
        known = known[::1 + len(known) // _MOST_ARROWS]
        if len(known):
            ends = np.stack([at[known], at[known] + scale * by[known]], axis=1).reshape(-1, 3)
            self._add('flow', Marker.LINE_LIST, (0.15 * size, 0.0, 0.0), _colour(colours.ARROW), points_of(ends))
