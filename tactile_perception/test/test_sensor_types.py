# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest

from tactile_perception.calibration.files.format import BELONGS_TO
from tactile_perception.press.sensor import MARKER_SENSORS
from tactile_perception.press.parameters import MARKER_SENSOR_PARAMETERS
from tactile_perception.sensors import MARKER_SENSOR_TYPES


@pytest.mark.parametrize('name', MARKER_SENSOR_TYPES)
def test_an_entry_is_known_to_geometry_parameters_and_calibration(name):
    kind, sensor = MARKER_SENSOR_TYPES[name], MARKER_SENSORS[name]
    assert (sensor.type, sensor.rows, sensor.columns, sensor.pitch) == (name, kind.rows, kind.columns, kind.pitch)
    assert sensor.is_sheet == (kind.size != (0.0, 0.0)) and kind.cameras in (1, 2)
    assert name in next(p for p in MARKER_SENSOR_PARAMETERS if p.name == 'sensor_type').choices
    assert ('sheet_size' if sensor.is_sheet else 'dome.height') in BELONGS_TO[name]
