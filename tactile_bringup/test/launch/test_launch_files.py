# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Runs launch_files.py by launch_testing, one test for each launch file."""
import launch_files
import pytest
from launch_testing.loader import LoadTestsFromPythonModule
from launch_testing.test_runner import LaunchTestRunner

#: in `make test`: a hand of an array and a finger, and a touchpad with the demo
QUICK = ('hand', 'demo')
RUNS = {run.param_args['name']: run for run in LoadTestsFromPythonModule(launch_files)}


def test_no_launch_file_is_left_out():
    assert {path.name for path in launch_files.FOLDER.glob('*.py')} == {f'{name}.launch.py' for name in RUNS}


@pytest.mark.parametrize('name', [name if name in QUICK else pytest.param(name, marks=pytest.mark.full) for name in RUNS])
def test_a_launch_starts_delivers_and_ends(name):
    result, = LaunchTestRunner([RUNS[name]]).run().values()
    assert result.wasSuccessful(), '\n'.join(text for _, text in result.failures + result.errors)
