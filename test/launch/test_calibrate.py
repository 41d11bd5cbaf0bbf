# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""calibrate.launch.py: what it says first, and what it lacks."""
import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')

pytestmark = pytest.mark.ros
SESSION = ('launch', 'tactile_bringup', 'calibrate.launch.py', 'namespace:=/palm', 'scene:=areal_single_session', 'rate:=5')


def test_a_session_on_the_simulated_stage_begins_and_keeps_what_it_has_when_interrupted(ros2):
    launched = ros2(*SESSION, 'simulated_stage:=true', 'probe:=stage_tip', 'wrench:=/stage/wrench')
    launched.wait_for_line('press 1 of 12: go to', 120)
    launched.wait_for_line('held at|dropped', 120)
    assert launched.interrupt() == 0, launched.log
    assert 'start it again with the same output to go on' in launched.log and 'does not join' not in launched.log


def test_a_probe_that_tf_does_not_know_is_reported_with_the_frames_that_it_knows(ros2):
    launched = ros2(*SESSION, 'probe:=nowhere')
    launched.wait_for_line("/tf does not join 'nowhere' and 'palm'; its frames are", 120)
    assert launched.interrupt() == 0, launched.log


def test_an_array_is_led_through_its_weights_and_a_dome_asks_for_the_radius_of_the_tip(ros2):
    launched = ros2('launch', 'tactile_bringup', 'calibrate.launch.py', 'type:=taxel_array', 'namespace:=/mat', 'weights:=5 10 0',
                    'rate:=20', 'scene:=rest')
    launched.wait_for_line('weight 1 of 3: lay 5 N on', 120)
    assert launched.interrupt() == 0, launched.log
    refused = ros2('launch', 'tactile_bringup', 'calibrate.launch.py', 'type:=air_cushion', 'probe:=tip')
    refused.wait(60)
    assert 'tip_radius' in refused.log and 'Traceback' not in refused.log, refused.log
