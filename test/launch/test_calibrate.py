# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""calibrate.launch.py: what it says first."""
import pytest


pytestmark = pytest.mark.ros
SESSION = ('launch', 'tactile_bringup', 'calibrate.launch.py', 'namespace:=/palm', 'scene:=areal_single_session', 'rate:=5')


def test_a_session_on_the_simulated_stage_begins_and_keeps_what_it_has_when_interrupted(ros2):
    launched = ros2(*SESSION, 'simulated_stage:=true', 'probe:=stage_tip', 'wrench:=/stage/wrench')
    launched.wait_for_line('press 1 of 12: go to', 120)
    launched.wait_for_line('held at|dropped', 120)
    launched.interrupt()  # exit codes after it: test_sensors.py
    assert 'start it again with the same output to go on' in launched.log and 'does not join' not in launched.log
