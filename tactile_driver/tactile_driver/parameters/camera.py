# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of camera_node."""
from __future__ import annotations

from collections.abc import Mapping

from ..errors import BadArgument
from ..frame import ENCODINGS
from .shared import AUTOSTART, SCENE, SEED, sensor_parameters
from ..sources.registry import CAMERA_SOURCES
from .table import Parameter

CAMERA_PARAMETERS = (
    Parameter('source', str, 'sim', '', 'origin of the images: sim (simulated sensor), device (camera), file (video or folder of images) '
              'or bag (rosbag2 recording)', choices=tuple(CAMERA_SOURCES)),
    Parameter('device', str, '0', '', 'source device: index, /dev path, name under /dev/v4l/by-id, or part of a serial number'),
    Parameter('path', str, '', '', 'source file: the video or folder of images; source bag: the rosbag2 folder'),
    Parameter('topic', str, '', '', 'source bag: the image topic; empty if the bag has only one'),
    SCENE,
    SEED,
    Parameter('rate', float, -1.0, 'Hz', "frame rate; -1: the source's own (sim: 30 Hz); sources file and bag, 0: as fast as subscribers "
              'receive', -1.0, 1000.0),
    Parameter('loop', bool, False, '', 'sources file and bag: restart at the end (sim always does)'),
    Parameter('width', int, 0, 'px', "sources device and sim: image width; 0: the source's own", 0, 8192),
    Parameter('height', int, 0, 'px', "sources device and sim: image height; 0: the source's own", 0, 8192),
    Parameter('pixel_format', str, '', '', "source device: FOURCC code, such as MJPG, YUYV or GREY; empty: the camera's own"),
    Parameter('exposure', float, 0.0, 's', 'source device: exposure time; 0: automatic. May be changed while active', 0.0, 10.0),
    Parameter('encoding', str, '', '', 'encoding of image_raw; empty: bgr8 for colour, mono8 for grey', choices=('', *ENCODINGS)),
    *sensor_parameters('touchpad'),
    Parameter('camera.rotation', list[float], [0.0, 0.0, 0.0], 'rad', 'rotation vector from sensor to camera frame', -10.0, 10.0),
    Parameter('camera.translation', list[float], [0.0, 0.0, 0.0], 'm', "sensor frame's origin in the camera frame; zeros: not known, and "
              'not published on /tf_static', -10.0, 10.0),
    Parameter('camera_info_path', str, '', '', "calibration file of camera_calibration (YAML); empty: the source's own (sim, bag), "
              'else uncalibrated'),
    AUTOSTART,
)


def known_pose(values: Mapping) -> dict[str, tuple[list[float], list[float]]]:
    """'' -> (rotation vector, translation) of the camera, as of camera_transforms; empty where it is not known. Raises BadArgument."""
    rotation, translation = values['camera.rotation'], values['camera.translation']
    if len(rotation) != 3 or len(translation) != 3:
        raise BadArgument('parameters camera.rotation and camera.translation must have three numbers each')
    return {'': (rotation, translation)} if any(translation) else {}
