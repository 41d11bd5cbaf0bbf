# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest

from tactile_driver.errors import BadArgument
from tactile_driver.parameters.drivers import CAMERA_PARAMETERS, PSD_DRIVER_PARAMETERS, TAXEL_DRIVER_PARAMETERS, check_together
from tactile_driver.parameters.table import defaults

TABLES = pytest.mark.parametrize('table', [CAMERA_PARAMETERS, PSD_DRIVER_PARAMETERS, TAXEL_DRIVER_PARAMETERS])


@TABLES
@pytest.mark.parametrize(('changes', 'named'), [({'source': 'bag'}, 'path'), ({'rate': -0.5}, 'rate'), ({'frame_id': ''}, 'frame_id')])
def test_what_does_not_fit_together_is_named(table, changes, named):
    with pytest.raises(BadArgument, match=f'parameter {named}'):
        check_together(defaults(table) | changes)
