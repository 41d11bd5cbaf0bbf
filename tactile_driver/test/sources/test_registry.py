# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Every source of every driver is made from its node's parameters."""
import time

import pytest

from tactile_driver.camera.file import TwoFilesSource
from tactile_driver.camera.pairs import PairedSource
from tactile_driver.camera.simulated import DualSimulatedSource
from tactile_driver.errors import BadArgument
from tactile_driver.parameters.drivers import CAMERA_PARAMETERS, DUAL_CAMERA_PARAMETERS, PSD_DRIVER_PARAMETERS, TAXEL_DRIVER_PARAMETERS
from tactile_driver.parameters.table import defaults
from tactile_driver.sources.registry import CAMERA_SOURCES, DUAL_CAMERA_SOURCES, PSD_SOURCES, TAXEL_SOURCES, make_source

KINDS = [(CAMERA_SOURCES, CAMERA_PARAMETERS), (PSD_SOURCES, PSD_DRIVER_PARAMETERS), (TAXEL_SOURCES, TAXEL_DRIVER_PARAMETERS)]
TWO = {**defaults(DUAL_CAMERA_PARAMETERS), 'path': 'a', 'right_path': 'b', 'device': 'A1', 'right_device': 'B2'}


@pytest.mark.parametrize(('sources', 'table', 'name'), [(*kind, name) for kind in KINDS for name in kind[0]])
def test_every_source_is_made_from_the_nodes_parameters(sources, table, name):
    source = make_source(sources, {**defaults(table), 'source': name, 'path': 'somewhere', 'device': '/dev/x'}, time.time_ns)
    assert source.live == (name in ('sim', 'device')) and not source.on_demand
    source.close()


@pytest.mark.parametrize('sources', [kind[0] for kind in KINDS])
def test_an_unknown_source_is_answered_with_the_known_ones(sources):
    with pytest.raises(BadArgument, match=', '.join(sources)):
        make_source(sources, {'source': 'nix'}, time.time_ns)


def made(**values):
    return make_source(DUAL_CAMERA_SOURCES, {**TWO, **values}, time.time_ns)


@pytest.mark.parametrize(('name', 'kind', 'live'), [('sim', DualSimulatedSource, True), ('device', PairedSource, True),
                                                    ('file', TwoFilesSource, False), ('bag', PairedSource, False)])
def test_each_kind_of_two_cameras(name, kind, live):
    source = made(source=name)
    assert isinstance(source, kind) and source.live == live
    source.close()


def test_left_and_right_are_what_was_asked_for():
    assert made(source='device').describe()['path'] == 'A1 + B2'
    about = made(source='bag', right_path='').describe()
    assert (about['left']['path'], about['right']['path']) == ('a', 'a')
    assert made(source='file').describe()['path'] == 'a + b'
