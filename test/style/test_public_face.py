# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The public face of tactile_perception: its names exist, are documented, need no ROS, and cost nothing until they are used."""

import inspect
import pathlib
import re
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / 'tactile_driver'), str(ROOT / 'tactile_perception')]
import tactile_perception  # noqa: E402

PATHS = f'import sys; sys.path[:0] = {[str(ROOT / "tactile_driver"), str(ROOT / "tactile_perception")]!r}\n'


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


def test_no_name_needs_ros():
    modules = imported_by('from tactile_perception import *')
    assert 'tactile_perception.taxel.estimator' in modules
    assert [name for name in modules if re.match(r'(rclpy|launch|cv_bridge|\w+_msgs|\w+_srvs)(\.|$)', name)] == []


def test_the_page_lists_every_name():
    page = (ROOT / 'docs' / 'python.md').read_text()
    assert [name for name in tactile_perception.__all__ if f'`{name}`' not in page] == []


def test_nothing_is_imported_before_it_is_used():
    assert [name for name in imported_by('import tactile_perception') if name.startswith(('tactile_perception.', 'numpy'))] == []
