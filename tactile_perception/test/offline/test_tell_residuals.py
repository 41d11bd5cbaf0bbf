# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Outliers and the picture are told; that it cannot be written loses no calibration."""
import numpy as np
from tactile_perception.calibration.residuals import Residuals
from tactile_perception.offline.tell_residuals import tell_residuals

FOUND = [Residuals('depth', 'mm', np.arange(3.0), np.zeros((3, 2)), ('x (mm)', 'y (mm)'), ('a', 'b', 'c'))]


def test_lines_and_the_picture(tmp_path):
    lines = tell_residuals(FOUND, ['c: far off'], tmp_path / 'pad.yaml', 'touchpad')
    assert lines == ['stands out: c: far off', f'errors over the sensor: {tmp_path / "pad_residuals.png"}']
    assert (tmp_path / 'pad_residuals.png').stat().st_size > 1000


def test_no_picture_is_told(tmp_path):
    lines = tell_residuals(FOUND, [], tmp_path / 'none' / 'pad.yaml', 'touchpad')
    assert len(lines) == 1 and lines[0].startswith('no picture of the errors: ')
