# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Plain NumPy references of the kernels of src/press/touch_region.cpp."""

import numpy as np


def contact_radius(depth, tip, clearance):
    """m, by bisection of depth = a^2 / tip (1/2 + ln(clearance / a))."""
    low, high = 0.0, max(min(0.95 * tip, clearance), 1e-9)
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if middle**2 / tip * (0.5 + np.log(clearance / middle)) < depth else (low, middle)
    return 0.5 * (low + high)


def disc(tip, size, rim, height):
    """Centre (3,), normal (3,) and radius of the contact disc of a tip (5,); size of a sheet, or rim and height of a dome."""
    place, (depth, radius) = tip[:3], tip[3:]
    if min(size) > 0:
        bend, strips = 0.0, 2 * np.array(size) / np.pi * np.cos(np.pi * np.clip(place[:2] / size, -0.499, 0.499))
        clearance = (strips**-4.0).sum()**-0.25
        normal = np.array([0.0, 0.0, 1.0])
    else:
        bend = 2 * height / (rim**2 + height**2)
        clearance = max(rim**2 - place[:2] @ place[:2], 0.0) / rim
        across = place[:2] / (1 + radius * bend) * bend
        across = across * min(1.0, rim * bend / max(np.hypot(*across), 1e-12))
        normal = np.r_[across, np.sqrt(max(1 - across @ across, 0.0))]
    with np.errstate(divide='ignore'):
        patch = contact_radius(depth, 1 / (1 / radius + bend), clearance)
    return place + [0.0, 0.0, radius] - np.sqrt(radius**2 - patch**2) * normal, normal, patch


def outline(centre, normal, radius):
    """(36, 3) m, corners of a disc."""
    along = np.array([normal[2], 0.0, -normal[0]]) / np.hypot(normal[0], normal[2])
    turn = 2 * np.pi * np.arange(36)[:, None] / 36
    return centre + radius * (np.cos(turn) * along + np.sin(turn) * np.cross(normal, along))


def under(discs, rest, shift, eye, plane):
    """Numbers of the markers that are seen, and whether each appears under a disc."""
    seen = np.flatnonzero(np.isfinite(shift).all(axis=1))
    now, found = (rest + shift)[seen], np.zeros(len(seen), bool)
    for centre, _, radius in discs:
        share = (plane - eye[seen, 2]) / (centre[2] - eye[seen, 2])
        found |= np.hypot(*(now - eye[seen, :2] - share[:, None] * (centre[:2] - eye[seen, :2])).T) <= radius
    return seen, found
