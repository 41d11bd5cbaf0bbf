# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

import pytest

from tactile_perception.sensors import NODES, SENSOR_TYPES

PACKAGE = Path(__file__).resolve().parents[1]


@pytest.mark.parametrize('name', SENSOR_TYPES)
def test_each_type_is_there_in_full(name):
    kind = SENSOR_TYPES[name]
    assert {kind.driver, *kind.perception, kind.view} <= set(NODES)
    for file in (f'launch/{name}.launch.py', f'params/{name}.yaml', f'params/{name}_sim.yaml', f'rviz/{name}.rviz'):
        assert (PACKAGE / file).is_file(), file


def test_every_node_belongs_to_a_type():
    assert set(NODES) == {name for kind in SENSOR_TYPES.values() for name in (kind.driver, *kind.perception, kind.view)}


def test_the_sources_are_those_of_the_drivers():
    from tactile_driver.sources.registry import CAMERA_CHOICES, PSD_SOURCES, TAXEL_SOURCES
    known = {'camera_node': CAMERA_CHOICES, 'dual_camera_node': CAMERA_CHOICES, 'psd_node': PSD_SOURCES, 'taxel_array_node': TAXEL_SOURCES}
    for kind in SENSOR_TYPES.values():
        assert kind.sources == tuple(known[kind.driver])
