# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contacts, regions and slips made up for tests."""
import numpy as np

from tactile_perception.common.estimates import ContactEstimate, ContactRegionEstimate, SlipEstimate

UP = np.array([0.0, 0.0, 1.0])


def contact(x, y, depth=1e-3, id=1, force=2.0, normal=UP, sigma=1e-4, flags=0):
    return ContactEstimate(id, np.array([x, y, -np.nan_to_num(depth)]), np.array(normal), depth, force, sigma**2 * np.eye(3), flags,
                           np.zeros(0, bool))


def region(side, state, centre=(0.0, 0.0)):
    state = np.array(state, np.uint8)
    if not side:
        return ContactRegionEstimate(np.arange(len(state)), state)
    square = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * side / 2 + [*centre, 0]
    return ContactRegionEstimate(np.arange(len(state)), state, [square], [], side**2, np.array([*centre, 0.0]), UP)


def slip(state, fraction, vx, turn=0.0):
    return SlipEstimate(state, fraction, np.array([vx, 0, 0]), np.array([0, 0, turn]))
