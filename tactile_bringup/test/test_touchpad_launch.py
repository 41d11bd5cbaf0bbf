# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

import pytest

from tactile_bringup.sensor_launch import LaunchError
from tactile_bringup.touchpad_launch import has_surface

FOLDER = Path(__file__).resolve().parents[1] / 'params'


def test_a_contact_region_needs_a_surface():
    assert has_surface(str(FOLDER / 'touchpad.yaml'))
    assert not has_surface(str(FOLDER / 'marker_video.yaml'))


@pytest.mark.parametrize('text', ['a: [', 'just words', ''])
def test_a_broken_parameter_file_is_told_in_one_line(tmp_path, text):
    path = tmp_path / 'broken.yaml'
    path.write_text(text)
    with pytest.raises(LaunchError, match='broken.yaml'):
        has_surface(str(path))
