# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The sensor type `photometric_gel`: a gel with an opaque skin, lit from the sides in several colours, above a camera."""
from ..core.sensor_type import CAMERA_INFO, CAMERA_SOURCES, SensorType

_ABOUT = ('# A gel with an opaque skin that lamps of several colours light from the sides, with dots or without: its shape,\n'
          '# contact region, contacts.\n'
          '# gel.scale and a calibration with a ball are needed (docs/photometric_gel.md).\n')
_MINI = ('# GelSight Mini without markers: depth, contact region, contacts.\n'
          "# The scale is by its maker's software: 0.0634 mm a pixel of 320 x 240. A calibration with a ball is needed\n"
          '# (docs/photometric_gel.md).\n')
_DIGIT = ("# DIGIT without markers: depth, contact region, contacts. The format is by its maker's software, digit.py of\n"
          '# github.com/facebookresearch/digit-interface: 320 x 240 at 60 or 30 images a second, 640 x 480 at 30 or 15.\n'
          '# Its lamps are set by the camera control zoom; all bright: v4l2-ctl -d DEVICE -c zoom_absolute=4095\n'
          '# The scale is not published: measure it as gel.scale, and calibrate with a ball (docs/photometric_gel.md).\n')

PHOTOMETRIC_GEL = SensorType(
    driver='camera_node',
    perception='photometric_contact_node',
    view='surface_markers_node',
    rviz='touchpad',
    sources=CAMERA_SOURCES,
    arguments=CAMERA_INFO,
    uncalibrated='depth needs a calibration; press a ball of known radius at twenty positions',
    calibration_parameters=('gel.scale',),
    calibrate='tactile_perception.photometric.tools:calibrate_gel',
    loaded='through a ball in the middle of the gel',
    calibrate_options=('sphere_radius', 'weight'),
    parameters='tactile_perception.photometric.parameters:PHOTOMETRIC_SENSOR_PARAMETERS',
    files={'photometric_gel': (_ABOUT, {}),
           'gelsight_mini_photometric': (_MINI, {'width': 640, 'height': 480, 'gel.scale': 3.17e-05}),
           'digit_photometric': (_DIGIT, {'width': 320, 'height': 240, 'rate': 60.0})},
    simulated={'scene': 'photometric_demo', 'gel.scale': 3e-05},
    calibration_scene=('photometric_calib', 8.0, {'sphere_radius': 0.0025}),
)
