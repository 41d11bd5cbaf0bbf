# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest

from tactile_driver.errors import BadArgument
from tactile_driver.parameters.psd import PSD_DRIVER_PARAMETERS, check_together
from tactile_driver.parameters.table import defaults

GOOD = defaults(PSD_DRIVER_PARAMETERS)


def test_defaults_fit_together():
    check_together(GOOD)


@pytest.mark.parametrize(('change', 'name'), [({'source': 'bag'}, 'path'), ({'rate': -0.5}, 'rate'), ({'frame_id': ''}, 'frame_id')])
def test_what_does_not_fit(change, name):
    with pytest.raises(BadArgument, match=name):
        check_together(GOOD | change)
