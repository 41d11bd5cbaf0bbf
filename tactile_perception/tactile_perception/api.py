# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The functions of the public face that no other module has: one call each for what a node does in several steps."""
from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from tactile_driver.parameters.table import defaults

from .press.calibration import read_touch
from .common.dots import Dots
from .dots.detect import DotDetector
from .errors import BadArgument
from .finger.parameters import PSD_PARAMETERS
from .press.field import view_maker
from .parameters.file import read_parameters
from .press.parameters import POINT_PARAMETERS, marker_sensor
from .taxel.parameters import TAXEL_PARAMETERS
from .parameters.touchpad import DOT_PARAMETERS, REGION_PARAMETERS
from .press.estimator import TouchEstimator
from .touchpad.sensor import camera_pose

_TABLES = {'dot_tracker_node': DOT_PARAMETERS, 'contact_region_node': REGION_PARAMETERS, 'contact_point_node': POINT_PARAMETERS,
           'psd_contact_node': PSD_PARAMETERS, 'taxel_contact_node': TAXEL_PARAMETERS}


def detect_dots(image: np.ndarray, polarity: str = 'dark', method: str = 'likelihood') -> Dots:
    """The printed dots of one image, in no order.

    image: (H, W) grey or (H, W, 3) BGR, uint8; polarity: 'dark' dots on bright ground, or 'bright' ones on dark; method: a name in
    dots.detect.METHODS. Returns Dots: uv (N, 2) px (column, row), area (N,) px^2, sigma (N,) px, standard deviation of uv per
    axis. Raises BadFrame for an image without dots (black, white, of another type or shape) and BadArgument for an unknown name.
    For a stream of images use DotTracker, which keeps what it has learnt of the dots' appearance.
    """
    return DotDetector(polarity, method).detect(image)


def load_marker_touch(values: Mapping, matrix: np.ndarray | None = None, distortion: np.ndarray | None = None) -> TouchEstimator:
    """The calibrated touch estimator of a sheet or a dome with markers, as contact_point_node runs it.

    values: of node_parameters('contact_point_node', ...), with calibration the path of a file that `calibrate` wrote; matrix: K (3, 3) and
    distortion: (5,) of the camera, neither for an image that is stitched from two. Its process(tracks, stamp_s) takes the DotTracks of
    DotTracker and returns region, contacts, wrench (6,) N and N m, and points. Raises BadArgument for a camera that is missing, and
    BadCalibration for a file that cannot be used.
    """
    sensor = marker_sensor(values)
    calibration = read_touch(values['calibration'], sensor.type, values)
    matrices = None if matrix is None else (np.asarray(matrix, float), np.zeros(5) if distortion is None else np.asarray(distortion, float))
    make_view = view_maker(sensor, matrices, calibration.stitching, camera_pose(values))
    if make_view is None:
        raise BadArgument(f'load_marker_touch: the markers of a {sensor.type} are seen by a calibrated camera; give its matrix')
    return TouchEstimator(sensor, make_view, values, calibration)


def node_parameters(node: str, path: str | Path | None = None) -> dict[str, object]:
    """Name -> value of a node's parameters: the defaults, then those that the parameter file at path has for the node.

    node: dot_tracker_node, contact_region_node, contact_point_node, psd_contact_node or taxel_contact_node. Raises BadArgument for another
    node, a file that cannot be read, and a value that is not allowed.
    """
    if node not in _TABLES:
        raise BadArgument(f'no node {node!r}; there are {", ".join(_TABLES)}')
    return defaults(_TABLES[node]) if path is None else read_parameters(path, node, _TABLES[node])
