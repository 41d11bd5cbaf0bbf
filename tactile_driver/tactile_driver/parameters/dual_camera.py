# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of dual_camera_node."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from .camera import CAMERA_PARAMETERS
from ..errors import BadArgument
from .shared import SCENE, check_together, sensor_parameters
from ..sources.registry import DUAL_SOURCES, LAYOUTS
from ..stitching.methods import STITCHERS
from .table import Parameter

_OWN = (
    Parameter('source', str, 'sim', '', 'origin of the image pairs: sim (simulated sensor), device (cameras), file (videos or folders of '
              'images), bag (rosbag2 recording) or topics (two image topics)', choices=DUAL_SOURCES),
    Parameter('layout', str, 'two', '', 'sources device, file and bag: two for a source of each view, side_by_side for one with both views '
              'in each image', choices=LAYOUTS),
    Parameter('device', str, '0', '', 'source device: left camera, or the one with both views: index, /dev path, name under '
              '/dev/v4l/by-id, or part of a serial number'),
    Parameter('right_device', str, '1', '', 'source device: right camera, named in the same way'),
    Parameter('path', str, '', '', 'source file: the left video or folder of images; source bag: the rosbag2 folder'),
    Parameter('right_path', str, '', '', 'source file: the right video or folder; source bag: bag of the right camera, empty if one bag '
              'has both'),
    Parameter('topic', str, 'left/image_raw', '', 'sources bag and topics: topic of the left images, or of those with both views'),
    Parameter('right_topic', str, 'right/image_raw', '', 'sources bag and topics: topic of the right images'),
    replace(SCENE, default='areal_dual_demo'),
    Parameter('max_skew', float, -1.0, 's', 'sources device, bag and topics: largest difference of the stamps of a pair; -1: half a frame '
              'period, which is always the most', -1.0, 10.0),
    Parameter('width', int, 0, 'px', "source device: image width; 0: the camera's own", 0, 8192),
    Parameter('height', int, 0, 'px', "source device: image height; 0: the camera's own", 0, 8192),
    Parameter('stitching', str, 'plane', '', 'method that makes image_raw: plane (metric; the seam runs between markers) or middle (the '
              "paper's: both views cut at the middle of their overlap)", choices=tuple(STITCHERS)),
    Parameter('stitching_path', str, '', '', 'calibration file with a stitching, from calibrate; empty: both views side by side'),
    Parameter('overlap', int, 0, 'px', 'without stitching_path: columns at the inner edge of both views that show the same', 0, 8192),
    *sensor_parameters('areal_dual'),
    Parameter('camera_info_path', str, '', '', "calibration file of camera_calibration (YAML) of the left camera; empty: the source's own "
              '(sim, bag), else uncalibrated'),
    Parameter('right_camera_info_path', str, '', '', 'the same of the right camera'),
)
_NAMES = {p.name for p in _OWN}

#: The stitching tells where the two cameras are.
DUAL_CAMERA_PARAMETERS = _OWN + tuple(p for p in CAMERA_PARAMETERS if p.name not in _NAMES and not p.name.startswith('camera.'))


def check_pair(values: Mapping) -> None:
    """Check what depends on several parameters: of any driver, and of two cameras. Raises BadArgument."""
    check_together(values)
    two = values['layout'] == 'two'
    if values['source'] == 'file' and two and not values['right_path']:
        raise BadArgument('parameter right_path is empty, but source file needs two videos or folders; or set layout to side_by_side')
    if values['source'] == 'device' and two and values['device'] == values['right_device']:
        raise BadArgument(f'parameters device and right_device both name {values["device"]!r}; name two, or set layout to side_by_side')
    if values['source'] in ('bag', 'topics') and two and values['topic'] == values['right_topic'] and not values['right_path']:
        raise BadArgument(f'parameters topic and right_topic are both {values["topic"]!r}; name two')
