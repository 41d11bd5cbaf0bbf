# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import time

import pytest

from tactile_driver.errors import BadArgument
from tactile_driver.parameters.camera import CAMERA_PARAMETERS
from tactile_driver.parameters.table import defaults
from tactile_driver.sources.camera.registry import SOURCES, make_source


@pytest.mark.parametrize('name', SOURCES)
def test_every_source_is_made_from_the_nodes_parameters(name):
    source = make_source({**defaults(CAMERA_PARAMETERS), 'source': name, 'path': 'somewhere'}, time.time_ns)
    assert source.describe()['source'] == name
    assert source.live == (name in ('sim', 'device'))
    assert not source.on_demand
    source.close()


def test_an_unknown_source_is_answered_with_the_known_ones():
    with pytest.raises(BadArgument, match='sim, device, file, bag'):
        make_source({'source': 'nix'}, time.time_ns)
