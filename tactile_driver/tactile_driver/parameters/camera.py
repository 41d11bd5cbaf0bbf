# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of camera_node."""
from __future__ import annotations

from collections.abc import Mapping

from ..errors import BadArgument
from ..frame import ENCODINGS
from ..sources.camera.registry import SOURCES
from .table import Parameter

CAMERA_PARAMETERS = (
    Parameter('source', str, 'sim', '', 'where frames come from: simulated sensor, camera, video or folder of images, rosbag2 recording',
              choices=tuple(SOURCES)),
    Parameter('device', str, '0', '', 'device: index, /dev path, name under /dev/v4l/by-id, or part of a serial number'),
    Parameter('path', str, '', '', 'file, bag: the video, the folder of images or the rosbag2 folder'),
    Parameter('topic', str, '', '', 'bag: the topic with the images; empty where the bag has only one'),
    Parameter('scene', str, 'demo', '', 'sim: the scene; an unknown name is answered with those that exist'),
    Parameter('seed', int, 0, '', 'sim: of the noise and of the irregularities of the specimen', 0, 2**31 - 1),
    Parameter('rate', float, -1.0, 'Hz', "-1: the source's own (sim 30); file, bag: 0 for as fast as it is consumed", -1.0, 1000.0),
    Parameter('loop', bool, False, '', 'file, bag: start again at the end (sim always does)'),
    Parameter('width', int, 0, 'px', "device, sim: width of the image; 0: the source's own", 0, 8192),
    Parameter('height', int, 0, 'px', "device, sim: height of the image; 0: the source's own", 0, 8192),
    Parameter('pixel_format', str, '', '', "device: FOURCC as MJPG, YUYV or GREY; empty: the camera's own"),
    Parameter('exposure', float, 0.0, 's', 'device: exposure time; 0: automatic. Takes effect at once', 0.0, 10.0),
    Parameter('encoding', str, '', '', 'of image_raw; empty: colour as bgr8, grey as mono8, as they come', choices=('', *ENCODINGS)),
    Parameter('frame_id', str, 'touchpad', '', 'the sensor frame, in every header'),
    Parameter('sensor_type', str, 'touchpad', '', 'kind of sensor, in the description'),
    Parameter('camera_info_path', str, '', '', "YAML file of camera_calibration; empty: the source's own (sim, bag) or uncalibrated"),
    Parameter('autostart', bool, True, '', 'configure and activate by itself, and again while the device is missing', read_only=True),
)
LIVE = frozenset({'exposure'})


def check_together(values: Mapping) -> None:
    """What one parameter alone cannot tell. Raises BadArgument."""
    if values['source'] in ('file', 'bag') and not values['path']:
        raise BadArgument(f'parameter path is empty, but source {values["source"]} needs the path of a recording')
    if -1 < values['rate'] < 0:
        raise BadArgument(f'parameter rate is {values["rate"]}, but must be -1, 0 or a rate above 0 Hz')
    if not values['frame_id']:
        raise BadArgument('parameter frame_id is empty; name the sensor frame')
