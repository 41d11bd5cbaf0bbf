# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.errors import BadArgument
from tactile_perception.touch.sensor import MARKER_SENSORS, MarkerSensor


def test_the_grid_is_centred_and_numbered_row_by_row():
    sensor = MARKER_SENSORS['areal_single']
    grid = sensor.grid()
    assert grid.shape == (117, 2)
    assert grid[[0, 1, 116]] == pytest.approx(np.array([[-0.027, -0.018], [-0.0225, -0.018], [0.027, 0.018]]))
    assert sensor.plane_z == 0 and MARKER_SENSORS['air_cushion'].plane_z == 0.120


@pytest.mark.parametrize('wrong', [{}, {'size': (0.06, 0.04), 'rim_radius': 0.1, 'height': 0.1}, {'rim_radius': 0.1}])
def test_neither_sheet_nor_dome_is_refused(wrong):
    with pytest.raises(BadArgument, match='either size'):
        MarkerSensor('areal_single', 9, 13, (4e-3, 4e-3), **wrong)


def test_normals_of_a_sheet_and_a_dome():
    assert MARKER_SENSORS['areal_single'].normal(np.array([0.01, 0.02])).tolist() == [0.0, 0.0, 1.0]
    dome = MARKER_SENSORS['air_cushion']
    radius = (0.15**2 + 0.12**2) / 0.24
    assert dome.normal(np.array([0.05, 0.0])) == pytest.approx([0.05 / radius, 0.0, np.sqrt(1 - (0.05 / radius)**2)])
    assert dome.normal(np.array([0.0, 9.0])) == pytest.approx(dome.normal(np.array([0.0, 0.15])))
