# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""taxel_markers_node: RViz markers and image_annotated of a taxel array, and the frame of its taxels on /tf_static."""
from __future__ import annotations

import sys
from collections.abc import Mapping

import numpy as np
from geometry_msgs.msg import Vector3, Wrench
from sensor_msgs.msg import Image
from std_msgs.msg import Header
from tactile_driver.nodes.messages.images import grey_to_array
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.nodes.runtime.run import run_node
from tactile_msgs.msg import ContactRegion, Slip
from tactile_perception.nodes.messages.conversions import RESULTS
from visualization_msgs.msg import Marker, MarkerArray

from ..parameters.table import TAXEL_MARKERS_PARAMETERS
from ..visualization import pictures as colours
from ..visualization.markers import SLIP_NAMES, MarkerSet, colour_of, force_word, points_of, rings_of
from ..visualization.pictures import Annotation, annotate
from .drawing_node import DrawingNode

_MOST_ARROWS = 200  # chosen
_TONES = 64  # steps of the cells' colours, chosen: finer than the eye resolves
_FAINT = 0.025  # of the full value, chosen: a fainter cell is drawn as untouched
_UNDER = 1e-4  # m, chosen: from the outlines down to the cells, and from these to the plate of the untouched ones
_SHARED = ('normal_length', 'force_length', 'full_force', 'full_torque')


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
        self._tones = [colour_of(rgb) for rgb in colours.of_depth(np.linspace(0.0, 1.0, _TONES)).tolist()]
        self._shape: tuple[int, ...] = ()  # of the array

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
        if found.get('wrench') is not None and found['wrench'].header.frame_id in ('', header.frame_id):  # else it is at another origin
            self._wrench(_known(found['wrench'].wrench), region)
        if found.get('slip') is not None and region.outlines:
            self._flow(found['slip'])
            self._slip(found['slip'], region)
        return self._array(found, 0.5 * self._array_sizes['pitch'] * np.array(self._shape[::-1] or (0, 0)))

    def _cells(self, image: Image) -> None:
        """Draw the array as a plate and each pressed taxel as a square on it, just under the surface, where the outlines lie."""
        values = grey_to_array(image, 'taxel image').astype(np.float32)
        self._shape, full, pitch = values.shape, self._array_sizes['full_value'], self._array_sizes['pitch']
        rows, columns = self._shape
        plate = self._add('plate', Marker.CUBE, (columns * pitch, rows * pitch, 0.5 * _UNDER), self._tones[0], [])
        plate.pose.position.z = -2 * _UNDER
        row, column = np.nonzero(values > _FAINT * full)
        if len(row):
            places = np.column_stack([column - 0.5 * (columns - 1), row - 0.5 * (rows - 1)]) * pitch
            tone = np.clip(np.round((_TONES - 1) * values[row, column] / full), 0, _TONES - 1).astype(int)
            cells = self._add('cells', Marker.POINTS, (pitch, pitch, 0.0), colour_of(colours.TEXT),
                              points_of(np.column_stack([places, np.full(len(places), -_UNDER)])))
            cells.colors = [self._tones[k] for k in tone.tolist()]

    def _lines(self, region: ContactRegion) -> None:
        """Draw outlines, holes and principal axes of the region."""
        self._region(region)
        middle = np.array([region.centroid.x, region.centroid.y, region.centroid.z])
        if np.isfinite(region.orientation):
            along = np.array([np.cos(region.orientation), np.sin(region.orientation), 0.0])
            across = np.array([-along[1], along[0], 0.0])
            ends = [middle + side * 0.5 * length * axis for axis, length in ((along, region.major_axis), (across, region.minor_axis))
                    for side in (-1, 1)]
            width = 0.5 * self._array_sizes['pitch']
            self._add('axes', Marker.LINE_LIST, (width, 0.0, 0.0), colour_of(colours.CONTACT), points_of(np.array(ends)))

    def _flow(self, slip: Slip) -> None:
        """Draw the slip velocity at each slipping point as a line."""
        size, scale = self._array_sizes['pitch'], self._array_sizes['flow_scale']
        at = np.column_stack([slip.x, slip.y, np.zeros(len(slip.x))]).astype(float)
        by = np.column_stack([slip.vx, slip.vy, np.zeros(len(slip.vx))]).astype(float)
        known = np.flatnonzero(np.isfinite(by).all(axis=1))
        known = known[::1 + len(known) // _MOST_ARROWS]
        if len(known):
            ends = np.stack([at[known], at[known] + scale * by[known]], axis=1).reshape(-1, 3)
            self._add('flow', Marker.LINE_LIST, (0.15 * size, 0.0, 0.0), colour_of(colours.ARROW), points_of(ends))


_LEGEND = [('untouched', tuple(colours.of_depth(np.zeros(1))[0])), ('full', tuple(colours.of_depth(np.ones(1))[0])),
           ('region', colours.REGION), ('contact', colours.CONTACT), ('slip', colours.STATE_COLOURS[2])]
_RING = 0.3  # taxels, radius of the ring at the tip of the slip arrow; chosen


def coloured(values: np.ndarray, full_value: float) -> np.ndarray:
    """values (rows, columns) as colours (rows, columns, 3) uint8 BGR, those of the markers; full_value: the brightest."""
    rgb = colours.of_depth(np.clip(values.astype(float) / full_value, 0, 1).ravel())
    return np.round(255 * rgb[:, 2::-1]).astype(np.uint8).reshape(*values.shape, 3)


def taxel_annotation(found: Mapping, shape: tuple[int, int], sizes: Mapping) -> Annotation:
    """Outlines, contacts, the slip arrow and two lines of text, from messages by topic (contact_region, contacts, slip, wrench; any may be
    missing); shape: (rows, columns); sizes: pitch (m), flow_scale (s), by which a velocity becomes the arrow's length."""
    region = found.get('contact_region') or ContactRegion()
    middle = 0.5 * np.array([shape[1] - 1, shape[0] - 1])

    def places(xy: np.ndarray) -> np.ndarray:
        return xy[:, :2] / sizes['pitch'] + middle

    contacts = found['contacts'].contacts if 'contacts' in found else []
    outlines, holes = ([places(ring) for ring in rings if len(ring)] for rings in rings_of(region))
    what = Annotation(outlines=outlines, holes=holes, radius=_RING, text=_lines(found, region, len(contacts)), legend=_LEGEND)
    what.contacts = places(np.array([(c.position.x, c.position.y) for c in contacts], float).reshape(-1, 2))
    velocity = _velocity(found, region)
    if np.isfinite(velocity).all() and velocity.any():
        what.duv = velocity[None] * (sizes['flow_scale'] / sizes['pitch'])
        what.uv = places(np.array([[region.centroid.x, region.centroid.y]])) + what.duv
        what.id, what.state = np.zeros(1, np.int64), np.array([2])
    return what


def _velocity(found: Mapping, region: ContactRegion) -> np.ndarray:
    """(2,) m/s of the object at the region's centroid; NaN without slip."""
    if 'slip' not in found or not region.outlines or not found['slip'].state:
        return np.full(2, np.nan)
    twist, at = found['slip'].velocity, region.centroid
    turn = np.nan_to_num(twist.angular.z)
    return np.array([twist.linear.x - turn * at.y, twist.linear.y + turn * at.x])


def _lines(found: Mapping, region: ContactRegion, contacts: int) -> list[str]:
    if not region.outlines:
        return ['nothing touches', '']
    force = force_word(found['wrench'].wrench.force) if 'wrench' in found else ''
    first = [f'{contacts} contact{"s" if contacts != 1 else ""}', f'{1e6 * region.area:.0f} mm2', force]
    return [', '.join(filter(None, first)), SLIP_NAMES.get(found['slip'].state, '') if 'slip' in found else '']


class TaxelMarkersNode(DrawingNode):
    """Draws the array and its results."""

    marked = pictured = {'image_raw': Image, **RESULTS}
    marker_rate = picture_rate = 'rate'

    def __init__(self, host: Host | None = None):
        super().__init__('taxel_markers_node', TAXEL_MARKERS_PARAMETERS, host)
        self.markers = TaxelMarkers(self.settings)
        self.publish_place('taxels', (0.0, 0.0, -self.settings['cell_height']))

    def picture(self, found: Mapping) -> np.ndarray:
        """The taxels in colours, with what was found."""
        values = grey_to_array(found['image_raw'], 'taxel image')
        return annotate(coloured(values, self.settings['full_value']), taxel_annotation(found, values.shape, self.settings))


def main(args: list[str] | None = None) -> None:
    """Run the process taxel_markers_node."""
    sys.exit(run_node(TaxelMarkersNode, args))


if __name__ == '__main__':
    main()
