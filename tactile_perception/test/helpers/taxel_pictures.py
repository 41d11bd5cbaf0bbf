# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Taxel images by geometry alone: shapes drawn fine, blurred as a soft pad would, and seen by taxels."""
import cv2
import numpy as np

from tactile_perception.common.surface import Moments
from tactile_perception.taxel.pressure import TaxelArray

FINE, DRAWN = 6, 24  # parts of a taxel: blurred, drawn
ARRAY = TaxelArray(44, 44, 1e-3)
BLUR = 0.8  # mm


def picture(inside, load=60.0, array=ARRAY, blur=BLUR):
    """(rows, columns) float32 under a face that is where inside(x, y), mm, is true."""
    y, x = ((np.arange(count * DRAWN) + 0.5) / DRAWN - 0.5 * count for count in array.shape)
    drawn = inside(*np.meshgrid(x.astype(np.float32), y.astype(np.float32))).astype(np.float32) * np.float32(load)
    drawn = cv2.resize(drawn, (array.columns * FINE, array.rows * FINE), interpolation=cv2.INTER_AREA)
    drawn = cv2.GaussianBlur(drawn, (0, 0), blur * FINE, borderType=cv2.BORDER_CONSTANT)
    return cv2.resize(drawn, (array.columns, array.rows), interpolation=cv2.INTER_AREA)


def bar(x0=0.0, y0=0.0, angle=0.0, length=20.0, width=8.0):
    """A rectangle's inside: centre, mm, and direction of its long side, rad."""
    def inside(x, y):
        along, across = (x - x0) * np.cos(angle) + (y - y0) * np.sin(angle), (y - y0) * np.cos(angle) - (x - x0) * np.sin(angle)
        return (np.abs(along) < length / 2) & (np.abs(across) < width / 2)
    return inside


def disc(x0=0.0, y0=0.0, radius=8.0):
    """A disc's inside, mm."""
    return lambda x, y: (x - x0)**2 + (y - y0)**2 < radius**2


def ring(inner=4.0, outer=9.0):
    """A ring's inside, mm."""
    return lambda x, y: (x**2 + y**2 < outer**2) & (x**2 + y**2 > inner**2)


def both(*parts):
    """The union of insides."""
    return lambda x, y: np.any([part(x, y) for part in parts], axis=0)


def moments(*regions):
    """Moments of regions together."""
    area, x, y, *second = np.sum([region.integrals for region in regions], axis=0).tolist()
    return Moments(area, np.array([0.0, 0.0, area]), np.array([x, y, 0.0]), np.array(second))
