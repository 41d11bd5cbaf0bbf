# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The functions of the public face that no other module has: one call each for what a node does in several steps."""
from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from tactile_driver.parameters.table import defaults

from .common.camera import camera_pose
from .common.dots import Dots
from .dots.detect import DotDetector
from .dots.parameters import DOT_PARAMETERS
from .errors import BadArgument
from .finger.parameters import PSD_PARAMETERS
from .gel.parameters import GEL_NODE, GEL_PARAMETERS, PINS_NODE, PINS_PARAMETERS
from .parameters.file import read_parameters
from .press.calibration import read_touch
from .press.estimator import TouchEstimator
from .press.field import RestMarkers, checked_view, view_maker
from .press.parameters import MARKER_PARAMETERS, NODE as PRESS_NODE, marker_sensor
from .taxel.parameters import TAXEL_PARAMETERS
from .touchpad.parameters import NODE as TOUCHPAD_NODE, TOUCHPAD_PARAMETERS

_TABLES = {TOUCHPAD_NODE: TOUCHPAD_PARAMETERS, PRESS_NODE: MARKER_PARAMETERS, GEL_NODE: GEL_PARAMETERS, PINS_NODE: PINS_PARAMETERS,
           'psd_contact_node': PSD_PARAMETERS, 'taxel_contact_node': TAXEL_PARAMETERS, 'dot_tracker_node': DOT_PARAMETERS}


def detect_dots(image: np.ndarray, polarity: str = 'dark', method: str = 'likelihood') -> Dots:
    """The printed dots of one image, in no order.

    image: (H, W) grey or (H, W, 3) BGR, uint8; polarity: 'dark' dots on bright ground, or 'bright' ones on dark; method: a name in
    dots.detect.METHODS. Returns Dots: uv (N, 2) px (column, row), area (N,) px^2, sigma (N,) px, standard deviation of uv per
    axis. Raises BadFrame for an image without dots (black, white, of another type or shape) and BadArgument for an unknown name.
    For a stream of images use DotTracker, which keeps what it has learnt of the dots' appearance.
    """
    return DotDetector(polarity, method).detect(image)


def load_marker_touch(values: Mapping, matrix: np.ndarray | None = None, distortion: np.ndarray | None = None) -> TouchEstimator:
    """The calibrated touch estimator of a sheet or a dome with markers, as press_contact_node runs it.

    values: of node_parameters('press_contact_node', ...), with calibration the path of a file that `calibrate` wrote; matrix: K (3, 3) and
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
    count = sensor.rows * sensor.columns if calibration.pattern is None else len(calibration.pattern)
    return TouchEstimator(sensor, RestMarkers(count, checked_view(make_view, calibration.rest)), values, calibration)


def node_parameters(node: str, path: str | Path | None = None) -> dict[str, object]:
    """Name -> value of a node's parameters: the defaults, then those that the parameter file at path has for the node.

    node: a perception node, such as touchpad_contact_node. Raises BadArgument for another node, a file that cannot be read, and a value
    that is not allowed.
    """
    if node not in _TABLES:
        raise BadArgument(f'no node {node!r}; there are {", ".join(_TABLES)}')
    return defaults(_TABLES[node]) if path is None else read_parameters(path, node, _TABLES[node])
