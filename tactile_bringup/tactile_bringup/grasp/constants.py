# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of simulated grasps, of their controller and of the simulated gripper."""
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class GraspConstants:
    """Constants of simulated grasps, of their controller and of the simulated gripper."""

    touchpad_rate: float = constant(50.0, 'Hz', 'prior', 'frames of the touchpad')
    fixed_force: float = constant(6.0, 'N', 'prior', 'of a gripper that knows nothing of its object')
    oracle_margin: float = constant(1.3, '1', 'prior', 'force over the smallest that holds, of a gripper that knows weight and friction')
    slip_speed: float = constant(2e-3, 'm/s', 'limit', 'from which the object of the engine slips; far above its creep of 1e-6 m/s')
    untouched_s: float = constant(0.3, 's', 'prior', 'before the gripper closes')
    max_duration_s: float = constant(20.0, 's', 'limit', 'of a grasp that is never lifted')
    dropped_displacement: float = constant(0.015, 'm', 'limit', 'an object that has moved so far in the hand is dropped')
    fault_begin_s: float = constant(1.0, 's', 'prior', 'from the lift to the simulated fault of a sensor')
    late_s: float = constant(0.1, 's', 'prior', 'delay of the messages of a late sensor')
    lamp_level: int = constant(60, 'grey level', 'prior', 'light that a lamp adds to the images of the touchpad')
    lift_stiffness: float = constant(2e4, 'N/m', 'physical', 'of the drive of the wrist; 1 kg lowers it by 0.5 mm')
    waiting_messages: int = constant(100, '1', 'limit', 'a second of the messages of the controllers')
    held_check_s: float = constant(0.1, 's', 'limit', 'between two checks whether the object is held')
    friction_median: float = constant(0.5, '1', 'prior', 'of skins and rubber on dry objects; two thirds are between 0.27 and 0.9')
    friction_spread: float = constant(0.6, '1', 'prior', 'standard deviation of the log of friction')
    ratio_error: float = constant(0.08, '1', 'measured', 'relative error of shear over normal force of the simulated touchpad')
    slip_error: float = constant(0.3, '1', 'measured',
                                 "relative error of Mindlin's equation on faces and balls; slip is seen only while the load grows")
    min_slipping_share: float = constant(0.2, '1', 'limit',
                                         'of a contact that slips; a smaller one is within the error with which dots are called slipping')
    min_force: float = constant(0.3, 'N', 'limit', 'of a contact whose ratio of forces has the error above')
    cautious_quantile: float = constant(0.3, '1', 'prior', 'of the distribution of friction')
    min_force_change: float = constant(0.01, '1', 'limit', 'relative change of the force that is worth a new goal')
    age_check_s: float = constant(0.02, 's', 'limit', 'between two checks of the age of the last message of the sensor')
    max_answer_s: float = constant(
        0.5, 's', 'limit',
        'a controller answers a goal within some ms, or never: the first one may come before it has discovered its client')
    joint_rate: float = constant(50.0, 'Hz', 'prior', 'of the joint states')
    max_standstill: float = constant(1e-5, 'm', 'limit',
                                     'per period of the joint states; a gripper that moves less has stalled or has reached its goal')
    goal_tolerance: float = constant(5e-4, 'm', 'limit', 'from the commanded gap')
    driver_end_s: float = constant(0.5, 's', 'limit',
                                   'Ctrl-C ends the driver of the array at the same moment, which must not report that its port is gone')
    min_pace: float = constant(0.95, '1', 'limit', 'of the requested pace, below which the gripper says that it is slower')
    gravity: float = constant(9.81, 'm/s^2', 'physical', 'acceleration')
    settled_s: float = constant(0.5, 's', 'prior', 'from the first contact to the lift')
    opening: float = constant(0.01, 'm', 'prior', 'from each pad to the object at the start')
    lift_s: float = constant(1.0, 's', 'prior', 'duration of the lift')
    lift_height: float = constant(0.10, 'm', 'prior', 'by which the wrist rises')
    held_s: float = constant(7.5, 's', 'prior', 'from the beginning of the lift to the end')
    wrist_speed: float = constant(1.0, 'rad/s', 'prior', 'of the wrist between two postures')
    posture_settled_s: float = constant(0.5, 's', 'limit', 'after which a posture is measured')
    posture_measured_s: float = constant(0.3, 's', 'numeric', 'duration of the measurement')
    skin_tension: float = constant(320.0, 'N/m', 'physical',
                                   'of a skin stiff enough for grips of up to 15 N; its liquid has a pressure of 32 kPa')
    edge_radius: float = constant(0.0004, 'm', 'physical', 'of the edges of an object')
    max_skin_step: float = constant(4e-4, 'm', 'numeric', 'by which the skin yields at once; half a spacing of its nodes')
    max_skin_steps: int = constant(4, '1', 'numeric', 'until the skin bears the force of the engine')
    force_tolerance: float = constant(0.02, '1', 'numeric', 'relative error of the force that the skin bears')
    video_rate: float = constant(10.0, 'Hz', 'prior', 'pictures of the video')
    video_begin_s: float = constant(0.4, 's', 'prior', 'just before the fingers close')
    scene_side: int = constant(360, 'px', 'prior', 'of the scene, and of the two images beside it together')
    curves_height: int = constant(110, 'px', 'prior', 'of the curves below the scene')
    video_quality: int = constant(60, '%', 'prior', 'of the compressed video')
    array_gain: float = constant(4.0, '1', 'prior', 'of the images of the array')
    full_force: float = constant(12.0, 'N', 'prior', 'at the end of its curve')
    full_displacement: float = constant(3.0, 'mm', 'prior', 'at the end of its curve')
    video_s: float = constant(9.0, 's', 'prior', 'at the end of the curves')
    taxels: int = constant(44, '1', 'physical', 'on a side of the array')
    taxel_pitch: float = constant(1e-3, 'm', 'physical', 'of the array')
    taxel_samples: int = constant(3, '1', 'numeric',
                                  'of the area of a taxel, along each side; with one, the border of an object jumps by whole taxels')
    engine_step_s: float = constant(0.002, 's', 'numeric', 'contacts with a time constant of 6 ms need three steps or more in it')
    frame_s: float = constant(0.01, 's', 'physical', 'between two frames of the array')
    pad_half: float = constant(0.022, 'm', 'physical', 'half a side of a pad; as large as the array')
    pad_depth: float = constant(0.003, 'm', 'physical', 'half the thickness of a pad')
    finger_mass: float = constant(0.05, 'kg', 'physical', 'of each finger')
    finger_damping: float = constant(40.0, 'N s/m', 'physical', 'of the drive of the fingers; it closes by 25 mm/s at 1 N')
    domes: int = constant(8, '1', 'physical', 'taxels that measure forces, on a side')
    dome_pitch: float = constant(5.5e-3, 'm', 'physical', 'of these; together they are as large as the array')
    dome_radius: float = constant(2.7e-3, 'm', 'physical',
                                  'of the round top of such a taxel; half of the pitch, so that none is beyond the pad')
    pad_spread: float = constant(0.75, 'taxel', 'physical', 'standard deviation with which the cover of the pad spreads a load')
    min_pad_height: float = constant(0.024, 'm', 'limit', 'from the table to the middle of the pads, which end above the table')


GRASP = GraspConstants()
