# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the pages of Python and of controllers show is what ships, and works."""
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from ament_index_python.packages import PackageNotFoundError, get_package_prefix
from pages import ROOT

EXAMPLES = ROOT / 'docs' / 'examples'
STAND_IN = Path(__file__).with_name('rclcpp_stand_in')
MESSAGES = ('tactile_msgs', 'std_msgs', 'geometry_msgs', 'builtin_interfaces', 'rosidl_runtime_cpp', 'rosidl_runtime_c',
            'rosidl_typesupport_interface', 'rcutils')


def test_it_builds_where_rclcpp_is(tmp_path):
    try:
        get_package_prefix('rclcpp')
    except PackageNotFoundError:
        pytest.skip('rclcpp is not there: only its use of the messages is compiled')
    shutil.copytree(EXAMPLES / 'slip_watch', tmp_path / 'src' / 'slip_watch')
    done = subprocess.run(['colcon', 'build', '--event-handlers', 'console_direct+'], cwd=tmp_path, capture_output=True, text=True,
                          timeout=400)
    assert done.returncode == 0, done.stdout + done.stderr
    assert os.access(tmp_path / 'install' / 'slip_watch' / 'lib' / 'slip_watch' / 'slip_watch', os.X_OK)


def includes():
    """Folders of the messages' C++ headers, in either of the two layouts that ROS 2 has."""
    found = [str(STAND_IN)]
    for package in MESSAGES:
        top = Path(get_package_prefix(package)) / 'include'
        found += [str(top / package), str(top)]
    return found


def test_its_use_of_the_messages_compiles():
    """Against the true headers of tactile_msgs, with as much of rclcpp as the example uses: fields, types and constants are checked."""
    compiler = shutil.which('g++') or shutil.which('clang++')
    if compiler is None:
        pytest.skip('no C++ compiler')
    headers = [f'-isystem{path}' for path in includes()]
    done = subprocess.run([compiler, '-std=c++17', '-fsyntax-only', '-Wall', '-Wextra', '-Werror', *headers,
                           str(EXAMPLES / 'slip_watch' / 'src' / 'slip_watch.cpp')], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr


WITHOUT_ROS = """
import runpy, sys
sys.modules['rclpy'] = None  # an import raises ImportError
runpy.run_path(sys.argv[1], run_name='__main__')
"""


@pytest.fixture
def run(tmp_path):
    """Runs an example in a folder that has the repository's files, and returns what it printed."""
    for name in ('docs', 'tactile_bringup'):
        (tmp_path / name).symlink_to(ROOT / name)

    def run(name):
        paths = os.pathsep.join(str(ROOT / package) for package in ('tactile_driver', 'tactile_perception'))
        done = subprocess.run([sys.executable, '-c', WITHOUT_ROS, EXAMPLES / name], cwd=tmp_path, env={**os.environ, 'PYTHONPATH': paths},
                              capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stderr
        return done.stdout
    return run


def test_rows_and_columns_are_those_of_the_picture(run, tmp_path):
    printed = run('rows_and_columns.py')
    assert printed.startswith('117 dots')
    first = np.array(re.findall(r'row (\d+): first dot at u (\S+) px, v (\S+) px', printed), float)
    assert first[:, 0].tolist() == list(range(9))
    assert np.abs(first[:, 1] - 88.5).max() < 3 and np.abs(np.diff(first[:, 2]) - 38).max() < 3  # as seen in the picture
    drawn, plain = cv2.imread(str(tmp_path / 'rows_and_columns.png')), cv2.imread(str(ROOT / 'docs' / 'examples' / 'sheet.jpg'))
    assert drawn.shape == plain.shape and (drawn != plain).any(axis=2).sum() > 117 * 50


def test_press_and_drag_shows_contact_then_slip_then_nothing(run):
    found = re.findall(r'area (\d+) mm2, force \[\s*\S+\s+\S+\s+(\S+)\s*\] N, slip (\w+)', run('press_and_drag.py'))
    area, pull = [int(line[0]) for line in found], [float(line[1]) for line in found]
    assert area[0] == 0 and max(area) > 100 and area[-1] > 0
    assert pull[0] == 0 and min(pull) < -0.5
    assert list(dict.fromkeys(line[2] for line in found)) == ['none', 'incipient', 'gross']
