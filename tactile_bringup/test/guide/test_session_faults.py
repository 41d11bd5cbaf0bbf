# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What goes wrong in a lab while a session runs: it is reported, the press is dropped, and those before and after it count."""
from itertools import chain

import cv2
import numpy as np
import pytest
import rclpy
from geometry_msgs.msg import PointStamped, WrenchStamped
from guided_lab import Lab
from sensor_msgs.msg import CameraInfo

from tactile_driver.frame import Frame
from tactile_driver.nodes.messages.conversions import header_of, image_to_message, point

pytestmark = pytest.mark.full
RATE = 20.0
HEIGHTS = [5e-3] * 28 + [*np.linspace(5e-3, -3e-3, 8)] + [-3e-3] * 30 + [*np.linspace(-3e-3, 5e-3, 6)] + [5e-3] * 3  # m
DOWN = 40  # number of an image in which it is held
VIEW = cv2.resize(np.random.default_rng(0).integers(30, 220, (12, 16), np.uint8), (160, 120), interpolation=cv2.INTER_CUBIC)


def press(number, x=0.0, jump=0.0, stops=False, stuck=False, shift=0):
    """(stamp in ns, topic, message) of one press; shift: of the camera, px; the other faults: while it is held."""
    for k, z in enumerate(HEIGHTS):
        stamp, held = 10**9 + round((number * len(HEIGHTS) + k) * 1e9 / RATE), k >= DOWN and z == HEIGHTS[DOWN]
        header = header_of(stamp, 'palm')
        if not (stops and k >= DOWN):
            yield stamp, 'ground_truth/tip', PointStamped(header=header, point=point([x + jump * held, 0.0, z]))
        if stuck:
            yield stamp, '/stage/wrench', WrenchStamped(header=header_of(stamp, 'stage_force'))
        else:
            yield stamp, 'ground_truth/wrench', WrenchStamped(header=header)
        yield stamp, 'camera_info', CameraInfo(header=header, width=160, height=120)
        yield stamp, 'image_raw', image_to_message(Frame(np.roll(VIEW, shift, axis=1), stamp, 'mono8'), '', header)


def test_each_fault_is_reported_and_costs_its_own_press_alone(tmp_path, capfd):
    faults = [({'stops': True}, '/tf has no pose of stage_tip'), ({'jump': 0.027}, 'the probe jumped by 27.0 mm'),
              ({'stuck': True}, 'the wrench does not change: the force sensor is saturated or has stopped'),
              ({'x': 0.031}, 'the press is outside the surface'), ({'shift': 4}, 'the camera has moved by 2.5 % of its image')]
    lab = Lab('areal_single', tmp_path / 'palm.yaml', ahead=25)
    hows = [how for fault, _ in faults for how in ({}, fault)] + [{}]
    for _ in lab.play(chain.from_iterable(press(number, **how) for number, how in enumerate(hows))):
        pass
    assert len(lab.session.presses.paths) == len(faults) + 1, 'those without a fault'
    lab.close()
    reported = capfd.readouterr().err
    assert [said for _, said in faults if said not in reported] == [] and reported.count('dropped: ') == len(faults)


def test_a_probe_that_tf_does_not_know_is_reported_with_the_frames_that_it_knows(tmp_path, capfd):
    lab = Lab('areal_single', tmp_path / 'palm.yaml', ahead=25, probe='nowhere')
    for _ in lab.play(press(0)):
        pass
    assert lab.session.presses.paths == []
    lab.close()
    assert "/tf does not join 'nowhere' and 'palm'; its frames are: palm, stage_base, stage_force, stage_tip" in capfd.readouterr().err


def test_what_finds_no_sensor_is_refused(tmp_path):
    from tactile_driver.errors import BadArgument
    for wrong, said in (({'find': 'true', 'mounting': None}, 'find needs'), ({'tip_radius': 0.0}, 'tip_radius')):
        with pytest.raises(BadArgument, match=said):
            Lab('air_cushion', tmp_path / 'palm.yaml', **wrong)
        rclpy.shutdown()
