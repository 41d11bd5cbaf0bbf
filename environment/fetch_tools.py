# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""
Take launch, the ros2 command line and some message definitions of ROS 2 Jazzy out of a wheel on PyPI that carries them.

Usage: python fetch_tools.py FOLDER. None of them has a wheel of its own; isaacsim-ros2 holds an unmodified Jazzy. Each package
taken is upstream's own, under Apache-2.0 or BSD by its own metadata. They go into FOLDER (FOLDER/python, FOLDER/interfaces), which
is neither committed nor passed on; the wheel is deleted.
"""

import hashlib
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile

WHEEL = 'isaacsim-ros2==6.2.0.0'
SHA256 = '34910c880e452528f5771e0f31673b08703e522f2d09cdb173216be7cd89844f'
INSIDE = 'isaacsim/exts/isaacsim.ros2.core/jazzy/'
PYTHON_PACKAGES = (
    'launch', 'launch_ros', 'launch_testing', 'launch_testing_ros', 'launch_xml', 'launch_yaml', 'osrf_pycommon', 'ros2cli', 'ros2node',
    'ros2param', 'ros2pkg', 'ros2run', 'ros2service', 'ros2topic', 'rosidl_runtime_py', 'sensor_msgs_py',
)
PYTHON_MODULES = ('launch_testing_ros_pytest_entrypoint.py',)
# Of the interface packages only what is used: each definition takes a compiler seconds.
INTERFACES = {'composition_interfaces': ('srv/LoadNode.srv',), 'control_msgs': ('msg/GripperCommand.msg', 'action/GripperCommand.action'),
              'tf2_msgs': ('msg/TFMessage.msg',)}
PYTHON_PATTERN = re.compile(r'rclpy/(%s)(-[^/]+\.egg-info)?/.*' % '|'.join(PYTHON_PACKAGES))
# The definitions come without the CMake file that builds them.
CMAKE_LISTS = """cmake_minimum_required(VERSION 3.16)
project({name})
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
find_package({dependency} REQUIRED)
rosidl_generate_interfaces({name} {files} DEPENDENCIES {dependency})
ament_package()
"""
DEPENDENCIES = {'composition_interfaces': 'rcl_interfaces', 'control_msgs': 'action_msgs', 'tf2_msgs': 'geometry_msgs'}


def download(folder):
    """Fetch the wheel into the folder with pip and return its path; end with a message when it is not the pinned file."""
    subprocess.run([sys.executable, '-m', 'pip', 'download', '--no-deps', '--disable-pip-version-check', '--no-cache-dir',
                    '--progress-bar', 'off', '--python-version', '3.12', '--platform', 'manylinux_2_35_x86_64',
                    '--only-binary=:all:', '--dest', str(folder), WHEEL], check=True)
    wheel = next(folder.glob('*.whl'))
    if hashlib.sha256(wheel.read_bytes()).hexdigest() != SHA256:
        sys.exit(f'{wheel.name} is not the file that was expected: its SHA-256 is not {SHA256}. Download it again.')
    return wheel


def extract(wheel, folder):
    """Copy the wanted files of the wheel to folder/python and folder/interfaces."""
    wanted = {f'share/{name}/{file}' for name, definitions in INTERFACES.items() for file in (*definitions, 'package.xml')}
    with zipfile.ZipFile(wheel) as archive:
        for name in archive.namelist():
            inner = name.removeprefix(INSIDE)
            if inner == name or name.endswith('/'):
                continue
            if PYTHON_PATTERN.fullmatch(inner) or inner.removeprefix('rclpy/') in PYTHON_MODULES:
                target = folder / 'python' / inner.removeprefix('rclpy/')
            elif inner in wanted:
                target = folder / 'interfaces' / inner.removeprefix('share/')
            else:
                continue
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(archive.read(name))


def write_cmake(folder):
    """Add a CMakeLists.txt to each interface package in the folder."""
    for name, dependency in DEPENDENCIES.items():
        text = CMAKE_LISTS.format(name=name, files=' '.join(INTERFACES[name]), dependency=dependency)
        (folder / 'interfaces' / name / 'CMakeLists.txt').write_text(text)


def main():
    """Download, extract, and only then put the result in place, so that an interrupted run leaves nothing that looks whole."""
    target = pathlib.Path(sys.argv[1])
    with tempfile.TemporaryDirectory(dir=target.parent, prefix='download-') as scratch:
        made = pathlib.Path(scratch, 'tools')
        made.mkdir()
        extract(download(pathlib.Path(scratch)), made)
        write_cmake(made)
        shutil.rmtree(target, ignore_errors=True)
        made.rename(target)


if __name__ == '__main__':
    main()
