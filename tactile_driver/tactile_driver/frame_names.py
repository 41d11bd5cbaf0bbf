# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The names of the coordinate frames of a sensor. No ROS here."""
from __future__ import annotations

import re

_OPTICAL = 'camera_optical'
_VIEW = re.compile(f'_(left|right)_{_OPTICAL}$')


def sensor_frame(namespace: str) -> str:
    """The sensor frame of the nodes in a namespace: its name with _ for /; '' for the root namespace."""
    return namespace.strip('/').replace('/', '_')


def optical_frame(sensor: str, view: str = '') -> str:
    """The frame of a sensor's camera, as headers of images and camera_info name it: z along the view, x and y along columns and rows (REP
    103). view: left or right of two cameras; '' for one camera, or for the picture stitched from two."""
    return '_'.join(part for part in (sensor, view, _OPTICAL) if part)


def stitched_frame(view: str) -> str:
    """The frame of the stitched picture, from that of one of its views; other names are returned as they are."""
    return _VIEW.sub(f'_{_OPTICAL}', view)
