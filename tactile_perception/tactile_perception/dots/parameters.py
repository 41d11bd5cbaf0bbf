# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of sensors with dots: how dots are found and numbered. All are fixed at start."""
from __future__ import annotations

from dataclasses import replace
from functools import partial

from tactile_driver.parameters.table import Parameter

from .detect import METHODS, POLARITIES
from .number import AUTO, METHODS as NUMBERING, WITHOUT_GRID

fixed = partial(Parameter, read_only=True)

IMAGES, DOTS = 'images', 'dots'


def camera_pose_parameters(distance: float) -> tuple[Parameter, ...]:
    """The camera's pose in the sensor; distance: m, default along the optical axis, 0 for not known."""
    return (
        fixed('camera.rotation', list[float], [0.0, 0.0, 0.0], 'rad', 'rotation vector from sensor to camera frame', -10.0, 10.0),
        fixed('camera.translation', list[float], [0.0, 0.0, distance], 'm', "sensor frame's origin in the camera frame", -10.0, 10.0),
    )


def pattern_parameters(sensor_type: str, rows: int = 0, columns: int = 0, choices: tuple[str, ...] = ()) -> tuple[Parameter, ...]:
    """The sensor type and the size of the printed pattern, with these defaults; choices: of the sensor type, () for any."""
    return (
        fixed('sensor_type', str, sensor_type, '', 'sensor type; a calibration file must be for the same type', choices=choices),
        fixed('rows', int, rows, '', 'rows of the printed grid; rows and columns 0: the pattern is not a grid', 0, 250),
        fixed('columns', int, columns, '', 'columns of the printed grid', 0, 250),
    )


def detection_parameters(polarity: str = 'any', detection: str = 'auto', numbering: str = AUTO) -> tuple[Parameter, ...]:
    """How dots are found, numbered and compared with the reference, with these defaults."""
    return (
        fixed('input', str, IMAGES, '', 'what is processed: images, or the topic dots of another node or of a recording',
              choices=(IMAGES, DOTS)),
        fixed('frame_id', str, '', '', 'sensor frame, in which all results are; empty: named as the namespace, with _ for /'),
        fixed('polarity', str, polarity, '', 'dots darker or brighter than the background; any: detection auto measures it',
              choices=tuple(POLARITIES)),
        fixed('detection', str, detection, '', 'dot detection method', choices=METHODS),
        fixed('mask', str, '', 'px', 'what of the image shows the sensor: an image file of its size, white there, or a polygon '
              'x,y,x,y,...; empty: all'),
        fixed('numbering', str, numbering, '', 'dot indexing method; auto: finds a grid, else tracks; tracks, register, sort: other '
              'patterns', choices=(AUTO, *NUMBERING.own, *WITHOUT_GRID.own)),
        fixed('reference.frames', int, 10, '', 'untouched frames averaged for the reference', 1, 1000),
        fixed('reference.time_constant', float, 30.0, 's',
              'time constant with which the reference follows drift while nothing touches', 0.1, 1e6),
    )


#: Of dot_tracker_node: dots of a sensor that has no model of contact.
DOT_SENSOR_PARAMETERS = pattern_parameters('dots')
#: Those that may change while the node runs: a new tracker is made, with a new reference.
TUNED = 'polarity', 'detection', 'mask'
DOT_PARAMETERS = DOT_SENSOR_PARAMETERS + tuple(
    replace(one, read_only=one.name not in TUNED) for one in detection_parameters() if one.name != 'input')
