# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the nodes of this package."""
from __future__ import annotations

from tactile_driver.parameters.table import Parameter

from ..grasp.controller import GripLimits
from ..grasp.objects import FLAT_PAD, PADS


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
              -2.0, 2.0, read_only=True),
    Parameter('text.up', list[float], [0.0, 0.0, 1.0], '', 'unit vector from a line of the text to the one above, in the sensor frame',
              -1.0, 1.0, read_only=True),
)

MARKERS_PARAMETERS = (
    Parameter('frame_id', str, 'touchpad', '', 'the sensor frame', read_only=True),
    Parameter('camera.rotation', list[float], [0.0, 0.0, 0.0], 'rad', 'rotation vector from sensor to camera frame', -10.0, 10.0,
              read_only=True),
    Parameter('camera.translation', list[float], [0.0, 0.0, 0.04], 'm', "sensor frame's origin in the camera frame", -10.0, 10.0,
              read_only=True),
    Parameter('calibration', str, '', '', 'two cameras: calibration file, which maps positions to pixels of the stitched image',
              read_only=True),
    Parameter('dot_size', float, 0.0006, 'm', 'diameter of a dot among the markers; lines and arrows are in proportion', 1e-5, 1.0),
    Parameter('dot_colour', str, 'state', '', 'what the colour of a dot shows: contact state, or depth below the undeformed sheet or dome',
              choices=('state', 'depth')),
    Parameter('sensor_type', str, 'touchpad', '', 'sensor type, which determines the undeformed surface: a cap, a sheet or a dome',
              read_only=True),
    Parameter('cap.curvature_radius', float, 0.020, 'm', 'touchpad: radius of the undeformed sphere', 1e-4, 10.0, read_only=True),
    Parameter('cap.height', float, 0.013, 'm', 'touchpad: height over the rim', 1e-4, 10.0, read_only=True),
    Parameter('dome.rim_radius', float, 0.0, 'm', 'air_cushion: radius of the rim', 0.0, 10.0, read_only=True),
    Parameter('dome.height', float, 0.0, 'm', 'air_cushion: height over the rim', 0.0, 10.0, read_only=True),
    Parameter('full_depth', float, 0.003, 'm', 'depth below the undeformed surface where the colour scale ends', 1e-5, 1.0),
    Parameter('normal_length', float, 0.006, 'm', "length of a contact's normal", 0.0, 10.0),
    Parameter('picture_rate', float, 0.0, 'Hz', 'maximum rate of image_annotated, by the stamps; 0: each image', 0.0, 1000.0,
              read_only=True),
    *_arrows(0.009, 4.0, 0.03), *_TEXT,
)

FINGER_MARKERS_PARAMETERS = (
    Parameter('frame_id', str, 'psd_finger', '', 'the sensor frame; /tf_static has the position of its tip', read_only=True),
    Parameter('radius', float, 0.016, 'm', 'outer radius of the hemisphere', 1e-4, 1.0, read_only=True),
    Parameter('point_size', float, 0.0015, 'm', 'diameter of a contact among the markers; lines and arrows are in proportion', 1e-5, 1.0,
              read_only=True),
    Parameter('normal_length', float, 0.008, 'm', "length of a contact's normal", 0.0, 10.0, read_only=True),
    Parameter('rate', float, 30.0, 'Hz', 'maximum rate of markers and images, by the stamps', 0.1, 1000.0, read_only=True),
    *_TEXT,
)

SURFACE_MARKERS_PARAMETERS = (
    Parameter('frame_id', str, 'sensor', '', 'the sensor frame; /tf_static has the position of the surface', read_only=True),
    Parameter('gel.scale', float, 0.0, 'm', 'length on the gel that one pixel of the image shows', 0.0, 0.1, read_only=True),
    Parameter('dot_size', float, 0.0004, 'm', 'diameter of a point of the surface; lines and arrows are in proportion', 1e-5, 1.0,
              read_only=True),
    Parameter('full_depth', float, 0.001, 'm', 'depth where the colour scale ends', 1e-5, 1.0, read_only=True),
    Parameter('normal_length', float, 0.004, 'm', "length of a contact's normal", 0.0, 10.0, read_only=True),
    *_arrows(0.009, 10.0, 0.03, read_only=True),
    Parameter('rate', float, 30.0, 'Hz', 'maximum rate of markers and images, by the stamps', 0.1, 1000.0, read_only=True),
    *_TEXT,
)

FORCE_MARKERS_PARAMETERS = (
    Parameter('frame_id', str, 'sensor', '', 'the sensor frame; /tf_static has it as the position of the surface', read_only=True),
    Parameter('dot_size', float, 0.0012, 'm', 'diameter of a taxel among the markers; lines and arrows are in proportion', 1e-5, 1.0,
              read_only=True),
    Parameter('full_taxel_force', float, 1.0, 'N', "force of one taxel whose line has its full length, and where the colour scale ends",
              1e-6, 1e6, read_only=True),
    Parameter('normal_length', float, 0.004, 'm', "length of a contact's normal", 0.0, 10.0, read_only=True),
    *_arrows(0.009, 10.0, 0.03, read_only=True),
    Parameter('rate', float, 30.0, 'Hz', 'maximum rate of markers and images, by the stamps', 0.1, 1000.0, read_only=True),
    *_TEXT,
)

TAXEL_MARKERS_PARAMETERS = (
    Parameter('frame_id', str, 'taxel_array', '', 'the sensor frame; /tf_static has the position of the taxels', read_only=True),
    Parameter('pitch', float, 0.001, 'm', 'distance of neighbouring taxels; lines and arrows are in proportion', 1e-5, 0.1, read_only=True),
    Parameter('cell_height', float, 0.002, 'm', 'depth below the surface of the pad at which cells are drawn', 1e-5, 0.1, read_only=True),
    Parameter('full_value', float, 120.0, '', 'value of a taxel where the colour scale ends', 1.0, 65535.0, read_only=True),
    Parameter('normal_length', float, 0.006, 'm', "length of a contact's normal", 0.0, 10.0, read_only=True),
    *_arrows(0.009, 120.0, 1.0, read_only=True),
    Parameter('flow_scale', float, 0.5, 's', 'length of the flow arrows for each m/s', 0.0, 1e3, read_only=True),
    Parameter('rate', float, 30.0, 'Hz', 'maximum rate of markers and images, by the stamps', 0.1, 1000.0, read_only=True),
    *_TEXT,
)

RECORD_PARAMETERS = (
    Parameter('bag', str, '', '', 'rosbag2 folder (MCAP) to write; it must not exist', read_only=True),
    Parameter('pictures', bool, False, '', 'record markers and image_annotated too, which other topics reproduce', read_only=True),
    Parameter('patience', float, 15.0, 's', 'how long raw data wait for a node that processes them, because a recording starts with '
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
    Parameter('collars', list[float], [], 'm', 'depths to which the collars of a hand-held tool limit a press', 0.0, 1.0, read_only=True),
    Parameter('mounting', list[float], [], '', 'x y z, m, and rotation vector, rad, of the sensor in the frame base; empty: /tf has it',
              read_only=True),
    Parameter('find', bool, False, '', 'contacts find the pose of the sensor first; mounting is only approximate', read_only=True),
    Parameter('base', str, 'base_link', '', 'frame of /tf in which mounting is', read_only=True),
    Parameter('params', str, '', '', "the sensor's parameter file", read_only=True),
    Parameter('output', str, '', '', 'calibration file to write; the presses are kept in a folder beside it', read_only=True),
)

HAND_PARAMETERS = (
    Parameter('hand', str, '', '', 'YAML file with the sensors of the hand, or its URDF or xacro file', read_only=True),
    Parameter('publish_frames', bool, True, '', 'publish the frames on /tf and /tf_static; false where robot_state_publisher does',
              read_only=True),
    Parameter('simulated_joints', bool, False, '', 'URDF: move all joints slowly on /joint_states while no other node does',
              read_only=True),
    Parameter('object', bool, False, '', 'follow the held object and publish its frame on /tf without a subscriber of /hand/object, too',
              read_only=True),
)

GRIPPER_PARAMETERS = (
    Parameter('object', str, 'box', '', 'what stands between the fingers, a name of grasp/objects.py:OBJECTS', read_only=True),
    Parameter('pad', str, FLAT_PAD, '', 'sensor of the left finger', choices=tuple(PADS), read_only=True),
    Parameter('port', str, 'gripper_array_port', '', 'symbolic link to the pseudo-terminal of the array: what its driver opens as device',
              read_only=True),
    Parameter('lift', bool, False, '', 'lift the object by itself half a second after both pads touch it', read_only=True),
    Parameter('speed', float, 1.0, '', 'simulated time in a second of real time; less than 1 where perception is too slow', 0.01, 1.0,
              read_only=True),
    Parameter('touchpad_rate', float, 20.0, 'Hz', 'images of the touchpad on the right finger; a slow machine draws fewer', 1.0, 100.0,
              read_only=True),
    Parameter('seed', int, 0, '', 'of the noise and irregularities of array and touchpad', 0, 2**31 - 1, read_only=True),
)

GRIP_PARAMETERS = (
    Parameter('sensor', str, 'array', '', 'namespace of the sensor whose slip and contacts decide', read_only=True),
    Parameter('shear_sensor', str, '', '', 'namespace of a sensor whose wrench has the shear, such as a touchpad; empty: none. '
              'Friction and load follow from it', read_only=True),
    Parameter('autostart', bool, True, '', 'configure and activate at the start; false: wait for the lifecycle services', read_only=True),
    Parameter('grasp', bool, False, '', 'grasp by itself as soon as all sensors report', read_only=True),
    Parameter('closed_position', float, 0.0, 'm or rad', 'position of the gripper command that closes: 0 where it is the gap between the '
              'fingers; where it is that of a joint whose controller is a PID, as far beyond the object as max_force needs', -10.0, 10.0),
    Parameter('open_position', float, 0.1, 'm or rad', 'the same of the one that opens, for `release`', -10.0, 10.0),
    Parameter('max_force', float, GripLimits.max_force, 'N', 'largest grip force that is ever commanded', 0.01, 1e4),
    Parameter('min_force', float, GripLimits.min_force, 'N', 'smallest grip force while an object is held', 0.01, 1e4),
    Parameter('approach_force', float, GripLimits.approach_force, 'N', 'force with which the fingers close until they touch', 0.01, 1e4),
    Parameter('contact_force', float, GripLimits.contact_force, 'N', 'reported force from which the sensor touches the object', 0.0, 1e4),
    Parameter('start_force', float, GripLimits.start_force, 'N',
              'first grip force, before anything is known of weight and friction', 0.01, 1e4),
    Parameter('margin', float, GripLimits.margin, '', 'held force over what load and friction need, or over the largest force at which '
              'the object has slipped', 1.0, 100.0),
    Parameter('rise', float, GripLimits.rise, '', 'factor by which slip raises the force', 1.01, 100.0),
    Parameter('rise_interval', float, GripLimits.rise_interval, 's',
              'until slip that is still reported raises the force again', 0.001, 10.0),
    Parameter('relaxation', float, GripLimits.relaxation, '1/s',
              'part of the force that is taken away per second while nothing slips and no sensor measures the shear', 0.0, 0.99),
    Parameter('adjustment', float, GripLimits.adjustment, '1/s',
              'the same where a sensor measures the shear, down to what load and friction need', 0.0, 0.99),
    Parameter('slip_probability', float, GripLimits.slip_probability, '', 'probability of slip from which the force is raised', 0.01, 0.99),
    Parameter('blind_force', float, GripLimits.blind_force, 'N',
              'minimum grip force while it is uncertain whether the object slips', 0.01, 1e4),
    Parameter('timeout', float, GripLimits.timeout, 's', "age of the sensor's last message from which it is lost", 0.01, 10.0),
)

#: Frames/s of the demo's video and images: half of a camera's usual 30, because drawing and encoding take most of a core.
VIDEO_RATE = 15.0

DEMO_PARAMETERS = (
    Parameter('out', str, 'out/demo', '', 'folder for images and video', read_only=True),
    Parameter('seconds', float, 25.0, 's', 'duration, by the stamps; 0: until no frame arrives', 0.0, 1e6, read_only=True),
    Parameter('patience', float, 30.0, 's', 'how long it waits for the first frame', 0.1, 1e6, read_only=True),
)
