# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The examples of the controllers' page: what it shows is what ships, and it compiles."""
import os
import shutil
import subprocess
from pathlib import Path

import pytest
from pages import ROOT, blocks

from ament_index_python.packages import PackageNotFoundError, get_package_prefix

PAGE, EXAMPLE = ROOT / 'docs' / 'controllers.md', ROOT / 'docs' / 'examples' / 'slip_watch'
STAND_IN = Path(__file__).with_name('rclcpp_stand_in')
MESSAGES = ('tactile_msgs', 'std_msgs', 'geometry_msgs', 'builtin_interfaces', 'rosidl_runtime_cpp', 'rosidl_runtime_c',
            'rosidl_typesupport_interface', 'rcutils')


@pytest.mark.parametrize('kind, file', [('xml', 'package.xml'), ('cmake', 'CMakeLists.txt'), ('cpp', 'src/slip_watch.cpp')])
def test_the_page_shows_what_ships(kind, file):
    block, = (block for block in blocks(PAGE) if block.kind == kind)
    assert '\n'.join(block.lines) + '\n' == (EXAMPLE / file).read_text()


def test_it_builds_where_rclcpp_is(tmp_path):
    try:
        get_package_prefix('rclcpp')
    except PackageNotFoundError:
        pytest.skip('rclcpp is not there: only its use of the messages is compiled')
    shutil.copytree(EXAMPLE, tmp_path / 'src' / 'slip_watch')
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
                           str(EXAMPLE / 'src' / 'slip_watch.cpp')], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
