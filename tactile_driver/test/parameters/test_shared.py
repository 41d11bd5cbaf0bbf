# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest

from tactile_driver.errors import BadArgument
from tactile_driver.parameters.drivers import CAMERA_PARAMETERS, LIVE, PSD_DRIVER_PARAMETERS, TAXEL_DRIVER_PARAMETERS, check_together
from tactile_driver.parameters.table import defaults

TABLES = pytest.mark.parametrize('table', [CAMERA_PARAMETERS, PSD_DRIVER_PARAMETERS, TAXEL_DRIVER_PARAMETERS])


@TABLES
@pytest.mark.parametrize(('changes', 'named'), [({'source': 'bag'}, 'path'), ({'rate': -0.5}, 'rate'), ({'frame_id': ''}, 'frame_id')])
def test_what_does_not_fit_together_is_named(table, changes, named):
    with pytest.raises(BadArgument, match=f'parameter {named}'):
        check_together(defaults(table) | changes)


@TABLES
def test_the_defaults_fit_together(table):
    check_together(defaults(table))


def test_a_file_needs_a_path():
    with pytest.raises(BadArgument, match='parameter path'):
        check_together(defaults(CAMERA_PARAMETERS) | {'source': 'file'})


def test_live_parameters_exist():
    assert LIVE <= set(defaults(CAMERA_PARAMETERS))
