# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the nodes of this package."""
from __future__ import annotations

from tactile_driver.parameters.table import Parameter


def _arrows(length: float, force: float, torque: float, read_only: bool = False) -> tuple[Parameter, ...]:
    """Parameters of the arrows of a wrench, with their defaults."""
    return (Parameter('force_length', float, length, 'm', 'length of the arrows of full_force and full_torque; none is longer', 0.0, 10.0,
                      read_only=read_only),
            Parameter('full_force', float, force, 'N', 'force whose arrow has its full length: the largest of the calibrated range', 1e-6,
                      1e6, read_only=read_only),
            Parameter('full_torque', float, torque, 'N m', 'torque whose arrow has its full length', 1e-9, 1e6, read_only=read_only))


_TEXT = (
    Parameter('text.height', float, 0.0, 'm', 'height of the letters of a sensor of a hand; 0: in proportion to the sensor, a line for '
              'each quantity', 0.0, 10.0, read_only=True),
    Parameter('text.side', list[float], [1.0, 1.0, 0.0], '', 'where the text stands beside the sensor, in half widths, in the sensor frame',
              -1.0, 1.0, read_only=True),
    Parameter('text.up', list[float], [0.0, 0.0, 1.0], '', 'unit vector from a line of the text to the one above, in the sensor frame',
              -1.0, 1.0, read_only=True),
)

MARKERS_PARAMETERS = (
    Parameter('frame_id', str, 'touchpad', '', 'the sensor frame', read_only=True),
    Parameter('camera.rotation', list[float], [0.0, 0.0, 0.0], 'rad', 'rotation vector from sensor to camera frame', -10.0, 10.0,
              read_only=True),
    Parameter('camera.translation', list[float], [0.0, 0.0, 0.04], 'm', "sensor frame's origin in the camera frame", -10.0, 10.0,
              read_only=True),
    Parameter('calibration', str, '', '', 'of two cameras: calibration file, which tells where places appear in the stitched picture',
              read_only=True),
    Parameter('dot_size', float, 0.0006, 'm', 'diameter of a dot among the markers; lines and arrows are in proportion', 1e-5, 1.0),
    Parameter('dot_colour', str, 'state', '', 'what colours dots tell: contact state, or depth under the untouched sheet or dome',
              choices=('state', 'depth')),
    Parameter('sensor_type', str, 'touchpad', '', 'tells what the untouched surface is: a cap, a sheet or a dome', read_only=True),
    Parameter('cap.curvature_radius', float, 0.020, 'm', 'touchpad: radius of the untouched sphere', 1e-4, 10.0, read_only=True),
    Parameter('cap.height', float, 0.013, 'm', 'touchpad: height over the rim', 1e-4, 10.0, read_only=True),
    Parameter('dome.rim_radius', float, 0.0, 'm', 'air_cushion: radius of the rim', 0.0, 10.0, read_only=True),
    Parameter('dome.height', float, 0.0, 'm', 'air_cushion: height over the rim', 0.0, 10.0, read_only=True),
    Parameter('full_depth', float, 0.003, 'm', 'depth under the untouched surface where the scale of colours ends', 1e-5, 1.0),
    Parameter('normal_length', float, 0.006, 'm', "length of a contact's normal", 0.0, 10.0),
    Parameter('picture_rate', float, 0.0, 'Hz', 'image_annotated is drawn at most so often, by the stamps; 0: for each image', 0.0, 1000.0,
              read_only=True),
    *_arrows(0.009, 4.0, 0.03), *_TEXT,
)

FINGER_MARKERS_PARAMETERS = (
    Parameter('frame_id', str, 'psd_finger', '', 'the sensor frame; /tf_static tells where its tip is', read_only=True),
    Parameter('radius', float, 0.016, 'm', "of the hemisphere's outside", 1e-4, 1.0, read_only=True),
    Parameter('point_size', float, 0.0015, 'm', 'diameter of a contact among the markers; lines and arrows are in proportion', 1e-5, 1.0,
              read_only=True),
    Parameter('normal_length', float, 0.008, 'm', "length of a contact's normal", 0.0, 10.0, read_only=True),
    Parameter('rate', float, 30.0, 'Hz', 'markers and pictures are drawn at most so often, by the stamps', 0.1, 1000.0, read_only=True),
    *_TEXT,
)

TAXEL_MARKERS_PARAMETERS = (
    Parameter('frame_id', str, 'taxel_array', '', 'the sensor frame; /tf_static tells where the taxels are', read_only=True),
    Parameter('pitch', float, 0.001, 'm', 'from taxel to taxel; lines and arrows are in proportion', 1e-5, 0.1, read_only=True),
    Parameter('cell_height', float, 0.002, 'm', 'of the pad: so far under its surface the cells are drawn', 1e-5, 0.1, read_only=True),
    Parameter('full_value', float, 120.0, '', 'value of a taxel where the scale of colours ends', 1.0, 65535.0, read_only=True),
    Parameter('normal_length', float, 0.006, 'm', "length of a contact's normal", 0.0, 10.0, read_only=True),
    *_arrows(0.009, 120.0, 1.0, read_only=True),
    Parameter('flow_scale', float, 0.5, 's', 'length of the flow arrows for each m/s', 0.0, 1e3, read_only=True),
    Parameter('rate', float, 30.0, 'Hz', 'markers and pictures are drawn at most so often, by the stamps', 0.1, 1000.0, read_only=True),
    *_TEXT,
)

RECORD_PARAMETERS = (
    Parameter('bag', str, '', '', 'rosbag2 folder (MCAP) to write; it must not exist', read_only=True),
    Parameter('pictures', bool, False, '', 'record markers and image_annotated too, which can be made again from the rest', read_only=True),
    Parameter('patience', float, 15.0, 's', 'how long raw data wait for somebody who works on them: a recording that is played begins with '
              'its first subscriber', 0.0, 1e3, read_only=True),
)

CALIBRATE_PARAMETERS = (
    Parameter('probe', str, '', '', "frame of /tf at the probe's tip", read_only=True),
    Parameter('frame_id', str, 'areal_single', '', 'the sensor frame', read_only=True),
    Parameter('tip_radius', float, 0.0, 'm', "of the probe's round tip; a touchpad and a dome need it", 0.0, 1.0, read_only=True),
    Parameter('wrench', str, '', '', 'topic of a force/torque sensor, in any frame of /tf; empty: no forces', read_only=True),
    Parameter('weights', list[float], [], 'N', 'array: known weights, in the order in which they are laid on', 0.0, 1e5, read_only=True),
    Parameter('holes', list[float], [], 'm', 'x y of each hole of a guide plate, in the order in which they are pressed', -10.0, 10.0,
              read_only=True),
    Parameter('collars', list[float], [], 'm', 'depths to which the collars of a hand-held tool let it in', 0.0, 1.0, read_only=True),
    Parameter('mounting', list[float], [], '', 'x y z, m, and rotation vector, rad, of the sensor in the frame base; empty: /tf has it',
              read_only=True),
    Parameter('find', bool, False, '', 'touches find the sensor first; mounting is known by hand only', read_only=True),
    Parameter('base', str, 'base_link', '', 'frame of /tf in which mounting is', read_only=True),
    Parameter('params', str, '', '', "the sensor's parameter file", read_only=True),
    Parameter('output', str, '', '', 'calibration file to write; the presses are kept in a folder beside it', read_only=True),
)

HAND_PARAMETERS = (
    Parameter('hand', str, '', '', 'YAML file with the sensors of the hand, or its URDF or xacro file', read_only=True),
    Parameter('publish_frames', bool, True, '', 'publish the frames on /tf and /tf_static; false where robot_state_publisher does',
              read_only=True),
    Parameter('simulated_joints', bool, False, '', 'of a URDF: move all joints slowly on /joint_states while nobody else does',
              read_only=True),
)

#: Frames/s of the demo's video, and its pictures; chosen: half a camera's usual 30, for drawing and encoding take most of a core.
VIDEO_RATE = 15.0

DEMO_PARAMETERS = (
    Parameter('out', str, 'out/demo', '', 'folder for pictures and video', read_only=True),
    Parameter('seconds', float, 25.0, 's', 'how long it lasts, by the stamps; 0: until nothing comes any more', 0.0, 1e6, read_only=True),
    Parameter('patience', float, 30.0, 's', 'how long it waits for the first frame', 0.1, 1e6, read_only=True),
)
