# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest

from tactile_driver.errors import BadArgument
from tactile_driver.parameters.camera import CAMERA_PARAMETERS, LIVE, check_together
from tactile_driver.parameters.table import defaults


@pytest.mark.parametrize(('changes', 'named'), [({'source': 'file'}, 'path'), ({'source': 'bag'}, 'path'), ({'rate': -0.5}, 'rate'),
                                                ({'frame_id': ''}, 'frame_id')])
def test_what_does_not_fit_together_is_named(changes, named):
    with pytest.raises(BadArgument, match=f'parameter {named}'):
        check_together({**defaults(CAMERA_PARAMETERS), **changes})


def test_the_defaults_fit_together():
    check_together(defaults(CAMERA_PARAMETERS))
    assert LIVE <= set(defaults(CAMERA_PARAMETERS))
