# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Draws results over an image: dots coloured by state, displacements, contact regions, numbers. Needs no ROS."""
from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np

#: Colours (r, g, b), 0 to 1, by dot state: untouched, sticking, slipping (the constants of ContactRegion). All colours are chosen.
STATE_COLOURS = ((0.45, 0.62, 0.80), (0.20, 0.85, 0.35), (1.00, 0.15, 0.90))
STATE_NAMES = ('untouched', 'sticking', 'slipping')
REGION = (1.00, 0.82, 0.10)
HOLE = (0.30, 0.90, 1.00)
CONTACT = (1.00, 1.00, 1.00)
ARROW = (1.00, 1.00, 0.35)
FORCE = (1.00, 0.55, 0.10)
TORQUE = (0.60, 0.40, 1.00)
TEXT = (1.00, 1.00, 1.00)


#: Colour scale from untouched to full depth, chosen.
_DEPTH_COLOURS = np.array([STATE_COLOURS[0], (0.25, 0.80, 0.60), (0.95, 0.85, 0.20), (1.00, 0.35, 0.10)])


def of_depth(share: np.ndarray) -> np.ndarray:
    """Colours (N, 3) of relative depths (N,): 0 is untouched; 1 and above is full depth."""
    at = np.clip(np.asarray(share, float), 0.0, 1.0) * (len(_DEPTH_COLOURS) - 1)
    return np.column_stack([np.interp(at, np.arange(len(_DEPTH_COLOURS)), channel) for channel in _DEPTH_COLOURS.T])


def bgr(colour: tuple[float, float, float]) -> tuple[int, int, int]:
    """The colour as 8-bit (blue, green, red) for OpenCV."""
    red, green, blue = (round(255 * c) for c in colour)
    return blue, green, red


_SHIFT = 4  # OpenCV's fixed-point coordinates: 4 fractional bits, 1/16 px
_SHORTEST = 1.2  # px of the picture, chosen: shorter arrows show mostly noise
_HEAD = 0.35  # length of the head over the arrow's, chosen
_SIZE = 0.6  # font scale, chosen: letters are 13 px high
_FEW = 200  # arrows, chosen: up to this number each gets a dark border
_GAP = 2.0  # px between a dot and its ring, chosen
_CORNERS = np.stack([np.cos(np.arange(10) * np.pi / 5), np.sin(np.arange(10) * np.pi / 5)], axis=1)
_FONT = cv2.FONT_HERSHEY_SIMPLEX
PANEL = 600  # px: width at which RViz shows the picture; what is drawn is legible there


@dataclass
class Annotation:
    """What is drawn on one image. Coordinates are px of that image.

    rows, columns: size of the dot grid, 0 without a grid
    id: (N,) dot ids
    uv, duv: (N, 2) positions and displacements from rest, NaN where unknown
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
    legend: list[tuple[str, tuple[float, float, float]]] = field(default_factory=list)


def states_of(id: np.ndarray, state_id: np.ndarray, state: np.ndarray) -> np.ndarray:
    """States (N,) of the dots id (N,), looked up in state (M,) of the dots state_id (M,); -1 for a dot that is not listed."""
    found = np.full(len(id), -1, np.int64)
    if len(state_id):
        order = np.argsort(state_id)
        place = np.minimum(np.searchsorted(state_id[order], id), len(state_id) - 1)
        known = state_id[order][place] == id
        found[known] = state[order][place][known]
    return found


def enlargement(width: int, height: int) -> int:
    """Smallest integer factor that makes an image at least PANEL px wide, limited to a height of 2 * PANEL px."""
    return max(1, min(-(-PANEL // width), 2 * PANEL // height))


def annotate(image: np.ndarray, what: Annotation) -> np.ndarray:
    """Draw an annotation over image (H, W) or (H, W, 3) uint8; a BGR picture (k H + t, k W, 3) uint8.

    k is enlargement(W, H). Text and legend, t px high, stand below the image and hide no dot: 26 px for one line, 20 px for each further
    line of text, 26 px for the legend.
    Text and line widths grow with pictures wider than 640 px, because viewers shrink those. One line takes at most a quarter of the image.
    """
    height, width = image.shape[:2]
    scale = enlargement(width, height)
    thick = max(1.0, scale * min(width / 640, height / (4 * 26)))
    picture = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) if image.ndim == 2 else image.copy()
    if scale > 1:
        picture = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_LINEAR)

    def placed(uv: np.ndarray) -> np.ndarray:
        # The centre of pixel 0 moves to (scale - 1) / 2 in the enlarged picture.
        return uv * scale + (scale - 1) / 2

    draw_region(picture, [placed(o) for o in what.outlines], [placed(h) for h in what.holes], thick)
    uv = placed(what.uv)
    draw_arrows(picture, uv - what.duv * scale, uv, thick)
    draw_dots(picture, uv, what.state, scale * what.radius + _GAP, thick)  # drawn over the arrows, so that the state stays visible
    draw_numbers(picture, what, uv, thick)
    draw_contacts(picture, placed(what.contacts), thick)
    bars = [text_bar(what.text, picture.shape[1], thick)] if what.text else []
    bars += [legend_bar(what.legend, picture.shape[1], thick)] if what.legend else []
    return np.vstack([picture, *bars])


def _fixed(points: np.ndarray) -> np.ndarray:
    return np.round(points * (1 << _SHIFT)).astype(np.int32)


def draw_region(picture: np.ndarray, outlines: list[np.ndarray], holes: list[np.ndarray], thick: float = 1.0) -> None:
    """Shade outlines less holes, each (n, 2) px, and draw their borders. thick scales line widths, here and below."""
    if not outlines:
        return
    corners = np.concatenate(outlines)
    x0, y0 = np.maximum(np.floor(corners.min(axis=0)).astype(int) - 1, 0)
    x1, y1 = np.ceil(corners.max(axis=0)).astype(int) + 2
    part = picture[y0:y1, x0:x1]
    if part.size:
        veiled = part.copy()
        cv2.fillPoly(veiled, [_fixed(points - (x0, y0)) for points in outlines + holes], bgr(REGION), shift=_SHIFT)
        cv2.addWeighted(veiled, 0.22, part, 0.78, 0.0, dst=part)
    cv2.polylines(picture, [_fixed(points) for points in outlines], True, bgr(REGION), round(2 * thick), cv2.LINE_AA, _SHIFT)
    if holes:
        cv2.polylines(picture, [_fixed(points) for points in holes], True, bgr(HOLE), round(2 * thick), cv2.LINE_AA, _SHIFT)


def draw_dots(picture: np.ndarray, uv: np.ndarray, state: np.ndarray, radius: float, thick: float = 1.0) -> None:
    """Draw a ring of radius px around each dot at uv (N, 2), coloured by state (N,); rings of touched dots are thicker."""
    rings = _fixed(uv[:, None] + radius * _CORNERS)
    for value, colour in enumerate(STATE_COLOURS):
        chosen = rings[(state == value) | (state < 0)] if value == 0 else rings[state == value]
        if len(chosen):
            width, kind = (round(2 * thick), cv2.LINE_AA) if value else (round(thick), cv2.LINE_8)
            cv2.polylines(picture, list(chosen), True, bgr(colour), width, kind, _SHIFT)


def draw_arrows(picture: np.ndarray, start: np.ndarray, end: np.ndarray, thick: float = 1.0) -> None:
    """Draw arrows from start to end (N, 2) px; skip those with a NaN and those too short to see."""
    along = end - start
    length = np.hypot(along[:, 0], along[:, 1])
    chosen = length > _SHORTEST  # false for NaN
    if not chosen.any():
        return
    start, end, along = start[chosen], end[chosen], along[chosen]
    size = np.minimum(_HEAD * length[chosen], 5.0 * thick) / length[chosen]
    back, side = along * size[:, None], np.stack([-along[:, 1], along[:, 0]], axis=1) * (0.6 * size[:, None])
    strokes = _fixed(np.stack([start, end, end - back + side, end, end - back - side], axis=1))
    if len(start) <= _FEW:
        cv2.polylines(picture, list(strokes), False, (0, 0, 0), round(3 * thick), cv2.LINE_8, _SHIFT)
    cv2.polylines(picture, list(strokes), False, bgr(ARROW), round(thick), cv2.LINE_AA, _SHIFT)


def draw_numbers(picture: np.ndarray, what: Annotation, uv: np.ndarray, thick: float = 1.0) -> None:
    """Write row.column beside every few dots of a grid, at most four per side."""
    if not what.rows * what.columns:
        return
    row, column = np.divmod(what.id, what.columns)
    step = max(1, -(-max(what.rows, what.columns) // 4))
    middle = step // 2
    for k in np.nonzero((row % step == middle) & (column % step == middle))[0]:
        place = round(uv[k, 0]) + 5, round(uv[k, 1]) - 5
        text = f'{row[k]}.{column[k]}'
        cv2.putText(picture, text, place, _FONT, 0.45 * thick, (0, 0, 0), round(3 * thick), cv2.LINE_8)
        cv2.putText(picture, text, place, _FONT, 0.45 * thick, bgr(TEXT), round(thick), cv2.LINE_AA)


def draw_contacts(picture: np.ndarray, places: np.ndarray, thick: float = 1.0) -> None:
    """Draw a cross in a circle at each contact (C, 2) px; skip NaN."""
    for u, v in places[np.isfinite(places).all(axis=1)]:
        centre = round(u), round(v)
        cv2.circle(picture, centre, round(9 * thick), (0, 0, 0), round(4 * thick), cv2.LINE_AA)
        cv2.circle(picture, centre, round(9 * thick), bgr(CONTACT), round(2 * thick), cv2.LINE_AA)
        cv2.drawMarker(picture, centre, bgr(CONTACT), cv2.MARKER_CROSS, round(26 * thick), round(2 * thick))


def text_bar(lines: list[str], width: int, thick: float = 1.0) -> np.ndarray:
    """Lines of text on a dark bar (thick * (20 px per line + 6 px), width, 3) uint8; a line that is too long gets smaller letters."""
    bar = np.full((round(thick * (20 * len(lines) + 6)), width, 3), 24, np.uint8)
    for k, line in enumerate(lines):
        size = _SIZE * thick * min(1.0, (width - 16 * thick) / max(1, cv2.getTextSize(line, _FONT, _SIZE * thick, 1)[0][0]))
        cv2.putText(bar, line, (round(8 * thick), round(thick * (18 + 20 * k))), _FONT, size, bgr(TEXT), round(thick), cv2.LINE_AA)
    return bar


def legend_bar(entries: list[tuple[str, tuple[float, float, float]]], width: int, thick: float = 1.0) -> np.ndarray:
    """Names, each after a square of its colour, on a dark bar (26 * thick, width, 3) uint8; smaller where they are too long."""
    bar = np.full((round(26 * thick), width, 3), 24, np.uint8)
    lengths = [cv2.getTextSize(name, _FONT, _SIZE * thick, 1)[0][0] + 36 * thick for name, _ in entries]  # px, with square and gaps
    scale, left = min(1.0, (width - 8 * thick) / sum(lengths)), 8 * thick
    for (name, colour), length in zip(entries, lengths):
        top, side = round(13 * thick - 6 * thick * scale), 12 * thick * scale
        cv2.rectangle(bar, (round(left), top), (round(left + side), round(top + side)), bgr(colour), -1)
        place = round(left + 1.5 * side), round(top + side)
        cv2.putText(bar, name, place, _FONT, _SIZE * thick * scale, bgr(TEXT), round(thick), cv2.LINE_AA)
        left += length * scale
    return bar
