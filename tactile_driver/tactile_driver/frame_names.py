# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The names of the coordinate frames of a sensor. No ROS here."""
from __future__ import annotations

import re

_OPTICAL = 'camera_optical'
_VIEW = re.compile(f'_(left|right)_{_OPTICAL}$')


def sensor_frame(namespace: str) -> str:
    """Name of the sensor frame of the nodes in a namespace.

    Parameters
    ----------
    namespace : str
        Namespace of a node.

    Returns
    -------
    str
        The namespace with ``_`` for ``/``; empty for the root namespace.

    Examples
    --------
    >>> sensor_frame('/hand/thumb')
    'hand_thumb'
    """
    return namespace.strip('/').replace('/', '_')


def optical_frame(sensor: str, view: str = '') -> str:
    """Name of a camera's optical frame, which headers of images and camera_info carry.

    Its z axis points along the view, x along the columns and y along the rows of the image (REP 103).

    Parameters
    ----------
    sensor : str
        Name of the sensor frame.
    view : str
        ``left`` or ``right`` of two cameras; empty for one camera and for the stitched image of two.

    Returns
    -------
    str
        Name of the frame.

    Examples
    --------
    >>> optical_frame('thumb'), optical_frame('palm', 'left')
    ('thumb_camera_optical', 'palm_left_camera_optical')
    """
    return '_'.join(part for part in (sensor, view, _OPTICAL) if part)


def stitched_frame(view: str) -> str:
    """Name of the optical frame of the stitched image.

    Parameters
    ----------
    view : str
        Name of the optical frame of one of its views. Any other name is returned unchanged.

    Returns
    -------
    str
        Name of the frame.

    Examples
    --------
    >>> stitched_frame('palm_left_camera_optical')
    'palm_camera_optical'
    """
    return _VIEW.sub(f'_{_OPTICAL}', view)
