# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact regions of a taxel image: outlines with subtaxel accuracy and their moments (paper taxel_array_image_processing, eqs 1 to 3, with
I = 1 inside the outline)."""
from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from .._core import taxel_regions
from .array import TaxelArray
from ..common.surface import Moments, Outline, grouped
from .score import LEVEL

_AROUND = 2  # taxels around a region that share its force. Chosen: a pad of 2 mm on taxels of 1 mm (paper)
_MOST = 64  # regions; an image with more is broken. Chosen: more than fingers can make
_AREA = 8  # column of the kernel's table
_LEAST = 0.25  # taxels, area of a region. Chosen: half of what a single taxel of full score has; noise at a border makes smaller ones


@dataclass(frozen=True)
class TaxelRegion:
    """One region, of one piece or of several that were joined.

    label: in the frame's labels; box: its rows and columns, slices; outlines: of its pieces, with holes; moments: of area; count: of
    taxels; force: sum of pressure times area over its taxels and those around, in the pressure's unit times m^2; peak: largest
    pressure.
    """

    label: int
    box: tuple[slice, slice]
    outlines: list[Outline]
    moments: Moments
    count: int
    force: float
    peak: float


@dataclass(frozen=True)
class Regions:
    """Regions of one frame. all: largest first; labels: (rows, columns) int32, 0 outside; touched: (rows, columns) bool, inside; near:
    labels extended to the taxels around, which share a region's force; broken: whether the image has more than 64 regions, of which all
    holds the largest."""

    all: list[TaxelRegion]
    labels: np.ndarray
    touched: np.ndarray
    near: np.ndarray
    broken: bool = False

    @property
    def total(self) -> Moments:
        """Moments of all regions together; requires at least one."""
        return sum((region.moments for region in self.all[1:]), self.all[0].moments)


def find_regions(score: np.ndarray, pressure: np.ndarray, array: TaxelArray) -> Regions:
    """Regions where score (rows, columns) float32 exceeds LEVEL, with the load of pressure (rows, columns) float32."""
    labels, near, broken, table, places, points, start, numbers = taxel_regions(score, pressure, level=LEVEL, pitch=array.pitch, most=_MOST,
                                                                                around=_AROUND)
    outlines = grouped(places, points, start, numbers)
    least = _LEAST * array.taxel_area
    regions = [_region(outline, row) for outline, row in zip(outlines, table.tolist()) if row[_AREA] > least]
    return Regions(regions, labels, labels > 0, near, broken)


def joined(regions: Regions, reach: float, light: float) -> Regions:
    """regions, with those that one object can make as one; reach: pitches that a pad hands pressure on to, its thickness; light: peak.

    Two regions nearer than reach are one: the pad hands on the pressure of two objects so near as that of one. Of regions with lower peaks
    than light, two are one up to twice reach: a rough object that is pressed lightly touches in pieces. A broken image stays as it is.
    """
    if len(regions.all) < 2 or regions.broken:
        return regions
    weak = [region.label for region in regions.all if region.peak < light]
    box = tuple(slice(max(min(side.start for side in sides) - round(reach), 0), max(side.stop for side in sides) + round(reach))
                for sides in zip(*(region.box for region in regions.all)))
    labels = regions.labels[box]
    meet = _grown(labels > 0, 0.5 * reach)
    if len(weak) > 1:
        meet |= _grown(np.isin(labels, weak), reach)
    numbers = np.zeros(regions.labels.shape, np.int32)
    _, numbers[box] = cv2.connectedComponents(meet)
    groups: dict[int, list[TaxelRegion]] = {}
    for region in regions.all:
        group = numbers[region.box][regions.labels[region.box] == region.label][0]
        groups.setdefault(int(group), []).append(region)
    if len(groups) == len(regions.all):
        return regions
    label = np.arange(max(int(regions.labels.max()), int(regions.near.max())) + 1, dtype=regions.labels.dtype)
    for pieces in groups.values():
        label[[piece.label for piece in pieces]] = pieces[0].label
    together = sorted((_together(pieces) for pieces in groups.values()), key=lambda region: -region.moments.area)
    return replace(regions, all=together, labels=label[regions.labels], near=label[regions.near])


def without(regions: Regions, gone: list[int]) -> Regions:
    """regions without those of the labels gone."""
    if not gone:
        return regions
    labels, near = (np.where(np.isin(image, gone), 0, image).astype(image.dtype) for image in (regions.labels, regions.near))
    kept = [region for region in regions.all if region.label not in gone]
    return replace(regions, all=kept, labels=labels, touched=labels > 0, near=near)


def _grown(mask: np.ndarray, reach: float) -> np.ndarray:
    """(rows, columns) uint8: taxels within reach, in pitches, of mask (rows, columns) bool."""
    size = 2 * round(reach) + 1
    return cv2.dilate(mask.astype(np.uint8), cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)))


def _together(pieces: list[TaxelRegion]) -> TaxelRegion:
    """One region of several, largest first."""
    box = tuple(slice(min(side.start for side in sides), max(side.stop for side in sides)) for sides in zip(*(p.box for p in pieces)))
    return TaxelRegion(pieces[0].label, box, [outline for piece in pieces for outline in piece.outlines],
                       sum((piece.moments for piece in pieces[1:]), pieces[0].moments), sum(piece.count for piece in pieces),
                       sum(piece.force for piece in pieces), max(piece.peak for piece in pieces))


def _region(outline: Outline, row: list[float]) -> TaxelRegion:
    """The TaxelRegion of an outline and its row in the kernel's table."""
    label, count, top, left, bottom, right = map(int, row[:6])
    force, peak, area, first_x, first_y, *second = row[6:]
    moments = Moments(area, np.array([0.0, 0.0, area]), np.array([first_x, first_y, 0.0]), np.array(second))
    return TaxelRegion(label, (slice(top, bottom), slice(left, right)), [outline], moments, count, force, peak)
