# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters that do not fit together are refused by name."""
import numpy as np
import pytest
from tactile_driver.parameters.table import defaults
from tactile_perception.errors import BadArgument
from tactile_perception.parameters.touchpad import SENSOR_PARAMETERS
from tactile_perception.touchpad.sensor import Touchpad

DEFAULT = defaults(SENSOR_PARAMETERS)


def test_the_default_is_the_papers_pad_seen_from_40_mm_behind_the_rim():
    sensor = Touchpad.from_parameters(DEFAULT)
    camera = sensor.camera(np.diag([700.0, 700.0, 1.0]), np.zeros(5))
    assert (sensor.rows, sensor.columns, sensor.cap.curvature_radius, sensor.cap.height) == (23, 23, 0.020, 0.013)
    assert camera.centre == pytest.approx([0, 0, -0.04])


@pytest.mark.parametrize('changes, message', [
    ({'camera.rotation': [0.0, 1.0]}, 'three numbers'), ({'rows': 0, 'columns': 0}, 'at least 3'),
    ({'cap.height': 0.05}, 'cap: need'), ({'membrane.rest_pressure': 9e5}, 'membrane')])
def test_what_does_not_fit_together_is_named(changes, message):
    with pytest.raises(BadArgument, match=message):
        Touchpad.from_parameters({**DEFAULT, **changes})


def test_without_a_surface_a_pattern_may_be_no_grid():
    assert Touchpad.from_parameters({**DEFAULT, 'surface': 'none', 'rows': 0, 'columns': 0}).cap is None
