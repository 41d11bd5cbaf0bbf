# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of all drivers, and the checks across them. No ROS here."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ..camera.v4l2 import CONTROLS
from ..errors import BadArgument
from ..frame import ENCODINGS
from ..serial.frames import LARGEST
from ..serial.psd import FORMATS
from ..sources.array_file import AXES
from ..sources.registry import CAMERA_CHOICES, DUAL_CAMERA_CHOICES, PSD_SOURCES, TAXEL_SOURCES
from ..stitching.methods import STITCHERS
from .table import Parameter

SCENE = Parameter('scene', str, 'demo', '', 'source sim: name of the scene; an unknown name lists all names')
SEED = Parameter('seed', int, 0, '', 'source sim: seed of the noise and of the manufacturing tolerances of the sensor', 0, 2**31 - 1)
#: names of the parameters that may be changed while a driver is active
LIVE = frozenset(CONTROLS)
_OR = ', may be changed while active; 0: automatic where the camera has that; -1: leave it'
AUTOSTART = Parameter('autostart', bool, True, '', 'configure and activate at start, retry while the device is missing', read_only=True)
STAY = Parameter('stay', bool, True, '', 'sources file and bag: wait when the recording is over; false: end the process', read_only=True)
SERIAL_DEVICE = Parameter('device', str, '', '', 'source device: path, name under /dev/serial/by-id, or part of a USB serial number')


def sensor_parameters(sensor_type: str) -> tuple[Parameter, Parameter]:
    """frame_id and sensor_type, with the sensor type as default of both."""
    return (Parameter('frame_id', str, sensor_type, '', 'sensor frame; images and camera_info are in <frame_id>_camera_optical'),
            Parameter('sensor_type', str, sensor_type, '', 'sensor type, published in the description'))


def check_together(values: Mapping) -> None:
    """Check what depends on several parameters of a driver. Raises BadArgument."""
    if values['source'] in ('file', 'bag') and not values['path']:
        raise BadArgument(f'parameter path is empty, but source {values["source"]} needs the path of a recording')
    if -1 < values['rate'] < 0:
        raise BadArgument(f'parameter rate is {values["rate"]}, but must be -1, 0 or a rate above 0 Hz')
    if not values['frame_id']:
        raise BadArgument('parameter frame_id is empty; name the sensor frame')


CAMERA_PARAMETERS = (
    Parameter('source', str, 'sim', '', 'origin of the images: sim (simulated sensor), device (camera), file (video or folder of images), '
              "bag (rosbag2 recording) or topics (images of another camera's driver)", choices=CAMERA_CHOICES),
    Parameter('device', str, '0', '', 'source device: index, /dev path, name under /dev/v4l/by-id, or part of a serial number'),
    Parameter('path', str, '', '', 'source file: the video or folder of images; source bag: the rosbag2 folder'),
    Parameter('topic', str, '', '', 'source bag: the image topic, empty if the bag has only one; topics: raw or .../compressed; '
              'camera_info is taken from beside it'),
    SCENE,
    SEED,
    Parameter('rate', float, -1.0, 'Hz', "frame rate; -1: the source's own (sim: 30 Hz); sources file and bag, 0: as fast as subscribers "
              'receive', -1.0, 1000.0),
    Parameter('loop', bool, False, '', 'sources file and bag: restart at the end (sim always does)'),
    Parameter('width', int, 0, 'px', "sources device and sim: image width; 0: the source's own", 0, 8192),
    Parameter('height', int, 0, 'px', "sources device and sim: image height; 0: the source's own", 0, 8192),
    Parameter('pixel_format', str, '', '', "source device: FOURCC code, such as MJPG, YUYV or GREY; empty: the one with the best "
              "colours that carries the rate; if rate is -1, the camera's own"),
    Parameter('exposure', float, -1.0, 's', f'source device: exposure time{_OR}', -1.0, 10.0),
    Parameter('gain', float, -1.0, '', f"source device: gain in the driver's units{_OR}", -1.0, 1e6),
    Parameter('white_balance', float, -1.0, 'K', f'source device: colour temperature of white{_OR}', -1.0, 20000.0),
    Parameter('focus', float, -1.0, '', f"source device: focus in the driver's units{_OR}", -1.0, 1e6),
    Parameter('power_line_frequency', int, -1, 'Hz', 'source device: of lamps whose flicker the camera evens out; 0: none; -1: leave it',
              choices=(-1, 0, 50, 60)),
    Parameter('encoding', str, '', '', 'encoding of image_raw; empty: bgr8 for colour, mono8 for grey', choices=('', *ENCODINGS)),
    *sensor_parameters('touchpad'),
    Parameter('camera.rotation', list[float], [0.0, 0.0, 0.0], 'rad', 'rotation vector from sensor to camera frame', -10.0, 10.0),
    Parameter('camera.translation', list[float], [0.0, 0.0, 0.0], 'm', "sensor frame's origin in the camera frame; zeros: not known, and "
              'not published on /tf_static', -10.0, 10.0),
    Parameter('camera_info_url', str, '', '', "calibration file of camera_calibration (YAML); empty: the source's own (sim, bag, topics), "
              'else uncalibrated'),
    STAY,
    AUTOSTART,
)


def known_pose(values: Mapping) -> dict[str, tuple[list[float], list[float]]]:
    """'' -> (rotation vector, translation) of the camera, as of camera_transforms; empty where it is not known. Raises BadArgument."""
    rotation, translation = values['camera.rotation'], values['camera.translation']
    if len(rotation) != 3 or len(translation) != 3:
        raise BadArgument('parameters camera.rotation and camera.translation must have three numbers each')
    return {'': (rotation, translation)} if any(translation) else {}


_OWN = (
    Parameter('source', str, 'sim', '', 'origin of the image pairs: sim (simulated sensor), device (cameras), file (videos or folders of '
              'images), bag (rosbag2 recording) or topics (two image topics)', choices=DUAL_CAMERA_CHOICES),
    Parameter('device', str, '0', '', 'source device: left camera: index, /dev path, name under '
              '/dev/v4l/by-id, or part of a serial number'),
    Parameter('right_device', str, '1', '', 'source device: right camera, named as the left one'),
    Parameter('path', str, '', '', 'source file: the left video or folder of images; source bag: the rosbag2 folder'),
    Parameter('right_path', str, '', '', 'source file: the right video or folder; source bag: bag of the right camera, empty if one bag '
              'has both'),
    Parameter('topic', str, 'left/image_raw', '', 'sources bag and topics: topic of the left images'),
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
    Parameter('camera_info_url', str, '', '', "calibration file of camera_calibration (YAML) of the left camera; empty: the source's own "
              '(sim, bag), else uncalibrated'),
    Parameter('right_camera_info_url', str, '', '', 'the same of the right camera'),
)
_NAMES = {p.name for p in _OWN}

#: The calibration of the stitching holds the poses of both cameras.
DUAL_CAMERA_PARAMETERS = _OWN + tuple(p for p in CAMERA_PARAMETERS if p.name not in _NAMES and not p.name.startswith('camera.'))


def check_pair(values: Mapping) -> None:
    """Check what depends on several parameters: of any driver, and of two cameras. Raises BadArgument."""
    check_together(values)
    if values['source'] == 'file' and not values['right_path']:
        raise BadArgument('parameter right_path is empty, but source file needs two videos or folders')
    if values['source'] == 'device' and values['device'] == values['right_device']:
        raise BadArgument(f'parameters device and right_device both name {values["device"]!r}; name two')
    if values['source'] in ('bag', 'topics') and values['topic'] == values['right_topic'] and not values['right_path']:
        raise BadArgument(f'parameters topic and right_topic are both {values["topic"]!r}; name two')


PSD_DRIVER_PARAMETERS = (
    Parameter('source', str, 'sim', '', 'origin of the samples: sim (simulated finger), device (serial port) or bag (rosbag2 recording)',
              choices=PSD_SOURCES),
    SERIAL_DEVICE,
    Parameter('baud', int, 921600, 'bit/s', 'source device: baud rate', 300, 20_000_000),
    Parameter('format', str, 'binary', '', 'source device: format of the stream, see doc/serial_protocol.md', choices=FORMATS),
    Parameter('adc.full_scale', float, 5.0, 'V', 'source device: voltage that the count 2**bits of the converter would mean', 1e-3, 1e3),
    Parameter('adc.bits', int, 12, '', 'source device, format csv: resolution of the converter; binary frames state it', 8, 16),
    Parameter('modulation', bool, False, '',
              "source device: the finger's light is on in every second sample, and a fifth column indicates which; "
              'the dark samples are subtracted and half as many net samples published'),
    Parameter('saturation', float, 4.9, 'V', 'voltage from which an output counts as saturated in /diagnostics', 1e-3, 1e3),
    Parameter('batch_period', float, 0.005, 's', 'sources device and sim: time that the samples of one message span', 0.001, 0.05),
    Parameter('path', str, '', '', 'source bag: the rosbag2 folder'),
    Parameter('topic', str, '', '', 'source bag: the topic with the voltages; empty if the bag has only one'),
    SCENE,
    SEED,
    Parameter('rate', float, -1.0, 'Hz', "sim: sample rate; bag: message rate, 0: as fast as subscribers receive; -1: the source's own "
              "(sim: 1000)", -1.0, 20000.0),
    Parameter('loop', bool, False, '', 'source bag: restart at the end (sim always does)'),
    *sensor_parameters('psd_finger'),
    STAY,
    AUTOSTART,
)


#: How a driver of taxels plays scenes and recordings.
PLAYED_FRAMES = (
    SCENE,
    SEED,
    Parameter('rate', float, -1.0, 'Hz', "frame rate; -1: the source's own (sim: 100 Hz); sources file and bag, 0: as fast as subscribers "
              'receive', -1.0, 20000.0),
    Parameter('loop', bool, False, '', 'sources file and bag: restart at the end (sim always does)'),
)

TAXEL_DRIVER_PARAMETERS = (
    Parameter('source', str, 'sim', '', 'origin of the images: sim (simulated array), device (serial port), file (.npz, .npy, .csv '
              'or a folder of them) or bag (rosbag2 recording)', choices=TAXEL_SOURCES),
    SERIAL_DEVICE,
    Parameter('baud', int, 12000000, 'bit/s', 'source device: baud rate', 300, 20_000_000),
    Parameter('path', str, '', '', 'source file: the file or folder; source bag: the rosbag2 folder'),
    Parameter('topic', str, '', '', 'source bag: the image topic; source file: the array in an .npz; empty if there is only one'),
    *PLAYED_FRAMES,
    Parameter('rows', int, 44, '', 'rows of taxels in the published image', 1, LARGEST),
    Parameter('columns', int, 44, '', 'columns of taxels in the published image', 1, LARGEST),
    Parameter('transposed', bool, False, '', 'sources device, file and bag: exchange rows and columns'),
    Parameter('flip_rows', bool, False, '', 'sources device, file and bag: reverse the order of the rows (after transposed)'),
    Parameter('flip_columns', bool, False, '', 'sources device, file and bag: reverse the order of the columns (after transposed)'),
    Parameter('layout', list[int], [-1], '', 'source file: of each cell, row by row, the number of its value among those of a frame, from '
              '0; -1: no taxel there; only -1: the values are row by row', -1, 2**31 - 1),
    Parameter('axis', str, 'z', '', 'source file: which of three numbers of a taxel is shown', choices=tuple(AXES)),
    Parameter('inverted', bool, False, '', 'source file: pressing lowers the values'),
    *sensor_parameters('taxel_array'),
    STAY,
    AUTOSTART,
)
