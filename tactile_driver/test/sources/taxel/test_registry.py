# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import time

import pytest
from tactile_driver.errors import BadArgument
from tactile_driver.parameters.table import defaults
from tactile_driver.parameters.taxel import TAXEL_DRIVER_PARAMETERS
from tactile_driver.sources.taxel.registry import TAXEL_SOURCES, make_taxel_source

VALUES = defaults(TAXEL_DRIVER_PARAMETERS) | {'device': 'x', 'path': 'y'}


@pytest.mark.parametrize('name', TAXEL_SOURCES)
def test_each_source_is_made(name):
    about = make_taxel_source(VALUES | {'source': name}, time.time_ns).describe()
    assert about['source'] == name


def test_unknown_source():
    with pytest.raises(BadArgument, match='sim, device, file, bag'):
        make_taxel_source(VALUES | {'source': 'magic'}, time.time_ns)
