# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import time

import pytest

from tactile_driver.errors import BadArgument
from tactile_driver.parameters.psd import PSD_DRIVER_PARAMETERS
from tactile_driver.parameters.table import defaults
from tactile_driver.sources.psd.registry import PSD_SOURCES, make_psd_source

VALUES = defaults(PSD_DRIVER_PARAMETERS) | {'path': 'somewhere', 'device': '/dev/x'}


@pytest.mark.parametrize('name', sorted(PSD_SOURCES))
def test_every_source_is_made_of_the_parameters(name):
    assert make_psd_source(VALUES | {'source': name}, time.time_ns).describe()['source'] == name


def test_an_unknown_source_is_answered_with_those_that_exist():
    with pytest.raises(BadArgument, match='sim, device, bag'):
        make_psd_source(VALUES | {'source': 'radio'}, time.time_ns)
