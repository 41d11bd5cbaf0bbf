# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The public face of tactile_perception: its names exist, are documented, and cost nothing until they are used; no algorithm needs ROS."""

import inspect
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / 'tactile_driver'), str(ROOT / 'tactile_perception')]
import tactile_perception  # noqa: E402

PATHS = f'import sys; sys.path[:0] = {[str(ROOT / "tactile_driver"), str(ROOT / "tactile_perception")]!r}\n'
IMPORT_ALL = """
import importlib, re, sys
BLOCKED = re.compile(r'(rclpy|launch\\w*|cv_bridge|message_filters|ament_index_python|rosbag2_py|rosidl\\w*|'
                     r'\\w+_msgs|\\w+_srvs)(\\.|$)')

class Block:
    def find_spec(self, name, path=None, target=None):
        if BLOCKED.match(name):
            raise ImportError(name + ' is blocked: the core imports no ROS')

sys.meta_path.insert(0, Block())
"""


def core_modules(package):
    """Return the names of all modules of the package, without those that read and write ROS messages."""
    root = ROOT / package
    with_ros = {'nodes', 'node.py', 'messages.py', 'stage.py', 'camera_stage.py', 'work_log.py', 'recordings', 'bags', 'bag.py', 'tools',
                'tools.py'}
    found = [path.relative_to(root) for path in (root / package).rglob('*.py')]
    core = [path.with_suffix('') for path in found if not with_ros & set(path.parts)]
    return sorted({'.'.join(path.parts[:-1] if path.name == '__init__' else path.parts) for path in core})


def imported_by(code):
    """Return the names of all modules that are there after the code."""
    done = subprocess.run([sys.executable, '-c', f'{PATHS}{code}\nprint(*sys.modules)'], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_every_name_exists_and_is_documented():
    for name in tactile_perception.__all__:
        found = getattr(tactile_perception, name)
        assert inspect.getdoc(found) and name in dir(tactile_perception), name
    with pytest.raises(AttributeError):
        tactile_perception.detect_dot


def test_the_page_lists_every_name():
    page = (ROOT / 'docs' / 'python.md').read_text()
    assert [name for name in tactile_perception.__all__ if f'`{name}`' not in page] == []


def test_nothing_is_imported_before_it_is_used():
    assert [name for name in imported_by('import tactile_perception') if name.startswith(('tactile_perception.', 'numpy'))] == []


@pytest.mark.parametrize('package', ['tactile_driver', 'tactile_perception'])
def test_algorithms_sources_and_simulation_import_with_ros_blocked(package):
    modules = core_modules(package)
    assert len(modules) > 3
    imported_by(f'{IMPORT_ALL}for name in {modules!r}:\n    importlib.import_module(name)')


def test_the_nodes_of_a_touchpad_start_without_scipy():
    names = imported_by('from tactile_perception.core.sensor_type import NODES\n'
                        "for name in ('camera_node', 'touchpad_contact_node', 'markers_node'):\n    NODES[name]")
    assert 'tactile_perception.touchpad.stage' in names and 'scipy' not in names
