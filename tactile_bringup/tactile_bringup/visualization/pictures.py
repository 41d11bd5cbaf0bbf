# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Results in words and drawn over an image: dots coloured by state, displacements, contact regions, numbers."""
from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import cv2
import numpy as np
from sensor_msgs.msg import CameraInfo

from tactile_driver.stitching.calibration import Stitching
from tactile_msgs.msg import ContactRegion, DotTracks, Slip
from tactile_perception.common.camera import CameraModel

from .constants import COLOURS, DRAWING

#: Colour scale from untouched to full depth.
_DEPTH_COLOURS = np.array([COLOURS.states[0], (0.25, 0.80, 0.60), (0.95, 0.85, 0.20), (1.00, 0.35, 0.10)])


def of_depth(share: np.ndarray) -> np.ndarray:
    """Colours (N, 3) of relative depths (N,): 0 is untouched; 1 and above is full depth."""
    step = np.clip(np.asarray(share, float), 0.0, 1.0) * (len(_DEPTH_COLOURS) - 1)
    return np.column_stack([np.interp(step, np.arange(len(_DEPTH_COLOURS)), channel) for channel in _DEPTH_COLOURS.T])


def bgr(colour: Sequence[float]) -> tuple[int, int, int]:
    """The colour as 8-bit (blue, green, red) for OpenCV."""
    red, green, blue = (round(255 * c) for c in colour)
    return blue, green, red


def array_of(points) -> np.ndarray:
    """(N, 3) of N messages with x, y and z."""
    return np.array([(p.x, p.y, p.z) for p in points], float).reshape(-1, 3)


SLIP_NAMES = {Slip.NONE: 'no slip', Slip.INCIPIENT: 'incipient slip', Slip.GROSS: 'gross slip'}


def touch_words(found: Mapping) -> list[str]:
    """Known values of depth, force and slip state as text, from messages by topic (contacts, wrench, slip; any may be missing).

    If some components of the force are unknown, its z component is given."""
    contacts = found['contacts'].contacts if 'contacts' in found else []
    depths = [contact.depth for contact in contacts if np.isfinite(contact.depth)]
    forces = [contact.force for contact in contacts if np.isfinite(contact.force)]
    words = [f'{1e3 * max(depths):.1f} mm deep'] if depths else []
    if 'wrench' in found:
        force = found['wrench'].wrench.force
        size = float(np.linalg.norm([force.x, force.y, force.z]))
        words += [f'{size:.1f} N'] if np.isfinite(size) else [f'{abs(force.z):.1f} N along z'] if np.isfinite(force.z) else []
    elif forces:
        words.append(f'{sum(forces):.2f} N')
    return words + ([SLIP_NAMES[found['slip'].state]] if 'slip' in found else [])


def lines_of(found: Mapping) -> list[str]:
    """Lines of text about messages by topic.

    The first line, present with dots only, has their number and largest displacement. The second has area, depth, force, slip state, and
    the numbers of sticking and slipping dots; it is empty if contact is unknown."""
    dots, region, lines = found.get('dots'), found.get('contact_region'), []
    if dots is not None:
        displacement = np.hypot(dots.du, dots.dv)
        largest = f'{np.nanmax(displacement):.1f} px' if np.isfinite(displacement).any() else 'not known yet'
        lines.append(f'{len(dots.id)} dots, largest displacement {largest}')
    if region is not None and region.outlines:
        counts = np.bincount(np.asarray(region.dot_state, np.int64), minlength=3)
        states = [f'{counts[1]} stick, {counts[2]} slip'] if counts.any() else []
        lines.append(', '.join([f'{1e6 * region.area:.0f} mm2', *touch_words(found), *states]))
    elif 'contacts' in found and found['contacts'].contacts:
        lines.append(', '.join(touch_words(found)) or 'contact, its depth and force are not known')
    else:
        lines.append('nothing touches' if region is not None or 'contacts' in found else '')
    return lines


Projection = Callable[[np.ndarray], np.ndarray]  # from points (N, 3), m, of one object in the sensor frame to px (N, 2)


def projection(matrices: tuple | None, rotation: Sequence[float], translation: Sequence[float], stitching: Stitching | None = None
               ) -> Projection | None:
    """Projection to a camera's image; None for an uncalibrated camera.

    matrices: from camera_matrices; rotation, translation: from sensor to camera frame, as a rotation vector (rad) and a vector (m);
    stitching: of a picture stitched from two views, which has no camera model of its own.
    """
    if matrices is not None:
        return CameraModel(*matrices, cv2.Rodrigues(np.array(rotation, float))[0], np.array(translation, float)).project
    return None if stitching is None else partial(_stitched, stitching)


def plane_projection(points: np.ndarray, uv: np.ndarray) -> Projection | None:
    """Projection of a camera whose pose is unknown, for positions near a plane: the affine map that fits points (N, 3), m, to their pixels
    (N, 2) best. None if fewer than three points are known."""
    known = np.isfinite(np.column_stack([points, uv])).all(axis=1)
    if known.sum() < 3:
        return None
    fit = np.linalg.lstsq(_with_ones(points[known]), uv[known], rcond=None)[0]
    return lambda xyz: _with_ones(xyz) @ fit


def _with_ones(xyz: np.ndarray) -> np.ndarray:
    """(N, 3): x, y and 1 of positions (N, 3)."""
    return np.column_stack([xyz[:, :2], np.ones(len(xyz))])


def _stitched(stitching: Stitching, xyz: np.ndarray) -> np.ndarray:
    """Projection to a stitched picture; all points are projected to the view that shows their mean."""
    left, right = (stitching.origin + stitching.scale * (centre[:2] + (xyz[:, :2] - centre[:2]) * (centre[2] / (centre[2] - xyz[:, 2:])))
                   for centre in stitching.camera_centres)
    return right if stitching.side_of(left.mean(axis=0))[0] else left


def camera_info_key(message: CameraInfo) -> tuple:
    """The values that identify a calibration."""
    return tuple(message.k), tuple(message.d)


CAMERA_LEGEND = (*zip(('untouched', 'sticking', 'slipping'), COLOURS.states), ('displacement', COLOURS.arrow), ('region', COLOURS.region),
                 ('contact', COLOURS.contact))
ARRAY_LEGEND = (('untouched', COLOURS.states[0]), ('full', _DEPTH_COLOURS[-1]), ('region', COLOURS.region), ('contact', COLOURS.contact),
                ('slip', COLOURS.states[2]))
SURFACE_LEGEND = (('region', COLOURS.region), ('contact', COLOURS.contact))
FINGER_LEGEND = (('contact', COLOURS.contact),)


@dataclass
class Annotation:
    """What is drawn on one image. Coordinates are px of that image.

    rows, columns: size of the dot grid, 0 without a grid
    id: (N,) dot ids
    uv, duv: (N, 2) positions and displacements from the reference, NaN where unknown
    state: (N,) 0 untouched, 1 sticking, 2 slipping, -1 unknown
    radius: of the dots, px
    outlines, holes: lists of (n, 2)
    contacts: (C, 2)
    text: lines below the image
    legend: names and their colours (r, g, b), 0 to 1, below the text
    """

    rows: int = 0
    columns: int = 0
    id: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    uv: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    duv: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    state: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    radius: float = 3.0
    outlines: list[np.ndarray] = field(default_factory=list)
    holes: list[np.ndarray] = field(default_factory=list)
    contacts: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    text: list[str] = field(default_factory=list)
    legend: Sequence[tuple[str, Sequence[float]]] = ()


def annotation_of(found: Mapping, project: Projection | None, legend: Sequence = CAMERA_LEGEND, flow_scale: float = 0.0) -> Annotation:
    """Annotation of messages by topic (dots, contact_region, contacts, slip, wrench; any may be missing).

    project: None if unknown, so that only dots are drawn; flow_scale: s, arrow length over slip velocity, 0 for no arrow."""
    dots, region = found.get('dots') or DotTracks(), found.get('contact_region') or ContactRegion()
    id = np.asarray(dots.id, np.int64)
    what = Annotation(dots.rows, dots.columns, id, np.column_stack([dots.u, dots.v]).astype(float).reshape(-1, 2),
                      np.column_stack([dots.du, dots.dv]).astype(float).reshape(-1, 2), states_of(id, region), legend=legend,
                      text=lines_of(found) if 'dots' in found or legend is not CAMERA_LEGEND else ['no dots', ''])
    if np.isfinite(dots.area).any():
        what.radius = float(np.sqrt(np.nanmedian(dots.area) / np.pi))
    if project is None:
        return what
    what.outlines, what.holes = ([project(ring) for ring in map(array_of, (polygon.points for polygon in polygons))
                                  if len(ring) and np.isfinite(ring).all()] for polygons in (region.outlines, region.holes))
    contacts = array_of(contact.position for contact in found['contacts'].contacts) if 'contacts' in found else np.zeros((0, 3))
    what.contacts = np.array([project(each[None])[0] for each in contacts if np.isfinite(each).all()]).reshape(-1, 2)
    if flow_scale and 'slip' in found and found['slip'].state and region.outlines:
        begin, twist = array_of([region.centroid]), found['slip'].velocity
        turn = np.nan_to_num(twist.angular.z)
        velocity = np.array([[twist.linear.x - turn * begin[0, 1], twist.linear.y + turn * begin[0, 0], 0.0]])
        what.id, what.state, what.uv = np.zeros(1, np.int64), np.array([2]), project(begin + flow_scale * velocity)
        what.duv, what.radius = what.uv - project(begin), 0.3  # px: of the ring at its tip
    return what


def states_of(id: np.ndarray, region: ContactRegion) -> np.ndarray:
    """States (N,) of the dots id (N,) in a region; -1 for a dot that is not listed."""
    states = dict(zip(region.dot_id, region.dot_state))
    return np.array([states.get(each, -1) for each in id.tolist()], np.int64)


def array_picture(values: np.ndarray, full_value: float) -> np.ndarray:
    """values (rows, columns) of taxels as colours (rows, columns, 3) uint8 BGR, those of the markers; full_value: the brightest."""
    rgb = of_depth(np.clip(values.astype(float) / full_value, 0, 1).ravel())
    return np.round(255 * rgb[:, 2::-1]).astype(np.uint8).reshape(*values.shape, 3)


def taxels_picture(positions: np.ndarray, forces: np.ndarray, pressed: np.ndarray, full: float) -> tuple[np.ndarray, Projection]:
    """Picture (480, 640, 3) uint8 BGR of taxels from above, and the function from positions (N, 3), m, to its pixels.

    positions: (K, 3) m; forces: (K, 3) N; pressed: (K,) N; full: N, where the colour scale ends and the lines of shear are a pitch long.
    """
    image = np.zeros((480, 640, 3), np.uint8)
    low, high = positions[:, :2].min(axis=0), positions[:, :2].max(axis=0)
    pitch = np.sqrt(max(float(np.prod(high - low)), 1e-6) / len(positions))
    scale = float(np.min(np.array([640, 480]) / (high - low + 2 * pitch)))
    middle, centre = (low + high) / 2, np.array([319.5, 239.5])

    def project(xyz: np.ndarray) -> np.ndarray:
        return (xyz[:, :2] - middle) * scale + centre
    shown = of_depth(np.nan_to_num(pressed) / full)
    radius = max(int(0.35 * pitch * scale), 2)
    ends = project(positions + np.nan_to_num(forces) * (pitch / full))
    for at, end, colour in zip(np.rint(project(positions)).astype(int).tolist(), np.rint(ends).astype(int).tolist(), shown):
        cv2.circle(image, at, radius, bgr(colour), -1, cv2.LINE_AA)
        cv2.line(image, at, end, bgr(COLOURS.arrow), max(radius // 8, 1), cv2.LINE_AA)
    return image, project


def finger_picture(found: Mapping) -> np.ndarray:
    """Picture (H, W, 3) uint8 BGR of a finger's hemisphere and contacts, seen along -z, x right, y down."""
    middle, radius = 180, 160
    picture = np.full((2 * middle, 2 * middle, 3), 32, np.uint8)
    for degrees, part in ((30, 0.4), (60, 0.4), (90, 1.0)):
        ring = round(radius * np.sin(np.radians(degrees)))
        cv2.circle(picture, (middle, middle), ring, bgr(part * np.array(COLOURS.glass)), 1, cv2.LINE_AA)
    positions = array_of(contact.normal for contact in found['contacts'].contacts)[:, :2]
    return annotate(picture, Annotation(contacts=middle + radius * positions, text=lines_of(found), legend=FINGER_LEGEND))


_SHIFT = 4  # OpenCV's fixed-point coordinates: 4 fractional bits, 1/16 px
_CORNERS = np.stack([np.cos(np.arange(10) * np.pi / 5), np.sin(np.arange(10) * np.pi / 5)], axis=1)
_FONT = cv2.FONT_HERSHEY_SIMPLEX


def annotate(image: np.ndarray, what: Annotation) -> np.ndarray:
    """Draw an annotation over an image (H, W) or (H, W, 3) uint8; return a BGR picture (k H + t, k W, 3) uint8.

    k is the smallest integer that makes the picture as wide as the panel of RViz, limited to twice its height. Text and legend, t px high,
    are below the image. Text and line widths grow with pictures wider than 640 px, because viewers shrink those; a line of text is at most
    a quarter of the image high.
    """
    height, width = image.shape[:2]
    scale = max(1, min(-(-DRAWING.panel_width // width), 2 * DRAWING.panel_width // height))
    thick = max(1.0, scale * min(width / 640, height / (4 * 26)))
    picture = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) if image.ndim == 2 else image.copy()
    if scale > 1:
        picture = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_LINEAR)

    def placed(uv: np.ndarray) -> np.ndarray:
        # The centre of pixel 0 moves to (scale - 1) / 2 in the enlarged picture.
        return uv * scale + (scale - 1) / 2

    _draw_region(picture, [placed(o) for o in what.outlines], [placed(h) for h in what.holes], thick)
    uv = placed(what.uv)
    _draw_arrows(picture, uv - what.duv * scale, uv, thick)
    # over the arrows, so that the state stays visible
    _draw_dots(picture, uv, what.state, scale * what.radius + DRAWING.ring_gap, thick)
    _draw_numbers(picture, what, uv, thick)
    _draw_contacts(picture, placed(what.contacts), thick)
    return np.vstack([picture, *([_text_bar(what.text, picture.shape[1], thick)] if what.text else []),
                      *([_legend_bar(what.legend, picture.shape[1], thick)] if what.legend else [])])


def _fixed(points: np.ndarray) -> np.ndarray:
    return np.round(points * (1 << _SHIFT)).astype(np.int32)


def _draw_region(picture: np.ndarray, outlines: list[np.ndarray], holes: list[np.ndarray], thick: float) -> None:
    """Shade outlines less holes, each (n, 2) px, and draw their borders. thick scales line widths, here and below."""
    if not outlines:
        return
    corners = np.concatenate(outlines)
    x0, y0 = np.maximum(np.floor(corners.min(axis=0)).astype(int) - 1, 0)
    x1, y1 = np.ceil(corners.max(axis=0)).astype(int) + 2
    part = picture[y0:y1, x0:x1]
    if part.size:
        veiled = part.copy()
        cv2.fillPoly(veiled, [_fixed(points - (x0, y0)) for points in outlines + holes], bgr(COLOURS.region), shift=_SHIFT)
        cv2.addWeighted(veiled, 0.22, part, 0.78, 0.0, dst=part)
    for rings, colour in ((outlines, COLOURS.region), (holes, COLOURS.hole)):
        cv2.polylines(picture, [_fixed(points) for points in rings], True, bgr(colour), round(2 * thick), cv2.LINE_AA, _SHIFT)


def _draw_dots(picture: np.ndarray, uv: np.ndarray, state: np.ndarray, radius: float, thick: float) -> None:
    """Draw a ring of radius px around each dot at uv (N, 2), coloured by state (N,); rings of touched dots are thicker."""
    rings, state = _fixed(uv[:, None] + radius * _CORNERS), np.maximum(state, 0)
    for value, colour in enumerate(COLOURS.states):
        width, kind = (round(2 * thick), cv2.LINE_AA) if value else (round(thick), cv2.LINE_8)
        cv2.polylines(picture, list(rings[state == value]), True, bgr(colour), width, kind, _SHIFT)


def _draw_arrows(picture: np.ndarray, start: np.ndarray, end: np.ndarray, thick: float) -> None:
    """Draw arrows from start to end (N, 2) px; skip those with a NaN and those too short to see."""
    along = end - start
    length = np.hypot(along[:, 0], along[:, 1])
    is_drawn = length > DRAWING.min_arrow  # false for NaN
    start, end, along = start[is_drawn], end[is_drawn], along[is_drawn]
    size = np.minimum(DRAWING.arrow_head * length[is_drawn], 5.0 * thick) / length[is_drawn]
    back, side = along * size[:, None], np.stack([-along[:, 1], along[:, 0]], axis=1) * (0.6 * size[:, None])
    strokes = list(_fixed(np.stack([start, end, end - back + side, end, end - back - side], axis=1)))
    if len(start) <= DRAWING.max_bordered_arrows:
        cv2.polylines(picture, strokes, False, (0, 0, 0), round(3 * thick), cv2.LINE_8, _SHIFT)
    cv2.polylines(picture, strokes, False, bgr(COLOURS.arrow), round(thick), cv2.LINE_AA, _SHIFT)


def _draw_numbers(picture: np.ndarray, what: Annotation, uv: np.ndarray, thick: float) -> None:
    """Write row.column beside some dots of a grid, at most four in a row and in a column."""
    if not what.rows * what.columns:
        return
    row, column = np.divmod(what.id, what.columns)
    step = max(1, -(-max(what.rows, what.columns) // 4))
    middle = step // 2
    for k in np.nonzero((row % step == middle) & (column % step == middle))[0]:
        corner, text = (round(uv[k, 0]) + 5, round(uv[k, 1]) - 5), f'{row[k]}.{column[k]}'
        cv2.putText(picture, text, corner, _FONT, 0.45 * thick, (0, 0, 0), round(3 * thick), cv2.LINE_8)
        cv2.putText(picture, text, corner, _FONT, 0.45 * thick, bgr(COLOURS.text), round(thick), cv2.LINE_AA)


def _draw_contacts(picture: np.ndarray, positions: np.ndarray, thick: float) -> None:
    """Draw a cross in a circle at each contact (C, 2) px; skip NaN."""
    for u, v in positions[np.isfinite(positions).all(axis=1)]:
        centre = round(u), round(v)
        cv2.circle(picture, centre, round(9 * thick), (0, 0, 0), round(4 * thick), cv2.LINE_AA)
        cv2.circle(picture, centre, round(9 * thick), bgr(COLOURS.contact), round(2 * thick), cv2.LINE_AA)
        cv2.drawMarker(picture, centre, bgr(COLOURS.contact), cv2.MARKER_CROSS, round(26 * thick), round(2 * thick))


def _text_bar(lines: list[str], width: int, thick: float) -> np.ndarray:
    """Lines of text on a dark bar (thick * (20 px per line + 6 px), width, 3) uint8; a line that is too long gets smaller letters."""
    bar = np.full((round(thick * (20 * len(lines) + 6)), width, 3), 24, np.uint8)
    for k, line in enumerate(lines):
        size = DRAWING.font_scale * thick
        size *= min(1.0, (width - 16 * thick) / max(1, cv2.getTextSize(line, _FONT, size, 1)[0][0]))
        cv2.putText(bar, line, (round(8 * thick), round(thick * (18 + 20 * k))), _FONT, size, bgr(COLOURS.text), round(thick), cv2.LINE_AA)
    return bar


def _legend_bar(entries: Sequence[tuple[str, Sequence[float]]], width: int, thick: float) -> np.ndarray:
    """Names, each after a square of its colour, on a dark bar (26 * thick, width, 3) uint8; smaller where they are too long."""
    bar = np.full((round(26 * thick), width, 3), 24, np.uint8)
    size = DRAWING.font_scale * thick
    lengths = [cv2.getTextSize(name, _FONT, size, 1)[0][0] + 36 * thick for name, _ in entries]  # px, with square and gaps
    scale, left = min(1.0, (width - 8 * thick) / sum(lengths)), 8 * thick
    for (name, colour), length in zip(entries, lengths):
        top, side = round(13 * thick - 6 * thick * scale), 12 * thick * scale
        cv2.rectangle(bar, (round(left), top), (round(left + side), round(top + side)), bgr(colour), -1)
        corner = round(left + 1.5 * side), round(top + side)
        cv2.putText(bar, name, corner, _FONT, DRAWING.font_scale * thick * scale, bgr(COLOURS.text), round(thick), cv2.LINE_AA)
        left += length * scale
    return bar
