# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The scripts of the Python page, run as they stand, where ROS is blocked."""
import os
import re
import subprocess
import sys

import cv2
import numpy as np
import pytest
from pages import ROOT, files

PAGE = ROOT / 'docs' / 'python.md'
WITHOUT_ROS = """
import runpy, sys
sys.modules['rclpy'] = None  # an import raises ImportError
runpy.run_path(sys.argv[1], run_name='__main__')
"""


@pytest.fixture
def run(tmp_path):
    """Runs a script of the page in a folder that has the repository's files, and returns what it printed."""
    for name in ('docs', 'tactile_bringup'):
        (tmp_path / name).symlink_to(ROOT / name)

    def run(name):
        (tmp_path / name).write_text(files(PAGE)[name])
        paths = os.pathsep.join(str(ROOT / package) for package in ('tactile_driver', 'tactile_perception'))
        done = subprocess.run([sys.executable, '-c', WITHOUT_ROS, name], cwd=tmp_path, env={**os.environ, 'PYTHONPATH': paths},
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
