# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The algorithms, the sources and the simulation import where there is no ROS at all."""

import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
IMPORT_ALL = """
import importlib, re, sys
BLOCKED = re.compile(r'(rclpy|launch\\w*|cv_bridge|message_filters|ament_index_python|rosbag2_py|rosidl\\w*|'
                     r'\\w+_msgs|\\w+_srvs)(\\.|$)')

class Block:
    def find_spec(self, name, path=None, target=None):
        if BLOCKED.match(name):
            raise ImportError(name + ' is blocked: the core imports no ROS')

sys.meta_path.insert(0, Block())
for name in sys.argv[1:]:
    importlib.import_module(name)
"""


def core_modules(package):
    """Return the names of all modules of the package, without those that read and write ROS messages."""
    root = ROOT / package
    with_ros = {'nodes', 'node.py', 'stage.py', 'camera_stage.py', 'work_log.py', 'recordings', 'bags', 'bag.py', 'tools', 'tools.py'}
    found = [path.relative_to(root) for path in (root / package).rglob('*.py')]
    core = [path.with_suffix('') for path in found if not with_ros & set(path.parts)]
    return sorted({'.'.join(path.parts[:-1] if path.name == '__init__' else path.parts) for path in core})


@pytest.mark.parametrize('package', ['tactile_driver', 'tactile_perception'])
def test_core_imports_with_ros_blocked(package):
    modules = core_modules(package)
    assert len(modules) > 3
    path = f'import sys; sys.path[:0] = {[str(ROOT / "tactile_driver"), str(ROOT / "tactile_perception")]!r}\n'
    found = subprocess.run([sys.executable, '-c', path + IMPORT_ALL, *modules], capture_output=True, text=True)
    assert found.returncode == 0, found.stderr
