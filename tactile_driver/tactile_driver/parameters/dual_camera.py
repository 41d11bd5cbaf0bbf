# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of dual_camera_node."""
from __future__ import annotations

from collections.abc import Mapping

from .camera import CAMERA_PARAMETERS, check_together as check_one_camera
from ..errors import BadArgument
from ..sources.dual_camera.registry import DUAL_SOURCES, LAYOUTS
from ..stitching.methods import STITCHERS
from .table import Parameter

_OWN = (
    Parameter('source', str, 'sim', '', 'where pairs come from: simulated sensor, cameras, videos or folders of images, rosbag2 recording, '
              'two image topics', choices=DUAL_SOURCES),
    Parameter('layout', str, 'two', '', 'device, file, bag: two sources, or one with both views side by side', choices=LAYOUTS),
    Parameter('device', str, '0', '', 'device: left camera, or the one with both views: index, /dev path, name under /dev/v4l/by-id, or '
              'part of a serial number'),
    Parameter('right_device', str, '1', '', 'device: right camera, named in the same way'),
    Parameter('path', str, '', '', 'file, bag: the left video or folder of images, or the rosbag2 folder'),
    Parameter('right_path', str, '', '', 'file, bag: the right one; bag: empty where one bag has both'),
    Parameter('topic', str, 'left/image_raw', '', 'bag, topics: the topic with the left images, or with both views'),
    Parameter('right_topic', str, 'right/image_raw', '', 'bag, topics: the topic with the right images'),
    Parameter('scene', str, 'areal_dual_demo', '', 'sim: the scene; an unknown name is answered with those that exist'),
    Parameter('max_skew', float, 0.008, 's', 'device, bag, topics: most that stamps of a pair differ; half a period at most', 0.0, 10.0),
    Parameter('width', int, 0, 'px', "device: width of the images; 0: the camera's own", 0, 8192),
    Parameter('height', int, 0, 'px', "device: height of the images; 0: the camera's own", 0, 8192),
    Parameter('stitching', str, 'plane', '', "how image_raw is made: plane (metric, seam between markers) or middle (the paper's "
              'cut at the middle of what both see)', choices=tuple(STITCHERS)),
    Parameter('stitching_path', str, '', '', 'calibration file with a stitching, from calibrate; empty: views are put side by side'),
    Parameter('overlap', int, 0, 'px', 'without stitching_path: columns at the inner edges of both views that show the same', 0, 8192),
    Parameter('frame_id', str, 'areal_dual', '', 'the sensor frame, in every header'),
    Parameter('sensor_type', str, 'areal_dual', '', 'kind of sensor, in the description'),
    Parameter('camera_info_path', str, '', '', "YAML file of camera_calibration, left camera; empty: the source's own or uncalibrated"),
    Parameter('right_camera_info_path', str, '', '', 'the same of the right camera'),
)
_NAMES = {p.name for p in _OWN}

DUAL_CAMERA_PARAMETERS = _OWN + tuple(p for p in CAMERA_PARAMETERS if p.name not in _NAMES)


def check_together(values: Mapping) -> None:
    """What one parameter alone cannot tell. Raises BadArgument."""
    check_one_camera(values)
    two = values['layout'] == 'two'
    if values['source'] == 'file' and two and not values['right_path']:
        raise BadArgument('parameter right_path is empty, but source file needs two videos or folders; or set layout to side_by_side')
    if values['source'] == 'device' and two and values['device'] == values['right_device']:
        raise BadArgument(f'parameters device and right_device both name {values["device"]!r}; name two, or set layout to side_by_side')
    if values['source'] in ('bag', 'topics') and two and values['topic'] == values['right_topic'] and not values['right_path']:
        raise BadArgument(f'parameters topic and right_topic are both {values["topic"]!r}; name two')
