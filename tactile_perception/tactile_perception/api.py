# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Functions of the public interface that do in one call what a node does in several steps."""
from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from tactile_driver.parameters.table import defaults

from .common.camera import camera_pose
from .common.dots import Dots
from .core.errors import BadArgument
from .core.parameter_files import read_parameters
from .dots.detect import DotDetector
from .dots.parameters import DOT_PARAMETERS
from .finger.parameters import PSD_PARAMETERS
from .gel.parameters import GEL_NODE, GEL_PARAMETERS, PINS_NODE, PINS_PARAMETERS
from .press.calibration import read_touch
from .press.estimator import TouchEstimator
from .press.field import RestMarkers, checked_view, view_maker
from .press.parameters import MARKER_PARAMETERS, NODE as PRESS_NODE, marker_sensor
from .taxel.parameters import TAXEL_PARAMETERS
from .touchpad.parameters import NODE as TOUCHPAD_NODE, TOUCHPAD_PARAMETERS

_TABLES = {TOUCHPAD_NODE: TOUCHPAD_PARAMETERS, PRESS_NODE: MARKER_PARAMETERS, GEL_NODE: GEL_PARAMETERS, PINS_NODE: PINS_PARAMETERS,
           'psd_contact_node': PSD_PARAMETERS, 'taxel_contact_node': TAXEL_PARAMETERS, 'dot_tracker_node': DOT_PARAMETERS}


def detect_dots(image: np.ndarray, polarity: str = 'dark', method: str = 'likelihood') -> Dots:
    """Detect the printed dots of one image.

    Parameters
    ----------
    image : ndarray of uint8, shape (H, W) or (H, W, 3)
        Grey or BGR image.
    polarity : str
        ``dark`` for dark dots on a bright ground, ``bright`` for bright dots on a dark ground.
    method : str
        Name in ``dots.detect.METHODS``.

    Returns
    -------
    Dots
        Positions ``uv`` (N, 2) as column and row in px, areas ``area`` (N,) in px^2, and the standard deviation ``sigma`` (N,) of a
        position along each axis in px, in no particular order.

    Raises
    ------
    BadFrame
        If the image has no dots, or is of another type or shape.
    BadArgument
        If a name is unknown.

    Notes
    -----
    For a stream of images use `DotTracker`, which keeps the appearance of the dots.

    Examples
    --------
    >>> import cv2
    >>> image = np.full((120, 160), 200, np.uint8)
    >>> for u in range(20, 160, 20):
    ...     for v in range(20, 120, 20):
    ...         image = cv2.circle(image, (u, v), 4, 40, -1)
    >>> len(detect_dots(cv2.GaussianBlur(image, (0, 0), 1.0)))
    35
    """
    return DotDetector(polarity, method).detect(image)


def load_marker_touch(values: Mapping, matrix: np.ndarray | None = None, distortion: np.ndarray | None = None) -> TouchEstimator:
    """Make the calibrated contact estimator of a sheet or a dome with markers, as ``press_contact_node`` runs it.

    Parameters
    ----------
    values : Mapping
        Parameters of ``node_parameters('press_contact_node', ...)``; ``calibration`` is the path of a file that `calibrate` wrote.
    matrix : ndarray, shape (3, 3), optional
        Camera matrix in px; None for an image that is stitched from two cameras.
    distortion : ndarray, shape (5,), optional
        Distortion of the camera, model ``plumb_bob``.

    Returns
    -------
    TouchEstimator
        Its ``process(tracks, stamp_s)`` takes the `DotTracks` of a `DotTracker` and returns region, contacts, wrench (6,) in N and N m,
        and points.

    Raises
    ------
    BadArgument
        If the camera is missing.
    BadCalibration
        If the calibration file cannot be used.
    """
    sensor = marker_sensor(values)
    calibration = read_touch(values['calibration'], sensor.type, values)
    matrices = None if matrix is None else (np.asarray(matrix, float), np.zeros(5) if distortion is None else np.asarray(distortion, float))
    make_view = view_maker(sensor, matrices, calibration.stitching, camera_pose(values))
    if make_view is None:
        raise BadArgument(f'load_marker_touch: the markers of a {sensor.type} are seen by a calibrated camera; give its matrix')
    count = sensor.rows * sensor.columns if calibration.pattern is None else len(calibration.pattern)
    return TouchEstimator(sensor, RestMarkers(count, checked_view(make_view, calibration.rest)), values, calibration)


def node_parameters(node: str, path: str | Path | None = None) -> dict[str, object]:
    """Parameters of a node: the defaults, overridden by a parameter file.

    Parameters
    ----------
    node : str
        Name of a perception node.
    path : str or Path, optional
        Parameter file; only its section of this node is read.

    Returns
    -------
    dict
        Name to value.

    Raises
    ------
    BadArgument
        If the node is unknown, the file cannot be read, or a value is not allowed.

    Examples
    --------
    >>> node_parameters('touchpad_contact_node')['sensor_type']
    'touchpad'
    """
    if node not in _TABLES:
        raise BadArgument(f'no node {node!r}; there are {", ".join(_TABLES)}')
    return defaults(_TABLES[node]) if path is None else read_parameters(path, node, _TABLES[node])
